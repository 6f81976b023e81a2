//! A road user of which nothing was left, and which is seen again.

use std::f64::consts::PI;

use nalgebra::{Rotation2, Vector2};

use super::{MOVING_MPS, Track};
use crate::time::Time;
use crate::track::motion::Estimate;

/// How long a lost road user may be out of sight and still be the same.
const LONGEST_S: f64 = 4.0;
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
            deviation_mps: libm::sqrt(0.5 * estimate.velocity_covariance.trace()),
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

    /// How far from here the road user would be that parted before, on an arc from its last
    /// velocity to this one; `None` if that is too far, or if the velocities do not go together.
    fn off_from_m(&self, parted: &Self, length_m: f64) -> Option<f64> {
        let gap_s = (self.at - parted.at).seconds();
        if self.has_velocity() {
            if !self.goes_together_with(parted, gap_s) {
                return None;
            }
            return self.off_arc_m(parted, self.velocity_mps, gap_s, length_m);
        }
        // As long as its own velocity is not known, the other one went straight on or went on to
        // turn.
        let turn_rad = (parted.yaw_rate_radps * gap_s).clamp(-PI, PI);
        let turned = Rotation2::new(turn_rad) * parted.velocity_mps;
        let ends = [parted.velocity_mps, turned];
        let off_m = ends.map(|end_mps| self.off_arc_m(parted, end_mps, gap_s, length_m));
        off_m.into_iter().flatten().min_by(f64::total_cmp)
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
        let half_rad = (0.5 * parted.velocity_mps.angle(&end_mps)).max(1e-6);
        let speed_mps = 0.5 * (parted.velocity_mps.norm() + end_mps.norm());
        let chord_m = speed_mps * gap_s * libm::sin(half_rad) / half_rad;
        let course = (parted.velocity_mps + end_mps).try_normalize(1e-6);
        let way_m = course.map_or(Vector2::zeros(), |course| course * chord_m);
        let off_m = (self.position_m - parted.position_m - way_m).norm();
        let farthest_m = OFF_M + OFF_PER_LENGTH * length_m + OFF_PER_WAY * way_m.norm();
        (off_m < farthest_m).then_some(off_m)
    }
}

impl Track {
    /// Whether it may come back at a time, and is then worth an old id.
    pub(in crate::track) fn may_return(&self, now: Time) -> bool {
        self.is_published && (now - self.last_measured).seconds() <= LONGEST_S
    }

    /// How far this new track is from where one that is not seen any more would be by now;
    /// `None` if it cannot be the same road user.
    pub(in crate::track) fn off_from_m(&self, lost: &Self) -> Option<f64> {
        let gap_s = (self.parted.at - lost.parted.at).seconds();
        let length_m = lost.shape.size_m(lost.belief.vehicle())[0];
        // A few returns may have been taken for the old one where this one was already seen.
        let is_apart =
            lost.parted.at < self.first_seen || lost.parted.points < CLEAR * self.parted.points;
        let is_in_time = gap_s > 0.0 && gap_s <= LONGEST_S;
        if !is_in_time || !is_apart || self.shape.seen_m[0] > length_m + GROWTH_M {
            return None;
        }
        let is_new = !self.moves && (self.time - self.first_seen).seconds() < NEW_S;
        let own = if is_new {
            self.parted.of_unknown_velocity()
        } else {
            self.parted
        };
        // What moves tells by its speed whether it is the same.
        let tells = lost.parted.moves() && own.has_velocity();
        if !tells && self.is_vehicle() != lost.is_vehicle() {
            return None;
        }
        own.off_from_m(&lost.parted, length_m)
    }

    /// Whether nothing or hardly anything is seen of it, though others know it.
    pub(in crate::track) fn is_missed(&self) -> bool {
        self.is_published && (self.points == 0 || self.parted.at < self.last_measured)
    }

