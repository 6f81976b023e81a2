//! Where a road user goes: lines and arcs, and a speed that changes with time.

use std::f64::consts::TAU;

use crate::ego::wrapped_rad;

/// A way to go, with the time table.
#[derive(Debug, Clone)]
pub struct Path {
    start_m: [f64; 2],
    start_yaw_rad: f64,
    pieces: Vec<Piece>,
    /// Whether the end is the beginning.
    is_loop: bool,
    /// The way on which the steering goes over from one piece to the next.
    steering_m: f64,
    /// Times with the speed at them; between two, the speed changes evenly.
    speeds: Vec<(f64, f64)>,
}

#[derive(Debug, Clone, Copy)]
struct Piece {
    length_m: f64,
    /// 1/radius, to the left positive.
    curvature_per_m: f64,
}

/// A place on the pieces of a path.
#[derive(Debug, Clone, Copy)]
struct Place {
    position_m: [f64; 2],
    yaw_rad: f64,
    curvature_per_m: f64,
}

/// A moment on a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Place of the middle.
    pub position_m: [f64; 2],
    /// Direction of motion in (-pi, pi].
    pub yaw_rad: f64,
    /// Along the yaw.
    pub speed_mps: f64,
    /// Counter-clockwise.
    pub yaw_rate_radps: f64,
    /// Along the yaw.
    pub acceleration_mps2: f64,
    /// Way behind it.
    pub travelled_m: f64,
}

impl Path {
    /// Somebody who stands.
    pub fn parked(position_m: [f64; 2], yaw_deg: f64) -> Self {
        Self::from(position_m, yaw_deg).timed(&[(0.0, 0.0)])
    }

    /// A path that begins at a place in a direction, without any length yet.
    pub fn from(position_m: [f64; 2], yaw_deg: f64) -> Self {
        Self {
            start_m: position_m,
            start_yaw_rad: yaw_deg.to_radians(),
            pieces: vec![],
            is_loop: false,
            steering_m: 0.0,
            speeds: vec![],
        }
    }

    /// Straight on for longer than a scene lasts, at one speed.
    pub fn straight(position_m: [f64; 2], yaw_deg: f64, speed_mps: f64) -> Self {
        Self::from(position_m, yaw_deg)
            .line(400.0)
            .timed(&[(0.0, speed_mps)])
    }

    /// A circle around a place that is gone round and round, counter-clockwise where `radius_m`
    /// is positive, beginning at an angle from east.
    pub fn circle([x, y]: [f64; 2], radius_m: f64, start_deg: f64, speed_mps: f64) -> Self {
        let (sine, cosine) = libm::sincos(start_deg.to_radians());
        let out_m = radius_m.abs();
        let ahead_deg = start_deg + 90f64.copysign(radius_m);
        let round = Self::from([x + out_m * cosine, y + out_m * sine], ahead_deg);
        let mut path = round.arc(radius_m, 360.0).timed(&[(0.0, speed_mps)]);
        path.is_loop = true;
        path
    }

    /// Straight on.
    pub fn line(mut self, length_m: f64) -> Self {
        self.pieces.push(Piece {
            length_m,
            curvature_per_m: 0.0,
        });
        self
    }

    /// A bend, to the left where `radius_m` is positive.
    pub fn arc(mut self, radius_m: f64, degrees: f64) -> Self {
        self.pieces.push(Piece {
            length_m: radius_m.abs() * degrees.to_radians(),
            curvature_per_m: 1.0 / radius_m,
        });
        self
    }

    /// With a steering wheel that takes some way to turn: the curvature goes over evenly from one piece to the next, so
    /// that the path is within the bends, by `way_m` squared over 24 radii.
    pub fn steered(mut self, way_m: f64) -> Self {
        self.steering_m = way_m;
        self
    }

    /// With these speeds at these times; before the first and after the last it is constant.
    pub fn timed(mut self, speeds: &[(f64, f64)]) -> Self {
        self.speeds = speeds.to_vec();
        self
    }

    /// All speeds times a factor.
    pub fn hurried(mut self, factor: f64) -> Self {
        for (_, speed_mps) in &mut self.speeds {
            *speed_mps *= factor;
        }
        self
    }

    /// Forgets the speeds after a time, and goes over to another one until a later time.
    pub fn driven(&mut self, from_s: f64, until_s: f64, speed_mps: f64) {
        let (_, now_mps, _) = self.progress(from_s);
        self.speeds.retain(|(at_s, _)| *at_s < from_s);
        self.speeds
            .extend([(from_s, now_mps), (until_s, speed_mps)]);
    }

