//! The binary Bayes filter and the inverse sensor model of one ray.

use super::GridParameters;

/// Log-odds of a probability.
pub fn log_odds(probability: f64) -> f64 {
    libm::log(probability / (1.0 - probability))
}

/// Probability of log-odds.
pub fn probability(log_odds: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-log_odds))
}

/// Units of the log-odds in a cell: small enough that a sum of many stays right, and so large
/// that 16 bits hold any probability of use.
pub const UNITS: f64 = 1024.0;

/// Log-odds in the units of a cell.
pub(super) fn in_units(log_odds: f64) -> i16 {
    libm::round(log_odds * UNITS).clamp(-32_000.0, 32_000.0) as i16
}

/// What a measurement says of the cells along its ray (Chen 2021, figures 2.10 and 2.11).
///
/// Below the smallest distance that can be measured the probability of being occupied is low and
/// constant; beyond, it rises linearly with distance and never above one half. The cell of the
/// return has a high one, and of those behind it nothing is said.
#[derive(Debug, Clone, PartialEq)]
pub struct InverseSensorModel {
    nearest_m: f64,
    low: f64,
    slope_per_m: f64,
    hit: f64,
}

impl InverseSensorModel {
    /// The model with the parameters of a profile.
    pub fn new(parameters: &GridParameters) -> Self {
        Self {
            nearest_m: parameters.nearest_m,
            low: parameters.free_probability,
            slope_per_m: parameters.free_slope_per_m,
            hit: parameters.hit_probability,
        }
    }

    /// Probability that a cell is occupied which a ray passed at a distance from the sensor.
    pub fn passed(&self, distance_m: f64) -> f64 {
        let beyond_m = (distance_m - self.nearest_m).max(0.0);
        (self.low + self.slope_per_m * beyond_m).min(0.5)
    }

    /// Probability that a cell is occupied in which a ray ended.
    pub fn hit(&self) -> f64 {
        self.hit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::Profile;

    fn model(profile: Profile) -> InverseSensorModel {
        InverseSensorModel::new(&GridParameters::profile(profile))
    }

    /// Chen 2021, equations 2.11 and 2.12.
    fn filtered(before: f64, measured: f64) -> f64 {
        let y = measured / (1.0 - measured) * (before / (1.0 - before));
        y / (y + 1.0)
    }

    #[test]
    fn the_sum_of_log_odds_is_the_filter_of_the_document() {
        for profile in Profile::ALL {
            let model = model(profile);
            let (mut plain, mut sum) = (0.5, 0.0);
            let mut in_cell = 0i16;
            for step in 0..40 {
                let measured = match step % 3 {
                    0 => model.hit(),
                    _ => model.passed(f64::from(step)),
                };
                plain = filtered(plain, measured);
                sum += log_odds(measured);
                in_cell += in_units(log_odds(measured));
                assert!((probability(sum) - plain).abs() < 1e-12, "{step}");
                let kept = probability(f64::from(in_cell) / UNITS);
                assert!((kept - plain).abs() < 0.004, "{step}: {kept} {plain}");
            }
        }
    }

    #[test]
    fn free_space_rises_from_a_low_constant_to_one_half_and_no_farther() {
        let model = model(Profile::Thesis);
        assert_eq!(model.passed(0.0), model.passed(0.3));
        let along: Vec<f64> = (0..200).map(|n| model.passed(0.5 * f64::from(n))).collect();
        assert!(along.is_sorted());
        assert!(along[0] < 0.3 && along[199] == 0.5);
        let [a, b, c] = [4.0, 5.0, 6.0].map(|distance_m| model.passed(distance_m));
        assert!((b - a - (c - b)).abs() < 1e-12);
    }

    #[test]
    fn no_probability_is_too_far_out_for_a_cell() {
        assert_eq!(in_units(log_odds(0.5)), 0);
        assert!(in_units(log_odds(1e-30)) < in_units(log_odds(1e-12)));
    }
}
