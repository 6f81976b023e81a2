//! How far the clock that stamps poses is behind that of the revolutions.

use crate::time::{Span, Time};

/// A lag up to this is that of the network and of the rate at which poses come.
const TOLERATED: Span = Span::from_micros(150_000);
/// A clock farther off than this is another one altogether.
const FARTHEST: Span = Span::from_micros(2_000_000);
/// The least lag of so long is the clock's: poses wait for nothing now and then.
const WINDOW: Span = Span::from_micros(2_000_000);

/// What a lag is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Clock {
    /// None to speak of.
    Same,
    /// One that differs steadily by so much, which is made up for.
    Behind(Span),
    /// One that differs by so much that poses are of no use.
    Another(Span),
}

/// Follows the least lag of the last seconds.
#[derive(Debug, Clone, Default)]
pub(super) struct Lag {
    /// The newest value when it was looked at last.
    last: Option<Time>,
    /// When the window began, the least lag in it, and the least in the window before.
    begun: Option<Time>,
    least: Option<Span>,
    before: Option<Span>,
}

impl Lag {
    /// Notes the time of the newest value at the end of a revolution. One that was noted before says nothing: it waits for
    /// the next one.
    pub(super) fn note(&mut self, newest: Option<Time>, end: Time) {
        let Some(newest) = newest.filter(|newest| self.last != Some(*newest)) else {
            return;
        };
        self.last = Some(newest);
        let begun = *self.begun.get_or_insert(end);
        let is_over = (end - begun) > WINDOW || (end - begun).micros() < 0;
        if is_over {
            (self.begun, self.before) = (Some(end), self.least.take());
        }
        let lag = end - newest;
        self.least = Some(self.least.map_or(lag, |least| least.min(lag)));
    }

    /// What is known of the clock.
    pub(super) fn clock(&self) -> Clock {
        let least = [self.least, self.before].into_iter().flatten().min();
        match least {
            Some(lag) if lag.micros().abs() > FARTHEST.micros() => Clock::Another(lag),
            Some(lag) if lag.micros().abs() > TOLERATED.micros() => Clock::Behind(lag),
            _ => Clock::Same,
        }
    }

    /// A time of the revolutions by the clock of the values.
    pub(super) fn by_its_clock(&self, time: Time) -> Time {
        match self.clock() {
            Clock::Behind(lag) => time + Span::from_micros(-lag.micros()),
            Clock::Same | Clock::Another(_) => time,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Poses so many a second, stamped so far behind, for 10 s.
    fn after(rate_hz: f64, behind_s: f64) -> Clock {
        let mut lag = Lag::default();
        for revolution in 1..100 {
            let end_s = 0.1 * f64::from(revolution);
            let newest_s = (end_s * rate_hz).floor() / rate_hz;
            let time = |seconds: f64| Time::from_micros((1e6 * seconds) as i64);
            lag.note(Some(time(newest_s - behind_s)), time(end_s));
        }
        lag.clock()
    }

    #[test]
    fn a_steady_difference_is_found_and_the_pause_between_two_poses_is_none() {
        for rate_hz in [1.0, 5.0, 100.0] {
            assert_eq!(after(rate_hz, 0.0), Clock::Same, "{rate_hz}");
            let Clock::Behind(lag) = after(rate_hz, 0.8) else {
                panic!("{rate_hz}");
            };
            assert!((lag.seconds() - 0.8).abs() < 0.11, "{rate_hz}: {lag:?}");
        }
        assert!(matches!(after(100.0, -0.5), Clock::Behind(_)));
        assert!(matches!(after(100.0, 3600.0), Clock::Another(_)));
    }

    #[test]
    fn a_source_that_falls_silent_is_not_late() {
        let mut lag = Lag::default();
        let newest = Some(Time::from_micros(5_000_000));
        for revolution in 50..100 {
            lag.note(newest, Time::from_micros(100_000 * revolution));
        }
        assert_eq!(lag.clock(), Clock::Same);
    }
}
