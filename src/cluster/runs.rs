//! Core points of a layer that follow each other: a surface is a few runs, not many points.

use std::ops::Range;

use multiversion::multiversion;

use super::row::{self, Row};
use crate::cloud::{MAX_COLUMNS, MAX_LAYERS};
use crate::float::{greatest, least};
use crate::marks::marked;

/// Core points of one layer, each a neighbour of the one before.
#[derive(Debug, Clone)]
pub(super) struct Run {
    /// Counts the runs of all layers. There are no more than points, so that 16 bits hold it.
    pub(super) number: u32,
    /// From the first to behind the last; points between that are no core points do not count.
    pub(super) columns: Range<usize>,
    /// How many core points it has.
    pub(super) points: u32,
    /// Least range of a point.
    pub(super) low_m: f32,
    /// Greatest range of a point.
    pub(super) high_m: f32,
    /// The box that holds all points.
    low: [f32; 3],
    high: [f32; 3],
}

impl Run {
    /// A run of no point yet.
    fn begin(number: u32, column: usize) -> Self {
        Self {
            number,
            columns: column..column,
            points: 0,
            low_m: f32::INFINITY,
            high_m: 0.0,
            low: [f32::INFINITY; 3],
            high: [f32::NEG_INFINITY; 3],
        }
    }

    /// Adds a stretch of columns, all of them core points.
    fn extend(&mut self, stretch: Range<usize>, row: &mut Row) {
        let (at_m, range_m) = row.points(stretch.clone());
        for range_m in range_m {
            self.low_m = least(self.low_m, *range_m);
            self.high_m = greatest(self.high_m, *range_m);
        }
        for (axis, metres) in at_m.into_iter().enumerate() {
            for metres in metres {
                self.low[axis] = least(self.low[axis], *metres);
                self.high[axis] = greatest(self.high[axis], *metres);
            }
        }
        for run in &mut row.run_of[stretch.clone()] {
            *run = self.number as u16;
        }
        self.points += stretch.len() as u32;
        self.columns.end = stretch.end;
    }
}

/// The runs of a layer in the order of their columns.
#[derive(Debug, Clone)]
pub(super) struct LayerRuns {
    runs: Vec<Run>,
    /// Their boxes: the three least coordinates, then the three greatest.
    bounds_m: [Vec<f32>; 6],
    /// The number of the first.
    first: u32,
    /// How many runs begin in or before each column.
    begun: Box<[u16; MAX_COLUMNS]>,
}

impl LayerRuns {
    fn new() -> Self {
        Self {
            runs: vec![],
            bounds_m: Default::default(),
            first: 0,
            begun: Box::new([0; MAX_COLUMNS]),
        }
    }

    /// All of them.
    pub(super) fn iter(&self) -> impl Iterator<Item = &Run> {
        self.runs.iter()
    }

    /// Finds the runs anew: stretches of core points that follow each other, and over a gap where
    /// `goes_on` says of the last column before it and the first behind it that they are
    /// neighbours. Returns the number of the next layer's first run.
    fn find(
        &mut self,
        first: u32,
        columns: usize,
        row: &mut Row,
        marks: &mut [bool],
        goes_on: impl Fn(&Row, usize, usize) -> bool,
    ) -> u32 {
        self.runs.clear();
        self.first = first;
        row.run_of[..columns].fill(Row::NO_RUN);
        row::mark_edges(row, columns, marks);
        let mut edges = marked(&marks[..columns]).chain([columns]).peekable();
        let mut noted = 0;
        while let Some(begin) = edges.next() {
            if begin == columns || !row.core[begin] {
                continue;
            }
            let end = edges.peek().copied().unwrap_or(columns);
            self.note_begun(noted..begin);
            let last = self.runs.last_mut();
            match last.filter(|last| goes_on(row, last.columns.end - 1, begin)) {
                Some(last) => last.extend(begin..end, row),
                None => {
                    let mut run = Run::begin(first + self.runs.len() as u32, begin);
                    run.extend(begin..end, row);
                    self.runs.push(run);
                }
            }
            noted = begin;
        }
        self.note_begun(noted..columns);
        for (corner, metres) in self.bounds_m.iter_mut().enumerate() {
            metres.clear();
            metres.extend(self.runs.iter().map(|run| match corner {
                0..3 => run.low[corner],
                _ => run.high[corner - 3],
            }));
        }
        first + self.runs.len() as u32
    }

