//! Core points of a layer that follow each other: a surface is a few runs, not many points.

use std::ops::Range;

use multiversion::multiversion;

use super::density::Density;
use super::returns::Returns;
use crate::cloud::{CAPACITY, MAX_COLUMNS, MAX_LAYERS};
use crate::float::{greatest, least};

/// Core points of one layer in columns that follow each other, each a neighbour of the one before.
#[derive(Debug, Clone)]
pub(super) struct Run {
    /// Counts the runs of all layers, in the order in which the array has their first points. There
    /// are no more than points, so that 16 bits hold it.
    pub(super) number: u16,
    pub(super) columns: Range<u16>,
    /// The place in its layer where the runs end that follow it and are known to belong to its set.
    alike_until: u16,
    /// Least x, y, z and range of its points.
    pub(super) low_m: Corner,
    /// The greatest ones.
    pub(super) high_m: Corner,
}

/// A corner of a box around points: x, y, z, and range.
type Corner = [f32; AXES];

const AXES: usize = 4;
/// The place of the range in a corner.
const RANGE: usize = 3;

/// Columns for which it is noted together how many runs begin before them.
const BLOCK: usize = 8;

/// No run of any point has the number of none.
const _: () = assert!(CAPACITY < Runs::NONE as usize);

impl Run {
    /// Range of its nearest point.
    pub(super) fn nearest_m(&self) -> f32 {
        self.low_m[RANGE]
    }

    /// Range of its farthest point.
    pub(super) fn farthest_m(&self) -> f32 {
        self.high_m[RANGE]
    }

    /// Whether any of its points may have a range between two.
    #[inline(always)]
    pub(super) fn is_between(&self, ranges_m: &Range<f32>) -> bool {
        self.nearest_m() <= ranges_m.end && self.farthest_m() >= ranges_m.start
    }

    /// The place in its layer where the runs end that follow it and are known to belong to its set.
    pub(super) fn alike_until(&self) -> usize {
        usize::from(self.alike_until)
    }

    /// Its columns.
    pub(super) fn columns(&self) -> Range<usize> {
        usize::from(self.columns.start)..usize::from(self.columns.end)
    }

    /// Square of the distance between its box and a point.
    #[inline(always)]
    pub(super) fn squared_distance_to(&self, position_m: [f32; 3]) -> f32 {
        let mut squared = 0.0;
        for (axis, metres) in position_m.into_iter().enumerate() {
            let outside = greatest(self.low_m[axis] - metres, metres - self.high_m[axis]);
            let apart = greatest(outside, 0.0);
            squared += apart * apart;
        }
        squared
    }

    /// Square of the distance between its box and that of another run.
    #[inline(always)]
    pub(super) fn squared_distance(&self, other: &Run) -> f32 {
        let [x, y, z, _] = [0, 1, 2, RANGE].map(|axis: usize| {
            let below = self.low_m[axis] - other.high_m[axis];
            let above = other.low_m[axis] - self.high_m[axis];
            let apart = greatest(greatest(below, above), 0.0);
            apart * apart
        });
        x + y + z
    }
}

/// The runs of every layer, in the order of their columns. Its buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct Runs {
    layers: [Vec<Run>; MAX_LAYERS],
    count: u16,
    /// How many runs of each layer begin before the first of so many columns, and so on.
    begun: [[u16; MAX_LAYERS]; MAX_COLUMNS.div_ceil(BLOCK)],
    /// The number of every point's run, or [`Runs::NONE`].
    of: Box<[u16; CAPACITY]>,
    /// Where runs begin, or have just ended.
    edges: Box<[bool; CAPACITY]>,
    /// The runs that go on, and the corners of what they have so far.
    open: [u16; MAX_LAYERS],
    low_m: [[f32; MAX_LAYERS]; AXES],
    high_m: [[f32; MAX_LAYERS]; AXES],
}

impl Runs {
    /// The number of no run.
    pub(super) const NONE: u16 = u16::MAX;

    pub(super) fn new() -> Self {
        Self {
            layers: Default::default(),
            count: 0,
            begun: [[0; MAX_LAYERS]; MAX_COLUMNS.div_ceil(BLOCK)],
            of: Box::new([Self::NONE; CAPACITY]),
            edges: Box::new([false; CAPACITY]),
            open: [Self::NONE; MAX_LAYERS],
            low_m: Default::default(),
            high_m: Default::default(),
        }
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        usize::from(self.count)
    }

    /// The runs of a layer.
    pub(super) fn of_layer(&self, layer: usize) -> &[Run] {
        &self.layers[layer]
    }

    /// The place of the first run of a layer that ends behind the beginning of a column.
    pub(super) fn first_behind(&self, column: usize, layer: usize) -> usize {
        let runs = &self.layers[layer];
        let begun = usize::from(self.begun[column / BLOCK][layer]);
        let mut place = begun.saturating_sub(1);
        while place < runs.len() && runs[place].columns().end <= column {
            place += 1;
        }
        place
    }

