//! How long something takes.

use std::time::Duration;

/// CPU time of this thread: other processes do not count.
pub(crate) fn cpu_time() -> Duration {
    let clock = nix::time::ClockId::CLOCK_THREAD_CPUTIME_ID;
    Duration::from(nix::time::clock_gettime(clock).unwrap())
}

/// Median and 99th percentile.
pub(crate) fn quantiles(times_us: &mut [f64]) -> (f64, f64) {
    times_us.sort_by(f64::total_cmp);
    let count = times_us.len();
    (times_us[count / 2], times_us[count * 99 / 100])
}
