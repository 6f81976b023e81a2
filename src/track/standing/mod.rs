//! Vehicles that stand, each remembered by its place.
//!
//! What stands is told by its looks alone, and the place where it stands is all that must be known to
//! recognise it. So a cluster is judged as DBSCAN gives it, by its appearance, and belongs to the
//! `candidate` in whose place it lies, whose `sides` all looks together show. What moves there takes
//! the candidate's identity over, and a vehicle that came to rest gives it back.

mod candidate;

mod sides;

use nalgebra::Vector2;

use super::above::Climber;
use super::appearance::{Appearance, Eye, FEATURES};
use super::look::Look;
use super::nearby::Places;
use super::objects::floor_z_m;
use super::placing::Placing;
use super::road_user::Track;
use super::sight::Sight;
use super::spots::Spot;
use super::{Object, Scene, TrackParameters};
use crate::cluster::Clusters;
use crate::ego::wrapped_rad;
use crate::geometry::Rectangle;
use crate::time::Time;
use candidate::{Candidate, LEAST_LOG, Sighting, may_begin};

/// Everything that stands and may be a vehicle.
#[derive(Debug, Clone, Default)]
pub(super) struct Standing {
    candidates: Vec<Candidate>,
    /// Those that were listed and of which nothing is left.
    lost: Vec<Lost>,
    /// Where the candidates are expected, and how far a cluster of theirs may be.
    places: Places,
    eye: Eye,
    /// Of every cluster what it looks like, if it is not too small.
    appearances: Vec<Option<Appearance>>,
    tops_m: Vec<f32>,
    placing: Placing,
    spots: Vec<Spot>,
    sightings: Vec<Sighting>,
    pairs: Vec<Pair>,
    is_taken: Vec<bool>,
    is_seen: Vec<bool>,
    outline: Vec<[f64; 2]>,
}

/// A listed candidate of which nothing is left: whoever stands there next is it.
#[derive(Debug, Clone, Copy)]
struct Lost {
    id: u32,
    place: Rectangle,
    time: Time,
}

/// A candidate, a sighting in its place, and how far that is from where it was seen last.
#[derive(Debug, Clone, Copy)]
struct Pair {
    apart_m: f64,
    candidate: usize,
    sighting: usize,
}

/// Distance of a cluster's middle from the box of a candidate up to which it may belong to it.
const BESIDE_M: f64 = 0.6;
/// Farther away as much is wrong as right: up to 75 m 0.4 % more vehicles are found in the shared recording
/// astyx_held_dev, and 0.15 objects a revolution more where none is.
const FARTHEST_M: f64 = 50.0;
/// There are no more vehicles within that distance; whatever else there is costs no more.
const MOST_CANDIDATES: usize = 200;
/// How long a place is remembered; without, ids change twice as often (1.4 instead of 0.8 per object and minute,
/// `scripts/evaluate --seeds 611 --duration 20 --scenarios roundabout,street,car-park`).
const MEMORY_S: f64 = 10.0;
/// Two vehicles side by side are not nearer than this, from middle to middle; without, ids change twice as often
/// (1.5, the same command).
const NEAREST_M: f64 = 1.9;

impl Standing {
    pub(super) fn reset(&mut self) {
        self.candidates.clear();
        self.lost.clear();
    }

    pub(super) fn reframe(
        &mut self,
        turn_rad: f64,
        moved: impl Fn([f64; 2]) -> [f64; 2] + Copy,
        rise_m: f64,
    ) {
        for candidate in &mut self.candidates {
            candidate.reframe(turn_rad, moved, rise_m);
        }
        for lost in &mut self.lost {
            lost.place.centre_m = moved(lost.place.centre_m);
            lost.place.yaw_rad = wrapped_rad(lost.place.yaw_rad + turn_rad);
        }
    }

    /// What each cluster looks like, [`FEATURES`] numbers, zeros for one that is too small.
    pub(super) fn appearances(&self) -> impl ExactSizeIterator<Item = [f64; FEATURES]> {
        let all = self.appearances.iter();
        all.map(|known| known.map_or([0.0; FEATURES], |appearance| appearance.features))
    }

    /// Takes the clusters of a revolution in.
    pub(super) fn process(
        &mut self,
        clusters: &Clusters,
        climber: &Climber,
        scene: &Scene<'_>,
        parameters: &TrackParameters,
    ) {
        let end = scene.scan.time();
        self.predict(scene);
        self.take_sightings(clusters, climber, scene);
        self.pair();
        self.update(scene, end);
        self.begin(scene, end, parameters);
        self.tidy(end, parameters);
    }