    /// All of them, with their layers.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, &Run)> {
        let layers = self.layers.iter().enumerate();
        layers.flat_map(|(layer, runs)| runs.iter().map(move |run| (layer, run)))
    }

    /// Takes note of which runs follow others of the same set, given the set of each.
    pub(super) fn note_alike(&mut self, sets: &[u32]) {
        for runs in &mut self.layers {
            let set_of = |run: &Run| sets[usize::from(run.number)];
            let mut next = (u32::MAX, 0);
            for (place, run) in runs.iter_mut().enumerate().rev() {
                let set = set_of(run);
                if set != next.0 {
                    next = (set, place as u16 + 1);
                }
                run.alike_until = next.1;
            }
        }
    }

    /// Gives a point the run of another one.
    pub(super) fn adopt(&mut self, point: usize, other: usize) {
        self.of[point] = self.of[other];
    }

    /// The number of every point's run, or [`Runs::NONE`].
    pub(super) fn numbers(&self, len: usize) -> &[u16] {
        &self.of[..len]
    }

    /// Finds the runs anew.
    pub(super) fn find(&mut self, returns: &Returns<'_>, density: &Density) {
        let len = returns.x_m.len();
        self.layers.iter_mut().for_each(Vec::clear);
        self.count = 0;
        self.open = [Self::NONE; MAX_LAYERS];
        let is_core = &density.is_core[..len];
        mark_edges(is_core, &density.follows[..len], &mut self.edges[..len]);
        let is_core = is_core.as_chunks::<MAX_LAYERS>().0.iter();
        for (column, is_core) in is_core.enumerate() {
            if column % BLOCK == 0 {
                let begun = &mut self.begun[column / BLOCK];
                *begun = self.layers.each_ref().map(|runs| runs.len() as u16);
            }
            let edges = &self.edges.as_chunks().0[column];
            // A byte for each layer, the first one lowest; those that were met are taken out.
            let mut edges = u128::from_le_bytes(edges.map(u8::from));
            while edges != 0 {
                let layer = edges.trailing_zeros() as usize / 8;
                edges &= edges - 1;
                self.end(layer, column);
                if is_core[layer] {
                    self.begin(layer, column);
                }
            }
            extend(
                [&returns.x_m, &returns.y_m, &returns.z_m, &returns.range_m]
                    .map(|metres| &metres.as_chunks().0[column]),
                (&mut self.low_m, &mut self.high_m),
            );
            let of: &mut [u16; MAX_LAYERS] = &mut self.of.as_chunks_mut().0[column];
            *of = self.open;
        }
        for layer in 0..MAX_LAYERS {
            self.end(layer, len / MAX_LAYERS);
        }
    }

    /// Begins a run.
    fn begin(&mut self, layer: usize, column: usize) {
        self.open[layer] = self.count;
        let column = column as u16;
        self.layers[layer].push(Run {
            number: self.count,
            columns: column..column,
            alike_until: 0,
            low_m: Corner::default(),
            high_m: Corner::default(),
        });
        self.count += 1;
        for axis in 0..AXES {
            self.low_m[axis][layer] = f32::INFINITY;
            self.high_m[axis][layer] = f32::NEG_INFINITY;
        }
    }

    /// Ends the run that goes on in a layer, if there is one, before a column.
    fn end(&mut self, layer: usize, column: usize) {
        if self.open[layer] != Self::NONE
            && let Some(run) = self.layers[layer].last_mut()
        {
            run.columns.end = column as u16;
            run.low_m = [0, 1, 2, 3].map(|axis: usize| self.low_m[axis][layer]);
            run.high_m = [0, 1, 2, 3].map(|axis: usize| self.high_m[axis][layer]);
            self.open[layer] = Self::NONE;
        }
    }
}

/// Marks the columns where a stretch of core points that follow each other begins, and those
/// behind where one ends.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn mark_edges(is_core: &[bool], follows: &[bool], edges: &mut [bool]) {
    if is_core.len() < MAX_LAYERS {
        return;
    }
    edges[..MAX_LAYERS].copy_from_slice(&is_core[..MAX_LAYERS]);
    let pairs = is_core.len() - MAX_LAYERS;
    let (before, is_core) = (&is_core[..pairs], &is_core[MAX_LAYERS..]);
    let (follows, edges) = (&follows[MAX_LAYERS..], &mut edges[MAX_LAYERS..]);
    let (is_core, follows, edges) = (&is_core[..pairs], &follows[..pairs], &mut edges[..pairs]);
    for pair in 0..pairs {
        edges[pair] =
            (before[pair] | is_core[pair]) & !(before[pair] & is_core[pair] & follows[pair]);
    }
}

/// Makes the boxes of all layers hold the points of a column.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn extend(
    column: [&[f32; MAX_LAYERS]; AXES],
    (low_m, high_m): (
        &mut [[f32; MAX_LAYERS]; AXES],
        &mut [[f32; MAX_LAYERS]; AXES],
    ),
) {
    for axis in 0..AXES {
        for layer in 0..MAX_LAYERS {
            low_m[axis][layer] = least(low_m[axis][layer], column[axis][layer]);
            high_m[axis][layer] = greatest(high_m[axis][layer], column[axis][layer]);
        }
    }
}
