//! One log line per kind of fault and interval, however many there are.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use tracing::warn;

/// Time between two lines of one kind.
const INTERVAL: Duration = Duration::from_secs(10);

/// Remembers which kinds were logged lately. Kinds are names in our code, so they are few.
#[derive(Debug, Default)]
pub(super) struct FaultLog {
    kinds: HashMap<&'static str, Kind>,
}

#[derive(Debug)]
struct Kind {
    logged: Instant,
    since: u64,
}

impl FaultLog {
    /// Logs a fault, or counts it for the next line of its kind.
    pub(super) fn note(&mut self, name: &'static str, text: impl FnOnce() -> String) {
        if let Some(since) = self.due(name, Instant::now()) {
            log(name, &text(), since);
        }
    }

    /// How many were not logged since the last line, if it is time for another one.
    fn due(&mut self, name: &'static str, now: Instant) -> Option<u64> {
        match self.kinds.get_mut(name) {
            Some(kind) if now.duration_since(kind.logged) < INTERVAL => {
                kind.since += 1;
                None
            }
            known => {
                let since = known.map_or(0, |kind| kind.since);
                self.kinds.insert(
                    name,
                    Kind {
                        logged: now,
                        since: 0,
                    },
                );
                Some(since)
            }
        }
    }
}

fn log(name: &str, text: &str, since: u64) {
    match since {
        0 => warn!("{name}: {text}"),
        _ => warn!("{name}: {text} ({since} more since the last line)"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_has_a_line_an_interval_that_counts_the_rest() {
        let mut log = FaultLog::default();
        let start = Instant::now();
        assert_eq!(log.due("a", start), Some(0));
        assert_eq!(log.due("a", start), None);
        assert_eq!(log.due("b", start), Some(0));
        assert_eq!(log.due("a", start + INTERVAL / 2), None);
        assert_eq!(log.due("a", start + INTERVAL), Some(2));
        assert_eq!(log.due("a", start + 2 * INTERVAL), Some(0));
    }
}
