//! Velocity by difference of positions.

use super::{CENTRE_DEVIATION_M, UNKNOWN_SPEED_DEVIATION_MPS};
use crate::time::Time;

/// Above this speed an object moves along its length.
const MOVING_MPS: f64 = 0.8;
/// Travel that shows a direction: noise of 0.1 m turns it by 5 degrees.
const TRAVEL_M: f64 = 1.5;

/// Over a shorter time a difference of positions is noise, whatever the time stamps say.
const LEAST_PASSED_S: f64 = 0.02;

/// Where an object was seen lately.
#[derive(Debug, Clone)]
pub(super) struct Motion {
    id: u32,
    first_seen: Time,
    observations: u32,
    /// Oldest first.
    positions: Vec<(Time, [f64; 2])>,
    velocity: Velocity,
}

/// A velocity in the local frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Velocity {
    /// East and north.
    pub(super) mps: [f64; 2],
    /// Standard deviation of either.
    pub(super) deviation_mps: f64,
    /// Whether it was measured at all.
    pub(super) known: bool,
}

impl Motion {
    pub(super) fn new(id: u32) -> Self {
        Self {
            id,
            first_seen: Time::ZERO,
            observations: 0,
            positions: vec![],
            velocity: Velocity {
                mps: [0.0; 2],
                deviation_mps: UNKNOWN_SPEED_DEVIATION_MPS,
                known: false,
            },
        }
    }

    pub(super) fn id(&self) -> u32 {
        self.id
    }

    pub(super) fn first_seen(&self) -> Time {
        self.first_seen
    }

    pub(super) fn velocity(&self) -> Velocity {
        self.velocity
    }

    /// Direction of motion, if it moves: that of the latest travel long enough to show one. A
    /// longer travel would lag behind in a bend.
    pub(super) fn heading_rad(&self) -> Option<f64> {
        let (_, [x, y]) = self.positions.last()?;
        let [vx, vy] = self.velocity.mps;
        if !self.velocity.known || libm::hypot(vx, vy) <= MOVING_MPS {
            return None;
        }
        let travels = self
            .positions
            .iter()
            .rev()
            .map(|(_, then)| [x - then[0], y - then[1]]);
        let long = travels
            .into_iter()
            .find(|[dx, dy]| libm::hypot(*dx, *dy) >= TRAVEL_M);
        let [dx, dy] = long.unwrap_or([vx, vy]);
        Some(libm::atan2(dy, dx))
    }

    /// Probability that the object exists: half of all single clusters are noise, and each
    /// further sighting halves the doubt.
    pub(super) fn existence(&self) -> f64 {
        1.0 - libm::exp2(-f64::from(self.observations.min(50)))
    }

    /// Takes a position in. The velocity is the difference to the oldest position within
    /// `baseline_s`, or to the one before if that is all there is.
    pub(super) fn observe(&mut self, time: Time, position_m: [f64; 2], baseline_s: f64) {
        if self.observations == 0 {
            self.first_seen = time;
        }
        self.observations = self.observations.saturating_add(1);
        let old = |(then, _): &(Time, [f64; 2])| (time - *then).seconds() > baseline_s + 0.02;
        while self.positions.len() > 1 && old(&self.positions[0]) {
            self.positions.remove(0);
        }
        if let Some((then, from_m)) = self.positions.first() {
            let passed_s = (time - *then).seconds();
            if passed_s >= LEAST_PASSED_S {
                self.velocity = Velocity {
                    mps: [0, 1].map(|axis| (position_m[axis] - from_m[axis]) / passed_s),
                    deviation_mps: std::f64::consts::SQRT_2 * CENTRE_DEVIATION_M / passed_s,
                    known: true,
                };
            }
        }
        self.positions.push((time, position_m));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(baseline_s: f64) -> Motion {
        let mut motion = Motion::new(0);
        for revolution in 0..20 {
            let time = Time::from_micros(100_000 * revolution);
            // 5 m/s, seen 0.1 m off to either side.
            let wobble = if revolution % 2 == 0 { 0.1 } else { -0.1 };
            motion.observe(time, [0.5 * revolution as f64 + wobble, 0.0], baseline_s);
        }
        motion
    }

    #[test]
    fn a_longer_baseline_is_calmer() {
        assert!((drive(0.0).velocity().mps[0] - 3.0).abs() < 1e-9);
        assert!((drive(0.5).velocity().mps[0] - 4.6).abs() < 1e-9);
        assert!(drive(0.5).velocity().deviation_mps < drive(0.0).velocity().deviation_mps);
    }

    #[test]
    fn a_first_sighting_has_no_velocity_and_says_so() {
        let mut motion = Motion::new(0);
        motion.observe(Time::ZERO, [3.0, 4.0], 0.5);
        assert_eq!(motion.velocity().mps, [0.0; 2]);
        assert!(!motion.velocity().known);
        assert_eq!(motion.existence(), 0.5);
    }
}
