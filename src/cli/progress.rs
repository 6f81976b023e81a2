//! How far a command has come, in one line of a terminal; nothing in a pipe.

use std::io::{IsTerminal as _, Write as _, stderr};
use std::time::{Duration, Instant};

/// What is shown while something takes long.
#[derive(Debug)]
pub(super) struct Progress {
    length: usize,
    position: usize,
    unit: &'static str,
    begun: Instant,
    /// When it was shown last; nothing is shown without a terminal.
    shown: Option<Instant>,
}

/// Time between two of what is shown.
const PERIOD: Duration = Duration::from_millis(100);
const BAR_LEN: usize = 30;
/// To the begin of the line, which is cleared.
const CLEAR: &str = "\r\x1b[2K";

impl Progress {
    /// Of so many units.
    pub(super) fn of(length: usize, unit: &'static str) -> Self {
        let begun = Instant::now();
        Self {
            length,
            position: 0,
            unit,
            begun,
            shown: stderr().is_terminal().then_some(begun),
        }
    }

    /// One more is done.
    pub(super) fn step(&mut self) {
        self.set(self.position + 1);
    }

    /// So many are done.
    pub(super) fn set(&mut self, position: usize) {
        self.position = position;
        if self.shown.is_some_and(|shown| shown.elapsed() >= PERIOD) {
            self.shown = Some(Instant::now());
            // A terminal that is gone needs no progress.
            let _ = write!(stderr(), "{CLEAR}{}", self.line(self.begun.elapsed()));
        }
    }

    fn line(&self, passed: Duration) -> String {
        let done = (self.position as f64 / self.length.max(1) as f64).min(1.0);
        let filled = (done * BAR_LEN as f64) as usize;
        let bar = "█".repeat(filled) + &"░".repeat(BAR_LEN - filled);
        let left_s = if done > 0.0 {
            passed.as_secs_f64() * (1.0 / done - 1.0)
        } else {
            0.0
        };
        let (length, unit) = (self.length, self.unit);
        format!(
            "{bar} {:.0} % of {length} {unit}, {left_s:.0} s left",
            100.0 * done
        )
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.shown.is_some_and(|shown| shown > self.begun) {
            let _ = write!(stderr(), "{CLEAR}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_how_much_is_done_and_how_long_the_rest_takes() {
        let mut progress = Progress::of(400, "revolutions");
        progress.set(100);
        let line = progress.line(Duration::from_secs(5));
        assert!(
            line.ends_with(" 25 % of 400 revolutions, 15 s left"),
            "{line}"
        );
        assert_eq!(line.matches('█').count(), 7);
        assert_eq!(line.matches(['█', '░']).count(), BAR_LEN);
        progress.set(500);
        assert!(progress.line(Duration::from_secs(5)).contains("100 %"));
        assert!(
            Progress::of(0, "bytes")
                .line(Duration::ZERO)
                .contains("0 %")
        );
    }
}