    /// Goes on as a road user that was lost.
    pub(in crate::track) fn take_over(&mut self, lost: &Self) {
        self.id = lost.id;
        self.first_seen = lost.first_seen;
        if lost.belief.road_user() > self.belief.road_user() {
            self.belief = lost.belief;
        }
        self.is_published = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::time::Span;
    use crate::track::look::Look;
    use crate::track::spots::Spot;
    use crate::track::tests::spots_of;

    const CYCLIST_M: f64 = 1.7;

    /// Seen at an angle of a circle of 16 m on which it drives at 4 m/s.
    fn at(angle_rad: f64) -> Parting {
        on_circle(16.0, 4.0, angle_rad)
    }

    /// Seen at an angle of a circle on which it drives.
    fn on_circle(radius_m: f64, speed_mps: f64, angle_rad: f64) -> Parting {
        let (sine, cosine) = angle_rad.sin_cos();
        Parting {
            position_m: Vector2::new(cosine, sine) * radius_m,
            velocity_mps: Vector2::new(-sine, cosine) * speed_mps,
            yaw_rate_radps: speed_mps / radius_m,
            deviation_mps: 0.3,
            standing: 0.0,
            points: 9.0,
            at: Time::ZERO + Span::from_seconds(angle_rad * radius_m / speed_mps),
        }
    }

    fn later(parting: Parting, seconds: f64) -> Parting {
        Parting {
            at: parting.at + Span::from_seconds(seconds),
            ..parting
        }
    }

    #[test]
    fn a_cyclist_who_turned_unseen_is_the_same() {
        let off_m = at(0.6).off_from_m(&at(0.0), CYCLIST_M);
        assert!(off_m.is_some_and(|off_m| off_m < 0.5), "{off_m:?}");
    }

    #[test]
    fn a_car_that_drove_most_of_half_a_circle_unseen_is_the_same() {
        let car = |angle_rad| on_circle(9.0, 8.0, angle_rad);
        let off_m = car(2.2).off_from_m(&car(0.0), 4.3);
        assert!(off_m.is_some_and(|off_m| off_m < 0.1), "{off_m:?}");
    }

    #[test]
    fn who_is_too_new_to_have_a_velocity_is_looked_for_straight_on_and_on_the_arc() {
        let car = |angle_rad| on_circle(11.0, 8.0, angle_rad);
        let parted = car(0.0);
        let on_arc = Parting {
            velocity_mps: Vector2::zeros(),
            standing: 0.6,
            ..car(1.0).of_unknown_velocity()
        };
        let gap_s = (on_arc.at - parted.at).seconds();
        let ahead = Parting {
            position_m: parted.position_m + parted.velocity_mps * gap_s,
            ..on_arc
        };
        let aside = Parting {
            position_m: 2.0 * ahead.position_m - on_arc.position_m,
            ..on_arc
        };
        let off_m = |seen: &Parting| seen.off_from_m(&parted, 1.0);
        assert!(off_m(&on_arc).is_some_and(|off_m| off_m < 0.1));
        assert!(off_m(&ahead).is_some_and(|off_m| off_m < 0.1));
        assert_eq!(off_m(&aside), None);
    }

    #[test]
    fn a_glimpse_is_no_parting_unless_it_is_all_there_is() {
        let parting = at(0.0);
        let soon = parting.at + Span::from_seconds(0.1);
        let late = parting.at + Span::from_seconds(1.5);
        assert!(parting.is_renewed_by(5, soon));
        assert!(!parting.is_renewed_by(4, soon));
        assert!(parting.is_renewed_by(1, late));
    }

    #[test]
    fn of_what_shows_a_few_returns_instead_of_many_hardly_anything_is_seen() {
        let scan = scan_of(1800, |column, layer| match column {
            0..40 if (5..8).contains(&layer) => 1500,
            _ => 0,
        });
        let spots = spots_of(&scan);
        let look = |spots: &[Spot]| Look::at(spots, &scan, Vector2::zeros());
        let (mut outline, begin) = (vec![], scan.time());
        let mut track = Track::new(1, false, &spots, &look(&spots), begin, 0.0, &mut outline);
        track.is_published = true;
        let mut is_missed_after = |count: usize, revolution: u32| {
            let end = begin + Span::from_seconds(0.1 * f64::from(revolution));
            let seen = &spots[..count];
            track.measure(seen, &look(seen), end, 0.0, &mut outline);
            track.is_missed()
        };
        assert!(!is_missed_after(spots.len(), 1));
        assert!(is_missed_after(3, 2));
        assert!(!is_missed_after(spots.len(), 3));
    }

    #[test]
    fn what_is_new_and_seems_to_stand_may_be_who_was_lost_as_long_as_it_is_new() {
        let scan = scan_of(1800, |column, layer| match column {
            0..40 if (5..8).contains(&layer) => 1500,
            _ => 0,
        });
        let (spots, begin) = (spots_of(&scan), scan.time());
        let look = Look::at(&spots, &scan, Vector2::zeros());
        let track = |id| Track::new(id, false, &spots, &look, begin, 0.0, &mut vec![]);
        let mut lost = track(1);
        lost.parted = Parting {
            at: begin,
            ..at(0.0)
        };
        let is_found_after = |age_s: f64| {
            let mut seen = track(2);
            seen.time = begin + Span::from_seconds(1.5 + age_s);
            seen.first_seen = begin + Span::from_seconds(1.5);
            seen.parted = Parting {
                position_m: lost.parted.position_m + lost.parted.velocity_mps * (1.5 + age_s),
                velocity_mps: Vector2::zeros(),
                standing: 0.9,
                at: seen.time,
                ..lost.parted
            };
            seen.off_from_m(&lost).is_some()
        };
        assert!(is_found_after(0.4) && !is_found_after(1.2));
    }

    #[test]
    fn who_comes_back_elsewhere_or_otherwise_is_someone_else() {
        let parted = at(0.0);
        let mut elsewhere = at(0.6);
        elsewhere.position_m.x += 4.0;
        let mut back = at(0.6);
        back.velocity_mps = -back.velocity_mps;
        let mut faster = at(0.6);
        faster.velocity_mps *= 2.5;
        let mut waiting = at(0.0);
        (waiting.velocity_mps, waiting.standing) = (Vector2::zeros(), 1.0);
        for other in [elsewhere, back, faster, waiting] {
            let other = Parting {
                at: at(0.6).at,
                ..other
            };
            assert_eq!(other.off_from_m(&parted, CYCLIST_M), None, "{other:?}");
        }
    }

    #[test]
    fn who_stood_is_found_where_it_stood() {
        let mut stood = at(0.0);
        (stood.velocity_mps, stood.standing) = (Vector2::zeros(), 1.0);
        let mut seen = later(stood, 3.0);
        seen.position_m.x += 0.4;
        assert!(seen.off_from_m(&stood, 0.5).is_some());
        seen.position_m.x += 1.5;
        assert_eq!(seen.off_from_m(&stood, 0.5), None);
    }
}
