//! Which core points belong together.

use super::rows::{Address, Rows};
use super::runs::{Core, Runs};
use super::sets::Sets;
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
            for before in (number.saturating_sub(BEFORE)..number).rev() {
                let (end, begin) = (runs[before].last(), run.first());
                if end.layer == begin.layer && core.are_neighbours(end, begin) {
                    self.partition.join(before as u32, number as u32);
                    break;
                }
            }
        }
    }

    /// Joins the runs that have neighbours in one column of layers that follow each other.
    fn join_along_columns(&mut self, rows: &Rows) {
        let of_points = self.runs.of_points(rows.points());
        for (number, run) in self.runs.all().iter().enumerate() {
            let Address { layer, mut place } = run.first();
            let row = rows.of(layer);
            while place <= run.last().place {
                let above = of_points.get(rows.point(Address { layer, place }) + 1);
                let above = above.filter(|above| row.meets_above(place) && **above != Runs::NONE);
                place = match above {
                    None => place + 1,
                    Some(above) => {
                        self.partition.join(number as u32, u32::from(*above));
                        // All that the run above goes on beside is joined with it now.
                        let Address {
                            layer: above,
                            place,
                        } = self.runs.all()[usize::from(*above)].last();
                        rows.first_behind(layer, rows.of(above).column(place))
                    }
                };
            }
        }
    }
}
