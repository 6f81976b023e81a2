//! What a recording showed, in a few lines, for somebody who asked for no file.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Result;

use crate::pipeline::RevolutionReport;
use crate::tally::Tally;
use crate::time::Time;
use crate::track::{Class, Object};

/// What was seen so far.
#[derive(Debug)]
pub(super) struct Summary {
    begun: Instant,
    revolutions: u32,
    first: Option<Time>,
    /// Objects in all lists together.
    listed: usize,
    /// The latest class of every object.
    classes: BTreeMap<u32, Class>,
    /// Objects of the busiest revolution, and when it was.
    busiest: Option<(usize, RevolutionReport)>,
}

impl Summary {
    pub(super) fn new() -> Self {
        Self {
            begun: Instant::now(),
            revolutions: 0,
            first: None,
            listed: 0,
            classes: BTreeMap::new(),
            busiest: None,
        }
    }

    /// Takes a revolution's objects.
    pub(super) fn take(&mut self, report: &RevolutionReport, objects: &[Object]) {
        self.revolutions += 1;
        self.first.get_or_insert(report.time);
        self.listed += objects.len();
        let classes = objects.iter().map(|object| (object.id, object.class));
        self.classes.extend(classes);
        if self.busiest.is_none_or(|(most, _)| objects.len() > most) {
            self.busiest = Some((objects.len(), *report));
        }
    }

    /// Says what was seen, and what to do next with the file.
    pub(super) fn print(&self, path: &Path) -> Result<()> {
        let (Some(first), Some((most, busiest))) = (self.first, &self.busiest) else {
            return Ok(());
        };
        let mut classes = Tally::default();
        for class in self.classes.values() {
            classes.count(class.name());
        }
        let revolutions = f64::from(self.revolutions);
        say!(
            "{} objects: {classes}; {:.1} at a time, most in revolution {} after {:.1} s: {most}",
            self.classes.len(),
            self.listed as f64 / revolutions,
            busiest.number,
            (busiest.time - first).seconds(),
        );
        let took: Duration = self.begun.elapsed();
        say!(
            "{:.2} ms a revolution",
            1000.0 * took.as_secs_f64() / revolutions
        );
        say!(
            "see it:  kreisel view {path}\nkeep it: --objects OUT.jsonl, --grid OUT.npz, --output OUT.rec",
            path = path.display()
        );
        Ok(())
    }
}
