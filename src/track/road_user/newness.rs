//! Whether something is where nothing was before: what the rays of the last seconds say of it.

use nalgebra::Vector2;

use super::vacated::Vacated;
use crate::track::look::Look;

/// What was seen before of the places of an object's returns, of late.
#[derive(Debug, Clone, Copy)]
pub(super) struct Newness {
    /// Returns a revolution whose place was seen empty, and occupied.
    new: f64,
    old: f64,
    /// Whether nothing is left where it was.
    pub(super) vacated: Vacated,
    /// Where the object was when it was first seen to move to where nothing was, and how far it went from there.
    from_m: Option<Vector2<f64>>,
    way_m: f64,
}

/// Share of a revolution in what is known. This and the other numbers here were set by hand on the recordings of people
/// indoors, of a yard and of traffic.
const FRESH: f64 = 0.2;
/// Share of returns in places that were empty from which on something moved there, and below which it stands.
const LEAST_NEW: f64 = 0.6;
const LEAST_MOVED: f64 = 0.2;
/// Known returns from which on they say whether it may begin to move.
const FEWEST_KNOWN: f64 = 2.0;
/// Returns in places that were occupied from which on what seems to go stands: who passes close by something has some, too.
/// With [`FEWEST_KNOWN`] the roundabout's HOTA falls from 89.2 to 87.1 (`scripts/evaluate --seeds 611-618 --duration 20`).
const MANY_OLD: f64 = 8.0;
/// The way from which on that no longer speaks against its motion.
const SURE_WAY_M: f64 = 5.0;
/// Share of the way that counts on after each revolution in which it was where something stood.
const CLINGING: f64 = 0.8;

impl Newness {
    pub(super) fn of(look: &Look) -> Self {
        Self {
            new: look.new,
            old: look.old,
            vacated: Vacated::default(),
            from_m: None,
            way_m: 0.0,
        }
    }

    pub(super) fn learn(&mut self, look: &Look) {
        self.new += FRESH * (look.new - self.new);
        self.old += FRESH * (look.old - self.old);
        if self.was_occupied() {
            self.way_m *= CLINGING;
        }
    }

    /// The share of the returns in places that were empty, of those of which that is known; `None` where too few are.
    fn share(&self) -> Option<f64> {
        let known = self.new + self.old;
        (known >= FEWEST_KNOWN).then(|| self.new / known)
    }

    /// Whether it is where nothing was, or nothing is where it was.
    pub(super) fn was_empty(&self) -> bool {
        let share = self.share();
        self.vacated.is_sure() || share.is_some_and(|share| share > LEAST_NEW)
    }

    /// Whether it is where something stood.
    fn was_occupied(&self) -> bool {
        let share = self.share();
        !self.vacated.is_sure() && share.is_some_and(|share| share < LEAST_MOVED)
    }

    /// Whether it may have moved to where it is.
    pub(super) fn allows_motion(&self) -> bool {
        let share = self.share();
        self.vacated.is_sure() || share.is_none_or(|share| share > LEAST_NEW)
    }

    /// Whether it only seems to move: it clings to something that stood there before it came.
    pub(super) fn clings(&self, stands: bool) -> bool {
        let is_much = self.way_m < SURE_WAY_M && self.old > MANY_OLD;
        self.was_occupied() && (is_much || stands)
    }

    /// Takes in where it is while it moves.
    pub(super) fn note_way(&mut self, at_m: Vector2<f64>) {
        if self.was_empty() {
            let from_m = *self.from_m.get_or_insert(at_m);
            self.way_m = self.way_m.max((at_m - from_m).norm());
        }
    }

    /// The way begins anew.
    pub(super) fn forget_way(&mut self) {
        (self.from_m, self.way_m) = (None, 0.0);
    }

    /// The frame is another one; how far it went stays.
    pub(super) fn reframe(&mut self) {
        self.from_m = None;
    }

    /// Whether it went to where nothing was, as a whole; of what stands now, far.
    pub(super) fn went(&self, stands: bool) -> bool {
        const LEAST_WAY_M: f64 = 0.1;
        const FAR_M: f64 = 1.5;
        self.way_m > if stands { FAR_M } else { LEAST_WAY_M }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::track::tests::spots_of;

    /// What so many looks in a row leave, each with so many returns in places that were empty and occupied.
    fn after(looks: usize, new: f64, old: f64) -> Newness {
        let scan = scan_of(1800, |column, _| u16::from(column < 3) * 1000);
        let look = Look {
            new,
            old,
            ..Look::at(&spots_of(&scan), &scan, Vector2::zeros())
        };
        let mut newness = Newness::of(&look);
        for _ in 1..looks {
            newness.learn(&look);
        }
        newness
    }

    #[test]
    fn too_few_known_returns_tell_nothing() {
        let newness = after(20, 1.0, 0.5);
        assert_eq!(newness.share(), None);
        assert!(newness.allows_motion());
        assert!(!newness.was_empty() && !newness.was_occupied());
    }

    #[test]
    fn what_is_where_something_stood_does_not_move_and_of_a_few_returns_only_what_stands_clings() {
        let few = after(20, 0.1, 2.5);
        assert!(few.was_occupied() && !few.allows_motion());
        assert!(few.clings(true) && !few.clings(false));
        let newness = after(20, 1.0, 25.0);
        assert!(newness.was_occupied() && !newness.allows_motion());
        assert!(newness.clings(false));
        let newness = after(20, 25.0, 1.0);
        assert!(newness.was_empty() && newness.allows_motion());
        assert!(!newness.clings(true));
    }

    #[test]
    fn a_long_way_counts_for_a_while_where_something_stood() {
        let mut newness = after(20, 25.0, 0.0);
        for step in 0..80 {
            newness.note_way(Vector2::new(0.1 * f64::from(step), 0.0));
        }
        assert!(newness.went(true));
        let before_a_wall = Newness {
            new: 0.0,
            old: 25.0,
            ..newness
        };
        assert!(!before_a_wall.clings(false));
        assert!(before_a_wall.clings(true));
        let scan = scan_of(1800, |column, _| u16::from(column < 3) * 1000);
        let look = Look {
            new: 0.0,
            old: 25.0,
            ..Look::at(&spots_of(&scan), &scan, Vector2::zeros())
        };
        let mut clinging = before_a_wall;
        for _ in 0..10 {
            clinging.learn(&look);
        }
        assert!(clinging.clings(false) && !clinging.went(true));
    }
}
