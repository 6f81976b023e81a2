//! Whose returns are: of a known track, or of a patch that may be a new one.

use nalgebra::Vector2;

use super::Grouping;
use crate::beams::Seen;
use crate::geometry::Extent;
use crate::time::Time;
use crate::track::look::Look;
use crate::track::patches::Patch;
use crate::track::placing::{Placed, distance_m};
use crate::track::road_user::{GATE, Track};
use crate::track::spots::{Spot, places_m};
use crate::track::{Scene, TrackParameters, seam};

/// Share of a cluster in the place of a track, from which on all of it may belong to that.
const LEAST_CLAIM: f64 = 0.3;
/// The same of what is no larger than somebody: it is one thing.
const LEAST_CLAIM_OF_SMALL: f64 = 0.5;
const SMALL_M: f64 = 1.2;
/// Part of a track's narrower side that a patch must have from corner to corner to be all of it.
const LEAST_PART: f64 = 0.7;
/// Share of the patch that a track is from which on there is somebody else in it who is known.
const LEAST_SHARE_OF_MAIN: f64 = 0.25;
/// What is longer and higher may be pieces of a lorry; shorter is who walks side by side, lower
/// are kerbs.
const LONG_M: f64 = 2.5;
const LOWEST_LONG_M: f32 = 1.2;

impl Grouping {
    /// Gives every return a group: the track in whose place it lies, or its own patch, if that
    /// can be a road user.
    pub(super) fn divide(
        &mut self,
        tracks: &[Track],
        scene: &Scene<'_>,
        parameters: &TrackParameters,
    ) {
        self.suspects.clear();
        self.spots.clear();
        self.find_mains(tracks, parameters);
        self.are_apart.clear();
        self.are_apart.resize(tracks.len(), false);
        for number in 0..self.placer.patches().len() {
            let patch = self.placer.patches()[number];
            if patch.is_suspect {
                self.suspects.push((tracks.len() + number) as u32);
            }
            let begin = self.spots.len();
            match self.mains.track_of(number) {
                Some(owner) => self.add_main(number, owner, tracks, scene),
                None => self.add_pieces(number, tracks, scene, parameters),
            }
            let spots = &mut self.spots[begin..];
            seam::align(spots, tracks, scene.scan.duration_s());
        }
    }

    /// Finds for every track the patch that it is, of those that stand apart: each is one thing.
    fn find_mains(&mut self, tracks: &[Track], parameters: &TrackParameters) {
        self.mains.begin(tracks.len(), self.placer.patches().len());
        for number in 0..self.placer.patches().len() {
            let patch = self.placer.patches()[number];
            if !patch.flanks.stand_apart || !patch.can_be_road_user(parameters) {
                continue;
            }
            self.find_near(number, tracks);
            for track in &self.near {
                let forecast = self.forecasts.of(*track);
                let middle_m = patch.bounds.middle_m();
                let is_much = patch.diagonal_m() >= LEAST_PART * tracks[*track].narrow_m();
                if is_much && forecast.reaches(middle_m) {
                    let off_m = distance_m(middle_m, forecast.middle_m);
                    self.mains.propose(off_m, *track, number);
                }
            }
        }
        self.mains.pair();
    }

    /// Adds the spots of a patch that stands apart to those of the track that it is, but for what belongs to
    /// others that are known to be there, too, since they touch it.
    fn add_main(&mut self, number: usize, owner: usize, tracks: &[Track], scene: &Scene<'_>) {
        if self.forecasts.of(owner).rests {
            return;
        }
        self.are_apart[owner] = true;
        self.find_near(number, tracks);
        let (mains, forecasts) = (&self.mains, &self.forecasts);
        self.near.retain(|track| {
            let other = &tracks[*track];
            let is_known = other.is_confirmed() && (other.was_likely || other.has_moved());
            let is_elsewhere = mains.patch_of(*track).is_some() || forecasts.of(*track).rests;
            *track == owner || (is_known && !is_elsewhere)
        });
        let patch = self.placer.patches()[number];
        let placed = self.placer.placed(&patch);
        let is_old = patch.before == Seen::Occupied;
        self.claims
            .settle(placed, &self.near, &self.forecasts, true, is_old);
        let claims = &self.claims;
        self.near
            .retain(|track| claims.share(*track) > LEAST_SHARE_OF_MAIN);
        for (placed, track) in placed.iter().zip(self.claims.owners()) {
            let track = track.filter(|track| self.near.contains(track));
            let group = track.unwrap_or(owner) as u32;
            self.spots.push(spot_of(placed, &patch, group, scene));
        }
    }

