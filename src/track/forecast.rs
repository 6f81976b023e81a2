//! Where the tracks are expected.

use multiversion::multiversion;
use nalgebra::Vector2;

use super::patches::Patch;
use super::road_user::Track;
use super::{Outline, Rectangle};
use crate::marks::marked;

/// Where a track is expected.
#[derive(Debug, Clone)]
pub(super) struct Forecast {
    pub(super) outline: Outline,
    /// How far out of it its returns may lie.
    pub(super) margin_m: f64,
    pub(super) most_m: [f64; 2],
    pub(super) yaw_rad: f64,
}

/// Around the box of a track its returns may lie this far out, and farther where it is unsure.
const LEAST_MARGIN_M: f64 = 0.25;
const MOST_MARGIN_M: f64 = 0.9;

impl Forecast {
    fn of(track: &Track, place: &Rectangle) -> Self {
        Self {
            outline: place.outline(),
            margin_m: (LEAST_MARGIN_M + track.spread_m()).min(MOST_MARGIN_M),
            most_m: track.most_m(),
            yaw_rad: track.yaw_rad(),
        }
    }
}

/// Where all tracks are expected, by their numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct Forecasts {
    forecasts: Vec<Forecast>,
    /// Their middles, in the frame of the patches, and how far they reach from there.
    x_m: Vec<f32>,
    y_m: Vec<f32>,
    reach_m: Vec<f32>,
    marks: Vec<bool>,
}

impl Forecasts {
    /// Takes over where the tracks are; the patches are placed relative to `origin_m`.
    pub(super) fn take(&mut self, tracks: &[Track], origin_m: Vector2<f64>) {
        self.forecasts.clear();
        for metres in [&mut self.x_m, &mut self.y_m, &mut self.reach_m] {
            metres.clear();
        }
        for track in tracks {
            let place = track.rectangle();
            let forecast = Forecast::of(track, &place);
            let [x, y] = place.centre_m;
            self.x_m.push((x - origin_m.x) as f32);
            self.y_m.push((y - origin_m.y) as f32);
            let radius_m = 0.5 * libm::hypot(place.length_m, place.width_m);
            self.reach_m.push((radius_m + forecast.margin_m) as f32);
            self.forecasts.push(forecast);
        }
        self.marks.clear();
        self.marks.resize(tracks.len(), false);
    }

    pub(super) fn of(&self, track: usize) -> &Forecast {
        &self.forecasts[track]
    }

    /// The numbers of the tracks that can hold any of a patch.
    pub(super) fn near(&mut self, patch: &Patch) -> impl Iterator<Item = usize> + use<'_> {
        let middles_m = [&self.x_m[..], &self.y_m[..]];
        mark_near(patch, middles_m, &self.reach_m, &mut self.marks);
        marked(&self.marks)
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn mark_near(patch: &Patch, [x_m, y_m]: [&[f32]; 2], reach_m: &[f32], marks: &mut [bool]) {
    let (low_m, high_m) = (patch.bounds.low_m, patch.bounds.high_m);
    let count = marks.len();
    let (x_m, y_m, reach_m) = (&x_m[..count], &y_m[..count], &reach_m[..count]);
    for track in 0..count {
        let (x, y, reach_m) = (x_m[track], y_m[track], reach_m[track]);
        marks[track] = (low_m[0] - reach_m <= x)
            & (x <= high_m[0] + reach_m)
            & (low_m[1] - reach_m <= y)
            & (y <= high_m[1] + reach_m);
    }
}
