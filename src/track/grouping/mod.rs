//! What may be one object: returns in the place of a known one, and clusters that none explains,
//! of which some are `pieces` of one vehicle.

mod mains;
mod pieces;

use std::ops::Range;

use nalgebra::Vector2;

use super::claims::Claims;
use super::forecast::Forecasts;
use super::look::Look;
use super::patches::{Patch, Placer};
use super::placing::{Placed, distance_m};
use super::road_user::{GATE, Track};
use super::spots::{Spot, bounds_m, places_m};
use super::strays::Strays;
use super::{Scene, TrackParameters, seam};
use crate::beams::Seen;
use crate::cluster::Clusters;
use crate::geometry::Extent;
use crate::time::Time;
use mains::Mains;

/// The groups of a revolution.
#[derive(Debug, Clone, Default)]
pub(super) struct Grouping {
    placer: Placer,
    strays: Strays,
    spots: Vec<Spot>,
    /// The stretches of which groups are made, and the spots, while they are sorted.
    stretches: Vec<Stretch>,
    sorted: Vec<Spot>,
    groups: Vec<Group>,
    /// The groups before some were joined.
    former: Vec<Group>,
    /// Where the tracks are expected, and which of them may be in a patch.
    forecasts: Forecasts,
    near: Vec<usize>,
    claims: Claims,
    mains: Mains,
    /// Of every track whether it is a patch that stands apart.
    are_apart: Vec<bool>,
    /// The groups that no track claims, and their bounds.
    free: Vec<(usize, [Vector2<f64>; 2])>,
    /// The group that each one joins.
    target: Vec<usize>,
    /// Group numbers of what was cut off structure, ascending.
    suspects: Vec<u32>,
}

/// Spots side by side that belong to one group.
#[derive(Debug, Clone)]
struct Stretch {
    /// Of the group.
    number: u32,
    spots: Range<usize>,
    /// The group that they were before, if they are all of it.
    former: Option<usize>,
}

/// Returns that may be one object: a stretch of the spots.
#[derive(Debug, Clone, Copy)]
pub(super) struct Group {
    number: u32,
    begin: usize,
    end: usize,
    pub(super) look: Look,
    /// The track in whose place they were found; a new object comes of none, but for what is too
    /// large for that track.
    pub(super) claimed_by: Option<usize>,
}

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
/// Fewer returns are noise.
const FEWEST_RETURNS: usize = 3;

impl Grouping {
    /// Forms the groups anew, given tracks that were carried on to this revolution.
    pub(super) fn form(
        &mut self,
        tracks: &[Track],
        clusters: &Clusters,
        scene: &Scene<'_>,
        parameters: &TrackParameters,
    ) {
        let origin_m = Vector2::from(scene.sweep.sensor.placement().origin_m());
        self.forecasts.take(tracks, origin_m, scene);
        self.placer
            .place(clusters, &mut self.forecasts, scene, parameters);
        self.divide(tracks, scene, parameters);
        let members = self.placer.members();
        self.strays.add(tracks, members, scene, &mut self.spots);
        self.gather(tracks, scene);
        self.join_pieces(tracks, scene);
    }

    pub(super) fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// The returns of a group.
    pub(super) fn spots(&self, group: &Group) -> &[Spot] {
        &self.spots[group.begin..group.end]
    }

    /// Whether a group was cut off structure.
    pub(super) fn is_suspect(&self, group: &Group) -> bool {
        self.suspects.binary_search(&group.number).is_ok()
    }

