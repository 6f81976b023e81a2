//! Step five: clusters become objects that keep their identity from revolution to revolution.
//!
//! `identity` hands ids from old clusters to new ones (thesis section 4.1.3), `rectangle` gives
//! a cluster its box, `motion` its velocity, this file puts objects together.

mod identity;

mod motion;

mod rectangle;

pub use rectangle::Rectangle;

use crate::cloud::Scan;
use crate::cluster::Clusters;
use crate::ground::Plane;
use crate::parameter::parameters;
use crate::time::Time;
use identity::Identities;
use motion::Motion;

parameters! {
    /// The tracks: identities, boxes, velocities.
    pub struct TrackParameters "track" {
        /// Distance between an old and a new cluster within which the id is handed on.
        association_distance_m: f64 = 3.0, in 0.1..=20.0, "m";
        /// A further cluster within this distance of the same old one gets its id, too, because
        /// objects fall apart. Large values glue neighbours together.
        share_distance_m: f64 = 0.5, thesis 3.0, in 0.0..=20.0, "m";
        /// Whether old clusters are moved by their velocity before they are compared.
        predict: bool = true, thesis false, "";
        /// How long an id is kept for a cluster that is not seen.
        memory_s: f64 = 1.0, thesis 0.0, in 0.0..=10.0, "s";
        /// Time over which a velocity is a difference of positions; 0 is from one revolution
        /// to the next. A longer one is calmer and later.
        velocity_baseline_s: f64 = 0.5, thesis 0.0, in 0.0..=2.0, "s";
        /// Whether a box that shows one side of a vehicle is completed to a whole car, away
        /// from the sensor, and further clusters within it get its id.
        complete_boxes: bool = true, thesis false, "";
        /// Longest side of a cluster that can be a road user; longer ones are structure.
        longest_object_m: f64 = 20.0, thesis 1000.0, in 1.0..=1000.0, "m";
        /// Greatest height above the ground of a cluster that can be a road user; higher ones
        /// are houses, poles and trees.
        highest_object_m: f64 = 4.5, thesis 1000.0, in 1.0..=1000.0, "m";
        /// Height above the ground at which a road user must have begun; what begins higher
        /// hangs over the road.
        clearance_m: f64 = 2.0, thesis 1000.0, in 0.1..=1000.0, "m";
    }
}

/// Size of the car whose hidden part is assumed: the average of new cars in Europe.
const CAR_LENGTH_M: f64 = 4.3;
const CAR_WIDTH_M: f64 = 1.8;
/// Longer than any bicycle: what moves and shows so long a side is a car.
const LONGEST_CYCLE_M: f64 = 2.1;
/// Visible sides between these are taken for the width of a vehicle...
const VEHICLE_WIDTH_M: std::ops::RangeInclusive<f64> = 1.3..=2.6;
/// ...and heights between these for its height.
const VEHICLE_HEIGHT_M: std::ops::RangeInclusive<f64> = 0.9..=3.5;
/// A cluster that begins above the first height and ends above the second is the cabin of a
/// car, whose body returned too low to be told from the road.
const CABIN_FLOOR_M: f64 = 0.45;
const CABIN_ROOF_M: f64 = 0.95;
/// Margin around a predicted box within which a cluster is a piece of it.
const PIECE_MARGIN_M: f64 = 0.8;
/// Standard deviation of where the middle of a cluster is seen.
const CENTRE_DEVIATION_M: f64 = 0.1;
/// Of a speed that was not measured yet: it may be any in a town.
const UNKNOWN_SPEED_DEVIATION_MPS: f64 = 8.0;

/// One road user, valid at the end of the sweep, in the local frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// Identity.
    pub id: u32,
    /// Middle of the box, metres.
    pub centre_m: [f64; 3],
    /// Direction of the length, radians counter-clockwise from x.
    pub yaw_rad: f64,
    /// Speed along the yaw.
    pub speed_mps: f64,
    /// Along the yaw.
    pub length_m: f64,
    /// Across the yaw.
    pub width_m: f64,
    /// From the ground up.
    pub height_m: f64,
    /// Standard deviation of either coordinate of the centre.
    pub position_deviation_m: f64,
    /// Standard deviation of the yaw.
    pub yaw_deviation_rad: f64,
    /// Standard deviation of the speed.
    pub speed_deviation_mps: f64,
    /// Probability that it exists.
    pub existence: f64,
    /// When it was first seen.
    pub first_seen: Time,
    /// Returns on it in this revolution.
    pub points: usize,
}

