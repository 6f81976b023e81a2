//! Step five: clusters become objects that keep their identity from revolution to revolution.
//!
//! `objects` takes a revolution in: `patches` takes its clusters, after `thinning` them, with what goes
//! on `above` them, by `placing` them, what drives along with the sensor over the `seam` of the sweep as one, and
//! divides them into `parts` that do not touch on the `floor`, and `crowds` into people, and asks what rays show
//! at the `flanks` of each; `grouping` says which `spots` belong together, given what each track `claims` by its `forecast`
//! and the `strays` near it, `assignment` what is whose, `sight` what is hidden and what is gone;
//! `nearby` spares all of them what is far away. A `road_user` learns from each `look`, and the
//! `view` of it in the road user's own axes, its `motion`, its `shape`, its `class`, of which there
//! is a `belief`, and by its `trail` whether it moves; `existence` says whether it is there at all, and
//! `confidence` how often that is right; what stands and is hardly a road user rests most of the
//! time, and one that was lost gets its id back (`road_user`). Vehicles that are `standing` are known by
//! the `appearance` of their clusters and by their places, and people by theirs. `nearest` is the tracking of the thesis.

mod above;

mod appearance;

mod assignment;

mod belief;

mod claims;

mod class;

mod confidence;

mod crowds;

mod existence;

mod flanks;

mod floor;

mod forecast;

mod grouping;

mod hypothesis;

mod look;

mod motion;

mod nearby;

mod nearest;

mod newcomers;

mod objects;

mod parts;

mod patches;

mod placing;

mod profiles;

mod road_user;

mod seam;

mod shape;

mod sight;

mod spots;

mod standing;

mod strays;

mod thinning;

mod trace;

mod trail;

mod view;

use nalgebra::Vector2;

pub use appearance::FEATURES as APPEARANCE_FEATURES;
pub use class::Class;
pub(crate) use road_user::MOST_LOST_S;

use crate::beams::Beams;
use crate::cloud::{Extent, Scan};
use crate::cluster::Clusters;
use crate::ego::{Anchor, Placement, Pose, Sweep};
use crate::geometry::Rectangle;
use crate::ground::GroundReport;
use crate::parameter::{choices, parameters};
use crate::time::{Span, Time};
use nearest::NearestTracker;
use objects::ObjectTracker;
use road_user::Track;

choices! {
    /// How clusters become objects.
    pub enum Method {
        /// Boxes with motion, class and memory, paired with clusters as a whole.
        Objects = "objects",
        /// Every cluster takes the id of the nearest old one (thesis section 4.1.3), and a
        /// CTRV filter gives its motion.
        Nearest = "nearest",
    }
}

parameters! {
    /// The tracks: identities, boxes, motion, classes.
    pub struct TrackParameters "track" {
        /// How clusters become objects.
        method: Method = Method::Objects, thesis Method::Nearest, "";
        /// Distance between an old and a new cluster, or between a box and a cluster, within
        /// which the id may be handed on.
        association_distance_m: f64 = 2.0, thesis 3.0, in 0.1..=20.0, "m";
        /// Confidence from which an object is published: the probability that it exists and is
        /// a road user. Lower values list walls, hedges and poles, too.
        least_confidence: f64 = 0.5, thesis 0.0, in 0.0..=1.0, "";
        /// How long a hidden object is remembered.
        hidden_memory_s: f64 = 5.0, in 0.0..=60.0, "s";
        /// Longest side of a cluster that can be a road user; longer ones are structure.
        longest_object_m: f64 = 18.0, in 1.0..=1000.0, "m";
        /// Greatest height above the ground of a cluster that can be a road user; higher ones
        /// are houses, poles and trees.
        highest_object_m: f64 = 4.2, in 1.0..=1000.0, "m";
        /// Height that a road user has at least; lower things are kerbs and grass.
        lowest_object_m: f64 = 0.45, in 0.0..=2.0, "m";
        /// Height above the ground at which a road user must have begun; what begins higher
        /// hangs over the road.
        clearance_m: f64 = 1.6, in 0.1..=1000.0, "m";
    }
}

/// One road user, valid at the end of the sweep, in the odometry frame until it is published.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// Identity.
    pub id: u32,
    /// What it is most likely.
    pub class: Class,
    /// Probability of that class, given that it is a road user.
    pub class_probability: f64,
    /// Whether this revolution measured it; else it is predicted.
    pub measured: bool,
    /// Middle of the box, metres.
    pub centre_m: [f64; 3],
    /// Direction of the length, radians counter-clockwise from x, in (-pi, pi].
    pub yaw_rad: f64,
    /// Speed along the yaw; negative when reversing.
    pub speed_mps: f64,
    /// Counter-clockwise.
    pub yaw_rate_radps: f64,
    /// Along the yaw.
    pub length_m: f64,
    /// Across the yaw.
    pub width_m: f64,
    /// From the ground up.
    pub height_m: f64,
    /// Standard deviations of the centre's x and y.
    pub position_deviation_m: [f64; 2],
    /// Standard deviation of the yaw.
    pub yaw_deviation_rad: f64,
    /// Standard deviation of the speed.
    pub speed_deviation_mps: f64,
    /// Probability that it exists and is a road user.
    pub existence: f64,
    /// When it was first seen.
    pub first_seen: Time,
    /// Since when it was not lost.
    pub seen_since: Time,
    /// When it was last seen.
    pub last_measured: Time,
    /// Returns on it in this revolution; of what is near and shows many, about as many.
    pub points: usize,
}

