//! Latency percentiles over the latest revolutions.

use crate::time::Span;

/// Revolutions that percentiles are taken over: 100 s at 10 Hz.
const KEPT: usize = 1000;

/// From a datagram's arrival to its list sent.
#[derive(Debug, Clone, Default)]
pub(super) struct Latency {
    latest_s: Vec<f32>,
    next: usize,
    max_s: f32,
}

/// Median, 99th percentile, and the greatest of all time, in seconds.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Percentiles {
    pub(super) median_s: f32,
    pub(super) p99_s: f32,
    pub(super) max_s: f32,
}

impl Latency {
    pub(super) fn record(&mut self, latency: Span) {
        // The clock may have been set in between.
        let seconds = latency.seconds().max(0.0) as f32;
        self.max_s = self.max_s.max(seconds);
        if self.latest_s.len() < KEPT {
            self.latest_s.push(seconds);
        } else {
            self.latest_s[self.next] = seconds;
            self.next = (self.next + 1) % KEPT;
        }
    }

    pub(super) fn percentiles(&self) -> Percentiles {
        let mut sorted = self.latest_s.clone();
        sorted.sort_by(f32::total_cmp);
        let at = |part: f64| {
            let index = (part * sorted.len() as f64).ceil() as usize;
            sorted.get(index.saturating_sub(1)).copied().unwrap_or(0.0)
        };
        Percentiles {
            median_s: at(0.5),
            p99_s: at(0.99),
            max_s: self.max_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_of_the_latest_and_the_maximum_is_of_all() {
        let mut latency = Latency::default();
        assert_eq!(latency.percentiles(), Percentiles::default());
        latency.record(Span::from_micros(9_000_000));
        for milliseconds in 1..=1000 {
            latency.record(Span::from_micros(1000 * milliseconds));
        }
        let found = latency.percentiles();
        assert_eq!((found.median_s, found.p99_s, found.max_s), (0.5, 0.99, 9.0));
    }
}
