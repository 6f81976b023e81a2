//! A simple driver: keeps to the vehicle's way and to what its bends allow, and stops where the advice does not
//! let it go on.

use crate::ego::wrapped_rad;
use crate::geometry::turned;
use crate::roundabout::{Advice, ArmAdvice, Crossing, RoundaboutParameters};
use crate::simulate::Truth;
use crate::simulate::path::Path;

/// Speed on the arms.
const APPROACH_MPS: f64 = 8.0;
/// Sideways in bends: brisk, on a dry road.
const SIDEWAYS_MPS2: f64 = 5.0;
/// What it brakes with where it can see it coming.
const BRAKES_MPS2: f64 = 3.0;
/// So near to where it has to stand it stands.
const STANDS_M: f64 = 0.3;
/// So far behind it, where others cross, it goes on.
const GOES_ON_M: f64 = 1.0;
/// How far it looks ahead.
const AHEAD_M: usize = 25;
/// Between two decisions.
const STEP_S: f64 = 0.1;
/// How far it drives on after the bend out.
const AFTER_M: f64 = 10.0;

/// On which part of its way it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// Before the circle, and until it has left the place where its way meets it.
    Entry,
    /// On the circle.
    Circle,
    /// Out of it.
    Exit,
}

pub(super) struct Driver {
    /// A metre a second.
    way: Path,
    acceleration_mps2: f64,
    deceleration_mps2: f64,
    /// Along the way.
    gone_m: f64,
    last_mps: Option<f64>,
    has_entered: bool,
    /// From where to where the way leads along the circle.
    circle_m: [f64; 2],
}

impl Driver {
    pub(super) fn new(way: &Path, parameters: &RoundaboutParameters) -> Self {
        let way = way.clone().timed(&[(0.0, 1.0)]);
        let is_round = |at_m: &usize| curvature_per_m(&way, *at_m as f64) > 0.0;
        let metres = 0..way.length_m() as usize;
        let first_m = metres.clone().find(is_round).unwrap_or(0);
        let last_m = metres.rev().find(is_round).unwrap_or(first_m);
        Self {
            acceleration_mps2: parameters.acceleration_mps2,
            deceleration_mps2: parameters.deceleration_mps2,
            gone_m: 0.0,
            last_mps: None,
            has_entered: false,
            circle_m: [first_m as f64, last_m as f64],
            way,
        }
    }

    /// The speed to have a step later.
    pub(super) fn speed_mps(&mut self, truth: &Truth, advice: Option<&Advice>) -> f64 {
        let now_mps = truth.sensor_speed_mps;
        // The first revolution is over when it is asked first.
        let before_mps = self.last_mps.replace(now_mps).unwrap_or(now_mps);
        self.gone_m += 0.5 * (before_mps + now_mps) * STEP_S;
        let bends = (0..AHEAD_M).map(|ahead_m| {
            let ahead_m = ahead_m as f64;
            let curvature_per_m = curvature_per_m(&self.way, self.gone_m + ahead_m).abs();
            let there_mps = libm::sqrt(SIDEWAYS_MPS2 / curvature_per_m.max(1e-9));
            braked_mps(there_mps.min(APPROACH_MPS), ahead_m)
        });
        let mut wanted_mps = bends.fold(f64::INFINITY, f64::min);
        if let Some(stop_m) = advice.and_then(|advice| self.stop_m(advice)) {
            wanted_mps = wanted_mps.min(if stop_m < STANDS_M {
                0.0
            } else {
                braked_mps(0.0, stop_m)
            });
        }
        let least_mps = (now_mps - self.deceleration_mps2 * STEP_S).max(0.0);
        wanted_mps.clamp(least_mps, now_mps + self.acceleration_mps2 * STEP_S)
    }

    /// How far it may go on, if it may not go where it likes.
    fn stop_m(&mut self, advice: &Advice) -> Option<f64> {
        let closed = |crossing: &Crossing| {
            let stops = !crossing.may_go && crossing.stop_m > -GOES_ON_M;
            stops.then_some(crossing.stop_m)
        };
        if let Some(arm) = advice.own_arm.filter(|_| !self.has_entered) {
            let entry = &advice.arms[arm].entry;
            self.has_entered = entry.stop_m < -GOES_ON_M;
            return closed(entry);
        }
        // By the arm that its way ends on.
        let end_rad = self.way.at(self.way.length_m()).yaw_rad;
        let off_rad = |arm: &&ArmAdvice| wrapped_rad(arm.bearing_rad - end_rad).abs();
        let arms = advice.arms.iter();
        let arm = arms.min_by(|a, b| off_rad(a).total_cmp(&off_rad(b)))?;
        // Who has only just entered has the first exit before him, whose stop may lie behind him.
        (self.gone_m > self.circle_m[0]).then(|| closed(&arm.exit))?
    }

    pub(super) fn part(&self) -> Part {
        /// From its middle to behind its rear.
        const CUTS_IN_M: f64 = 4.0;
        /// Before its end: the vehicle's front is on the way out by then.
        const FRONT_M: f64 = 3.0;
        let [begin_m, end_m] = self.circle_m;
        if self.gone_m < begin_m + CUTS_IN_M {
            Part::Entry
        } else if self.gone_m < end_m - FRONT_M {
            Part::Circle
        } else {
            Part::Exit
        }
    }

    /// Middle of the circle round which its way leads, ahead of it and to its left.
    pub(super) fn to_middle_m(&self) -> [f64; 2] {
        let half_way_m = 0.5 * (self.circle_m[0] + self.circle_m[1]);
        let there = self.way.at(half_way_m);
        let radius_m = 1.0 / curvature_per_m(&self.way, half_way_m).max(1e-9);
        let (sine, cosine) = libm::sincos(there.yaw_rad);
        let [x, y] = there.position_m;
        let middle_m = [x - radius_m * sine, y + radius_m * cosine];
        let own = self.way.at(self.gone_m);
        let off_m = [0, 1].map(|axis| middle_m[axis] - own.position_m[axis]);
        let (sine, cosine) = libm::sincos(own.yaw_rad);
        turned(&off_m, sine, cosine)
    }

    /// Whether its middle is on the circle.
    pub(super) fn is_on_circle(&self) -> bool {
        self.gone_m >= self.circle_m[0]
    }

    /// Whether the roundabout is behind it.
    pub(super) fn is_past(&self) -> bool {
        self.gone_m > self.way.length_m() + AFTER_M
    }
}

fn curvature_per_m(way: &Path, at_m: f64) -> f64 {
    way.at(at_m).yaw_rate_radps
}

/// As fast as one may be so far before a place where one has to have a speed.
fn braked_mps(there_mps: f64, ahead_m: f64) -> f64 {
    libm::sqrt(there_mps * there_mps + 2.0 * BRAKES_MPS2 * ahead_m.max(0.0))
}
