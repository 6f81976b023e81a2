//! How long answers and their steps take, and how many bytes come and go, since the beginning.

use std::time::Duration;

use crate::pipeline::Step;

/// Upper bounds of the buckets, in seconds; what is above them all counts in the total alone.
pub(super) const BOUNDS_S: [f64; 14] = [
    5e-5, 1e-4, 2e-4, 5e-4, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0,
];

/// A histogram as Prometheus has it, but for that each bucket counts its own alone.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Durations {
    pub(super) buckets: [u64; BOUNDS_S.len()],
    pub(super) count: u64,
    pub(super) sum_s: f64,
}

impl Durations {
    pub(super) fn record(&mut self, seconds: f64) {
        let bucket = BOUNDS_S.partition_point(|bound_s| *bound_s < seconds);
        if let Some(own) = self.buckets.get_mut(bucket) {
            *own += 1;
        }
        self.count += 1;
        self.sum_s += seconds;
    }
}

/// What a daemon measures for those who watch it by machine.
#[derive(Debug, Clone, Default)]
pub(super) struct Measures {
    /// From the arrival of a revolution to its list sent.
    pub(super) latency: Durations,
    /// Each step, in the order in which they came first.
    pub(super) steps: Vec<(Step, Durations)>,
    pub(super) received_bytes: u64,
    pub(super) sent_bytes: u64,
}

impl Measures {
    pub(super) fn note(&mut self, step: Step, took: Duration) {
        let known = self.steps.iter().position(|(own, _)| *own == step);
        let place = known.unwrap_or(self.steps.len());
        if known.is_none() {
            self.steps.push((step, Durations::default()));
        }
        self.steps[place].1.record(took.as_secs_f64());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duration_counts_in_the_first_bucket_that_holds_it_and_a_long_one_in_the_total_alone() {
        let mut durations = Durations::default();
        for seconds in [0.0, 5e-5, 0.003, 7.0] {
            durations.record(seconds);
        }
        assert_eq!((durations.buckets[0], durations.buckets[6]), (2, 1));
        assert_eq!(durations.buckets.iter().sum::<u64>(), 3);
        assert_eq!(durations.count, 4);
        assert!((durations.sum_s - 7.00305).abs() < 1e-9);
    }

    #[test]
    fn steps_are_kept_apart() {
        let mut measures = Measures::default();
        for step in [Step::Cloud, Step::Ego, Step::Cloud] {
            measures.note(step, Duration::from_millis(1));
        }
        let counts = measures.steps.iter().map(|(step, own)| (*step, own.count));
        assert!(counts.eq([(Step::Cloud, 2), (Step::Ego, 1)]));
    }
}
