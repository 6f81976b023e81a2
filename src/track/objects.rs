//! One revolution for all tracks: what is whose, what is new, what is hidden, what is gone.

use std::cmp::Reverse;
use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;

use super::above::Climber;
use super::appearance::FEATURES;
use super::assignment::{Assigner, Candidate};
use super::grouping::Grouping;
use super::nearby::Places;
use super::road_user::{GATE, Track};
use super::sight::Sight;
use super::spots::Spot;
use super::standing::Standing;
use super::{Object, Scene, TrackParameters};
use crate::cloud::Extent;
use crate::cluster::Clusters;
use crate::ego::{Pose, wrapped_rad};
use crate::geometry::Rectangle;
use crate::time::Time;

/// Tracks of road users.
#[derive(Debug, Clone, Default)]
pub(super) struct ObjectTracker {
    next_id: u32,
    /// How many tracks there ever were.
    born: u32,
    /// How many revolutions there were.
    revolution: u32,
    tracks: Vec<Track>,
    /// Of which nothing was left, but which may be seen again.
    lost: Vec<Track>,
    objects: Vec<Object>,
    standing: Standing,
    /// What goes on above clusters.
    climber: Climber,
    grouping: Grouping,
    outline: Vec<[f64; 2]>,
    candidates: Vec<Candidate>,
    /// Pairs each track with a group.
    assigner: Assigner,
    /// Places of the tracks, and how far they reach.
    places: Places,
    /// How likely each track exists, and whether it is no road user.
    odds: Vec<f64>,
    background: Vec<bool>,
}

/// Returns of a single low layer that show a vehicle.
const BUMPER_RETURNS: usize = 15;
/// Share of its columns in which a new object may go on above: more do so in walls, hedges and
/// trunks, of which there are many tracks otherwise that nobody needs.
const MOST_GOES_ON: f64 = 0.65;
/// What it speaks for a pairing that the group was found in the track's place.
const CLAIM_BONUS: f64 = 4.0;
/// Farthest leap from one revolution to the next.
const FARTHEST_LEAP_M: f64 = 6.0;

impl ObjectTracker {
    pub(super) fn reset(&mut self) {
        self.tracks.clear();
        self.lost.clear();
        self.standing.reset();
        self.objects.clear();
    }

    pub(super) fn objects(&self) -> &[Object] {
        &self.objects
    }

    /// Forgets who was not seen since a time where the own vehicle turned out to be: it was a piece of that.
    pub(super) fn forget_pieces(&mut self, own_vehicle: &Extent, sensor: &Pose, since: Time) {
        let placement = sensor.placement();
        self.tracks.retain(|track| {
            let place_m = placement.sensor_m(track.position_m().into());
            track.last_measured >= since || !own_vehicle.contains(place_m)
        });
    }

    /// What each cluster of the last revolution looks like.
    pub(super) fn appearances(&self) -> impl ExactSizeIterator<Item = [f64; FEATURES]> {
        self.standing.appearances()
    }

    /// Adds the boxes of those that are meant, as they will be at a time, seen from the sensor.
    pub(super) fn expect(
        &self,
        end: Time,
        sensor: &Pose,
        is_meant: impl Fn(&Track) -> bool,
        boxes: &mut Vec<Rectangle>,
    ) {
        let placement = sensor.placement();
        let meant = self
            .tracks
            .iter()
            .filter(|track| track.is_confirmed() && is_meant(track));
        boxes.extend(meant.map(|track| {
            let place = track.rectangle_at(end);
            Rectangle {
                centre_m: placement.sensor_m(place.centre_m),
                yaw_rad: wrapped_rad(place.yaw_rad - sensor.yaw_rad + FRAC_PI_2),
                ..place
            }
        }));
    }

    /// The frame changed: what was at `from` is now at `to`.
    pub(super) fn reframe(&mut self, from: &Pose, to: &Pose) {
        let (old, new) = (from.placement(), to.placement());
        let turn_rad = wrapped_rad(to.yaw_rad - from.yaw_rad);
        let rise_m = to.position_m[2] - from.position_m[2];
        let moved = |at| new.local_m(old.sensor_m(at));
        self.standing.reframe(turn_rad, moved, rise_m);
        for track in self.tracks.iter_mut().chain(&mut self.lost) {
            track.reframe(turn_rad, moved, rise_m);
        }
    }

    pub(super) fn process(
        &mut self,
        clusters: &Clusters,
        scene: &Scene<'_>,
        parameters: &TrackParameters,
    ) {
        let end = scene.scan.time();
        self.revolution = self.revolution.wrapping_add(1);
        for track in &mut self.tracks {
            track.rest(self.revolution, end, parameters.least_confidence);
        }
        self.predict(scene, end);
        self.climber.begin(scene, clusters.members());
        self.grouping
            .form(&self.tracks, clusters, &mut self.climber, scene, parameters);
        let origin_m = Vector2::from(scene.sweep.sensor.placement().origin_m());
        self.pair(origin_m, parameters);
        self.update(scene, end);
        self.begin(scene, end, origin_m, parameters);
        self.tidy(end, parameters);
        self.standing
            .process(clusters, &self.climber, scene, parameters);
        self.standing.tell_looks(&mut self.tracks);
        self.publish(end, parameters);
    }