impl Object {
    /// Its box from above.
    pub fn rectangle(&self) -> Rectangle {
        Rectangle {
            centre_m: [self.centre_m[0], self.centre_m[1]],
            yaw_rad: self.yaw_rad,
            length_m: self.length_m,
            width_m: self.width_m,
        }
    }

    fn velocity_mps(&self) -> [f64; 2] {
        let (sine, cosine) = libm::sincos(self.yaw_rad);
        [self.speed_mps * cosine, self.speed_mps * sine]
    }
}

/// The track step.
#[derive(Debug, Clone)]
pub struct Tracker {
    parameters: TrackParameters,
    identities: Identities,
    motions: Vec<Motion>,
    /// Clusters of this revolution that may be road users, with their centres.
    seen: Vec<Seen>,
    objects: Vec<Object>,
    objects_time: Time,
    outline: Vec<[f64; 2]>,
}

/// A cluster's centre, and when the sensor passed over it.
#[derive(Debug, Clone, Copy)]
struct Seen {
    cluster: usize,
    id: u32,
    centre_m: [f64; 2],
    time: Time,
}

impl Tracker {
    /// A tracker without tracks, whose first id will be 0.
    pub fn new(parameters: &TrackParameters) -> Self {
        Self {
            parameters: parameters.clone(),
            identities: Identities::default(),
            motions: vec![],
            seen: vec![],
            objects: vec![],
            objects_time: Time::ZERO,
            outline: vec![],
        }
    }

    /// Forgets all tracks, for a session that begins anew. Ids go on ascending.
    pub fn reset(&mut self) {
        self.identities.forget();
        self.motions.clear();
        self.objects.clear();
    }

    /// The objects of the last revolution, by id.
    pub fn objects(&self) -> &[Object] {
        &self.objects
    }

    /// Takes the clusters of a revolution in.
    pub fn process(&mut self, scan: &Scan, clusters: &Clusters, ground: &Plane) -> &[Object] {
        self.see(scan, clusters, ground);
        self.identify(scan.time());
        self.objects.clear();
        let seen = std::mem::take(&mut self.seen);
        for pieces in seen.chunk_by(|a, b| a.id == b.id) {
            let object = self.object(scan, clusters, ground, pieces);
            self.objects.push(object);
        }
        self.seen = seen;
        &self.objects
    }

    /// Notes the clusters that can be road users.
    fn see(&mut self, scan: &Scan, clusters: &Clusters, ground: &Plane) {
        self.seen.clear();
        for (cluster, points) in clusters.iter().enumerate() {
            let extent = Extent::of(scan, points, ground);
            if extent.can_be_road_user(&self.parameters) {
                let age = crate::time::Span::from_seconds(-extent.mean_age_s);
                self.seen.push(Seen {
                    cluster,
                    id: 0,
                    centre_m: extent.centre_m,
                    time: scan.time() + age,
                });
            }
        }
    }

    /// Gives every cluster an id, and every id its motion.
    fn identify(&mut self, now: Time) {
        let centres: Vec<[f64; 2]> = self.seen.iter().map(|seen| seen.centre_m).collect();
        let velocity = |id: u32| {
            let motion = self.motions.iter().find(|motion| motion.id() == id);
            motion.map_or([0.0; 2], |motion| motion.velocity().mps)
        };
        let parameters = &self.parameters;
        let objects = parameters.complete_boxes.then_some(&self.objects[..]);
        let boxes = objects.unwrap_or(&[]).iter().map(|object| {
            let passed_s = (now - self.objects_time).seconds();
            (
                object.id,
                object.rectangle().moved(object.velocity_mps(), passed_s),
            )
        });
        let boxes: Vec<(u32, Rectangle)> = boxes.collect();
        let owner = |centre_m: &[f64; 2]| {
            let around =
                |(_, rectangle): &&(u32, Rectangle)| rectangle.contains(centre_m, PIECE_MARGIN_M);
            boxes.iter().find(around).map(|(id, _)| *id)
        };
        let ids = self
            .identities
            .assign(&centres, now, velocity, owner, parameters);
        for (seen, id) in self.seen.iter_mut().zip(ids) {
            seen.id = *id;
        }
        self.seen.sort_by_key(|seen| (seen.id, seen.cluster));
        self.motions
            .retain(|motion| self.identities.knows(motion.id()));
        self.objects_time = now;
    }

