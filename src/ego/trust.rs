//! Whether a source of poses goes as the sensor does.

use super::Pose;
use crate::time::{Span, Time};

/// Both are compared after so long.
const APART: Span = Span::from_micros(1_000_000);
/// How far their ways may differ, and by how much more for each metre of way: a receiver's noise, and a heading that is
/// 10 degrees off.
const TOLERATED_M: f64 = 1.5;
const TOLERATED_PER_M: f64 = 0.2;
/// Comparisons in a row that must fail: a jump fails one.
const STRIKES: u32 = 2;

/// Compares the way of a source with that of the odometry.
#[derive(Debug, Clone, Default)]
pub(super) struct Trust {
    /// When they were compared last, and where both were then.
    last: Option<(Time, Pose, Pose)>,
    strikes: u32,
}

impl Trust {
    /// Takes in where the source and the odometry have the sensor at a time, each in its own frame; nothing where either does
    /// not know.
    pub(super) fn compare(&mut self, time: Time, both: Option<(Pose, Pose)>) {
        let Some((source, seen)) = both else {
            self.last = None;
            return;
        };
        let Some((last, from, seen_from)) = self.last else {
            self.last = Some((time, source, seen));
            return;
        };
        let passed = time - last;
        if passed.micros() >= 0 && passed < APART {
            return;
        }
        self.last = Some((time, source, seen));
        if passed.micros() < 0 || passed.micros() > 2 * APART.micros() {
            return;
        }
        let [way, seen_way] = [way_m(&from, &source), way_m(&seen_from, &seen)];
        let off_m = libm::hypot(way[0] - seen_way[0], way[1] - seen_way[1]);
        let tolerated_m = TOLERATED_M + TOLERATED_PER_M * libm::hypot(seen_way[0], seen_way[1]);
        self.strikes = if off_m > tolerated_m {
            self.strikes + 1
        } else {
            0
        };
    }

    /// Whether it goes as the sensor does, as far as is known.
    pub(super) fn holds(&self) -> bool {
        self.strikes < STRIKES
    }
}

/// Where a pose lies from another one, ahead of it and to its left.
fn way_m(from: &Pose, to: &Pose) -> [f64; 2] {
    let (sine, cosine) = libm::sincos(from.yaw_rad);
    let [x, y] = [0, 1].map(|axis| to.position_m[axis] - from.position_m[axis]);
    [x * cosine + y * sine, y * cosine - x * sine]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether a source is trusted after so many seconds, in which the sensor goes 5 m/s, and after a metre the source is where
    /// `source_m` says.
    fn holds_after(seconds: usize, source_m: impl Fn(f64) -> f64) -> bool {
        let mut trust = Trust::default();
        for tenth in 0..10 * seconds {
            let way_m = 0.5 * tenth as f64;
            let pose = |east_m: f64| Pose {
                position_m: [east_m, 0.0, 0.0],
                yaw_rad: 0.0,
            };
            let time = Time::from_micros(100_000 * tenth as i64);
            trust.compare(time, Some((pose(source_m(way_m)), pose(way_m))));
        }
        trust.holds()
    }

    #[test]
    fn a_source_that_stands_while_the_sensor_goes_is_not_trusted_and_one_that_jumps_is() {
        assert!(holds_after(5, |way_m| way_m));
        assert!(!holds_after(5, |_| 0.0));
        assert!(holds_after(10, |way_m| if way_m > 20.0 {
            way_m + 30.0
        } else {
            way_m
        }));
        assert!(holds_after(20, |way_m| way_m.max(30.0)));
    }
}
