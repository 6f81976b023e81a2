//! Where something was in the last seconds.

use nalgebra::Vector2;

use crate::time::{Span, Time};

/// The last places of something, one for each revolution that met it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Trace {
    places: [(Time, Vector2<f64>); Trace::LONGEST],
    /// How many there ever were.
    count: usize,
}

impl Trace {
    /// As many as there are in what [`crate::beams`] remembers.
    const LONGEST: usize = 26;

    pub(super) fn push(&mut self, time: Time, at_m: Vector2<f64>) {
        self.places[self.count % Self::LONGEST] = (time, at_m);
        self.count += 1;
    }

    /// These places, and then those of the same thing later.
    pub(super) fn followed_by(mut self, later: &Self) -> Self {
        for number in later.count.saturating_sub(Self::LONGEST)..later.count {
            let (time, at_m) = later.places[number % Self::LONGEST];
            self.push(time, at_m);
        }
        self
    }

    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// Where it was at a time, between the revolutions that met it before and after.
    pub(super) fn at(&self, time: Time) -> Option<Vector2<f64>> {
        /// Nothing is known of what was between revolutions farther apart.
        const LONGEST_GAP: Span = Span::from_micros(600_000);
        let (mut before, mut after) = (None, None);
        for (own, at_m) in &self.places[..self.count.min(Self::LONGEST)] {
            let slot = if *own <= time {
                &mut before
            } else {
                &mut after
            };
            let is_nearer = |(known, _): &(Time, Vector2<f64>)| {
                if *own <= time {
                    own > known
                } else {
                    own < known
                }
            };
            if slot.as_ref().is_none_or(is_nearer) {
                *slot = Some((*own, *at_m));
            }
        }
        let (from, from_m) = before?;
        let Some((to, to_m)) = after else {
            return (time - from <= LONGEST_GAP).then_some(from_m);
        };
        let share = (time - from).seconds() / (to - from).seconds();
        (to - from <= LONGEST_GAP).then(|| from_m + share * (to_m - from_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_on_as_another_was_where_that_was() {
        let at = |seconds: f64| Time::ZERO + Span::from_seconds(seconds);
        let begun = |from_s: f64, count: u32| {
            let mut trace = Trace::default();
            for step in 0..count {
                let seconds = from_s + 0.1 * f64::from(step);
                trace.push(at(seconds), Vector2::new(seconds, 0.0));
            }
            trace
        };
        let trace = begun(10.0, 40).followed_by(&begun(14.2, 3));
        for seconds in [12.0, 13.9, 14.3] {
            let off_m = trace.at(at(seconds)).unwrap() - Vector2::new(seconds, 0.0);
            assert!(off_m.norm() < 1e-9, "{seconds} {off_m}");
        }
    }

    #[test]
    fn a_place_is_known_between_revolutions_and_not_before_the_first_or_across_a_gap() {
        let at = |seconds: f64| Time::ZERO + Span::from_seconds(seconds);
        let mut trace = Trace::default();
        for step in 0..40 {
            let seconds = 0.1 * f64::from(step);
            trace.push(at(10.0 + seconds), Vector2::new(seconds, 1.0));
        }
        trace.push(at(15.0), Vector2::new(9.0, 9.0));
        assert_eq!(trace.at(at(11.0)), None);
        assert!((trace.at(at(12.55)).unwrap() - Vector2::new(2.55, 1.0)).norm() < 1e-9);
        assert_eq!(trace.at(at(14.5)), None);
        assert_eq!(trace.at(at(15.1)), Some(Vector2::new(9.0, 9.0)));
    }
}
