//! Whether the motion with which a frame began was right: asked once the answer is out.

use super::motion::Motion;
use super::search::{Reach, is_other};
use super::{Attempt, Odometry};

/// What is still to be done with a revolution.
#[derive(Debug, Clone, Copy)]
pub(super) struct Unsettled {
    /// From where and how it was aligned, while the frame is young.
    pub(super) doubtful: Option<(Motion, Attempt)>,
    /// It fits, and is one for the map.
    pub(super) fits: bool,
}

impl Odometry {
    /// Does what the last revolution's motion need not wait for: doubts it while the frame is young, and takes it into the map.
    /// Without it, the next revolution begins with this.
    pub fn settle(&mut self) {
        let Some(unsettled) = self.unsettled.take() else {
            return;
        };
        let is_doubted = |(predicted, attempt)| self.doubts(predicted, &attempt);
        if unsettled.doubtful.is_some_and(is_doubted) {
            self.begin_anew();
        } else if unsettled.fits {
            self.map.add(&self.view, &self.motion.pose);
        }
    }

    /// Whether the frame is so young that its motion is doubted.
    pub(super) fn is_young(&self) -> bool {
        /// Revolutions in which it is asked.
        const YOUNG: u32 = 20;
        !self.is_led() && self.followed < YOUNG
    }

    /// Whether a revolution of a young frame fits another motion better, as the one before it did: along a wall little tells them
    /// apart where it begins, and what is added to the map from a wrong place contradicts it. Without this strangers 605 and 789
    /// are taken for standing (`tests/odometry.rs`).
    fn doubts(&mut self, predicted: Motion, attempt: &Attempt) -> bool {
        /// So often in a row is no accident.
        const OFTEN: u32 = 2;
        self.followed += 1;
        let skewed = self.skewed;
        let other = self.search(predicted, *attempt, Reach::Anywhere);
        self.unskew(&skewed);
        self.doubted = if is_other(&other, attempt) {
            self.doubted + 1
        } else {
            0
        };
        self.doubted >= OFTEN
    }

    /// Whether the sensor was lost a moment ago: what seemed to move by a wrong motion may stand. Without this strangers 605 is
    /// taken for standing (`tests/odometry.rs`).
    pub fn was_lost(&self) -> bool {
        self.epoch > 0 && self.is_young()
    }
}