    /// Notes for a stretch of columns how many runs begin in or before them.
    fn note_begun(&mut self, stretch: Range<usize>) {
        let runs = self.runs.len() as u16;
        for begun in &mut self.begun[stretch] {
            *begun = runs;
        }
    }

    /// The runs that reach into a stretch of columns, by their places.
    fn within(&self, stretch: &Range<usize>) -> Range<usize> {
        if stretch.is_empty() {
            return 0..0;
        }
        let mut first = self.begun[stretch.start] as usize;
        if first > 0 && self.runs[first - 1].columns.end > stretch.start {
            first -= 1;
        }
        first..self.begun[stretch.end - 1] as usize
    }

    /// The runs in a stretch of columns, from a number on, whose boxes are closer than `eps_m` to
    /// the box of a run, and whose sets, by number, are not known to be that of the run.
    pub(super) fn near<'a>(
        &'a self,
        stretch: &Range<usize>,
        (run, set): (&Run, u32),
        from: u32,
        eps_m: f32,
        sets: &[u32],
        marks: &'a mut [u32],
    ) -> impl Iterator<Item = &'a Run> + use<'a> {
        let mut within = self.within(stretch);
        let from = from.saturating_sub(self.first) as usize;
        within.start = within.start.max(from).min(within.end);
        let marks = &mut marks[..within.len()];
        let sets = &sets[self.first as usize..][within.clone()];
        mark_near(self, within.clone(), (run, set), eps_m * eps_m, sets, marks);
        let marked = self.runs[within].iter().zip(marks);
        marked.filter(|(_, mark)| **mark != 0).map(|(run, _)| run)
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn mark_near(
    layer: &LayerRuns,
    within: Range<usize>,
    (run, set): (&Run, u32),
    eps_squared: f32,
    sets: &[u32],
    marks: &mut [u32],
) {
    let Run { low, high, .. } = run;
    let [x_low, y_low, z_low, x_high, y_high, z_high] = &layer.bounds_m;
    let (x_low, x_high) = (
        &x_low[within.start..within.end],
        &x_high[within.start..within.end],
    );
    let (y_low, y_high) = (
        &y_low[within.start..within.end],
        &y_high[within.start..within.end],
    );
    let (z_low, z_high) = (
        &z_low[within.start..within.end],
        &z_high[within.start..within.end],
    );
    let sets = &sets[..marks.len()];
    for at in 0..marks.len() {
        let x = greatest(greatest(x_low[at] - high[0], low[0] - x_high[at]), 0.0);
        let y = greatest(greatest(y_low[at] - high[1], low[1] - y_high[at]), 0.0);
        let z = greatest(greatest(z_low[at] - high[2], low[2] - z_high[at]), 0.0);
        let is_near = x * x + y * y + z * z <= eps_squared;
        marks[at] = u32::from(is_near & (sets[at] != set));
    }
}

/// The runs of every layer.
#[derive(Debug, Clone)]
pub(super) struct Runs {
    layers: Vec<LayerRuns>,
    count: u32,
}

impl Default for Runs {
    fn default() -> Self {
        Self {
            layers: (0..MAX_LAYERS).map(|_| LayerRuns::new()).collect(),
            count: 0,
        }
    }
}

impl Runs {
    /// Finds the runs of all layers anew; `goes_on` is asked of a layer and two of its columns.
    pub(super) fn find(
        &mut self,
        columns: usize,
        rows: &mut [Row],
        marks: &mut [bool],
        goes_on: impl Fn(&Row, usize, usize, usize) -> bool,
    ) {
        self.count = 0;
        for (layer, (runs, row)) in self.layers.iter_mut().zip(rows).enumerate() {
            let goes_on = |row: &Row, last, next| goes_on(row, layer, last, next);
            self.count = runs.find(self.count, columns, row, marks, goes_on);
        }
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.count as usize
    }

    /// The runs of a layer.
    pub(super) fn of(&self, layer: usize) -> &LayerRuns {
        &self.layers[layer]
    }
}
