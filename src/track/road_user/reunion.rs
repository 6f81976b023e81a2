//! A road user of which nothing was left, and which is seen again.

use std::f64::consts::PI;

use nalgebra::{Rotation2, Vector2};

use super::{MOVING_MPS, Track};
use crate::time::Time;
use crate::track::motion::Estimate;

/// How long a lost road user may be out of sight and still be the same.
pub(crate) const MOST_LOST_S: f64 = 4.0;
/// How far from where both velocities lead it may be, and for each metre of its length and of
/// the way more.
const OFF_M: f64 = 0.8;
const OFF_PER_LENGTH: f64 = 0.25;
const OFF_PER_WAY: f64 = 0.15;
/// How much it may have turned in a second, and the directions be wrong.
const TURN_RADPS: f64 = 0.8;
const TURN_RAD: f64 = 0.4;
/// Share by which its speed may have changed.
const SPEED_SHARE: f64 = 0.4;
/// How much longer it may be than was seen before.
const GROWTH_M: f64 = 1.0;
/// Standard deviation from which on nothing is known of a velocity.
const UNKNOWN_MPS: f64 = 1.5;
/// How fast somebody may have been whose velocity was not known, if it is soon seen again.
const FASTEST_MPS: f64 = 10.0;
const UNKNOWN_S: f64 = 0.4;
/// Standard deviation of a velocity that is taken over from who was lost.
const TAKEN_OVER_MPS: f64 = 1.5;
/// Nobody walks so fast.
const RUNNING_MPS: f64 = 3.0;
/// Time within which something new does not show whether it stands: its box grows meanwhile.
const NEW_S: f64 = 0.8;
/// Share of the returns before below which a look says little of where something is: they may be
/// of what is beside it...
const CLEAR: f64 = 0.5;
/// ...unless no more is seen of it for so long.
const RENEWED_S: f64 = 1.0;

/// Where and how fast a track was when it was last seen clearly.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Parting {
    position_m: Vector2<f64>,
    velocity_mps: Vector2<f64>,
    yaw_rate_radps: f64,
    deviation_mps: f64,
    standing: f64,
    /// Returns on it.
    points: f64,
    at: Time,
}

impl Parting {
    pub(super) fn of(estimate: &Estimate, points: usize, at: Time) -> Self {
        Self {
            position_m: estimate.position_m,
            velocity_mps: estimate.velocity_mps,
            yaw_rate_radps: estimate.yaw_rate_radps,
            deviation_mps: estimate.velocity_deviation_mps(),
            standing: estimate.standing,
            points: points as f64,
            at,
        }
    }

    /// Whether its velocity is known.
    fn has_velocity(&self) -> bool {
        self.deviation_mps < UNKNOWN_MPS
    }

    /// The same of which the velocity is not known.
    fn of_unknown_velocity(self) -> Self {
        Self {
            deviation_mps: f64::INFINITY,
            ..self
        }
    }

    /// Whether a look with some returns at a time takes its place.
    pub(super) fn is_renewed_by(&self, points: usize, at: Time) -> bool {
        points as f64 >= CLEAR * self.points || (at - self.at).seconds() > RENEWED_S
    }

    pub(super) fn reframe(
        &mut self,
        (sine, cosine): (f64, f64),
        moved: impl Fn([f64; 2]) -> [f64; 2],
    ) {
        self.position_m = moved(self.position_m.into()).into();
        let [x, y] = self.velocity_mps.into();
        self.velocity_mps = Vector2::new(x * cosine - y * sine, x * sine + y * cosine);
    }

    fn moves(&self) -> bool {
        self.standing < 0.5 && self.velocity_mps.norm() > MOVING_MPS
    }

    /// Whether it goes faster than anybody walks.
    fn is_fast(&self) -> bool {
        self.moves() && self.has_velocity() && self.velocity_mps.norm() > RUNNING_MPS
    }

