//! What needs no look in every revolution: what stands and is hardly a road user.

use super::Track;
use crate::time::Time;

/// What is younger is looked at each time: much is not known of it yet.
const KNOWN_S: f64 = 1.0;
/// Part of the confidence from which an object is published, below which it is far from that.
const HARDLY: f64 = 0.6;
/// One revolution of so many shows a resting track.
const TURNS: u32 = 3;
/// No track rests longer: a pedestrian who begins to walk gets no farther than half a metre.
const LONGEST_S: f64 = 0.32;

impl Track {
    /// Gives it a turn: tracks that were born one after the other rest in different revolutions.
    pub(in crate::track) fn taking_turns(self, turn: u32) -> Self {
        Self { turn, ..self }
    }

    /// Lets it rest in the revolution with this number, or not; they take turns, so that all
    /// revolutions cost alike.
    pub(in crate::track) fn rest(&mut self, revolution: u32, end: Time, least_confidence: f64) {
        let is_due = self.turn.wrapping_add(revolution).is_multiple_of(TURNS)
            || (end - self.last_measured).seconds() > LONGEST_S;
        self.rests = !is_due && self.may_rest(end, least_confidence);
    }

    /// Whether it is not looked at in this revolution: what lies in its place belongs to it unseen.
    pub(in crate::track) fn rests(&self) -> bool {
        self.rests
    }

    fn may_rest(&self, end: Time, least_confidence: f64) -> bool {
        let is_known = self.is_confirmed() && (end - self.first_seen).seconds() > KNOWN_S;
        let was_there = self.points > 0;
        let stands = !self.moves && self.motion.standing() > 0.5;
        let is_hardly = !self.was_likely && self.most_confidence() < HARDLY * least_confidence;
        is_known && was_there && stands && is_hardly
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::Scan;
    use crate::cloud::tests::scan_of;
    use crate::time::Span;
    use crate::track::tests::followed;

    /// What stands 10 m away and was seen so many times.
    fn seen(times: usize, scan: &Scan) -> (Track, Time) {
        followed(std::iter::repeat_n(scan, times))
    }

    #[test]
    fn only_what_is_known_to_stand_and_hardly_a_road_user_rests_and_not_for_long() {
        let scan = scan_of(1800, |column, layer| match column {
            0..20 if (5..8).contains(&layer) => 1000,
            _ => 0,
        });
        // Of any confidence, or of none, is little.
        let (much, none) = (f64::MAX, 0.0);
        let rests = |mut track: Track, after: Time, delay_s: f64, confidence: f64| {
            let end = after + Span::from_seconds(delay_s);
            let turns = (0..TURNS).filter(|revolution| {
                track.rest(*revolution, end, confidence);
                track.rests()
            });
            turns.count() as u32
        };
        let (track, end) = seen(14, &scan);
        assert_eq!(rests(track.clone(), end, 0.1, much), TURNS - 1);
        assert_eq!(rests(track.clone(), end, 0.4, much), 0);
        assert_eq!(rests(track.clone(), end, 0.1, none), 0);
        let published = Track {
            was_likely: true,
            ..track.clone()
        };
        let moving = Track {
            moves: true,
            ..track.clone()
        };
        let missed = Track { points: 0, ..track };
        for awake in [published, moving, missed] {
            assert_eq!(rests(awake, end, 0.1, much), 0);
        }
        let (young, end) = seen(8, &scan);
        assert_eq!(rests(young, end, 0.1, much), 0);
    }
}
