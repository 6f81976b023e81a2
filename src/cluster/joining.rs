//! Which core points belong together.

use std::ops::Range;

use super::rows::Rows;
use super::runs::{Core, Runs};
use super::sets::Sets;
use crate::cloud::MAX_LAYERS;
use crate::partition::Partition;

/// Joins core points that are neighbours. Its buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct Joiner {
    pub(super) runs: Runs,
    /// Runs that belong together, by their numbers.
    pub(super) partition: Partition,
    sets: Sets,
}

/// Runs before another one of a layer that are compared with it: what stands before a wall parts it.
const BEFORE: usize = 2;

impl Joiner {
    pub(super) fn new() -> Self {
        Self {
            runs: Runs::new(),
            partition: Partition::default(),
            sets: Sets::default(),
        }
    }

    /// Joins core points that are neighbours: first along the rows and the columns, and then what
    /// is near of the sets that came of it.
    pub(super) fn join(&mut self, core: &Core<'_>) {
        self.runs.find(core.rows, core.windows);
        self.partition.reset(self.runs.all().len());
        self.join_along_rows(core);
        self.join_along_columns(core.rows);
        self.partition.flatten();
        self.sets
            .gather(self.runs.all(), self.partition.parents(), core.parameters);
        self.sets.join(self.runs.all(), &mut self.partition, core);
    }

    /// Joins each run with those shortly before it in its row of which the end is near its begin.
    fn join_along_rows(&mut self, core: &Core<'_>) {
        let runs = self.runs.all();
        for (number, run) in runs.iter().enumerate() {
            let (row, begin) = (core.rows.of(run.layer()), run.places().start);
            for before in (number.saturating_sub(BEFORE)..number).rev() {
                let end = runs[before].places().end - 1;
                if runs[before].layer() == run.layer()
                    && row.are_neighbours(end, begin)
                    && core
                        .windows
                        .are_in_reach(row.column(end), row.column(begin))
                {
                    self.partition.join(before as u32, number as u32);
                    break;
                }
            }
        }
    }

    /// Joins the runs that have neighbours in one column of layers that follow each other.
    fn join_along_columns(&mut self, rows: &Rows) {
        let (runs, of_points) = (self.runs.all(), self.runs.of_points(rows.points()));
        for (number, run) in runs.iter().enumerate() {
            let (layer, row) = (run.layer(), rows.of(run.layer()));
            let Range { mut start, end } = run.places();
            while start < end {
                if !row.meets_above(start) {
                    start += 1;
                    continue;
                }
                let above = of_points[row.column(start) * MAX_LAYERS + layer + 1];
                start += 1;
                if above != Runs::NONE {
                    self.partition.join(number as u32, u32::from(above));
                    // As far as the run above goes on, it has the returns above all of them.
                    let above = &runs[usize::from(above)];
                    let last = rows.of(above.layer()).column(above.places().end - 1);
                    start = rows.first_behind(layer, last);
                }
            }
        }
    }
}
