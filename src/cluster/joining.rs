//! Which core points belong together.

use multiversion::multiversion;

use super::density::Density;
use super::runs::{Core, Runs};
use super::sets::Sets;
use crate::cloud::{CAPACITY, MAX_LAYERS};
use crate::marks::marked;
use crate::partition::Partition;

/// Joins core points that are neighbours. Its buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct Joiner {
    pub(super) runs: Runs,
    /// Runs that belong together, by their numbers.
    pub(super) partition: Partition,
    sets: Sets,
    /// Points that are looked at closer, for a moment.
    marks: Box<[bool; CAPACITY]>,
}

/// Columns before a run in which another run of its layer often ends that is its neighbour.
const GAP: usize = 8;

impl Joiner {
    pub(super) fn new() -> Self {
        Self {
            runs: Runs::new(),
            partition: Partition::default(),
            sets: Sets::default(),
            marks: Box::new([false; CAPACITY]),
        }
    }

    /// Joins core points that are neighbours: first along the layers, over small gaps, and along
    /// the columns, and then what is near of the sets that came of it.
    pub(super) fn join(&mut self, core: &Core<'_>, density: &Density) {
        self.runs.find(&core.returns, density);
        self.partition.reset(self.runs.all().len());
        self.join_over_gaps(core);
        self.join_along_columns(density, core.returns.x_m.len());
        self.partition.flatten();
        self.sets
            .gather(self.runs.all(), self.partition.parents(), core.parameters);
        self.sets.join(self.runs.all(), &mut self.partition, core);
    }

    /// Joins each run with another one of its layer that was there shortly before.
    fn join_over_gaps(&mut self, core: &Core<'_>) {
        let numbers = self.runs.numbers(core.returns.x_m.len());
        for (number, run) in self.runs.all().iter().enumerate() {
            let column = run.columns().start;
            let first = run.point(column);
            for apart in 1..=core.windows.clipped(GAP).min(column) {
                let before = first - apart * MAX_LAYERS;
                let other = numbers[before];
                if other != Runs::NONE && core.returns.are_neighbours(before, first) {
                    self.partition.join(u32::from(other), number as u32);
                    break;
                }
            }
        }
    }

    /// Joins the runs that have neighbours in one column of two layers that follow each other.
    fn join_along_columns(&mut self, density: &Density, len: usize) {
        let numbers = self.runs.numbers(len);
        let marks = &mut self.marks[..len];
        mark_meetings(&density.meets[..len], numbers, marks);
        for point in marked(marks) {
            let [a, b] = [numbers[point], numbers[point + 1]].map(u32::from);
            self.partition.join(a, b);
        }
    }
}

/// Marks the core points of which the next one of the array is a core point and a neighbour, where
/// it is not the same two runs as in the column before.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn mark_meetings(meets: &[bool], run: &[u16], marks: &mut [bool]) {
    marks.fill(false);
    let pairs = marks.len().saturating_sub(1);
    let (own, next) = (&run[..pairs], &run[run.len() - pairs..]);
    let (meets, marks) = (&meets[..pairs], &mut marks[..pairs]);
    for pair in 0..pairs {
        let are_core = (own[pair] != Runs::NONE) & (next[pair] != Runs::NONE);
        marks[pair] = meets[pair] & are_core;
    }
    let followed = pairs.saturating_sub(MAX_LAYERS);
    let (own, own_before) = (&own[pairs - followed..], &own[..followed]);
    let (next, next_before) = (&next[pairs - followed..], &next[..followed]);
    let (met_before, marks) = (&meets[..followed], &mut marks[pairs - followed..]);
    for pair in 0..followed {
        let are_same = (own[pair] == own_before[pair]) & (next[pair] == next_before[pair]);
        marks[pair] &= !(are_same & met_before[pair]);
    }
}
