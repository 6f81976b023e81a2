//! One road user, or what may become one: motion, shape, class, and whether it exists.

use nalgebra::{Matrix2, Vector2};

mod published;

mod reunion;

use super::class::{Belief, Qualities};
use super::existence::Existence;
use super::look::{Look, View};
use super::motion::Motion;
use super::shape::{Shape, fitted_yaw};
use super::sight::Sight;
use super::spots::Spot;
use super::trail::Trails;
use super::{Rectangle, TrackParameters};
use crate::time::{Span, Time};
use reunion::Parting;

/// Standard deviation of the velocity of something seen for the first time.
const BIRTH_MPS: f64 = 6.0;
/// Noise of a box's middle beside that of its edges, because its shape is not a box.
const MIDDLE_M: f64 = 0.08;

/// Returns below which an object may be no cluster in the next revolution.
const SPARSE: usize = 16;

/// Speeds from which an object counts as moving.
const MOVING_MPS: f64 = 0.6;
const FAST_MPS: f64 = 1.5;

#[derive(Debug, Clone)]
pub(super) struct Track {
    pub(super) id: u32,
    /// The time for which everything holds.
    time: Time,
    first_seen: Time,
    /// Since when it was not lost.
    seen_since: Time,
    pub(super) last_measured: Time,
    motion: Motion,
    shape: Shape,
    belief: Belief,
    roughness_m: f64,
    goes_on: f64,
    upper_m: Option<f64>,
    speed_mps: f64,
    /// Whether it was seen to move, and how far.
    moves: bool,
    travelled_m: f64,
    is_suspect: bool,
    /// Where it was first seen, since its frame is the same.
    born_m: Vector2<f64>,
    trails: Trails,
    existence: Existence,
    points: usize,
    range_m: f64,
    is_hidden: bool,
    floor_z_m: f64,
    /// Where and how fast it was when it was last measured.
    parted: Parting,
    /// Whether others know its id.
    pub(super) is_published: bool,
}

impl Track {
    pub(super) fn new(
        id: u32,
        is_suspect: bool,
        spots: &[Spot],
        look: &Look,
        end: Time,
        floor_z_m: f64,
        outline: &mut Vec<[f64; 2]>,
    ) -> Self {
        let shape = Shape::first(spots, look, outline);
        let time = end + Span::from_seconds(-look.age_s);
        let mut track = Self {
            id,
            time,
            first_seen: time,
            seen_since: time,
            last_measured: time,
            motion: Motion::new(look.middle_m, Matrix2::identity(), BIRTH_MPS),
            shape,
            belief: Belief::unknown(),
            roughness_m: look.roughness_m,
            goes_on: look.goes_on,
            upper_m: look.upper_m,
            speed_mps: 0.0,
            moves: false,
            travelled_m: 0.0,
            is_suspect,
            born_m: look.middle_m,
            trails: Trails::default(),
            existence: Existence::new(),
            points: look.points,
            range_m: look.range_m,
            is_hidden: false,
            floor_z_m,
            parted: Parting::default(),
            is_published: false,
        };
        track.belief = Belief::of(&track.qualities());
        let view = look.view(spots, track.shape.yaw_rad);
        let (centre_m, noise) = track.centre(&view, look.middle_m);
        track.trails.begin(centre_m);
        track.born_m = centre_m;
        track.motion = Motion::new(centre_m, noise, BIRTH_MPS);
        track.parted = Parting::of(&track.motion.estimate(), look.points);
        track
    }

    /// Carries the object on to a time.
    pub(super) fn predict(&mut self, to: Time) {
        let seconds = (to - self.time).seconds();
        if seconds > 0.0 {
            carry_on(&mut self.motion, &mut self.shape, seconds);
            self.time = to;
        }
    }

    /// What moves of it, carried on to a time.
    fn later(&self, to: Time) -> (Motion, Shape) {
        let (mut motion, mut shape) = (self.motion.clone(), self.shape.clone());
        let seconds = (to - self.time).seconds();
        if seconds > 0.0 {
            carry_on(&mut motion, &mut shape, seconds);
        }
        (motion, shape)
    }

    /// The box, if the object is where it is thought to be.
    pub(super) fn rectangle(&self) -> Rectangle {
        self.rectangle_of(&self.motion, &self.shape)
    }

    /// The box at a later time.
    pub(super) fn rectangle_at(&self, to: Time) -> Rectangle {
        let (motion, shape) = self.later(to);
        self.rectangle_of(&motion, &shape)
    }

    fn rectangle_of(&self, motion: &Motion, shape: &Shape) -> Rectangle {
        let [length_m, width_m] = shape.size_m(self.belief.vehicle());
        Rectangle {
            centre_m: motion.position_m().into(),
            yaw_rad: shape.yaw_rad,
            length_m,
            width_m,
        }
    }

    /// How far the object may be from where it is thought to be, one standard deviation.
    pub(super) fn spread_m(&self) -> f64 {
        let covariance = self.motion.estimate().position_covariance;
        libm::sqrt(0.5 * covariance.trace())
    }