    fn object(
        &mut self,
        scan: &Scan,
        clusters: &Clusters,
        ground: &Plane,
        pieces: &[Seen],
    ) -> Object {
        let points = || pieces.iter().flat_map(|seen| clusters.points(seen.cluster));
        let count = points().count();
        let motion = self.follow(pieces, clusters);
        let (velocity, heading_rad) = (motion.velocity(), motion.heading_rad());
        let (first_seen, existence) = (motion.first_seen(), motion.existence());

        self.outline.clear();
        let (mut floor_gap_m, mut height_m) = (f64::MAX, 0.0f64);
        for point in points() {
            let position = scan.point_m(*point as usize).map(f64::from);
            let above_m = ground.above_m(&position.into());
            (floor_gap_m, height_m) = (floor_gap_m.min(above_m), height_m.max(above_m));
            self.outline.push([position[0], position[1]]);
        }
        let [vx, vy] = velocity.mps;
        let measured = Rectangle::fit(&self.outline, heading_rad);
        let mut rectangle = measured;
        if self.parameters.complete_boxes && VEHICLE_HEIGHT_M.contains(&height_m) {
            let is_cabin = floor_gap_m > CABIN_FLOOR_M && height_m > CABIN_ROOF_M;
            rectangle = completed(measured, heading_rad, is_cabin);
        }

        // What was seen earlier in the sweep has moved on since.
        let late_s = (scan.time() - mean_time(pieces)).seconds();
        let [x, y] = rectangle.centre_m;
        let centre_m = [x + vx * late_s, y + vy * late_s];
        let floor_m = floor_below(ground, centre_m);
        let added_m = rectangle.length_m - measured.length_m;
        Object {
            id: pieces[0].id,
            centre_m: [centre_m[0], centre_m[1], floor_m + 0.5 * height_m],
            yaw_rad: rectangle.yaw_rad,
            speed_mps: vx * libm::cos(rectangle.yaw_rad) + vy * libm::sin(rectangle.yaw_rad),
            length_m: rectangle.length_m,
            width_m: rectangle.width_m,
            height_m,
            position_deviation_m: CENTRE_DEVIATION_M + 0.25 * added_m.max(0.0),
            yaw_deviation_rad: rectangle.yaw_deviation_rad(heading_rad.is_some()),
            speed_deviation_mps: velocity.deviation_mps,
            existence,
            first_seen,
            points: count,
        }
    }

    /// Carries the motion of an object on with what was seen of it.
    fn follow(&mut self, pieces: &[Seen], clusters: &Clusters) -> &Motion {
        let weight = |seen: &Seen| clusters.points(seen.cluster).len() as f64;
        let total: f64 = pieces.iter().map(weight).sum();
        let centre_m = [0, 1].map(|axis| {
            let sum: f64 = pieces
                .iter()
                .map(|seen| weight(seen) * seen.centre_m[axis])
                .sum();
            sum / total
        });
        let id = pieces[0].id;
        let found = self.motions.iter().position(|motion| motion.id() == id);
        let index = found.unwrap_or_else(|| {
            self.motions.push(Motion::new(id));
            self.motions.len() - 1
        });
        let baseline_s = self.parameters.velocity_baseline_s;
        self.motions[index].observe(mean_time(pieces), centre_m, baseline_s);
        &self.motions[index]
    }
}

/// What must be known of a cluster to tell whether it can be a road user.
struct Extent {
    low_m: [f64; 3],
    high_m: [f64; 3],
    centre_m: [f64; 2],
    mean_age_s: f64,
}

impl Extent {
    /// East, north, and above the ground.
    fn of(scan: &Scan, points: &[u32], ground: &Plane) -> Self {
        let [mut low_m, mut high_m, mut sum_m] = [[f64::MAX; 3], [f64::MIN; 3], [0.0; 3]];
        let mut age_s = 0.0;
        for point in points {
            let position = scan.point_m(*point as usize).map(f64::from);
            let above_m = ground.above_m(&position.into());
            for (axis, value) in [position[0], position[1], above_m].into_iter().enumerate() {
                low_m[axis] = low_m[axis].min(value);
                high_m[axis] = high_m[axis].max(value);
                sum_m[axis] += value;
            }
            age_s += scan.age_s(scan.column(*point as usize));
        }
        let count = points.len() as f64;
        Self {
            low_m,
            high_m,
            centre_m: [sum_m[0] / count, sum_m[1] / count],
            mean_age_s: age_s / count,
        }
    }

    fn can_be_road_user(&self, parameters: &TrackParameters) -> bool {
        let side_m = |axis: usize| self.high_m[axis] - self.low_m[axis];
        side_m(0).max(side_m(1)) <= parameters.longest_object_m
            && self.high_m[2] <= parameters.highest_object_m
            && self.low_m[2] <= parameters.clearance_m
    }
}

