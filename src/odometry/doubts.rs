//! Whether the motion with which a frame began was right: asked once the answer is out.

use super::motion::Motion;
use super::search::{Reach, is_clearly_another};
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

    /// Whether a revolution of a young frame clearly fits another motion better, as the one before it did: what is added to the
    /// map from a wrong place contradicts it. Without this a drive into a mini roundabout begins 1.4 m/s too slowly; and where it
    /// need not be clear, 15 of 49 drives in the open are taken for standing or running away (`tests/odometry.rs`).
    fn doubts(&mut self, predicted: Motion, attempt: &Attempt) -> bool {
        /// So often in a row is no accident.
        const OFTEN: u32 = 2;
        self.followed += 1;
        let skewed = self.skewed;
        let other = self.search(predicted, *attempt, Reach::Anywhere);
        self.unskew(&skewed);
        self.doubted = if is_clearly_another(&other, attempt) {
            self.doubted + 1
        } else {
            0
        };
        self.doubted >= OFTEN
    }
}