    /// Every track that is looked at to the time at which the sensor passed over its place.
    fn predict(&mut self, scene: &Scene<'_>, end: Time) {
        for track in self.tracks.iter_mut().filter(|track| !track.rests()) {
            let expected = track.position_m()
                + track.velocity_mps() * (end - track.last_measured).seconds().clamp(0.0, 0.2);
            track.predict(scene.passed_at(expected));
        }
    }

    /// Takes over where the tracks are, each with what `more_m` lets it reach beyond its box.
    fn take_places(&mut self, origin_m: Vector2<f64>, more_m: impl Fn(&Track) -> f64) {
        self.places.begin(origin_m);
        self.add_places(more_m);
    }

    /// The same for the tracks that were added since then.
    fn add_places(&mut self, more_m: impl Fn(&Track) -> f64) {
        for track in &self.tracks[self.places.len()..] {
            self.places.push(track.rectangle(), more_m(track));
        }
    }

    /// The cheapest pairing of tracks with groups.
    fn pair(&mut self, origin_m: Vector2<f64>, parameters: &TrackParameters) {
        let leap_m = |track: &Track| {
            FARTHEST_LEAP_M.min(parameters.association_distance_m + 2.0 * track.spread_m())
        };
        self.take_places(origin_m, leap_m);
        let groups = self.grouping.groups();
        self.candidates.clear();
        for (column, group) in groups.iter().enumerate() {
            let spots = self.grouping.spots(group);
            // Costs may be below 0 by the bonus; all pairs are shifted alike.
            let mut add = |row: usize, cost: f64| {
                self.candidates.push(Candidate { row, column, cost });
            };
            if let Some(owner) = group.claimed_by {
                add(owner, self.tracks[owner].cost(spots, &group.look));
            }
            let middle_m = group.look.middle_m;
            for (row, (_, outline)) in self.places.near(middle_m) {
                let track = &self.tracks[row];
                if track.rests() || group.claimed_by == Some(row) {
                    continue;
                }
                let off_m = outline.distance_within_m(middle_m.into(), leap_m(track));
                if off_m.is_some() {
                    add(row, track.cost(spots, &group.look) + CLAIM_BONUS);
                }
            }
        }
        let size = (self.tracks.len(), groups.len());
        self.assigner
            .assign(size, &mut self.candidates, GATE + CLAIM_BONUS);
    }

    fn update(&mut self, scene: &Scene<'_>, end: Time) {
        let placement = scene.sweep.sensor.placement();
        let sensor_height_m = scene.ground.plane.height_m();
        let sight = |place: &Rectangle, height_m: f64| {
            Sight::at(scene.scan, &placement, sensor_height_m, place, height_m)
        };
        for (track, pair) in self.tracks.iter_mut().zip(self.assigner.pairs()) {
            match pair.map(|group| &self.grouping.groups()[group]) {
                Some(group) => {
                    let spots = self.grouping.spots(group);
                    let floor_z_m = floor_z_m(spots, scene);
                    track.measure(spots, &group.look, end, floor_z_m, &mut self.outline);
                    track.look_back(sight);
                }
                None if track.rests() => {}
                None => {
                    track.miss(&sight(&track.rectangle(), track.height_m()), end);
                }
            }
        }
    }

    /// New tracks from what no track explains.
    fn begin(
        &mut self,
        scene: &Scene<'_>,
        end: Time,
        origin_m: Vector2<f64>,
        parameters: &TrackParameters,
    ) {
        self.take_places(origin_m, |_| 0.0);
        for (number, group) in self.grouping.groups().iter().enumerate() {
            // What was found in the place of a track that it cannot be may be a piece of that.
            let is_claimed = |owner: usize| !self.tracks[owner].is_dwarfed_by(&group.look);
            if self.assigner.is_paired(number) || group.claimed_by.is_some_and(is_claimed) {
                continue;
            }
            let middle_m = group.look.middle_m;
            let is_new = group.look.is_new();
            let is_piece = self.places.near(middle_m).any(|(number, (_, outline))| {
                let is_before = is_new && self.tracks[number].is_background();
                !is_before && outline.contains(middle_m.into())
            });
            let spots = self.grouping.spots(group);
            // Of a vehicle that is far away a single layer may show the bumper.
            let may_be_bumper = group.look.points >= BUMPER_RETURNS
                && group.look.top_below_m > parameters.lowest_object_m;
            let is_low = group.look.top_m < parameters.lowest_object_m && !may_be_bumper;
            if is_piece || is_low || (!is_new && group.look.goes_on > MOST_GOES_ON) {
                continue;
            }
            let floor_z_m = floor_z_m(spots, scene);
            let is_suspect = self.grouping.is_suspect(group);
            let track = Track::new(
                self.next_id,
                is_suspect,
                spots,
                &group.look,
                end,
                floor_z_m,
                &mut self.outline,
            );
            self.next_id = self.next_id.wrapping_add(1);
            self.tracks.push(track.taking_turns(self.born));
            self.born = self.born.wrapping_add(1);
        }
    }

