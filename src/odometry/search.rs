//! Looks for a motion that nothing predicted.

use nalgebra::{Vector3, Vector6};

use super::motion::Motion;
use super::{Attempt, Odometry, registration};
use crate::geometry;

/// How much better another motion must fit than the first: where the sensor was jerked or is followed, and where the frame
/// begins.
const CLEARLY: f64 = 1.25;
const SLIGHTLY: f64 = 1.05;

/// Which motions are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reach {
    /// All that a vehicle may have, straight on in any direction.
    Anywhere,
    /// A jerk beside the prediction.
    Jerk,
}

/// Whether one attempt is another motion than a second one, not the same that was found a little better, and clearly fits
/// better.
pub(super) fn is_clearly_another(one: &Attempt, second: &Attempt) -> bool {
    const OTHER_MPS: f64 = 1.0;
    let off = geometry::linear(&(one.motion.velocity - second.motion.velocity));
    let share = |attempt: &Attempt| attempt.alignment.agreement.map(|found| found.share);
    off.norm_squared() > OTHER_MPS * OTHER_MPS
        && share(one) > share(second).map(|least| CLEARLY * least)
}

impl Odometry {
    /// Looks around a prediction for the motion with which the revolution fits the map best, if that is better than the first.
    pub(super) fn search(&mut self, predicted: Motion, first: Attempt, reach: Reach) -> Attempt {
        const LEAST_PASSED_S: f64 = 0.01;
        /// One in so many features is asked, and so many motions are tried.
        const SEARCH_EVERY: usize = 4;
        const TRIED: usize = 4;
        if self.passed_s < LEAST_PASSED_S {
            return first;
        }
        self.unskew(&predicted);
        let is_anywhere = reach == Reach::Anywhere;
        let ahead = |direction_rad: f64| {
            let (sine, cosine) = libm::sincos(direction_rad);
            predicted.pose.rotation * Vector3::new(sine, cosine, 0.0)
        };
        let up = predicted.pose.rotation * Vector3::z();
        let mut found = std::mem::take(&mut self.found);
        found.clear();
        let mut offer = |shift: Vector3<f64>, turn: Vector3<f64>| {
            let by = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
            let score = registration::agreement(
                &self.map,
                &self.view,
                &predicted.pose,
                &by,
                self.passed_s,
                SEARCH_EVERY,
            );
            found.extend(score.map(|score| (score.share, by)));
        };
        if is_anywhere {
            for way in 1..=8 {
                for direction in 0..8 {
                    let shift = ahead(f64::from(direction) * std::f64::consts::FRAC_PI_4);
                    offer(shift * (0.5 * f64::from(way)), Vector3::zeros());
                }
            }
        } else {
            for turn in -10..=10 {
                for way in -2..=2 {
                    let shift = ahead(0.0) * (0.4 * f64::from(way));
                    offer(shift, up * (0.02 * f64::from(turn)));
                }
            }
        }
        found.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        let mut tried = [Vector6::zeros(); TRIED];
        let mut count = 0;
        let mut best = first;
        for (_, by) in &found {
            let is_near = |other: &Vector6<f64>| {
                let off = by - other;
                geometry::linear(&off).norm_squared() < 0.6 * 0.6
                    && geometry::angular(&off).norm_squared() < 0.05 * 0.05
            };
            if tried[..count].iter().any(is_near) {
                continue;
            }
            tried[count] = *by;
            count += 1;
            let mut jerked = predicted;
            jerked.jerk(by, self.passed_s);
            let attempt = self.attempt(jerked);
            let better = if is_anywhere { SLIGHTLY } else { CLEARLY };
            let share = |attempt: &Attempt| attempt.alignment.agreement.map(|found| found.share);
            let is_better = share(&attempt) > share(&best).map(|least| better * least);
            if is_better && (is_anywhere || self.is_usual(&attempt)) {
                best = attempt;
            }
            if count == TRIED {
                break;
            }
        }
        self.found = found;
        self.unskew(&best.motion);
        best
    }
}
