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
        let is_vehicle = self.is_vehicle();
        self.shape.learn(&view, look, is_vehicle);
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
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::ego::wrapped_rad;
    use crate::time::Span;
    use crate::track::tests::{followed, spots_of};

    /// What is 4.2 m long, 1.4 m deep and 20 m away, goes on above in a share of its columns, was
    /// thought to move, and was then seen for a second.
    fn seen(goes_on: f64) -> Track {
        let scan = scan_of(1800, |column, layer| match column {
            0..60 if (5..8).contains(&layer) => 2000 + 70 * (layer as u16 - 5),
            _ => 0,
        });
        let spots = spots_of(&scan);
        let look = Look {
            goes_on,
            ..Look::at(&spots, &scan, Vector2::zeros())
        };
        let (mut outline, mut end) = (vec![], scan.time());
        let mut track = Track::new(0, false, &spots, &look, end, 0.0, &mut outline);
        (track.moves, track.travelled_m) = (true, 20.0);
        for _ in 0..10 {
            end = end + Span::from_seconds(0.1);
            track.measure(&spots, &look, end, 0.0, &mut outline);
        }
        track
    }

    impl Track {
        /// Has it moved, whatever was seen of it.
        pub(in crate::track) fn moves_for_tests(&mut self) {
            self.moves = true;
        }
    }

    #[test]
    fn a_wall_does_not_move_whatever_the_piece_of_it_that_is_seen_does() {
        assert!(seen(0.0).moves);
        let wall = seen(1.0);
        assert!(wall.belief.road_user() < SURELY_NONE);
        assert!(!wall.moves && wall.travelled_m == 0.0);
    }

    /// Somebody half a metre wide, 10 m away, who walks across the line of sight at 1.2 m/s, so many revolutions to the
    /// left and so many back.
    fn walker(ahead: usize, back: usize) -> Track {
        let met = |step: usize| {
            let columns = 300 + 7 * step / 2..316 + 7 * step / 2;
            scan_of(1800, |column, layer| match layer {
                5..13 if columns.contains(&column) => 1000,
                _ => 0,
            })
        };
        let steps = (0..=ahead).chain((ahead - back..ahead).rev());
        followed(&steps.map(met).collect::<Vec<_>>()).0
    }

    #[test]
    fn who_walks_looks_where_he_goes_and_so_does_who_turns_round() {
        let off_rad = |track: &Track| {
            let [x, y]: [f64; 2] = track.motion.estimate().velocity_mps.into();
            assert!((libm::hypot(x, y) - 1.2).abs() < 0.3, "{x} {y}");
            wrapped_rad(track.shape.yaw_rad - libm::atan2(y, x)).abs()
        };
        let (ahead, turned) = (walker(20, 0), walker(20, 20));
        let apart = ahead
            .motion
            .velocity_mps()
            .dot(&turned.motion.velocity_mps());
        assert!(apart < 0.0);
        for track in [ahead, turned] {
            assert!(track.shape.front_known && off_rad(&track) < 0.3);
        }
    }

    #[test]
    fn what_shows_its_length_and_hardly_any_width_is_thin_within_a_second() {
        // A rail 4 m to the side that leads away, of which 6 m are met.
        let scan = scan_of(1800, |column, layer| match column {
            70..110 if layer == 6 => (400.0 / (0.2 * column as f64).to_radians().sin()) as u16,
            _ => 0,
        });
        let spots = spots_of(&scan);
        let look = Look::at(&spots, &scan, Vector2::zeros());
        let (mut outline, mut end) = (vec![], scan.time());
        let mut track = Track::new(0, false, &spots, &look, end, 0.0, &mut outline);
        let mut seen_for_a_second = |track: &mut Track| {
            for _ in 0..10 {
                end = end + Span::from_seconds(0.1);
                track.measure(&spots, &look, end, 0.0, &mut outline);
            }
        };
        seen_for_a_second(&mut track);
        // As if it had been seen askew.
        (track.shape.seen_m[1], track.shape.whole[1]) = (0.7, 0.0);
        seen_for_a_second(&mut track);
        let wide_m = track.qualities().wide_m;
        assert!(wide_m.is_some_and(|wide_m| wide_m < 0.25), "{wide_m:?}");
    }

    #[test]
    fn a_lorry_is_known_to_move_before_it_went_its_length_and_a_wall_is_not() {
        let mut lorry = seen(0.0);
        (lorry.shape.seen_m, lorry.shape.top_m) = ([12.0, 2.5], 3.5);
        lorry.travelled_m = 8.0;
        let wall = |shape: fn(&mut Track)| {
            let mut wall = lorry.clone();
            shape(&mut wall);
            wall
        };
        assert!(lorry.qualities().moved);
        assert!(!wall(|wall| wall.shape.seen_m[1] = 0.5).qualities().moved);
        assert!(!wall(|wall| wall.shape.top_m = 1.5).qualities().moved);
    }

    #[test]
    fn what_a_ray_passed_over_when_it_was_near_is_no_higher_far_away_by_as_much_as_the_ground_may_be_off()
     {
        let scan = scan_of(1800, |column, layer| match column {
            0..60 if (5..8).contains(&layer) => 2000,
            _ => 0,
        });
        let spots = spots_of(&scan);
        let of = |range_m: f64, top_m: f64, top_below_m: f64| Look {
            range_m,
            top_m,
            top_below_m,
            ..Look::at(&spots, &scan, Vector2::zeros())
        };
        let (mut outline, mut end) = (vec![], scan.time());
        let track = Track::new(
            0,
            false,
            &spots,
            &of(15.0, 1.5, 1.9),
            end,
            0.0,
            &mut outline,
        );
        let mut top_m = |front_known: bool, seen_m: f64| {
            let mut track = track.clone();
            track.shape.front_known = front_known;
            for _ in 0..10 {
                end = end + Span::from_seconds(0.1);
                track.measure(&spots, &of(35.0, seen_m, 4.5), end, 0.0, &mut outline);
            }
            track.shape.top_m
        };
        assert!(top_m(true, 2.3) < 1.95);
        // A lorry, and what was never seen to drive.
        assert!(top_m(true, 3.6) > 3.4);
        assert!(top_m(false, 2.3) > 2.2);
    }

    #[test]
    fn who_stands_apart_is_as_wide_as_seen_within_a_second_and_a_car_stays_as_it_was() {
        // What is met between some columns 10 m away, known as half as wide again or as a little wider.
        let wide_m = |columns: usize, factor: f64, is_apart: bool| {
            let scan = scan_of(1800, |column, layer| match column {
                column if column < columns && (4..8).contains(&layer) => 1000,
                _ => 0,
            });
            let spots = spots_of(&scan);
            let look = Look {
                is_apart,
                ..Look::at(&spots, &scan, Vector2::zeros())
            };
            let (mut outline, mut end) = (vec![], scan.time());
            let mut track = Track::new(0, false, &spots, &look, end, 0.0, &mut outline);
            let seen_m = track.shape.seen_m[0].max(track.shape.seen_m[1]);
            track.shape.seen_m = track.shape.seen_m.map(|side_m| factor * side_m);
            for _ in 0..10 {
                end = end + Span::from_seconds(0.1);
                track.measure(&spots, &look, end, 0.0, &mut outline);
            }
            track.shape.seen_m[0].max(track.shape.seen_m[1]) / seen_m
        };
        let (person, car) = (14, 120);
        assert!(wide_m(person, 1.5, true) < 1.1);
        assert!(wide_m(person, 1.5, false) > 1.2);
        assert!(wide_m(car, 1.5, true) < 1.2);
        assert!(wide_m(car, 1.07, true) > 1.03);
    }
}
