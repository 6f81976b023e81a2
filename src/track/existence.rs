//! Whether a track is something at all: the logarithm of its odds.

use super::sight::Sight;

/// At birth, gained by each sighting, and lost by a revolution that should have shown it, that
/// cannot have shown it, that shows what hides it, or that shows nothing in its place.
const BIRTH: f64 = -0.6;
const SEEN: f64 = 1.0;
const MISSED: f64 = -0.9;
const UNSEEN: f64 = -0.5;
const HIDDEN: f64 = -0.08;
const EMPTY: f64 = -2.0;
/// More certainty than this would make it slow to doubt.
const MOST: f64 = 5.0;
/// Below this nothing is left of it.
const LEAST: f64 = -1.2;
/// Younger ones are not remembered for long where they are hidden.
const YOUNG_S: f64 = 1.0;
/// Sightings that confirm a track.
const CONFIRMING: u32 = 3;

/// What speaks for a track.
#[derive(Debug, Clone, Copy)]
pub(super) struct Existence {
    odds: f64,
    sightings: u32,
}

impl Existence {
    /// After the first sighting.
    pub(super) fn new() -> Self {
        Self {
            odds: BIRTH,
            sightings: 1,
        }
    }

    pub(super) fn see(&mut self) {
        self.odds = (self.odds + SEEN).min(MOST);
        self.sightings = self.sightings.saturating_add(1);
    }

    /// Nothing was found of a track so old; `telling`, 0 to 1, is how much that says of it.
    pub(super) fn miss(&mut self, sight: &Sight, age_s: f64, telling: f64) {
        let change = if sight.is_hidden() {
            if age_s < YOUNG_S { MISSED } else { HIDDEN }
        } else if !sight.is_observable() {
            UNSEEN
        } else if sight.is_empty() {
            EMPTY
        } else {
            MISSED
        };
        self.odds += telling * change;
    }

    pub(super) fn is_confirmed(&self) -> bool {
        self.sightings >= CONFIRMING
    }

    pub(super) fn is_gone(&self) -> bool {
        self.odds < LEAST
    }

    /// Logarithm of the odds.
    pub(super) fn odds(&self) -> f64 {
        self.odds
    }

    pub(super) fn probability(&self) -> f64 {
        1.0 / (1.0 + libm::exp(-self.odds))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_hardly_ever_met_is_not_gone_when_it_is_missed_some_times() {
        let passed = Sight {
            rays: 10.0,
            blocked: 0.0,
            passed: 10.0,
        };
        let after_misses = |telling: f64| {
            let mut existence = Existence::new();
            (0..10).for_each(|_| existence.see());
            (0..5).for_each(|_| existence.miss(&passed, 5.0, telling));
            existence
        };
        assert!(after_misses(1.0).is_gone());
        assert!(!after_misses(0.3).is_gone());
    }
}
