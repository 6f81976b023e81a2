//! Values over time: between two of them, a little beyond the last, and no farther.

use super::lag::{Clock, Lag};
use super::{Pose, wrapped_rad};
use crate::time::{Span, Time};

/// Values nearer to the last one than this add nothing: no source of poses sends 500 a second, and a flood costs no more.
const NEAREST: Span = Span::from_micros(2_000);
/// How much is kept: more than two revolutions at 5 Hz.
const KEPT: Span = Span::from_micros(1_000_000);
/// Two values this far apart show how it goes on; nearer ones show their noise.
const TREND_S: f64 = 0.2;

/// A quantity that can be read between and beyond two of its values.
pub(super) trait Blend: Copy {
    /// The value at a share of the way to `other`.
    fn blend(&self, other: &Self, share: f64) -> Self;
}

impl Blend for f64 {
    fn blend(&self, other: &Self, share: f64) -> Self {
        self + share * (other - self)
    }
}

/// An angle that is blended the shorter way round.
#[derive(Debug, Clone, Copy)]
pub(super) struct Yaw(pub(super) f64);

impl Blend for Yaw {
    fn blend(&self, other: &Self, share: f64) -> Self {
        Self(wrapped_rad(self.0 + share * wrapped_rad(other.0 - self.0)))
    }
}

impl Blend for Pose {
    fn blend(&self, other: &Self, share: f64) -> Self {
        self.toward(other, share)
    }
}

impl Blend for [f64; 3] {
    fn blend(&self, other: &Self, share: f64) -> Self {
        [0, 1, 2].map(|axis| self[axis] + share * (other[axis] - self[axis]))
    }
}

/// Values of the last second, oldest first.
#[derive(Debug, Clone)]
pub(super) struct History<T> {
    values: Vec<(Time, T)>,
    lag: Lag,
}

impl<T> Default for History<T> {
    fn default() -> Self {
        Self {
            values: vec![],
            lag: Lag::default(),
        }
    }
}

impl<T: Blend> History<T> {
    pub(super) fn clear(&mut self) {
        self.values.clear();
    }

    /// Takes a value in. One that is not later than the last is out of order and no use, unless
    /// it is so old that time itself must have been set back.
    pub(super) fn push(&mut self, time: Time, value: T) {
        if let Some((last, _)) = self.values.last() {
            if (*last - time) > KEPT {
                self.values.clear();
            } else if time <= *last + NEAREST {
                return;
            }
        }
        self.values.push((time, value));
        let too_old = |(then, _): &(Time, T)| (time - *then) > KEPT;
        let old = self
            .values
            .iter()
            .take_while(|entry| too_old(entry))
            .count();
        self.values.drain(..old);
    }

    /// Says all values anew.
    pub(super) fn restate(&mut self, anew: impl Fn(&T) -> T) {
        for (_, value) in &mut self.values {
            *value = anew(value);
        }
    }

    /// Notes at the end of a revolution how far its clock is behind.
    pub(super) fn note_lag(&mut self, end: Time) {
        let newest = self.last().map(|(newest, _)| newest);
        self.lag.note(newest, end);
    }

    /// The clock that stamps the values.
    pub(super) fn clock(&self) -> Clock {
        self.lag.clock()
    }

    /// The value at a time of the revolutions' clock.
    pub(super) fn at_end(&self, time: Time, limit: Span) -> Option<T> {
        self.at(self.lag.by_its_clock(time), limit)
    }

    /// The part of a time of the revolutions' clock in which values are known.
    pub(super) fn known(&self, [from, to]: [Time; 2]) -> Option<[Time; 2]> {
        let ((first, _), (last, _)) = (self.values.first()?, self.values.last()?);
        let behind = self.lag.by_its_clock(to) - to;
        let by_theirs = |time: Time| time + Span::from_micros(-behind.micros());
        Some([by_theirs(*first).max(from), by_theirs(*last).min(to)])
    }

    pub(super) fn last(&self) -> Option<(Time, T)> {
        self.values.last().copied()
    }

    /// Whether the last value is too old at a time to be carried on to it.
    pub(super) fn is_stale(&self, time: Time, limit: Span) -> bool {
        self.last().is_some_and(|(last, _)| (time - last) > limit)
    }

    /// The value at a time, if one is known no more than `limit` away.
    pub(super) fn at(&self, time: Time, limit: Span) -> Option<T> {
        let after = self.values.partition_point(|(then, _)| *then < time);
        let ((last, latest), (first, _)) = (self.last()?, *self.values.first()?);
        if time > last {
            return ((time - last) <= limit).then(|| self.beyond(time, latest));
        }
        if time < first {
            let value = self.values[0].1;
            return ((first - time) <= limit).then_some(value);
        }
        let (then, value) = self.values[after];
        if then == time || after == 0 {
            return Some(value);
        }
        let (before, from) = self.values[after - 1];
        let share = (time - before).seconds() / (then - before).seconds();
        Some(from.blend(&value, share))
    }

    /// Goes on from the last value as it came there.
    fn beyond(&self, time: Time, latest: T) -> T {
        let Some((last, _)) = self.last() else {
            return latest;
        };
        let passed_s = |then: Time| (last - then).seconds();
        let trend = self.values.iter().rev();
        let earlier = trend
            .clone()
            .find(|(then, _)| passed_s(*then) >= TREND_S)
            .or(self.values.first());
        match earlier {
            Some((then, from)) if passed_s(*then) > 0.0 => {
                let share = 1.0 + (time - last).seconds() / passed_s(*then);
                from.blend(&latest, share)
            }
            _ => latest,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(milliseconds: i64) -> Time {
        Time::from_micros(1_000 * milliseconds)
    }

    const LIMIT: Span = Span::from_micros(500_000);

    #[test]
    fn between_two_values_it_is_linear_and_beyond_it_goes_on() {
        let mut history = History::default();
        for step in 0..6 {
            history.push(at(100 * step), step as f64);
        }
        assert_eq!(history.at(at(250), LIMIT), Some(2.5));
        assert_eq!(history.at(at(500), LIMIT), Some(5.0));
        let beyond = history.at(at(700), LIMIT).unwrap();
        assert!((beyond - 7.0).abs() < 1e-9);
        assert_eq!(history.at(at(1001), LIMIT), None);
    }

    #[test]
    fn a_flood_of_values_is_thinned() {
        let mut history = History::default();
        for step in 0..100_000 {
            history.push(Time::from_micros(10 * step), step as f64);
        }
        assert!(history.values.len() <= 501);
        assert!((history.at(at(900), LIMIT).unwrap() - 90_000.0).abs() < 1.0);
    }

    #[test]
    fn disorder_is_passed_over_and_a_clock_set_back_begins_anew() {
        let mut history = History::default();
        history.push(at(10_000), 1.0);
        history.push(at(9_900), 5.0);
        assert_eq!(history.at(at(10_000), LIMIT), Some(1.0));
        history.push(at(1_000), 2.0);
        assert_eq!(history.at(at(1_000), LIMIT), Some(2.0));
        assert_eq!(history.at(at(10_000), LIMIT), None);
    }
}
