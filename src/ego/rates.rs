//! Ground speed and yaw rate: what services send of them is trusted as far as it agreed with what was seen.
//!
//! Services differ in unit and sign of a yaw rate, and a speed may lie about its direction. So each reading of a
//! number is compared with the odometry while that sees well; where it does not, the one that agreed tells.

use crate::odometry::{Odometry, Quality};

/// One way to read a number, and how well it agreed so far.
#[derive(Debug, Clone, Copy)]
struct Reading {
    /// Of the number that is sent.
    factor: f64,
    /// Mean square of how far it was off, over the revolutions so far, the later ones counting more.
    square: f64,
    compared: u32,
}

/// What is learned of the numbers that a session sends.
#[derive(Debug, Clone)]
pub(super) struct Rates {
    speed: [Reading; 1],
    yaw_rate: [Reading; 4],
}

/// Comparisons before a number is relied upon.
const FEWEST: u32 = 20;
/// Share of a revolution in what is learned.
const FRESH: f64 = 0.05;
/// How far off a number may usually be, and is thought to be at least: m/s and radians a second.
const WORST_MPS: f64 = 0.5;
const BEST_MPS: f64 = 0.1;
const WORST_RADPS: f64 = 0.05;
const BEST_RADPS: f64 = 0.01;
/// A vehicle that hardly turns does not tell how its yaw rate is meant.
const LEAST_RADPS: f64 = 0.1;

impl Reading {
    const fn of(factor: f64) -> Self {
        Self {
            factor,
            square: 0.0,
            compared: 0,
        }
    }

    fn compare(&mut self, sent: f64, seen: f64) {
        let off = self.factor * sent - seen;
        self.compared = self.compared.saturating_add(1);
        let fresh = FRESH.max(1.0 / f64::from(self.compared));
        self.square += fresh * (off * off - self.square);
    }
}

/// The value of a number by the reading that agreed best, and its standard deviation.
fn trusted(readings: &[Reading], sent: f64, [best, worst]: [f64; 2]) -> Option<(f64, f64)> {
    let known = readings.iter().filter(|reading| reading.compared >= FEWEST);
    let reading = known.min_by(|a, b| a.square.total_cmp(&b.square))?;
    let deviation = libm::sqrt(reading.square).max(best);
    (deviation < worst).then_some((reading.factor * sent, deviation))
}

impl Rates {
    pub(super) fn new() -> Self {
        let degree = 1f64.to_radians();
        Self {
            speed: [Reading::of(1.0)],
            yaw_rate: [1.0, -1.0, degree, -degree].map(Reading::of),
        }
    }

    /// Tells the odometry what is sent in this moment, as far as it is trusted. The vehicle looks along `ahead_rad` in
    /// the odometry frame.
    pub(super) fn guide(
        &self,
        odometry: &mut Odometry,
        speed: Option<f64>,
        yaw_rate: Option<f64>,
        ahead_rad: f64,
    ) {
        let speed = speed.and_then(|sent| trusted(&self.speed, sent, [BEST_MPS, WORST_MPS]));
        if let Some((mps, deviation)) = speed {
            odometry.guide_speed(ahead_rad, mps, deviation);
        }
        let rate =
            yaw_rate.and_then(|sent| trusted(&self.yaw_rate, sent, [BEST_RADPS, WORST_RADPS]));
        if let Some((radps, deviation)) = rate {
            odometry.guide_yaw_rate(radps, deviation);
        }
    }

    /// Compares what is sent with what was seen in the same revolution.
    pub(super) fn learn(
        &mut self,
        odometry: &Odometry,
        speed: Option<f64>,
        yaw_rate: Option<f64>,
        ahead_rad: f64,
    ) {
        if odometry.report().quality != Quality::Following {
            return;
        }
        if let Some(sent) = speed {
            let seen = odometry.speed_mps(ahead_rad);
            self.speed
                .iter_mut()
                .for_each(|reading| reading.compare(sent, seen));
        }
        let seen = odometry.yaw_rate_radps();
        if let Some(sent) = yaw_rate.filter(|_| seen.abs() > LEAST_RADPS) {
            self.yaw_rate
                .iter_mut()
                .for_each(|reading| reading.compare(sent, seen));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_yaw_rate_is_read_in_the_unit_and_sign_that_agreed() {
        let mut readings = Rates::new().yaw_rate;
        let limits = [BEST_RADPS, WORST_RADPS];
        for step in 0..40 {
            // Degrees a second, clockwise.
            let seen = 0.3 + 0.01 * f64::from(step % 5);
            readings
                .iter_mut()
                .for_each(|reading| reading.compare(-seen.to_degrees(), seen));
            assert_eq!(
                trusted(&readings, 1.0, limits).is_some(),
                step >= 19,
                "{step}"
            );
        }
        let (radps, _) = trusted(&readings, 10.0, limits).unwrap();
        assert!((radps + 10f64.to_radians()).abs() < 1e-9);
    }

    #[test]
    fn a_number_that_disagrees_is_not_used() {
        let mut readings = Rates::new().speed;
        for step in 0..100 {
            readings[0].compare(7.0, f64::from(step % 10));
        }
        assert_eq!(trusted(&readings, 7.0, [BEST_MPS, WORST_MPS]), None);
    }
}