    /// How far from here the road user would be that parted before, on an arc from its last
    /// velocity to this one; `None` if that is too far, or if the velocities do not go together.
    fn off_from_m(&self, parted: &Self, length_m: f64) -> Option<f64> {
        let gap_s = (self.at - parted.at).seconds();
        if self.has_velocity() {
            if parted.has_velocity() && !self.goes_together_with(parted, gap_s) {
                return None;
            }
            return self.off_arc_m(parted, self.velocity_mps, gap_s, length_m);
        }
        self.on_from(parted, length_m).map(|(off_m, _)| off_m)
    }

    /// As long as its own velocity is not known, the other one went straight on or went on to turn:
    /// how far it is from the likelier end, and at which rate that turned.
    fn on_from(&self, parted: &Self, length_m: f64) -> Option<(f64, f64)> {
        let gap_s = (self.at - parted.at).seconds();
        let ends = [0.0, parted.yaw_rate_radps].map(|rate_radps| {
            let end_mps = parted.velocity_after_mps(rate_radps, gap_s);
            let off_m = self.off_arc_m(parted, end_mps, gap_s, length_m);
            off_m.map(|off_m| (off_m, rate_radps))
        });
        let ends = ends.into_iter().flatten();
        ends.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Its velocity after some seconds of turning at a rate.
    fn velocity_after_mps(&self, rate_radps: f64, seconds: f64) -> Vector2<f64> {
        Rotation2::new((rate_radps * seconds).clamp(-PI, PI)) * self.velocity_mps
    }

    /// Whether what had one velocity can have the other one so much later.
    fn goes_together_with(&self, parted: &Self, gap_s: f64) -> bool {
        if !parted.moves() {
            return !self.moves();
        }
        let turn_rad = parted.velocity_mps.angle(&self.velocity_mps);
        let speeds = [parted, self].map(|parting| parting.velocity_mps.norm());
        let changed_mps = libm::fabs(speeds[1] - speeds[0]);
        turn_rad <= TURN_RAD + TURN_RADPS * gap_s
            && changed_mps <= SPEED_SHARE * speeds[0].max(speeds[1]) + MOVING_MPS
    }

    /// How far this is from the end of an arc from where the other one parted, at which it has a
    /// velocity; `None` if that is too far.
    fn off_arc_m(
        &self,
        parted: &Self,
        end_mps: Vector2<f64>,
        gap_s: f64,
        length_m: f64,
    ) -> Option<f64> {
        let begin_mps = if parted.has_velocity() {
            parted.velocity_mps
        } else {
            end_mps
        };
        let half_rad = (0.5 * begin_mps.angle(&end_mps)).max(1e-6);
        let speed_mps = 0.5 * (begin_mps.norm() + end_mps.norm());
        let chord_m = speed_mps * gap_s * libm::sin(half_rad) / half_rad;
        let course = (begin_mps + end_mps).try_normalize(1e-6);
        let way_m = course.map_or(Vector2::zeros(), |course| course * chord_m);
        let off_m = (self.position_m - parted.position_m - way_m).norm();
        let unknown_m = if !parted.has_velocity() && gap_s < UNKNOWN_S {
            FASTEST_MPS * gap_s
        } else {
            0.0
        };
        let farthest_m = OFF_M + OFF_PER_LENGTH * length_m + OFF_PER_WAY * way_m.norm() + unknown_m;
        (off_m < farthest_m).then_some(off_m)
    }
}

impl Track {
    /// Whether it may come back at a time, and is then worth an old id.
    pub(in crate::track) fn may_return(&self, now: Time) -> bool {
        self.was_likely && (now - self.last_measured).seconds() <= MOST_LOST_S
    }