    /// Length of its pieces; beyond it goes straight on.
    pub fn length_m(&self) -> f64 {
        self.pieces.iter().map(|piece| piece.length_m).sum()
    }

    /// Places along it, from one way to another, half a metre apart at most.
    pub fn points(&self, from_m: f64, to_m: f64) -> Vec<[f64; 2]> {
        const APART_M: f64 = 0.5;
        let steps = libm::ceil((to_m - from_m) / APART_M).max(1.0) as usize;
        // A metre a second makes seconds metres.
        let slow = self.clone().timed(&[(0.0, 1.0)]);
        (0..=steps)
            .map(|step| {
                slow.at(from_m + (to_m - from_m) * step as f64 / steps as f64)
                    .position_m
            })
            .collect()
    }

    /// Moves the whole path.
    pub fn shift(&mut self, by_m: [f64; 2]) {
        for (metres, by_m) in self.start_m.iter_mut().zip(by_m) {
            *metres += by_m;
        }
    }

    /// Where it is after some time.
    pub fn at(&self, seconds: f64) -> Moment {
        let (travelled_m, speed_mps, acceleration_mps2) = self.progress(seconds);
        let (share, place) = if self.steering_m > 0.0 {
            self.steered_place(travelled_m)
        } else {
            (1.0, self.place(travelled_m))
        };
        Moment {
            position_m: place.position_m,
            yaw_rad: wrapped_rad(place.yaw_rad),
            speed_mps: share * speed_mps,
            yaw_rate_radps: speed_mps * place.curvature_per_m,
            acceleration_mps2: share * acceleration_mps2,
            travelled_m,
        }
    }

    /// Place, direction and curvature after so much of the pieces, and straight on before and after them.
    fn place(&self, way_m: f64) -> Place {
        let mut left_m = way_m;
        if self.is_loop {
            let total_m = self.length_m();
            left_m -= total_m * libm::floor(left_m / total_m);
        }
        let (mut position_m, mut yaw_rad) = (self.start_m, self.start_yaw_rad);
        for piece in &self.pieces {
            let along_m = left_m.min(piece.length_m);
            let curvature_per_m = if left_m < 0.0 {
                0.0
            } else {
                piece.curvature_per_m
            };
            (position_m, yaw_rad) = advanced(position_m, yaw_rad, along_m, curvature_per_m);
            left_m -= along_m;
            if left_m <= 0.0 {
                return Place {
                    position_m,
                    yaw_rad,
                    curvature_per_m,
                };
            }
        }
        let (position_m, yaw_rad) = advanced(position_m, yaw_rad, left_m, 0.0);
        Place {
            position_m,
            yaw_rad,
            curvature_per_m: 0.0,
        }
    }

    /// The mean of the places within half of the steering's way: of a step in curvature it makes a ramp. Before it, how much
    /// shorter the way has become.
    fn steered_place(&self, way_m: f64) -> (f64, Place) {
        const PARTS: usize = 32;
        let from_m = way_m - 0.5 * self.steering_m;
        let part_m = self.steering_m / PARTS as f64;
        let places_m = (0..PARTS).map(|part| {
            let middle_m = from_m + (part as f64 + 0.5) * part_m;
            self.place(middle_m).position_m
        });
        let [x, y] = places_m.fold([0.0; 2], |[x, y], at_m| [x + at_m[0], y + at_m[1]]);
        let [begin, end] = [from_m, from_m + self.steering_m].map(|end_m| self.place(end_m));
        let chord_m = [0, 1].map(|axis| end.position_m[axis] - begin.position_m[axis]);
        let share = libm::hypot(chord_m[0], chord_m[1]) / self.steering_m;
        let place = Place {
            position_m: [x, y].map(|sum| sum / PARTS as f64),
            yaw_rad: libm::atan2(chord_m[1], chord_m[0]),
            curvature_per_m: wrapped_rad(end.yaw_rad - begin.yaw_rad) / self.steering_m,
        };
        (share, place)
    }

    /// Way, speed and acceleration after some time.
    fn progress(&self, seconds: f64) -> (f64, f64, f64) {
        let (mut way_m, mut from_s) = (0.0, 0.0);
        let mut speed_mps = self.speeds.first().map_or(0.0, |(_, speed)| *speed);
        for (at_s, to_mps) in &self.speeds {
            if *at_s <= from_s {
                speed_mps = *to_mps;
                continue;
            }
            let rate = (to_mps - speed_mps) / (at_s - from_s);
            if seconds < *at_s {
                let passed_s = seconds - from_s;
                let mean_mps = speed_mps + 0.5 * rate * passed_s;
                return (
                    way_m + mean_mps * passed_s,
                    speed_mps + rate * passed_s,
                    rate,
                );
            }
            way_m += 0.5 * (speed_mps + to_mps) * (at_s - from_s);
            (from_s, speed_mps) = (*at_s, *to_mps);
        }
        (way_m + speed_mps * (seconds - from_s), speed_mps, 0.0)
    }
}

