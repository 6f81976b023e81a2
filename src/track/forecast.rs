//! Where the tracks are expected.

use nalgebra::Vector2;

use super::Scene;
use super::nearby::Discs;
use super::patches::Patch;
use super::road_user::Track;
use crate::beams::MOST_IMAGES;
use crate::geometry::{Outline, Rectangle};

/// Where a track is expected.
#[derive(Debug, Clone)]
pub(super) struct Forecast {
    pub(super) outline: Outline,
    /// Its middle, in the frame of the patches.
    pub(super) middle_m: [f32; 2],
    /// How far out of it its returns may lie.
    pub(super) margin_m: f32,
    /// Of late it was where nothing was before: what was there before is none of it.
    pub(super) is_new: bool,
    /// Of what moves, or seems to, where it was in the revolutions that the beams remember, from where it is now.
    pub(super) from_m: [Option<[f32; 2]>; MOST_IMAGES],
    /// Nothing of it is looked at.
    pub(super) rests: bool,
}

/// Around the box of a track its returns may lie this far out, and farther where it is unsure.
const LEAST_MARGIN_M: f64 = 0.25;
const MOST_MARGIN_M: f64 = 0.9;

/// What is nearer to where it was stands, unless it was seen to move.
const LEAST_WAY_M: f64 = 0.3;

impl Forecast {
    fn of(track: &Track, place: &Rectangle, middle_m: [f32; 2], scene: &Scene<'_>) -> Self {
        let mut from_m = [None; MOST_IMAGES];
        for (from_m, time) in from_m.iter_mut().zip(scene.beams.times()) {
            // The rays of its column passed over it as much earlier than the end of that sweep as of this one.
            let seen_at = time + (track.time() - scene.scan.time());
            let off_m = track
                .was_at_m(seen_at)
                .map(|was_m| was_m - Vector2::from(place.centre_m));
            let moved = off_m.filter(|off_m| track.has_moved() || off_m.norm() > LEAST_WAY_M);
            *from_m = moved.map(|off_m| off_m.map(|metres| metres as f32).into());
        }
        Self {
            from_m,
            outline: place.outline(),
            middle_m,
            margin_m: (LEAST_MARGIN_M + track.spread_m()).min(MOST_MARGIN_M) as f32,
            is_new: track.is_new(),
            rests: track.rests(),
        }
    }

    /// Whether it moves, or seems to.
    pub(super) fn moves(&self) -> bool {
        self.from_m.iter().any(Option::is_some)
    }

    /// Whether the track may have been in a place in a revolution that the beams remember.
    pub(super) fn reached(&self, at_m: [f32; 2], image: usize) -> bool {
        self.from_m[image].is_some_and(|from_m| {
            let at_m = [0, 1].map(|axis| at_m[axis] - from_m[axis]);
            self.reaches(at_m)
        })
    }

    /// Whether a place, in the frame of the patches, is within the track's box.
    pub(super) fn holds(&self, at_m: [f32; 2]) -> bool {
        self.off_edge_m(at_m) <= 0.0
    }

    /// Whether a place, in the frame of the patches, can be of the track.
    pub(super) fn reaches(&self, at_m: [f32; 2]) -> bool {
        self.off_edge_m(at_m) <= self.margin_m
    }

    /// How far out of the track's box a place is.
    fn off_edge_m(&self, at_m: [f32; 2]) -> f32 {
        let off_m = [0, 1].map(|axis| at_m[axis] - self.middle_m[axis]);
        self.outline.off_edge_m(off_m)
    }
}

/// Where all tracks are expected, by their numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct Forecasts {
    forecasts: Vec<Forecast>,
    /// How far their returns may lie.
    reaches: Discs,
}

impl Forecasts {
    /// Takes over where the tracks are; the patches are placed relative to `origin_m`.
    pub(super) fn take(&mut self, tracks: &[Track], origin_m: Vector2<f64>, scene: &Scene<'_>) {
        self.forecasts.clear();
        self.reaches.begin(origin_m);
        for track in tracks {
            let place = track.rectangle();
            let centre_m = place.centre_m.into();
            let forecast = Forecast::of(track, &place, self.reaches.relative_m(centre_m), scene);
            let reach_m = place.radius_m() + f64::from(forecast.margin_m);
            self.reaches.push(centre_m, reach_m);
            self.forecasts.push(forecast);
        }
    }

    /// Where the track with this number is expected.
    pub(super) fn of(&self, track: usize) -> &Forecast {
        &self.forecasts[track]
    }

    /// The numbers of the tracks that can hold any of a patch.
    pub(super) fn near(&mut self, patch: &Patch) -> impl Iterator<Item = usize> + use<'_> {
        let bounds = &patch.bounds;
        self.reaches.near_box(bounds.low_m, bounds.high_m)
    }
}

#[cfg(test)]
impl From<Vec<Forecast>> for Forecasts {
    fn from(forecasts: Vec<Forecast>) -> Self {
        Self {
            forecasts,
            ..Self::default()
        }
    }
}
