//! One revolution for all tracks: what is whose, what is new, what is hidden, what is gone.

use std::cmp::Reverse;
use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;

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
        self.grouping
            .form(&self.tracks, clusters, scene, parameters);
        let origin_m = Vector2::from(scene.sweep.sensor.placement().origin_m());
        self.pair(origin_m, parameters);
        self.update(scene, end);
        self.begin(scene, end, origin_m, parameters);
        self.tidy(end, parameters);
        self.standing.process(clusters, scene, parameters);
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
mod tests {
    use super::*;
    use crate::cloud::Scan;
    use crate::cloud::tests::{later, scan_of};
    use crate::cluster::{ClusterParameters, Dbscan};
    use crate::parameter::Profile;
    use crate::time::Span;
    use crate::track::look::Look;
    use crate::track::spots::Spot;
    use crate::track::tests::{spots_of, with_scene};

    #[test]
    fn what_goes_on_above_in_most_of_its_columns_begins_no_track() {
        // A body 3.5 m away, from 1.0 to 2.0 m above the ground. Layer 9 passes it there in 2.08 m,
        // too low to be taken for a part of it.
        let tracks = |going_on: usize| {
            let mut tracker = ObjectTracker::default();
            let scan = scan_of(1800, |column, layer| match (column, layer) {
                (100..130, ..9) => 350,
                (100.., 9) if column < 100 + going_on => 350,
                _ => 0,
            });
            see(&mut tracker, &scan);
            tracker.tracks.len()
        };
        assert_eq!((tracks(15), tracks(24)), (1, 0));
    }

    #[test]
    fn what_is_known_begins_no_other_track_and_what_rays_pass_through_is_dropped() {
        let mut tracker = ObjectTracker::default();
        (0..4).for_each(|_| see(&mut tracker, &body(1000, 0)));
        assert_eq!((tracker.tracks.len(), tracker.next_id), (1, 1));
        (0..6).for_each(|_| see(&mut tracker, &body(0, 0)));
        assert_eq!((tracker.tracks.len(), tracker.next_id), (0, 1));
    }

    #[test]
    fn what_is_not_seen_any_more_where_the_own_vehicle_is_was_a_piece_of_it() {
        let scan = body(1000, 0);
        let spots = spots_of(&scan);
        let sensor = Pose::SENSOR;
        let left = |far_m: f32, since_s: f64| {
            let mut tracker = ObjectTracker {
                tracks: vec![track_of(1, &spots, &scan)],
                ..ObjectTracker::default()
            };
            let [x, y] = tracker.tracks[0]
                .position_m()
                .map(|metres| metres as f32)
                .into();
            let own_vehicle = Extent {
                low_m: [x - far_m, y - far_m, -1.0],
                high_m: [x + far_m, y + far_m, 0.0],
            };
            let since = scan.time() + Span::from_seconds(since_s);
            tracker.forget_pieces(&own_vehicle, &sensor, since);
            tracker.tracks.len()
        };
        assert_eq!(
            [left(0.5, -0.3), left(0.5, 0.3), left(-0.5, 0.3)],
            [1, 0, 1]
        );
    }

    #[test]
    fn what_rests_keeps_what_lies_in_its_place_unseen() {
        let (post, nothing) = (body(1000, 10), body(0, 0));
        let mut tracker = ObjectTracker::default();
        let mut looks = 0;
        for revolution in 0..30 {
            let scan = later(&post, 0.1 * f64::from(revolution));
            see(&mut tracker, &scan);
            let [track] = &tracker.tracks[..] else {
                panic!("{}", tracker.tracks.len());
            };
            looks += u32::from(
                revolution >= 18 && scan.time() - track.last_measured < Span::from_seconds(0.1),
            );
        }
        assert_eq!((looks, tracker.next_id), (4, 1));
        for revolution in 30..36 {
            see(&mut tracker, &later(&nothing, 0.1 * f64::from(revolution)));
        }
        assert_eq!(tracker.tracks.len(), 0);
    }