    /// How far this new track is from where one that is not seen any more would be by now;
    /// `None` if it cannot be the same road user.
    pub(in crate::track) fn off_from_m(&self, lost: &Self) -> Option<f64> {
        let gap_s = (self.parted.at - lost.parted.at).seconds();
        let length_m = lost.shape.size_m(lost.belief.vehicle())[0];
        // A few returns may have been taken for the old one where this one was already seen.
        let is_apart =
            lost.parted.at < self.first_seen || lost.parted.points < CLEAR * self.parted.points;
        let is_in_time = gap_s > 0.0 && gap_s <= MOST_LOST_S;
        if !is_in_time || !is_apart || self.shape.seen_m[0] > length_m + GROWTH_M {
            return None;
        }
        let own = self.parting_known_at(self.time);
        let parted = lost.parting_known_at(lost.parted.at);
        // What moves tells by its speed whether it is the same; nobody walks where a car drives on.
        let tells = parted.is_fast() || (parted.moves() && own.has_velocity());
        if !tells && self.is_vehicle() != lost.is_vehicle() {
            return None;
        }
        own.off_from_m(&parted, length_m)
    }

    /// Whether nothing or hardly anything is seen of it, though others know it.
    pub(in crate::track) fn is_missed(&self) -> bool {
        self.was_likely && (self.points == 0 || self.parted.at < self.last_measured)
    }

    /// Whether it stands in the place of a known one of which less is seen: both are one.
    pub(in crate::track) fn replaces(&self, known: &Self) -> bool {
        let (own, other) = (self.rectangle(), known.rectangle());
        let (seen, parted) = (self.parting_known_at(self.time), known.parted);
        let gap_s = (seen.at - parted.at).seconds();
        let is_other_way = seen.has_velocity()
            && parted.has_velocity()
            && !seen.goes_together_with(&parted, gap_s);
        let are_in_one_place =
            || own.outline().contains(other.centre_m) || other.outline().contains(own.centre_m);
        known.was_likely
            && known.is_vehicle() == self.is_vehicle()
            && (known.points as f64) < CLEAR * self.points as f64
            && self.shape.seen_m[0] <= other.length_m + GROWTH_M
            && !is_other_way
            && are_in_one_place()
    }

    /// Whether it did not show yet whether it moves.
    fn is_new_at(&self, time: Time) -> bool {
        !self.moves && (time - self.first_seen).seconds() < NEW_S
    }

    /// Where it was last seen clearly, with its velocity if that was known at a time.
    fn parting_known_at(&self, time: Time) -> Parting {
        if self.is_new_at(time) {
            self.parted.of_unknown_velocity()
        } else {
            self.parted
        }
    }

    /// Goes on as a road user that was lost.
    pub(in crate::track) fn take_over(&mut self, lost: &Self) {
        let is_same_kind = lost.is_vehicle() == self.is_vehicle();
        if self.is_new_at(self.time) && lost.moves && lost.parted.is_fast() && is_same_kind {
            let length_m = lost.rectangle().length_m;
            let on = self.parted.on_from(&lost.parted, length_m);
            let rate_radps = on.map_or(0.0, |(_, rate_radps)| rate_radps);
            let gap_s = (self.time - lost.parted.at).seconds();
            let velocity_mps = lost.parted.velocity_after_mps(rate_radps, gap_s);
            self.motion.go_on(velocity_mps, rate_radps, TAKEN_OVER_MPS);
            self.parted = Parting::of(&self.motion.estimate(), self.points, self.time);
            self.moves = true;
        }
        if lost.moves && is_same_kind && !self.moves {
            self.moves = true;
            (self.travelled_m, self.speed_mps) = (lost.travelled_m, lost.speed_mps);
            self.newness = lost.newness;
        }
        self.trace = lost.trace.followed_by(&self.trace);
        (self.id, self.turn) = (lost.id, lost.turn);
        self.first_seen = lost.first_seen;
        if lost.belief.road_user() > self.belief.road_user() {
            self.belief = lost.belief;
        }
        self.was_likely = true;
    }
}

#[cfg(test)]
mod tests;