impl Object {
    /// The same in the local frame, of one in the odometry frame.
    pub fn in_local_frame(&self, anchor: &Anchor) -> Self {
        let (sine, cosine) = libm::sincos(anchor.yaw_rad);
        let [x, y] = self.position_deviation_m;
        Self {
            centre_m: anchor.place_m(self.centre_m),
            yaw_rad: anchor.yaw_rad(self.yaw_rad),
            position_deviation_m: [
                libm::hypot(x * cosine, y * sine),
                libm::hypot(x * sine, y * cosine),
            ],
            ..self.clone()
        }
    }

    /// Its box from above.
    pub fn rectangle(&self) -> Rectangle {
        Rectangle {
            centre_m: [self.centre_m[0], self.centre_m[1]],
            yaw_rad: self.yaw_rad,
            length_m: self.length_m,
            width_m: self.width_m,
        }
    }
}

/// What a revolution brings, beside its clusters.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// Its points.
    pub scan: &'a Scan,
    /// Their heights above the ground.
    pub heights_m: &'a [f32],
    /// The ground around the sensor.
    pub ground: &'a GroundReport,
    /// Where the sensor was.
    pub sweep: &'a Sweep,
    /// How the points of each column are placed.
    pub placements: &'a [Placement],
    /// What was seen of their places before.
    pub beams: &'a Beams,
}

impl Scene<'_> {
    /// When the sensor passed over a place.
    fn passed_at(&self, place_m: Vector2<f64>) -> Time {
        let [x, y] = self.sweep.sensor.placement().sensor_m(place_m.into());
        let age_s = self.scan.age_s(self.scan.column_at(libm::atan2(x, y)));
        self.scan.time() + Span::from_seconds(-age_s)
    }
}

/// The track step.
#[derive(Debug, Clone)]
pub struct Tracker {
    parameters: TrackParameters,
    by_object: ObjectTracker,
    by_distance: NearestTracker,
    last_sweep: Option<Sweep>,
    expected: Vec<Rectangle>,
}

impl Tracker {
    /// A tracker without tracks, whose first id will be 0.
    pub fn new(parameters: &TrackParameters) -> Self {
        Self {
            parameters: parameters.clone(),
            by_object: ObjectTracker::default(),
            by_distance: NearestTracker::default(),
            last_sweep: None,
            expected: vec![],
        }
    }

    /// Forgets all tracks, for a session that begins anew. Ids go on ascending.
    pub fn reset(&mut self) {
        self.by_object.reset();
        self.by_distance.reset();
        self.last_sweep = None;
    }

    /// The objects of the last revolution, by id.
    pub fn objects(&self) -> &[Object] {
        match self.parameters.method {
            Method::Objects => self.by_object.objects(),
            Method::Nearest => self.by_distance.objects(),
        }
    }

    /// Where what moves will be at `end`, in the sensor frame of a sweep: what is met there tells nothing of the
    /// sensor's own motion.
    pub fn expect_moving(&mut self, end: Time, sweep: &Sweep) -> &[Rectangle] {
        self.expect(end, sweep, Track::is_surely_moving)
    }

    /// The same of vehicles that drive: what is met there is no ground.
    pub fn expect_driving(&mut self, end: Time, sweep: &Sweep) -> &[Rectangle] {
        self.expect(end, sweep, Track::is_moving_vehicle)
    }

    fn expect(
        &mut self,
        end: Time,
        sweep: &Sweep,
        is_meant: impl Fn(&Track) -> bool,
    ) -> &[Rectangle] {
        self.expected.clear();
        let is_known = self
            .last_sweep
            .is_some_and(|last| last.epoch == sweep.epoch);
        if is_known && self.parameters.method == Method::Objects {
            self.by_object
                .expect(end, &sweep.sensor, is_meant, &mut self.expected);
        }
        &self.expected
    }

    /// Forgets who was not seen in the last revolution where the own vehicle turned out to be, given the sensor's pose in a
    /// sweep.
    pub fn forget_pieces(&mut self, own_vehicle: &Extent, scan: &Scan, sweep: &Sweep) {
        /// Returns of the revolution before this one are two old at most; half of one more is for jitter.
        const UNSEEN_REVOLUTIONS: f64 = 2.5;
        let since = scan.time() + Span::from_seconds(-UNSEEN_REVOLUTIONS * scan.duration_s());
        self.by_object
            .forget_pieces(own_vehicle, &sweep.sensor, since);
    }

    /// What each cluster of the last revolution looks like: [`APPEARANCE_FEATURES`] numbers a cluster, all
    /// zero for those of less than five returns; of no meaning but to fit what tells vehicles that stand.
    pub fn appearances(&self) -> impl ExactSizeIterator<Item = [f64; APPEARANCE_FEATURES]> {
        self.by_object.appearances()
    }

    /// Takes the clusters of a revolution in.
    pub fn process(&mut self, clusters: &Clusters, scene: &Scene<'_>) -> &[Object] {
        let Scene {
            scan,
            ground,
            sweep,
            ..
        } = *scene;
        match self.parameters.method {
            Method::Objects => {
                if let Some((from, to)) = self.change_of_frame(sweep) {
                    self.by_object.reframe(&from, &to);
                }
                self.by_object.process(clusters, scene, &self.parameters);
            }
            Method::Nearest => {
                self.by_distance
                    .process(scan, clusters, &ground.plane, sweep, &self.parameters);
            }
        }
        self.last_sweep = Some(*sweep);
        self.objects()
    }

    /// Where the sensor is in the old frame and in the new one, when a source of poses jumped,
    /// was found or was lost: objects keep their places around the vehicle.
    fn change_of_frame(&self, sweep: &Sweep) -> Option<(Pose, Pose)> {
        let last = self.last_sweep.as_ref()?;
        (last.epoch != sweep.epoch).then(|| (last.carried_on(), sweep.sensor))
    }
}

#[cfg(test)]
mod tests;