    /// Gives every return a group: the track in whose place it lies, or its own patch, if that
    /// can be a road user.
    fn divide(&mut self, tracks: &[Track], scene: &Scene<'_>, parameters: &TrackParameters) {
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

    /// Puts the spots of every group side by side and looks at it.
    fn gather(&mut self, tracks: &[Track], scene: &Scene<'_>) {
        self.stretches.clear();
        let mut end = 0;
        for spots in self.spots.chunk_by(|a, b| a.group == b.group) {
            let begin = end;
            end += spots.len();
            self.stretches.push(Stretch {
                number: spots[0].group,
                spots: begin..end,
                former: None,
            });
        }
        self.put_together(tracks, scene);
    }

    /// Makes one of the groups that have the same target.
    fn gather_joined(&mut self, tracks: &[Track], scene: &Scene<'_>) {
        std::mem::swap(&mut self.groups, &mut self.former);
        self.stretches.clear();
        for (place, target) in self.target.iter().enumerate() {
            let group = &self.former[place];
            self.stretches.push(Stretch {
                number: self.former[*target].number,
                spots: group.begin..group.end,
                former: Some(place),
            });
        }
        self.put_together(tracks, scene);
    }

    /// Forms groups of stretches that have the same number, and looks at those that are new.
    fn put_together(&mut self, tracks: &[Track], scene: &Scene<'_>) {
        let sensor_m = Vector2::from(scene.sweep.sensor.placement().origin_m());
        self.groups.clear();
        self.sorted.clear();
        self.stretches
            .sort_unstable_by_key(|stretch| (stretch.number, stretch.spots.start));
        for own in self.stretches.chunk_by(|a, b| a.number == b.number) {
            let number = own[0].number;
            let begin = self.sorted.len();
            for stretch in own {
                let spots = &self.spots[stretch.spots.clone()];
                self.sorted.extend_from_slice(spots);
            }
            let spots = &self.sorted[begin..];
            let claimed_by = Some(number as usize).filter(|number| *number < tracks.len());
            if spots.len() < FEWEST_RETURNS && claimed_by.is_none() {
                continue;
            }
            let look = match own {
                [
                    Stretch {
                        former: Some(place),
                        ..
                    },
                ] => self.former[*place].look,
                _ => Look {
                    is_apart: self.are_apart.get(number as usize) == Some(&true),
                    ..Look::at(spots, scene.scan, sensor_m)
                },
            };
            self.groups.push(Group {
                number,
                begin,
                end: self.sorted.len(),
                look,
                claimed_by,
            });
        }
        std::mem::swap(&mut self.spots, &mut self.sorted);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::Scan;
    use crate::cloud::tests::scan_of;
    use crate::track::tests::with_scene;

    /// Spots in columns of one layer, 10 m away, each of a group.
    fn grouping(scan: &Scan, groups: &[(Range<usize>, u32)]) -> Grouping {
        let mut grouping = Grouping::default();
        with_scene(scan, |scene| {
            for (columns, group) in groups {
                for column in columns.clone() {
                    let point = scan.index(column, 7);
                    let [x, y, _] = scan.point_m(point);
                    let spot = Spot::new(scene, point as u32, [x, y], *group);
                    grouping.spots.push(spot);
                }
            }
            grouping.gather(&[], scene);
        });
        grouping
    }

    fn columns(grouping: &Grouping, group: &Group, scan: &Scan) -> Vec<usize> {
        let spots = grouping.spots(group).iter();
        spots.map(|spot| scan.column(spot.point as usize)).collect()
    }

    #[test]
    fn the_spots_of_a_group_are_put_side_by_side_and_too_few_are_none() {
        let scan = scan_of(1800, |_, layer| if layer == 7 { 1000 } else { 0 });
        let groups = [
            (100..102, 5),
            (102..106, 2),
            (106..108, 9),
            (108..112, 5),
            (112..113, 2),
        ];
        let grouping = grouping(&scan, &groups);
        let found: Vec<_> = grouping
            .groups()
            .iter()
            .map(|group| (group.number, columns(&grouping, group, &scan)))
            .collect();
        assert_eq!(
            found,
            [
                (2, vec![102, 103, 104, 105, 112]),
                (5, vec![100, 101, 108, 109, 110, 111])
            ]
        );
    }

    #[test]
    fn pieces_of_a_vehicle_become_one_group_that_is_looked_at_anew() {
        let scan = scan_of(1800, |_, layer| if layer == 7 { 1000 } else { 0 });
        // 10 m away a column is 0.035 m wide: pieces of 1.4 m and 0.7 m, 0.35 m apart.
        let groups = [(100..140, 3), (150..170, 4), (300..340, 8)];
        let mut grouping = grouping(&scan, &groups);
        let far = grouping.groups()[2].look.middle_m;
        with_scene(&scan, |scene| grouping.join_pieces(&[], scene));
        let [vehicle, other] = grouping.groups() else {
            panic!("{:?}", grouping.groups());
        };
        let expected: Vec<usize> = (100..140).chain(150..170).collect();
        assert_eq!(columns(&grouping, vehicle, &scan), expected);
        assert_eq!((vehicle.number, vehicle.look.points), (3, 60));
        let sum_m = grouping.spots(vehicle).iter().fold([0.0; 2], |sum, spot| {
            [0, 1].map(|axis| sum[axis] + f64::from(spot.at_m[axis]))
        });
        assert!((vehicle.look.middle_m - Vector2::from(sum_m) / 60.0).norm() < 1e-6);
        assert_eq!((other.number, other.look.middle_m), (8, far));
    }
}
