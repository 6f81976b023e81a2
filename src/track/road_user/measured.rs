//! What a track learns from what is seen of it.

use nalgebra::Vector2;

use super::reunion::Parting;
use super::{MOVING_MPS, Track};
use crate::time::{Span, Time};
use crate::track::class::{Belief, Qualities};
use crate::track::look::Look;
use crate::track::shape::fitted_yaw;
use crate::track::spots::Spot;
use crate::track::view::View;

/// Speed from which a vehicle shows clearly where it goes.
const FAST_MPS: f64 = 1.5;

impl Track {
    /// Takes a group in that is this object.
    pub(in crate::track) fn measure(
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
        let view = View::of(look, spots, self.shape.yaw_rad);
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
        self.usual_points += 0.2 * (look.points as f64 - self.usual_points);
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
        if self.parted.is_renewed_by(look.points, seen_at) {
            self.parted = Parting::of(&self.motion.estimate(), look.points, seen_at);
        }
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

    pub(super) fn qualities(&self) -> Qualities {
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
}