fn advanced([x, y]: [f64; 2], yaw_rad: f64, way_m: f64, curvature_per_m: f64) -> ([f64; 2], f64) {
    let turn_rad = way_m * curvature_per_m;
    // The chord of an arc, in the direction half way through its turn.
    let half_rad = 0.5 * turn_rad;
    let chord_m = if half_rad.abs() < 1e-9 {
        way_m
    } else {
        way_m * libm::sin(half_rad) / half_rad
    };
    let (sine, cosine) = libm::sincos(yaw_rad + half_rad);
    (
        [x + chord_m * cosine, y + chord_m * sine],
        (yaw_rad + turn_rad) % TAU,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_closes_and_moves_along_its_yaw() {
        let path = Path::circle([3.0, 4.0], -12.0, 30.0, 8.0);
        let round_s = TAU * 12.0 / 8.0;
        let (first, last) = (path.at(0.1), path.at(0.1 + round_s));
        assert!((first.position_m[0] - last.position_m[0]).abs() < 1e-6);
        let next = path.at(0.1001);
        let moved = [0, 1].map(|axis| next.position_m[axis] - first.position_m[axis]);
        let turn_rad = moved[1].atan2(moved[0]) - first.yaw_rad;
        assert!(turn_rad.sin().abs() < 1e-3);
        assert!((moved[0].hypot(moved[1]) / 0.0001 - 8.0).abs() < 1e-2);
        assert!((first.yaw_rate_radps + 8.0 / 12.0).abs() < 1e-9);
    }

    #[test]
    fn steering_makes_ramps_of_steps_in_curvature_and_moves_along_its_yaw() {
        let bent = |path: Path| path.line(20.0).arc(-9.0, 60.0).arc(7.0, 120.0);
        let path = bent(Path::from([0.0; 2], 90.0))
            .steered(5.0)
            .timed(&[(0.0, 5.0)]);
        let mut before = path.at(0.0);
        for step in 1..800 {
            let now = path.at(0.01 * f64::from(step));
            let moved = [0, 1].map(|axis| now.position_m[axis] - before.position_m[axis]);
            let off_rad = wrapped_rad(moved[1].atan2(moved[0]) - now.yaw_rad);
            assert!(off_rad.abs() < 0.01, "{step}: {off_rad}");
            // The steering goes from -1/9 to 1/7 within five metres, a second.
            let ramp = (now.yaw_rate_radps - before.yaw_rate_radps) / 0.01;
            assert!(
                ramp.abs() < 1.05 * 5.0 * (1.0 / 9.0 + 1.0 / 7.0),
                "{step}: {ramp}"
            );
            let turned_rad = wrapped_rad(now.yaw_rad - before.yaw_rad);
            assert!(
                (turned_rad - 0.01 * now.yaw_rate_radps).abs() < 1e-3,
                "{step}"
            );
            before = now;
        }
    }

    #[test]
    fn speeds_change_evenly_and_the_way_is_their_integral() {
        let path =
            Path::from([0.0; 2], 0.0)
                .line(1000.0)
                .timed(&[(0.0, 10.0), (2.0, 10.0), (4.0, 0.0)]);
        assert!((path.at(2.0).position_m[0] - 20.0).abs() < 1e-9);
        assert!((path.at(3.0).speed_mps - 5.0).abs() < 1e-9);
        assert!((path.at(3.0).acceleration_mps2 + 5.0).abs() < 1e-9);
        assert!((path.at(9.0).position_m[0] - 30.0).abs() < 1e-9);
    }

    #[test]
    fn a_quarter_bend_to_the_left_turns_east_to_north() {
        let path = Path::from([0.0; 2], 0.0)
            .arc(10.0, 90.0)
            .line(5.0)
            .timed(&[(0.0, 1.0)]);
        let end = path.at(10.0 * TAU / 4.0 + 5.0);
        assert!((end.position_m[0] - 10.0).abs() < 1e-9);
        assert!((end.position_m[1] - 15.0).abs() < 1e-9);
        assert!((end.yaw_rad - TAU / 4.0).abs() < 1e-9);
    }
}