    pub(super) fn velocity_mps(&self) -> Vector2<f64> {
        self.motion.velocity_mps()
    }

    pub(super) fn position_m(&self) -> Vector2<f64> {
        self.motion.position_m()
    }

    pub(super) fn height_m(&self) -> f64 {
        self.shape.top_m
    }

    pub(super) fn yaw_rad(&self) -> f64 {
        self.shape.yaw_rad
    }

    /// Whether it is a vehicle that was seen to drive.
    pub(super) fn is_moving_vehicle(&self) -> bool {
        self.moves && self.shape.front_known && self.belief.vehicle() > 0.5
    }

    pub(super) fn is_confirmed(&self) -> bool {
        self.existence.is_confirmed()
    }

    /// Whether it returns so little that it may be no cluster.
    pub(super) fn is_sparse(&self) -> bool {
        self.points < SPARSE
    }

    pub(super) fn odds(&self) -> f64 {
        self.existence.odds()
    }

    /// Longest extent that more of the same object may have.
    pub(super) fn most_m(&self) -> [f64; 2] {
        let [length_m, width_m] = self.shape.size_m(self.belief.vehicle());
        let growth_m = if self.is_confirmed() { 0.6 } else { 2.0 };
        [length_m + growth_m, width_m + 0.4]
    }

    fn centre(&self, view: &View, expected_m: Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let vehicle = self.belief.vehicle();
        let (centre_m, noise) = view.centre(
            self.shape.size_m(vehicle),
            self.shape.size_deviation_m(vehicle),
            expected_m,
        );
        (centre_m, noise + Matrix2::identity() * MIDDLE_M * MIDDLE_M)
    }

    /// How unlikely it is that a group is this object: the squared Mahalanobis distance of its
    /// place, with a price for a spread that would take anything and for a size that does not fit.
    pub(super) fn cost(&self, spots: &[Spot], look: &Look) -> f64 {
        let view = look.view(spots, self.shape.yaw_rad);
        let estimate = self.motion.estimate();
        let (centre_m, noise) = self.centre(&view, estimate.position_m);
        let spread = estimate.position_covariance + noise;
        let off = centre_m - estimate.position_m;
        let Some(inverse) = spread.try_inverse() else {
            return f64::MAX;
        };
        let squared = (off.transpose() * inverse * off)[0];
        let most = self.most_m();
        let extent = view.extent_m();
        let excess_m = (extent[0] - most[0]).max(extent[1] - most[1]).max(0.0);
        let vanished = if self.is_confirmed() {
            let ratio = (look.points as f64 + 3.0) / (self.points as f64 + 3.0);
            libm::log(ratio).abs()
        } else {
            0.0
        };
        squared
            + 0.5 * libm::log(spread.determinant().max(1e-6) / 0.01).max(0.0)
            + 4.0 * excess_m
            + 0.3 * vanished
    }

    /// Takes a group in that is this object.
    pub(super) fn measure(
        &mut self,
        spots: &[Spot],
        look: &Look,
        end: Time,
        floor_z_m: f64,
        outline: &mut Vec<[f64; 2]>,
    ) {
        let seen_at = end + Span::from_seconds(-look.age_s);
        self.predict(seen_at);
        if let Some((yaw_rad, deviation_rad)) = fitted_yaw(spots, outline) {
            self.shape.measure_yaw(yaw_rad, deviation_rad);
        }
        let view = look.view(spots, self.shape.yaw_rad);
        let before = self.shape.size_m(self.belief.vehicle());
        self.shape.learn(&view, look);
        let after = self.shape.size_m(self.belief.vehicle());
        self.keep_near_edges(look, before, after);
        let (centre_m, noise) = self.centre(&view, self.motion.estimate().position_m);
        self.motion.measure_position(centre_m, noise);
        self.trails.push(centre_m, look);
        self.steer();
        self.existence.see();
        self.last_measured = seen_at;
        self.is_hidden = false;
        self.points = look.points;
        self.range_m = look.range_m;
        self.floor_z_m = floor_z_m;
        self.roughness_m += 0.2 * (look.roughness_m - self.roughness_m);
        self.goes_on += 0.2 * (look.goes_on - self.goes_on);
        if let Some(fresh_m) = look.upper_m {
            let known_m = self.upper_m.get_or_insert(fresh_m);
            let gain = if fresh_m > *known_m { 0.3 } else { 0.05 };
            *known_m += gain * (fresh_m - *known_m);
        }
        self.note_motion(look);
        self.parted = Parting::of(&self.motion.estimate(), look.points);
        self.belief.learn(&Belief::of(&self.qualities()), 0.3);
    }

    /// A size that changed moves the middle away from the sensor, not the edges that it sees.
    fn keep_near_edges(&mut self, look: &Look, before: [f64; 2], after: [f64; 2]) {
        let (sine, cosine) = libm::sincos(self.shape.yaw_rad);
        let sight = look.sight();
        let along = sight.x * cosine + sight.y * sine;
        let across = sight.y * cosine - sight.x * sine;
        let away = |share: f64, axis: usize| {
            let growth_m = (after[axis] - before[axis]).clamp(-0.5, 0.5);
            0.5 * growth_m * (3.0 * share).clamp(-1.0, 1.0)
        };
        let (u, v) = (away(along, 0), away(across, 1));
        self.motion
            .shift(Vector2::new(u * cosine - v * sine, u * sine + v * cosine));
    }