    /// Adds the spots of any other patch: of the tracks in whose places they lie.
    fn add_pieces(
        &mut self,
        number: usize,
        tracks: &[Track],
        scene: &Scene<'_>,
        parameters: &TrackParameters,
    ) {
        let patch = self.placer.patches()[number];
        let own = (tracks.len() + number) as u32;
        let is_whole = patch.can_be_road_user(parameters);
        self.find_near(number, tracks);
        let (mains, patches) = (&self.mains, self.placer.patches());
        self.near.retain(|track| {
            let main = mains.patch_of(*track).map(|main| &patches[main].flanks);
            !main.is_some_and(|main| patch.flanks.are_parted_from(main, scene.scan))
        });
        if self.near.is_empty() && !is_whole {
            return;
        }
        let begin = self.spots.len();
        let placed = self.placer.placed(&patch);
        let is_old = patch.before == Seen::Occupied;
        self.claims
            .settle(placed, &self.near, &self.forecasts, is_whole, is_old);
        let owner = is_whole
            .then(|| self.owner(&patch, tracks, scene.scan.time()))
            .flatten()
            .filter(|(track, _)| !(is_old && self.forecasts.of(*track).is_new));
        let owns = owner.map(|(track, _)| track);
        let rests = |track: usize| self.forecasts.of(track).rests;
        if owns.is_some_and(rests) {
            return;
        }
        // Of what is as small as somebody, a single track has all or nothing.
        let is_nobodys =
            is_whole && is_small(&patch) && owns.is_none() && self.claims.only().is_some();
        let placed = self.placer.placed(&patch).iter();
        for (placed, track) in placed.zip(self.claims.owners()) {
            let track = track.filter(|_| !is_nobodys);
            let group = track.map(|track| track as u32).or(is_whole.then_some(own));
            if let Some(group) = group.filter(|_| !track.is_some_and(rests)) {
                self.spots.push(spot_of(placed, &patch, group, scene));
            }
        }
        let sensor_m = Vector2::from(scene.sweep.sensor.placement().origin_m());
        let spots = &mut self.spots[begin..];
        let top_m = f64::from(patch.bounds.top_m);
        let fits = |track: usize| fits(spots, top_m, &tracks[track]);
        // What has moved may be elsewhere than it was expected, and only a part of the patch in its place.
        let may_be = |track: &usize| {
            let look = || Look::at(spots, scene.scan, sensor_m);
            let mover = &tracks[*track];
            mover.has_moved() && fits(*track) && mover.cost(spots, &look()) < GATE
        };
        let owner = owner.filter(|(track, at_any_size)| *at_any_size || fits(*track));
        let mover = self.claims.only().map(|(track, _)| track);
        let mover = mover.filter(|track| is_whole && owns.is_none() && !is_old && may_be(track));
        if let Some(track) = owner.map(|(track, _)| track).or(mover) {
            for spot in spots.iter_mut() {
                spot.group = track as u32;
            }
        }
    }

    /// Finds the tracks that can have returns of a patch.
    fn find_near(&mut self, number: usize, tracks: &[Track]) {
        let patch = &self.placer.patches()[number];
        self.near.clear();
        self.near.extend(self.forecasts.near(patch));
        let forecasts = &self.forecasts;
        if patch.before == Seen::Empty {
            // It is before what stands there, and none of it.
            self.near.retain(|track| !tracks[*track].is_background());
        }
        let middle_m = patch.bounds.middle_m();
        let is_known_vehicle = |track: &usize| {
            let vehicle = &tracks[*track];
            vehicle.was_likely && vehicle.is_vehicle() && forecasts.of(*track).reaches(middle_m)
        };
        if self.near.iter().any(is_known_vehicle) {
            // Pieces of it are no vehicles; who stands beside it is somebody.
            self.near
                .retain(|track| tracks[*track].was_likely || !tracks[*track].is_vehicle());
        }
    }

    /// The track to which all of a patch belongs, and whether it does so at any size. A patch that
    /// reaches out of the only box belongs to it as long as the whole can be one object. Several
    /// tracks beside each other that are all young may be pieces of something long that moves by
    /// more than their boxes from one revolution to the next: all of it goes on as the first one.
    fn owner(&self, patch: &Patch, tracks: &[Track], now: Time) -> Option<(usize, bool)> {
        let is_long = patch.diagonal_m() > LONG_M && patch.bounds.top_m > LOWEST_LONG_M;
        let are_young = || self.near.iter().all(|track| tracks[*track].is_young(now));
        if is_long && self.near.len() > 1 && are_young() {
            return self.claims.first().map(|track| (track, true));
        }
        let only = self.claims.only();
        let least = if is_small(patch) {
            LEAST_CLAIM_OF_SMALL
        } else {
            LEAST_CLAIM
        };
        let only = only.filter(|(_, share)| *share > least);
        only.map(|(track, _)| (track, false))
    }
}

/// Whether a patch is no larger than somebody.
fn is_small(patch: &Patch) -> bool {
    patch.diagonal_m() < SMALL_M
}

/// A return of a patch, as a spot of a group.
fn spot_of(placed: &Placed, patch: &Patch, group: u32, scene: &Scene<'_>) -> Spot {
    let mut spot = Spot::new(scene, placed.point, placed.at_m, group);
    spot.returns = patch.returns_each;
    spot.before = placed.before;
    if placed.is_brought {
        spot.age_s -= scene.scan.duration_s() as f32;
    }
    spot
}

/// Whether spots up to a height can all belong to an object.
fn fits(spots: &[Spot], top_m: f64, track: &Track) -> bool {
    let ([low, high], most_m) = (extent(spots, track.yaw_rad()), track.most_m(top_m));
    (0..2).all(|axis| high[axis] - low[axis] <= most_m[axis])
}

/// Least and greatest coordinates of spots along and across a direction.
fn extent(spots: &[Spot], yaw_rad: f64) -> [[f64; 2]; 2] {
    let (sine, cosine) = libm::sincos(yaw_rad);
    let extent = Extent::of(places_m(spots), sine, cosine);
    [extent.low, extent.high]
}