    #[test]
    fn who_comes_at_120_km_h_is_one_and_known_before_it_is_near() {
        let mut tracker = ObjectTracker::default();
        for revolution in 0..12 {
            let range_m = 55.0 - 3.3 * f64::from(revolution);
            // 1.8 m wide, from 0.3 to 1.5 m above the ground.
            let half = libm::round(0.9 / range_m / (2.0_f64.to_radians() / 10.0)) as usize;
            let scan = scan_of(1800, |column, layer| {
                let elevation_rad = (2.0 * layer as f64 - 15.0).to_radians();
                let height_m = 1.9 + range_m * libm::sin(elevation_rad);
                let is_met = column.abs_diff(500) <= half && (0.3..1.5).contains(&height_m);
                u16::from(is_met) * (100.0 * range_m) as u16
            });
            see(&mut tracker, &later(&scan, 0.1 * f64::from(revolution)));
            if revolution >= 3 {
                let [car] = tracker.objects() else {
                    panic!("{:?}", tracker.objects());
                };
                assert!(car.id == 0 && (car.speed_mps - 33.0).abs() < 2.0, "{car:?}");
            }
        }
    }

    #[test]
    fn of_two_tracks_in_one_place_the_later_goes_on_under_the_id_of_the_first() {
        let scan = body(1000, 0);
        let spots = spots_of(&scan);
        let track = |id: u32, spots: &[Spot]| track_of(id, spots, &scan);
        let mut first = track(7, &spots[..spots.len() / 3]);
        first.was_likely = true;
        let mut tracker = ObjectTracker {
            tracks: vec![first, track(8, &spots)],
            ..ObjectTracker::default()
        };
        assert_eq!(tracker.reunite(1), 0);
        assert_eq!((tracker.tracks.len(), tracker.tracks[0].id), (1, 7));
    }

    #[test]
    fn who_was_hidden_for_a_moment_is_known_by_a_single_ray_though_it_slowed_down() {
        let mut tracker = ObjectTracker::default();
        // A rider 35 m away, two columns wide, from 0.7 m up, at 4 m/s, which is 3.3 columns in
        // each revolution.
        let column = |revolution: usize| 300 + 10 * revolution / 3;
        for revolution in 0..15 {
            let first = column(revolution);
            let scan = scan_of(1800, |column, layer| {
                let is_met = (first..first + 2).contains(&column) && (6..9).contains(&layer);
                u16::from(is_met) * 3500
            });
            see(&mut tracker, &later(&scan, 0.1 * revolution as f64));
        }
        tracker.tracks[0].was_likely = true;
        let measured = |tracker: &ObjectTracker| {
            let [track] = &tracker.tracks[..] else {
                panic!("{}", tracker.tracks.len());
            };
            track.last_measured
        };
        let parted = measured(&tracker);
        for revolution in 15..20 {
            see(
                &mut tracker,
                &later(&body(0, 0), 0.1 * f64::from(revolution)),
            );
        }
        // 0.37 m behind where it would be: it brakes by 2 m/s^2.
        let behind = column(20) - 3;
        let scan = scan_of(1800, |column, layer| {
            u16::from(column == behind && layer == 7) * 3500
        });
        see(&mut tracker, &later(&scan, 2.0));
        assert!(measured(&tracker) > parted);
    }

    #[test]
    fn who_moves_has_all_of_what_only_partly_lies_where_he_was_expected() {
        let mut tracker = ObjectTracker::default();
        // A rider 20 m away, from 0.1 m up, at 5 m/s, which is 7 columns in each revolution.
        let rider = |columns: std::ops::Range<usize>| {
            scan_of(1800, |column, layer| {
                let is_met = columns.contains(&column) && (5..9).contains(&layer);
                u16::from(is_met) * 2000
            })
        };
        for revolution in 0..15 {
            let first = 300 + 7 * revolution;
            let scan = rider(first..first + 4);
            see(&mut tracker, &later(&scan, 0.1 * revolution as f64));
        }
        // He hastens, and more of him is seen, most of it ahead of where he would be.
        see(&mut tracker, &later(&rider(413..421), 1.5));
        assert_eq!((tracker.tracks.len(), tracker.next_id), (1, 1));
    }

