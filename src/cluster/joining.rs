//! Which core points belong together.

use super::ClusterParameters;
use super::row::{self, Row};
use super::runs::{Run, Runs};
use super::window::{Cone, Windows};
use crate::cloud::{MAX_COLUMNS, MAX_LAYERS};
use crate::marks::marked;
use crate::partition::Partition;

/// Joins core points that are neighbours. Its buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct Joiner {
    pub(super) runs: Runs,
    /// Runs that belong together, by their numbers.
    pub(super) partition: Partition,
    /// Columns and runs that are looked at closer, for a moment.
    column_marks: Box<[bool; MAX_COLUMNS]>,
    run_marks: Box<[u32; MAX_COLUMNS]>,
}

/// What is known of a revolution's points before they are joined.
#[derive(Clone, Copy)]
pub(super) struct Points<'a> {
    pub(super) parameters: &'a ClusterParameters,
    pub(super) windows: &'a Windows,
    pub(super) columns: usize,
}

impl Points<'_> {
    /// Whether the point in a column is a neighbour of another one in its layer, and in its
    /// window.
    fn sees(&self, row: &Row, layer: usize, column: usize, other: usize) -> bool {
        let apart = column.abs_diff(other);
        let centre = row.centre(layer, column, self.parameters);
        self.windows.clipped(apart) == apart && row.is_neighbour(other, &centre)
    }
}

impl Joiner {
    pub(super) fn new() -> Self {
        Self {
            runs: Runs::default(),
            partition: Partition::default(),
            column_marks: Box::new([false; MAX_COLUMNS]),
            run_marks: Box::new([0; MAX_COLUMNS]),
        }
    }

    /// Joins core points that are neighbours: first along the layers, then along the columns,
    /// then run by run with the runs of the same layer and of those above, because neighbours
    /// see each other.
    pub(super) fn join(&mut self, rows: &mut [Row], points: Points<'_>) {
        let goes_on = |row: &Row, layer, last, next| points.sees(row, layer, last, next);
        self.runs
            .find(points.columns, rows, &mut self.column_marks[..], goes_on);
        self.partition.reset(self.runs.count());
        self.join_along_columns(rows, points.columns);
        for layer in 0..MAX_LAYERS {
            self.partition.flatten();
            for run in self.runs.of(layer).iter() {
                join_run(
                    (layer, run),
                    &self.runs,
                    &mut self.partition,
                    &mut self.run_marks,
                    rows,
                    points,
                );
            }
        }
    }

    /// Joins the runs that have neighbours in one column of two layers that follow each other.
    fn join_along_columns(&mut self, rows: &[Row], columns: usize) {
        for pair in rows.windows(2) {
            row::mark_meetings(&pair[0], &pair[1], columns, &mut self.column_marks[..]);
            for column in marked(&self.column_marks[..columns]) {
                let [a, b] = [0, 1].map(|row: usize| u32::from(pair[row].run_of[column]));
                self.partition.join(a, b);
            }
        }
    }
}

/// Joins a run with all others that any of its points has a neighbour in. Its nearest point
/// reaches farthest.
fn join_run(
    (layer, run): (usize, &Run),
    runs: &Runs,
    partition: &mut Partition,
    marks: &mut [u32; MAX_COLUMNS],
    rows: &[Row],
    points: Points<'_>,
) {
    let eps_near_m = points.parameters.eps_m(run.low_m);
    let cone = Cone::around(run.low_m, eps_near_m);
    let eps_far_m = points.parameters.eps_m(run.high_m);
    for other in layer..MAX_LAYERS {
        let Some(reach) = points.windows.reach(layer, other, cone) else {
            break;
        };
        let stretches = points.windows.around(&run.columns, reach);
        for stretch in stretches.into_iter().filter(|stretch| !stretch.is_empty()) {
            let own = (run, partition.find(run.number));
            // Those before it in its layer have seen it.
            let near = runs.of(other).near(
                &stretch,
                own,
                run.number + 1,
                eps_far_m,
                partition.parents(),
                marks,
            );
            for candidate in near {
                if partition.find(run.number) != partition.find(candidate.number)
                    && touch(rows, (layer, run), (other, candidate), reach, points)
                {
                    partition.join(run.number, candidate.number);
                }
            }
        }
    }
}

/// Whether any core point of one run is a neighbour of any of the other, `reach` columns off at
/// most.
fn touch(
    rows: &[Row],
    (layer, run): (usize, &Run),
    (other_layer, other): (usize, &Run),
    reach: usize,
    points: Points<'_>,
) -> bool {
    let (own, row) = (&rows[layer], &rows[other_layer]);
    let near = points.windows.around(&other.columns, reach);
    let near = near
        .into_iter()
        .flat_map(|stretch| stretch.start.max(run.columns.start)..stretch.end.min(run.columns.end));
    near.filter(|column| own.core[*column]).any(|column| {
        let centre = own.centre(layer, column, points.parameters);
        let stretches = points.windows.stretches(column, reach, reach);
        stretches.into_iter().any(|stretch| {
            let start = stretch.start.max(other.columns.start);
            let both = start..stretch.end.min(other.columns.end).max(start);
            row::count(row, both, &centre) > 0
        })
    })
}
