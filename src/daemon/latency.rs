//! How long answers take: a histogram of the latest revolutions.

use std::fmt;

use hdrhistogram::Histogram;

use crate::time::Span;

/// Revolutions after which a histogram is full: 10 min at 10 Hz, of which the slowest
/// thousandth are six.
const FULL: u64 = 6000;
/// The longest latency that is told apart, in microseconds.
const LONGEST_US: u64 = 100_000_000;
/// Decimal digits that a latency keeps.
const DIGITS: u8 = 2;

/// From a datagram's arrival to its list sent.
#[derive(Debug, Clone)]
pub(super) struct Latency {
    /// The latest revolutions, fewer than [`FULL`].
    latest_us: Histogram<u32>,
    /// As many before them as a full histogram holds.
    earlier_us: Histogram<u32>,
    max_us: u64,
    revolutions: u64,
}

/// Of the latest revolutions, and the greatest of all time, in seconds.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Percentiles {
    pub(super) median_s: f32,
    pub(super) p99_s: f32,
    pub(super) p999_s: f32,
    pub(super) max_s: f32,
}

impl Default for Latency {
    fn default() -> Self {
        let empty = Histogram::new_with_bounds(1, LONGEST_US, DIGITS)
            .unwrap_or_else(|_| unreachable!("constant bounds"));
        Self {
            latest_us: empty.clone(),
            earlier_us: empty,
            max_us: 0,
            revolutions: 0,
        }
    }
}

impl Latency {
    pub(super) fn record(&mut self, latency: Span) {
        // The clock may have been set in between.
        let microseconds = latency.micros().max(0) as u64;
        self.max_us = self.max_us.max(microseconds);
        self.revolutions += 1;
        if self.latest_us.len() == FULL {
            std::mem::swap(&mut self.latest_us, &mut self.earlier_us);
            self.latest_us.reset();
        }
        self.latest_us.saturating_record(microseconds);
    }

    /// Latencies that were recorded since start.
    pub(super) fn revolutions(&self) -> u64 {
        self.revolutions
    }

    pub(super) fn percentiles(&self) -> Percentiles {
        let mut all_us = self.earlier_us.clone();
        // Both have the same bounds.
        let _ = all_us.add(&self.latest_us);
        let seconds = |microseconds: u64| (1e-6 * microseconds as f64) as f32;
        let at = |part: f64| seconds(all_us.value_at_quantile(part).min(self.max_us));
        Percentiles {
            median_s: at(0.5),
            p99_s: at(0.99),
            p999_s: at(0.999),
            max_s: seconds(self.max_us),
        }
    }
}

impl fmt::Display for Percentiles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "median {:.2} ms, p99 {:.2} ms, p99.9 {:.2} ms, longest {:.2} ms",
            1e3 * self.median_s,
            1e3 * self.p99_s,
            1e3 * self.p999_s,
            1e3 * self.max_s,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: f32, expected: f32) -> bool {
        (found / expected - 1.0).abs() < 0.01
    }

    #[test]
    fn nothing_took_no_time() {
        assert_eq!(Latency::default().percentiles(), Percentiles::default());
    }

    #[test]
    fn percentiles_are_of_the_latest_and_the_maximum_is_of_all() {
        let mut latency = Latency::default();
        latency.record(Span::from_micros(9_000_000));
        latency.record(Span::from_micros(-5));
        for number in 0..3 * FULL as i64 {
            latency.record(Span::from_micros(1000 * (1 + number % 1000)));
        }
        let found = latency.percentiles();
        assert!(close(found.median_s, 0.5), "{found:?}");
        assert!(close(found.p99_s, 0.99), "{found:?}");
        assert!(close(found.p999_s, 0.999), "{found:?}");
        assert_eq!(found.max_s, 9.0);
    }

    #[test]
    fn what_is_told_of_one_revolution_is_its_latency() {
        let mut latency = Latency::default();
        latency.record(Span::from_micros(12_345));
        assert_eq!(
            latency.percentiles().to_string(),
            "median 12.35 ms, p99 12.35 ms, p99.9 12.35 ms, longest 12.35 ms"
        );
    }
}