    /// Direction and motion inform each other.
    fn steer(&mut self) {
        let estimate = self.motion.estimate();
        let speed_mps = estimate.velocity_mps.norm();
        let deviation_mps = libm::sqrt(0.5 * estimate.velocity_covariance.trace());
        if estimate.standing < 0.3 && speed_mps > MOVING_MPS && speed_mps > 2.0 * deviation_mps {
            let course_rad = libm::atan2(estimate.velocity_mps.y, estimate.velocity_mps.x);
            // What is small turns on the spot; a vehicle must show clearly where it goes.
            let least_mps = if self.belief.vehicle() > 0.5 {
                FAST_MPS
            } else {
                MOVING_MPS
            };
            let is_fast = speed_mps > least_mps && speed_mps > 2.5 * deviation_mps;
            let deviation_rad = (1.5 * deviation_mps / speed_mps).max(0.08);
            self.shape
                .measure_course(course_rad, deviation_rad, is_fast);
        }
        /// Slip of tyres, and of a direction that is not quite right.
        const SLIP_MPS: f64 = 0.6;
        let rolls = self.belief.vehicle() > 0.6 && self.shape.yaw_variance < 0.03;
        if rolls && self.shape.front_known && speed_mps > FAST_MPS {
            let unsure_mps = speed_mps * libm::sqrt(self.shape.yaw_variance);
            self.motion
                .measure_no_slip(self.shape.yaw_rad, SLIP_MPS + unsure_mps);
        }
    }

    /// Notes whether it moves: by speed, and by a trail that is straight and long enough that
    /// no change of view explains it.
    fn note_motion(&mut self, look: &Look) {
        let estimate = self.motion.estimate();
        let speed_mps = estimate.velocity_mps.norm();
        let is_moving = estimate.standing < 0.1 && speed_mps > MOVING_MPS;
        if is_moving && self.trails.shows_motion(self.shape.seen_m[0], look) {
            self.moves = true;
            let travelled_m = (estimate.position_m - self.born_m).norm();
            self.travelled_m = self.travelled_m.max(travelled_m);
        }
        if is_moving {
            let gain = if speed_mps > self.speed_mps {
                0.15
            } else {
                0.03
            };
            self.speed_mps += gain * (speed_mps - self.speed_mps);
        }
    }

    fn qualities(&self) -> Qualities {
        let [length_m, width_m] = self.shape.seen_m;
        Qualities {
            long_m: length_m.max(width_m),
            short_m: length_m.min(width_m),
            across_m: self.shape.front_known.then_some(width_m),
            upper_m: self.upper_m,
            top_m: self.shape.top_m,
            top_below_m: self.shape.top_below_m,
            goes_on: self.goes_on,
            roughness_m: self.roughness_m,
            speed_mps: self.speed_mps,
            // The end of what is seen of a wall moves, too, but not by its length.
            moved: self.moves && self.travelled_m > (2.0 * length_m).max(1.2),
            whole_m: (self.shape.whole[0] > 0.3).then_some(length_m),
            range_m: self.range_m,
            points: self.points,
            is_suspect: self.is_suspect,
        }
    }

    /// Nothing was found that is this object.
    pub(super) fn miss(&mut self, sight: &Sight, end: Time) {
        self.points = 0;
        self.is_hidden = sight.is_hidden();
        if !self.moves {
            self.motion.halt();
        }
        let age_s = (end - self.first_seen).seconds();
        self.existence.miss(sight, age_s);
    }

    /// Whether nothing is left of it.
    pub(super) fn is_gone(&self, parameters: &TrackParameters) -> bool {
        let unseen_s = (self.time - self.last_measured).seconds();
        self.existence.is_gone()
            || unseen_s > parameters.hidden_memory_s
            || (self.is_hidden && !self.is_confirmed())
    }

    pub(super) fn reframe(
        &mut self,
        turn_rad: f64,
        moved: impl Fn([f64; 2]) -> [f64; 2] + Copy,
        rise_m: f64,
    ) {
        let (sine, cosine) = libm::sincos(turn_rad);
        self.motion.reframe(sine, cosine, moved);
        self.shape.yaw_rad = crate::ego::wrapped_rad(self.shape.yaw_rad + turn_rad);
        self.trails.reframe(moved);
        self.born_m = Vector2::from(moved(self.born_m.into()));
        self.parted.reframe((sine, cosine), moved);
        self.floor_z_m += rise_m;
    }
}

/// Carries motion and direction on by some seconds.
fn carry_on(motion: &mut Motion, shape: &mut Shape, seconds: f64) {
    motion.predict(seconds);
    let turning = (1.0 - motion.standing()) * motion.yaw_rate_radps();
    shape.predict(turning, seconds);
}