    #[test]
    fn a_lorry_that_comes_out_from_behind_a_house_begins_no_track_for_each_piece() {
        let mut tracker = ObjectTracker::default();
        for revolution in 0..8 {
            // 8 m long and 15 m away; it advances by 44 columns, which are 2.3 m.
            let front: usize = 400 + 44 * revolution;
            let rear = front.saturating_sub(153).max(375);
            let scan = scan_of(1800, |column, layer| {
                let is_met = (rear..front).contains(&column) && (3..9).contains(&layer);
                u16::from(is_met) * 1500
            });
            see(&mut tracker, &later(&scan, 0.1 * revolution as f64));
        }
        assert!(tracker.next_id <= 2, "{}", tracker.next_id);
    }

    #[test]
    fn what_is_large_is_no_piece_of_the_small_things_before_it() {
        let mut tracker = ObjectTracker::default();
        let scan = |is_met: fn(usize) -> bool| {
            scan_of(1800, |column, layer| {
                u16::from(is_met(column) && (3..9).contains(&layer)) * 1500
            })
        };
        // Two posts 15 m away, and then the side of a lorry of 8 m.
        let posts = scan(|column| matches!(column, 100..104 | 130..134));
        let side = scan(|column| (100..253).contains(&column));
        for revolution in 0..6 {
            let seen = if revolution < 3 { &posts } else { &side };
            see(&mut tracker, &later(seen, 0.1 * f64::from(revolution)));
        }
        let longest_m = |longest_m: f64, track: &Track| longest_m.max(track.rectangle().length_m);
        let longest_m = tracker.tracks.iter().fold(0.0, longest_m);
        assert!(longest_m > 7.0, "{longest_m}");
    }

    #[test]
    fn what_lies_in_the_place_of_a_known_vehicle_is_no_other_vehicle() {
        // 4.5 m long, 10 m away.
        let scan = scan_of(1800, |column, layer| match column {
            100..230 if (3..8).contains(&layer) => 1000,
            _ => 0,
        });
        let spots = spots_of(&scan);
        let track = |id: u32, spots: &[Spot]| track_of(id, spots, &scan);
        let claimed = |is_known: bool, piece: &[Spot]| {
            let mut whole = track(7, &spots);
            whole.was_likely = is_known;
            let piece = track(8, piece);
            let is_vehicle = piece.is_vehicle();
            let mut tracker = ObjectTracker {
                tracks: vec![piece, whole],
                ..ObjectTracker::default()
            };
            see(&mut tracker, &later(&scan, 0.1));
            let groups = tracker.grouping.groups().iter();
            let claimed = groups.map(|group| group.claimed_by);
            (is_vehicle, claimed.collect::<Vec<_>>())
        };
        let (half, end) = (&spots[..spots.len() / 2], &spots[..40]);
        assert_eq!(claimed(true, half), (true, vec![Some(1)]));
        assert_eq!(claimed(false, half), (true, vec![Some(0)]));
        // Who stands before it keeps what is theirs.
        assert_eq!(claimed(true, end), (false, vec![Some(0), Some(1)]));
    }

    /// A track that was seen once.
    fn track_of(id: u32, spots: &[Spot], scan: &Scan) -> Track {
        let look = Look::at(spots, scan, Vector2::zeros());
        Track::new(id, false, spots, &look, scan.time(), 0.0, &mut vec![])
    }

    /// Four layers and ten columns at a range; in some columns it goes on in the layer above.
    fn body(range_cm: u16, going_on: usize) -> Scan {
        scan_of(1800, |column, layer| match column {
            100..110 if (5..9).contains(&layer) => range_cm,
            100.. if column < 100 + going_on && layer == 9 => range_cm,
            _ => 0,
        })
    }

    /// A revolution that is clustered up to the eighth layer.
    fn see(tracker: &mut ObjectTracker, scan: &Scan) {
        let left_out: Vec<bool> = (0..scan.len()).map(|point| scan.layer(point) > 8).collect();
        with_scene(scan, |scene| {
            let mut dbscan = Dbscan::new(&ClusterParameters::profile(Profile::Default));
            let clusters = dbscan.process(scan, &left_out, scene.heights_m);
            tracker.process(clusters, scene, &TrackParameters::profile(Profile::Default));
        });
    }
}