    /// Every candidate to the time at which the sensor passed over its place, and where it is then.
    fn predict(&mut self, scene: &Scene<'_>) {
        for candidate in &mut self.candidates {
            let passed_at = scene.passed_at(candidate.track.position_m());
            candidate.track.predict(passed_at);
        }
        let origin_m = scene.sweep.sensor.placement().origin_m();
        self.places.begin(origin_m.into());
        for candidate in &self.candidates {
            self.places.push(candidate.place(), 2.0 * BESIDE_M);
        }
    }

    /// Looks at every cluster, and closer at those that may be a vehicle or lie where one is known.
    fn take_sightings(&mut self, clusters: &Clusters, climber: &Climber, scene: &Scene<'_>) {
        let placement = scene.sweep.sensor.placement();
        let origin_m = placement.origin_m();
        self.placing.begin(scene, origin_m);
        self.appearances.clear();
        self.spots.clear();
        self.sightings.clear();
        for points in clusters.iter() {
            let appearance = self.eye.look(points, scene);
            self.appearances.push(appearance);
            let Some(appearance) = appearance else {
                continue;
            };
            let log_odds = appearance.vehicle_log_odds();
            let [x, y] = appearance.middle_m;
            let middle_m = placement.local_m([x, y]);
            let may_be = log_odds > LEAST_LOG && libm::hypot(x, y) < FARTHEST_M;
            if !may_be && self.places.near(middle_m.into()).next().is_none() {
                continue;
            }
            let begin = self.spots.len();
            self.placing.place(points, scene);
            let placed = self.placing.iter();
            let spots = placed.map(|placed| Spot::new(scene, placed.point, placed.at_m, 0));
            self.spots.extend(spots);
            let spots = begin..self.spots.len();
            let sensor_m = Vector2::from(origin_m);
            self.sightings.push(Sighting {
                look: Look::at(&self.spots[spots.clone()], scene.scan, sensor_m),
                spots,
                log_odds,
                height_m: climber.usual_top_m(points, scene, &mut self.tops_m),
            });
        }
    }

    /// Finds the sightings in the places of candidates, those first that are where it was seen last: of what stands the
    /// same part is seen again, while its box may lie askew and reach over others.
    fn pair(&mut self) {
        self.pairs.clear();
        for (sighting, seen) in self.sightings.iter().enumerate() {
            let middle_m = seen.look.middle_m;
            for (candidate, (_, outline)) in self.places.near(middle_m) {
                if outline.distance_m(middle_m.into()) < BESIDE_M {
                    let apart_m = (middle_m - self.candidates[candidate].seen_m).norm();
                    self.pairs.push(Pair {
                        apart_m,
                        candidate,
                        sighting,
                    });
                }
            }
        }
        self.pairs.sort_by(|a, b| a.apart_m.total_cmp(&b.apart_m));
    }

    fn update(&mut self, scene: &Scene<'_>, end: Time) {
        self.is_taken.clear();
        self.is_taken.resize(self.sightings.len(), false);
        self.is_seen.clear();
        self.is_seen.resize(self.candidates.len(), false);
        for pair in &self.pairs {
            let (is_seen, is_taken) = (
                &mut self.is_seen[pair.candidate],
                &mut self.is_taken[pair.sighting],
            );
            if *is_seen || *is_taken {
                continue;
            }
            (*is_seen, *is_taken) = (true, true);
            let sighting = &self.sightings[pair.sighting];
            let spots = &self.spots[sighting.spots.clone()];
            let floor_z_m = floor_z_m(spots, scene);
            let candidate = &mut self.candidates[pair.candidate];
            candidate.see(sighting, spots, end, floor_z_m, &mut self.outline);
        }
        let placement = scene.sweep.sensor.placement();
        let sensor_height_m = scene.ground.plane.height_m();
        let missed = self.candidates.iter_mut().zip(&self.is_seen);
        for (candidate, _) in missed.filter(|(_, is_seen)| !**is_seen) {
            let (place, height_m) = (candidate.place(), candidate.track.height_m());
            let sight = Sight::at(scene.scan, &placement, sensor_height_m, &place, height_m);
            candidate.miss(&sight, end);
        }
    }

    /// New candidates from what lies in the place of none, or looks better than the one whose place it is.
    fn begin(&mut self, scene: &Scene<'_>, end: Time, parameters: &TrackParameters) {
        for (sighting, is_taken) in self.sightings.iter().zip(&self.is_taken) {
            if self.candidates.len() >= MOST_CANDIDATES {
                return;
            }
            let middle_m = sighting.look.middle_m.into();
            let is_within = |candidate: &Candidate| candidate.place().outline().contains(middle_m);
            if *is_taken || !may_begin(sighting, parameters) {
                continue;
            }
            let spots = &self.spots[sighting.spots.clone()];
            let floor_z_m = floor_z_m(spots, scene);
            let outline = &mut self.outline;
            let track = Track::new(0, false, spots, &sighting.look, end, floor_z_m, outline);
            let candidate = Candidate::new(track, sighting, spots, end, outline);
            let mut there = self.candidates.iter().filter(|known| is_within(known));
            if there.all(|known| candidate.is_better_than(known)) {
                self.candidates.push(candidate);
            }
        }
    }

