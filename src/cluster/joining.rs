//! Which core points belong together.

use std::ops::Range;

use multiversion::multiversion;

use super::ClusterParameters;
use super::density::Density;
use super::returns::Returns;
use super::runs::{Run, Runs};
use super::window::{Cone, Windows};
use crate::cloud::{CAPACITY, MAX_LAYERS};
use crate::marks::marked;
use crate::partition::Partition;

/// Joins core points that are neighbours. Its buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct Joiner {
    pub(super) runs: Runs,
    /// Runs that belong together, by their numbers.
    pub(super) partition: Partition,
    /// Points that are looked at closer, for a moment.
    marks: Box<[bool; CAPACITY]>,
}

/// What is known of a revolution's core points before they are joined.
#[derive(Clone, Copy)]
pub(super) struct Core<'a> {
    pub(super) parameters: &'a ClusterParameters,
    pub(super) windows: &'a Windows,
    /// Nothing but core points is looked at.
    pub(super) returns: Returns<'a>,
}

/// Columns before a run in which another run of its layer often ends that is its neighbour.
const GAP: usize = 4;

/// Points may be so much closer to each other, for rounding, than their ranges differ.
const ROUNDING_M: f32 = 1e-3;

impl Joiner {
    pub(super) fn new() -> Self {
        Self {
            runs: Runs::new(),
            partition: Partition::default(),
            marks: Box::new([false; CAPACITY]),
        }
    }

    /// Joins core points that are neighbours: first along the layers, over small gaps, then along
    /// the columns, then run by run with the runs of the same layer and of those above, because
    /// neighbours see each other.
    pub(super) fn join(&mut self, core: &Core<'_>, density: &Density) {
        self.runs.find(&core.returns, density);
        self.partition.reset(self.runs.count());
        self.join_over_gaps(core);
        self.join_along_columns(density, core.returns.x_m.len());
        self.partition.flatten();
        self.runs.note_alike(self.partition.parents());
        for layer in 0..MAX_LAYERS {
            self.partition.flatten();
            for place in 0..self.runs.of_layer(layer).len() {
                self.join_run(layer, place, core);
            }
        }
    }

    /// Joins each run with another one of its layer that was there shortly before.
    fn join_over_gaps(&mut self, core: &Core<'_>) {
        let numbers = self.runs.numbers(core.returns.x_m.len());
        for (layer, run) in self.runs.iter() {
            let column = run.columns().start;
            let first = column * MAX_LAYERS + layer;
            for apart in 2..=core.windows.clipped(GAP).min(column) {
                let before = first - apart * MAX_LAYERS;
                let other = numbers[before];
                if other != Runs::NONE && core.returns.are_neighbours(before, first) {
                    self.partition.join(u32::from(other), u32::from(run.number));
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

    /// Joins a run, by its layer and its place there, with all others that any of its points has
    /// a neighbour in. Its nearest point reaches farthest.
    fn join_run(&mut self, layer: usize, place: usize, core: &Core<'_>) {
        let run = &self.runs.of_layer(layer)[place];
        let own = u32::from(run.number);
        let eps_near_m = core.parameters.eps_m(run.nearest_m());
        let cone = Cone::around(run.nearest_m(), eps_near_m);
        let eps_far_m = core.parameters.eps_m(run.farthest_m());
        let eps_squared = eps_far_m * eps_far_m;
        let ranges_m =
            run.nearest_m() - eps_far_m - ROUNDING_M..run.farthest_m() + eps_far_m + ROUNDING_M;
        let mut set = self.partition.find(own);
        let (layers, reach) = core.windows.extent(layer, cone);
        for stretch in core.windows.around(&run.columns(), reach) {
            for other in layer..layers.end {
                let runs = self.runs.of_layer(other);
                let mut at = self.runs.first_behind(stretch.start, other);
                if other == layer {
                    // Those before it have seen it.
                    at = at.max(place + 1);
                }
                while at < runs.len() && runs[at].columns().start < stretch.end {
                    let candidate = &runs[at];
                    at += 1;
                    if !candidate.is_between(&ranges_m) {
                        continue;
                    }
                    let number = u32::from(candidate.number);
                    if self.partition.parents()[number as usize] == set {
                        at = candidate.alike_until();
                    } else if run.squared_distance(candidate) <= eps_squared
                        && self.partition.find(number) != set
                        && touch((layer, run), (other, candidate), reach, core)
                    {
                        self.partition.join(own, number);
                        set = self.partition.find(own);
                    }
                }
            }
        }
    }
}

/// Whether any point of one run is a neighbour of any of another, `reach` columns off at most.
fn touch(
    (layer, run): (usize, &Run),
    (other_layer, other): (usize, &Run),
    reach: usize,
    core: &Core<'_>,
) -> bool {
    // What is short is looked at point by point.
    let (short, long) = if run.columns.len() < other.columns.len() {
        ((layer, run), (other_layer, other))
    } else {
        ((other_layer, other), (layer, run))
    };
    let (layer, run) = short;
    let (other_layer, other) = long;
    let others = other.columns();
    for near in core.windows.around(&others, reach) {
        for column in overlap(&near, &run.columns()) {
            let point = column * MAX_LAYERS + layer;
            if other.squared_distance_to(core.returns.position_m(point))
                > core.returns.eps_squared[point]
            {
                continue;
            }
            for stretch in core.windows.stretches(column, reach, reach) {
                let mut both =
                    overlap(&stretch, &others).map(|column| column * MAX_LAYERS + other_layer);
                if both.any(|other| core.returns.are_neighbours(point, other)) {
                    return true;
                }
            }
        }
    }
    false
}

/// The columns of two stretches.
fn overlap(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    a.start.max(b.start)..a.end.min(b.end)
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
