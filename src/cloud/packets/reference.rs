//! Where a packet belongs among the others: by its time stamp, and by where it looked.

use super::looks::Looks;
use crate::cloud::sensor::VLP16;
use crate::time::{Span, Time};
use crate::wire::velodyne::data::DataPacket;
use crate::wire::velodyne::{HOUR_US, Packet};

/// Longest stretch of lost packets after which a revolution goes on, in microseconds.
const LONGEST_GAP_US: i64 = 250_000;
/// How much time stamps, which are whole microseconds, may differ from whole firings.
const STAMP_TOLERANCE_US: f64 = 10.0;
/// How much the azimuth of a packet may differ from where the rotation leads, and how much more for each degree that
/// it turned. Motors keep their rate within 0.3 %.
const AZIMUTH_TOLERANCE_DEG: f64 = 1.0;
const AZIMUTH_TOLERANCE: f64 = 0.01;
pub(super) const FIRING_PERIOD_US: f64 = 1e6 * VLP16.column_period_s;

/// When the firings of a packet were, and where it looked.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reference {
    /// Number of its first firing since the first of all.
    pub(super) number: i64,
    /// When that was, by the sensor's clock.
    time_us: u32,
    /// When the packet came.
    arrival: Time,
    firings: usize,
    pub(super) azimuth_deg: f64,
    pub(super) step_deg: f64,
}

impl Reference {
    pub(super) fn of(packet: &Packet<'_>, data: &DataPacket<'_>, looks: &Looks) -> Self {
        Self {
            number: 0,
            time_us: data.time_us(),
            arrival: packet.arrival,
            firings: looks.len(),
            azimuth_deg: looks.azimuth_deg(0),
            step_deg: looks.step_deg(),
        }
    }

    /// How many firings after it another packet begins, if that one goes on from it.
    pub(super) fn ahead(&self, other: &Self) -> Option<i64> {
        const HALF_US: i64 = HOUR_US / 2;
        let passed_us = i64::from(other.time_us) - i64::from(self.time_us);
        let passed_us = (passed_us + HALF_US).rem_euclid(HOUR_US) - HALF_US;
        let firings = libm::round(passed_us as f64 / FIRING_PERIOD_US);
        let off_us = libm::fabs(passed_us as f64 - firings * FIRING_PERIOD_US);
        let turned_deg = firings * self.step_deg;
        let off_deg = other.azimuth_deg - self.azimuth_deg - turned_deg;
        let off_deg = (off_deg + 180.0).rem_euclid(360.0) - 180.0;
        let tolerance_deg = AZIMUTH_TOLERANCE_DEG + AZIMUTH_TOLERANCE * libm::fabs(turned_deg);
        let goes_on = passed_us.abs() <= LONGEST_GAP_US
            && off_us <= STAMP_TOLERANCE_US
            && libm::fabs(off_deg) <= tolerance_deg;
        goes_on.then_some(firings as i64)
    }

    /// When a firing was: microseconds past the hour by the sensor's clock, and by that of the arrivals. A packet
    /// is sent when its last firing is over.
    pub(super) fn time_of(&self, number: i64) -> (i64, Time) {
        let after_us = libm::round((number - self.number) as f64 * FIRING_PERIOD_US) as i64;
        let whole_us = libm::round(self.firings as f64 * FIRING_PERIOD_US) as i64;
        (
            i64::from(self.time_us) + after_us,
            self.arrival + Span::from_micros(after_us - whole_us),
        )
    }
}