    /// Drops what is gone, and the worse of two in one place.
    fn tidy(&mut self, end: Time, parameters: &TrackParameters) {
        let mut number = 0;
        while number < self.candidates.len() {
            let own = &self.candidates[number];
            let place = own.place();
            let is_within = |other: &Candidate| {
                other.is_better_than(own) && is_one_place(&other.place(), &place)
            };
            if own.is_gone(parameters) || self.candidates.iter().any(is_within) {
                let gone = self.candidates.remove(number);
                if gone.track.is_listed {
                    self.lost.push(Lost {
                        id: gone.track.id,
                        place: gone.place(),
                        time: end,
                    });
                }
            } else {
                number += 1;
            }
        }
        self.lost
            .retain(|lost| (end - lost.time).seconds() < MEMORY_S);
    }

    /// Tells each track whether it looks like a vehicle, by what is known of its place.
    pub(super) fn tell_looks(&self, tracks: &mut [Track]) {
        for track in tracks.iter_mut().filter(|track| !track.rests()) {
            let place = track.rectangle();
            track.looks_like_vehicle = self.candidates.iter().any(|candidate| {
                candidate.looks_like_vehicle() && is_one_place(&candidate.place(), &place)
            });
        }
    }

    /// Gives what moves now and is as likely as that the place of what stood there, with its identity if it has none
    /// that others know. What moves and is hardly a road user hides none: a piece of a hedge behind a parked car.
    pub(super) fn give_way(&mut self, tracks: &mut [Track], least_confidence: f64) {
        let moves =
            |track: &&mut Track| track.goes_beyond_doubt() && track.may_be_listed(least_confidence);
        for track in tracks.iter_mut().filter(moves) {
            let place = track.rectangle();
            let gone = self
                .candidates
                .extract_if(.., |candidate| is_one_place(&candidate.place(), &place));
            for candidate in gone.filter(|candidate| candidate.track.is_listed) {
                if !track.is_listed {
                    (track.id, track.is_listed) = (candidate.track.id, true);
                }
            }
        }
    }

    /// Adds those that are as likely as that, but for those in the place of an object that is listed
    /// already. Who is listed for the first time takes the identity of what was lost there or came to
    /// rest there, or the next one.
    pub(super) fn list(
        &mut self,
        end: Time,
        least_confidence: f64,
        tracks: &mut [Track],
        next_id: &mut u32,
        objects: &mut Vec<Object>,
    ) {
        let listed = objects.len();
        for candidate in &mut self.candidates {
            if !candidate.is_known() {
                continue;
            }
            let mut object = candidate.track.object(end);
            let place = candidate.place();
            [object.centre_m[0], object.centre_m[1]] = place.centre_m;
            object.yaw_rad = place.yaw_rad;
            (object.length_m, object.width_m) = (place.length_m, place.width_m);
            object.height_m = object.height_m.max(candidate.height_m());
            let is_other = |other: &Object| is_one_place(&place, &other.rectangle());
            if object.existence < least_confidence || objects[..listed].iter().any(is_other) {
                continue;
            }
            let track = &mut candidate.track;
            if !track.is_listed {
                track.is_listed = true;
                let lost = self
                    .lost
                    .iter()
                    .position(|lost| is_one_place(&lost.place, &place));
                let resting = tracks.iter_mut().find(|resting| {
                    resting.is_listed
                        && resting.is_left_standing()
                        && is_one_place(&resting.rectangle(), &place)
                });
                track.id = match (lost, resting) {
                    (_, Some(resting)) => {
                        resting.is_listed = false;
                        std::mem::replace(&mut resting.id, take_next(next_id))
                    }
                    (Some(lost), None) => self.lost.swap_remove(lost).id,
                    (None, None) => take_next(next_id),
                };
            }
            object.id = track.id;
            objects.push(object);
        }
    }
}

fn take_next(next_id: &mut u32) -> u32 {
    let id = *next_id;
    *next_id = next_id.wrapping_add(1);
    id
}

/// Whether two boxes are of one vehicle: the middle of one lies in the other, or near its middle.
fn is_one_place(one: &Rectangle, other: &Rectangle) -> bool {
    let holds = |a: &Rectangle, b: &Rectangle| a.outline().contains(b.centre_m);
    let off = [0, 1].map(|axis| one.centre_m[axis] - other.centre_m[axis]);
    holds(one, other) || holds(other, one) || libm::hypot(off[0], off[1]) < NEAREST_M
}

#[cfg(test)]
mod tests;
