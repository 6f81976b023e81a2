//! What a track learns from what is seen of it.

use nalgebra::Vector2;

use super::reunion::Parting;
use super::{MOVING_MPS, SURELY_NONE, Track};
use crate::time::Time;
use crate::track::belief::{Belief, Qualities};
use crate::track::look::Look;
use crate::track::shape::{Course, fitted_yaw};
use crate::track::spots::Spot;
use crate::track::view::View;

/// Speed from which a vehicle shows clearly where it goes.
const FAST_MPS: f64 = 1.5;
/// Nobody reverses faster (with 1.5 and 6 m/s the real recordings' figures are the same). People and cyclists never
/// do.
const REVERSES_MPS: f64 = 3.0;
/// Standard deviations of its velocity above which a vehicle says where it goes. What is small turns on the
/// spot, and the filter says deviations three times as large as they are: with two of them the heading of real
/// people in a hall is off by 89 and 102 degrees in the mean, with one by 11 and 5 (shared recordings jaemin_0 and _1).
const VEHICLE_DEVIATIONS: f64 = 2.0;
const DEVIATIONS: f64 = 1.0;
/// So many times as fast, it says so clearly.
const CLEARLY: f64 = 1.25;

/// Of what is structure for sure motion says nothing, if it is as long as this: shorter ones are
/// seen whole.
const LONG_M: f64 = 2.5;
/// Slower things stand, as far as anybody can tell.
const SLOWEST_MPS: f64 = 0.3;
/// Probability of standing below which something moves.
const HARDLY_STANDS: f64 = 0.1;

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
        let seen_at = look.seen_at(end);
        self.predict(seen_at);
        if let Some((yaw_rad, deviation_rad)) = fitted_yaw(spots, outline) {
            self.shape.measure_yaw(yaw_rad, deviation_rad);
        }
        let view = View::of(look, spots, self.shape.yaw_rad);
        let before = self.shape.size_m(self.belief.vehicle());
        let (is_vehicle, lorry) = (self.is_vehicle(), self.belief.lorry());
        self.shape.learn(&view, look, is_vehicle, lorry);
        let after = self.shape.size_m(self.belief.vehicle());
        self.keep_near_edges(look, before, after);
        let (centre_m, noise) = self.centre(&view, self.motion.estimate().position_m);
        self.motion.measure_position(centre_m, noise);
        self.trails.push(centre_m, look, seen_at);
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
        if let Some(fresh) = look.person_log {
            let known = self.person_log.get_or_insert(fresh);
            *known += 0.3 * (fresh - *known);
        }
        self.newness.learn(look);
        self.trace.push(seen_at, self.motion.estimate().position_m);
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
            let growth_m = (after[axis] - before[axis]).clamp(-0.8, 0.8);
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
        let deviation_mps = estimate.velocity_deviation_mps();
        let is_vehicle = self.is_vehicle();
        let [least_mps, deviations] = if is_vehicle {
            [FAST_MPS, VEHICLE_DEVIATIONS]
        } else {
            [MOVING_MPS, DEVIATIONS]
        };
        let least_sure_mps = deviations * deviation_mps;
        if estimate.standing < 0.3 && speed_mps > MOVING_MPS.max(least_sure_mps) {
            self.shape.measure_course(&Course {
                direction_rad: libm::atan2(estimate.velocity_mps.y, estimate.velocity_mps.x),
                deviation_rad: (1.5 * deviation_mps / speed_mps).max(0.08),
                is_clear: speed_mps > least_mps.max(CLEARLY * least_sure_mps),
                may_be_backwards: is_vehicle && speed_mps < REVERSES_MPS,
            });
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
    /// no change of view explains it, or an empty place behind it.
    fn note_motion(&mut self, look: &Look) {
        let estimate = self.motion.estimate();
        // Of walls behind what is near, another piece is seen in every revolution.
        if !self.is_new() && self.belief.road_user() < SURELY_NONE && self.shape.seen_m[0] > LONG_M
        {
            (self.moves, self.travelled_m) = (false, 0.0);
            self.born_m = estimate.position_m;
            return;
        }
        if self.moves && self.newness.clings(estimate.standing > 0.5) {
            (self.moves, self.travelled_m) = (false, 0.0);
            self.born_m = estimate.position_m;
            self.newness.forget_way();
        }
        let is_moving = self.goes();
        let may_move = self.newness.allows_motion();
        let shows_motion =
            self.newness.vacated.is_sure() || self.trails.shows_motion(self.shape.seen_m[0], look);
        if is_moving && may_move && shows_motion {
            self.moves = true;
            self.newness.note_way(estimate.position_m);
            let travelled_m = (estimate.position_m - self.born_m).norm();
            self.travelled_m = self.travelled_m.max(travelled_m);
        }
        if is_moving {
            let speed_mps = estimate.velocity_mps.norm();
            let gain = if speed_mps > self.speed_mps {
                0.15
            } else {
                0.03
            };
            self.speed_mps += gain * (speed_mps - self.speed_mps);
        }
    }

    /// Whether it seems to go, by its motion alone.
    pub(super) fn goes(&self) -> bool {
        let estimate = self.motion.estimate();
        estimate.standing < HARDLY_STANDS && estimate.velocity_mps.norm() > SLOWEST_MPS
    }

    /// Whether it was of late where nothing was before.
    pub(in crate::track) fn is_new(&self) -> bool {
        self.newness.was_empty()
    }

    /// Whether it moves for sure, or did and went far: as a whole, and to where nothing was.
    fn surely_moves(&self) -> bool {
        self.moves && self.newness.went(self.motion.standing() > 0.5)
    }

    /// How far it must have gone until that says that it moves. The end of what is seen of a wall
    /// moves, too, but not by its length; what shows a lorry's front beside its length is no wall.
    fn telling_way_m(&self) -> f64 {
        const SHORTEST_M: f64 = 1.2;
        const LENGTHS: f64 = 2.0;
        const LORRY_LENGTHS: f64 = 0.5;
        const LEAST_LORRY_M: [f64; 2] = [5.0, 1.5];
        let seen_m = self.shape.seen_m;
        let is_large = (0..2).all(|axis| seen_m[axis] > LEAST_LORRY_M[axis]);
        let lengths = if is_large && self.shape.is_tall() {
            LORRY_LENGTHS
        } else {
            LENGTHS
        };
        (lengths * seen_m[0]).max(SHORTEST_M)
    }

    pub(super) fn qualities(&self) -> Qualities {
        let [length_m, width_m] = self.shape.seen_m;
        Qualities {
            long_m: length_m.max(width_m),
            short_m: length_m.min(width_m),
            across_m: self.shape.front_known.then_some(width_m),
            upper_m: self.upper_m,
            person_log: self.person_log,
            top_m: self.shape.top_m,
            top_below_m: self.shape.top_below_m,
            goes_on: self.goes_on,
            roughness_m: self.roughness_m,
            speed_mps: self.speed_mps,
            moved: self.moves && self.travelled_m > self.telling_way_m(),
            surely_moves: self.surely_moves(),
            has_come: self.is_confirmed() && self.is_new(),
            whole_m: (self.shape.whole[0] > 0.3).then_some(length_m),
            wide_m: (self.shape.whole[1] > 0.5).then_some(width_m),
            range_m: self.range_m,
            points: self.points,
            is_suspect: self.is_suspect,
        }
    }
}

#[cfg(test)]
mod tests;