    /// Drops what is gone, and the worse of two that stand in one place; the places of all but the
    /// new ones are known.
    fn tidy(&mut self, end: Time, parameters: &TrackParameters) {
        /// Of what is gone: nothing is worse.
        const GONE: f64 = f64::NEG_INFINITY;
        self.add_places(|_| 0.0);
        self.odds.clear();
        self.odds.extend(self.tracks.iter().map(|track| {
            if track.is_gone(parameters) {
                GONE
            } else {
                track.odds()
            }
        }));
        self.background.clear();
        self.background
            .extend(self.tracks.iter().map(Track::is_background));
        let (places, odds) = (&mut self.places, &self.odds);
        let background = &self.background;
        let mut number = 0;
        let dropped = self.tracks.extract_if(.., |_| {
            let own = number;
            number += 1;
            if odds[own] == GONE {
                return true;
            }
            let centre_m = places.rectangle(own).centre_m;
            places
                .near(centre_m.into())
                .any(|(other, (place, outline))| {
                    let is_better = (odds[other], Reverse(other)) > (odds[own], Reverse(own));
                    let depth_m = 0.3 * place.width_m.min(1.6);
                    let is_before = background[other] && !background[own];
                    is_better && !is_before && outline.distance_m(centre_m) < -depth_m
                })
        });
        self.lost.retain(|track| track.may_return(end));
        self.lost
            .extend(dropped.filter(|track| track.may_return(end)));
    }

    fn publish(&mut self, end: Time, parameters: &TrackParameters) {
        self.objects.clear();
        let least = parameters.least_confidence;
        let is_due = |track: &Track| {
            let may_be = !track.was_likely && track.most_confidence() >= least;
            may_be && track.object(end).existence >= least
        };
        let mut number = 0;
        while number < self.tracks.len() {
            if is_due(&self.tracks[number]) {
                number = self.reunite(number);
                self.tracks[number].was_likely = true;
            }
            number += 1;
        }
        self.standing.give_way(&mut self.tracks, least);
        for track in &mut self.tracks {
            if track.may_be_listed(least) && !track.is_left_standing() {
                let object = track.object(end);
                if object.existence >= least {
                    track.is_listed = true;
                    self.objects.push(object);
                }
            }
        }
        let (tracks, objects) = (&mut self.tracks, &mut self.objects);
        self.standing
            .list(end, least, tracks, &mut self.next_id, objects);
        self.objects.sort_by_key(|object| object.id);
    }

    /// Gives a track that is to be published for the first time the id of one that was lost, or
    /// of which nothing or less is seen now, and which it replaces. Gives the track's number after
    /// that.
    fn reunite(&mut self, number: usize) -> usize {
        let new = &self.tracks[number];
        let known = self.lost.iter().chain(&self.tracks).enumerate();
        let missed = known.filter(|(place, known)| *place < self.lost.len() || known.is_missed());
        let off = missed.filter_map(|(place, known)| Some((new.off_from_m(known)?, place)));
        let nearest = off.min_by(|a, b| a.0.total_cmp(&b.0));
        let in_one_place = self.tracks.iter().position(|known| new.replaces(known));
        let in_one_place = in_one_place.map(|known| self.lost.len() + known);
        let Some(place) = in_one_place.or(nearest.map(|(_, place)| place)) else {
            return number;
        };
        match place.checked_sub(self.lost.len()) {
            None => {
                let lost = self.lost.swap_remove(place);
                self.tracks[number].take_over(&lost);
                number
            }
            Some(missed) => {
                let missed_one = self.tracks.remove(missed);
                let number = number - usize::from(missed < number);
                self.tracks[number].take_over(&missed_one);
                number
            }
        }
    }
}

/// Height of the ground below a group in the local frame.
pub(super) fn floor_z_m(spots: &[Spot], scene: &Scene<'_>) -> f64 {
    let lowest = spots.iter().min_by(|a, b| a.above_m.total_cmp(&b.above_m));
    let z_m = lowest.map_or(0.0, |spot| {
        f64::from(scene.scan.z_m()[spot.point as usize] - spot.above_m)
    });
    scene.sweep.sensor.position_m[2] + z_m
}

#[cfg(test)]
mod tests;
