//! Points in time as integer microseconds: exact, ordered, and free of any clock.

use std::ops::{Add, Sub};

/// Microseconds since 1970-01-01T00:00:00Z, the resolution of every time stamp on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Hash)]
pub struct Time {
    micros: i64,
}

/// A signed difference between two [`Time`]s in microseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Hash)]
pub struct Span {
    micros: i64,
}

impl Time {
    /// The time that stands for "not given" on the wire.
    pub const ZERO: Time = Time { micros: 0 };

    /// A time from microseconds since the epoch.
    pub const fn from_micros(micros: i64) -> Self {
        Self { micros }
    }

    /// Microseconds since the epoch.
    pub const fn micros(self) -> i64 {
        self.micros
    }

    /// Seconds since the epoch.
    pub fn seconds(self) -> f64 {
        self.micros as f64 * 1e-6
    }

    /// Whether the sender left this time out.
    pub const fn is_zero(self) -> bool {
        self.micros == 0
    }
}

impl Span {
    /// A span from microseconds.
    pub const fn from_micros(micros: i64) -> Self {
        Self { micros }
    }

    /// A span from seconds, rounded to the nearest microsecond.
    pub fn from_seconds(seconds: f64) -> Self {
        Self {
            micros: libm::round(seconds * 1e6) as i64,
        }
    }

    /// The span in microseconds.
    pub const fn micros(self) -> i64 {
        self.micros
    }

    /// The span in seconds.
    pub fn seconds(self) -> f64 {
        self.micros as f64 * 1e-6
    }
}

impl Add<Span> for Time {
    type Output = Time;

    fn add(self, span: Span) -> Time {
        Time::from_micros(self.micros.saturating_add(span.micros))
    }
}

impl Sub for Time {
    type Output = Span;

    fn sub(self, earlier: Time) -> Span {
        Span::from_micros(self.micros.saturating_sub(earlier.micros))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_added_back_gives_the_later_time() {
        let early = Time::from_micros(1_700_000_000_123_456);
        let late = Time::from_micros(1_700_000_001_000_000);
        assert_eq!(early + (late - early), late);
        assert_eq!((late - early).micros(), 876_544);
    }

    #[test]
    fn hostile_extremes_saturate_instead_of_overflowing() {
        let end = Time::from_micros(i64::MAX);
        assert_eq!(end + Span::from_micros(1), end);
        assert_eq!((end - Time::from_micros(i64::MIN)).micros(), i64::MAX);
    }
}