fn mean_time(pieces: &[Seen]) -> Time {
    let first = pieces[0].time;
    let sum: i64 = pieces.iter().map(|seen| (seen.time - first).micros()).sum();
    first + crate::time::Span::from_micros(sum / pieces.len() as i64)
}

/// Height of the ground plane under a place, in the sensor frame.
fn floor_below(ground: &Plane, [x, y]: [f64; 2]) -> f64 {
    let [a, b, c] = ground.normal();
    -(a * x + b * y + ground.height_m()) / c
}

/// A box that shows one or two sides of a vehicle, grown to a whole car away from the sensor.
/// A moving one has its length along the motion; of a standing one a visible side as long as
/// a vehicle is wide is its front or rear.
/// A cabin sits in the middle of its car's length.
fn completed(seen: Rectangle, heading_rad: Option<f64>, is_cabin: bool) -> Rectangle {
    let is_wide = |across_m: f64| VEHICLE_WIDTH_M.contains(&across_m);
    let to_car = |seen: Rectangle| seen.grown(CAR_LENGTH_M, CAR_WIDTH_M, is_cabin);
    if heading_rad.is_some() {
        let side_view = seen.length_m > LONGEST_CYCLE_M;
        return if is_wide(seen.width_m) || side_view {
            to_car(seen)
        } else {
            seen
        };
    }
    if seen.length_m > *VEHICLE_WIDTH_M.end() {
        to_car(seen)
    } else if is_wide(seen.length_m) && seen.length_m > 1.5 {
        to_car(seen.quarter_turned())
    } else {
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::sensor::VLP16;
    use crate::cloud::tests::scan_of;
    use crate::cluster::{ClusterParameters, Dbscan};
    use crate::parameter::Profile;

    /// The rear of a car, 1.8 m wide and 1.2 m high, straight ahead.
    fn rear_of_car(distance_m: f64) -> Scan {
        scan_of(1800, |column, layer| {
            let azimuth = (column as f64 * 0.2).to_radians();
            let elevation = VLP16.elevation_deg[layer].to_radians();
            let across_m = distance_m * azimuth.tan();
            let up_m = distance_m * elevation.tan() / azimuth.cos();
            let ahead = !(450..1350).contains(&column);
            if ahead && across_m.abs() < 0.9 && (-1.6..-0.4).contains(&up_m) {
                (100.0 * distance_m / azimuth.cos() / elevation.cos()).round() as u16
            } else {
                0
            }
        })
    }

    fn track(tracker: &mut Tracker, scan: &Scan) -> Vec<Object> {
        let ground = vec![false; scan.len()];
        let mut dbscan = Dbscan::new(&ClusterParameters::profile(Profile::Default));
        let clusters = dbscan.process(scan, &ground);
        tracker.process(scan, clusters, &Plane::level(1.8)).to_vec()
    }

    #[test]
    fn a_car_seen_from_behind_has_its_middle_two_metres_ahead() {
        let mut tracker = Tracker::new(&TrackParameters::profile(Profile::Default));
        let objects = track(&mut tracker, &rear_of_car(10.0));
        let [car] = &objects[..] else {
            panic!("{objects:?}")
        };
        assert!(car.centre_m[0].abs() < 0.1, "{car:?}");
        assert!(
            (car.centre_m[1] - 10.0 - CAR_LENGTH_M / 2.0).abs() < 0.1,
            "{car:?}"
        );
        assert!(
            (car.length_m, car.width_m) == (CAR_LENGTH_M, CAR_WIDTH_M),
            "{car:?}"
        );
    }

    #[test]
    fn the_thesis_keeps_what_it_sees() {
        let mut tracker = Tracker::new(&TrackParameters::profile(Profile::Thesis));
        let objects = track(&mut tracker, &rear_of_car(10.0));
        assert!((objects[0].centre_m[1] - 10.0).abs() < 0.1);
    }

    #[test]
    fn the_same_car_keeps_its_id_and_standing_it_has_no_speed() {
        let mut tracker = Tracker::new(&TrackParameters::profile(Profile::Default));
        for _ in 0..5 {
            let objects = track(&mut tracker, &rear_of_car(12.0));
            assert_eq!(
                objects.iter().map(|object| object.id).collect::<Vec<_>>(),
                [0]
            );
            assert!(objects[0].speed_mps.abs() < 0.01);
        }
    }

    #[test]
    fn ids_are_never_given_twice() {
        let mut tracker = Tracker::new(&TrackParameters::profile(Profile::Default));
        track(&mut tracker, &rear_of_car(12.0));
        tracker.reset();
        assert_eq!(track(&mut tracker, &rear_of_car(12.0))[0].id, 1);
    }
}
