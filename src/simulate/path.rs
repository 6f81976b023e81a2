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
    /// Times with the speed at them; between two, the speed changes evenly.
    speeds: Vec<(f64, f64)>,
}

#[derive(Debug, Clone, Copy)]
struct Piece {
    length_m: f64,
    /// 1/radius, to the left positive.
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
        let total_m: f64 = self.pieces.iter().map(|piece| piece.length_m).sum();
        let mut left_m = travelled_m;
        if self.is_loop && total_m > 0.0 {
            left_m -= total_m * libm::floor(left_m / total_m);
        }
        let (mut position_m, mut yaw_rad) = (self.start_m, self.start_yaw_rad);
        let mut curvature_per_m = 0.0;
        for piece in &self.pieces {
            let along_m = left_m.min(piece.length_m);
            (position_m, yaw_rad) = advanced(position_m, yaw_rad, along_m, piece.curvature_per_m);
            curvature_per_m = piece.curvature_per_m;
            left_m -= along_m;
            if left_m <= 0.0 {
                break;
            }
        }
        if left_m > 0.0 {
            curvature_per_m = 0.0;
            (position_m, yaw_rad) = advanced(position_m, yaw_rad, left_m, 0.0);
        }
        Moment {
            position_m,
            yaw_rad: wrapped_rad(yaw_rad),
            speed_mps,
            yaw_rate_radps: speed_mps * curvature_per_m,
            acceleration_mps2,
            travelled_m,
        }
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
