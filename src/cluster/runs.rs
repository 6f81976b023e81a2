//! Core points of a layer that follow each other: a surface is a few runs, not many points.

use std::ops::Range;

use multiversion::multiversion;

use super::ClusterParameters;
use super::boxes::Bounds;
use super::density::Density;
use super::returns::Returns;
use super::window::{Cone, Windows};
use crate::cloud::{CAPACITY, MAX_LAYERS};

/// What is known of a revolution's core points before they are joined.
#[derive(Clone, Copy)]
pub(super) struct Core<'a> {
    pub(super) parameters: &'a ClusterParameters,
    pub(super) windows: &'a Windows,
    /// Nothing but core points is looked at.
    pub(super) returns: Returns<'a>,
}

/// Core points of one layer in columns that follow each other, each a neighbour of the one before.
#[derive(Debug, Clone)]
pub(super) struct Run {
    layer: u8,
    columns: Range<u16>,
    /// Around its points.
    pub(super) bounds: Bounds,
}

/// No run of any point has the number of none.
const _: () = assert!(CAPACITY < Runs::NONE as usize);

impl Run {
    /// Its columns.
    pub(super) fn columns(&self) -> Range<usize> {
        usize::from(self.columns.start)..usize::from(self.columns.end)
    }

    /// Its layer.
    fn layer(&self) -> usize {
        usize::from(self.layer)
    }

    /// Its point in a column.
    pub(super) fn point(&self, column: usize) -> usize {
        column * MAX_LAYERS + self.layer()
    }

    /// Whether any of its points is a neighbour of any of another run.
    pub(super) fn touches(&self, other: &Self, core: &Core<'_>) -> bool {
        // What is short is looked at point by point.
        let (short, long) = if self.columns().len() < other.columns().len() {
            (self, other)
        } else {
            (other, self)
        };
        // Its nearest point reaches farthest.
        let nearest_m = short.bounds.nearest_m();
        let cone = Cone::around(nearest_m, core.parameters.eps_m(nearest_m));
        let (_, reach) = core.windows.extent(short.layer(), cone);
        for near in core.windows.around(&long.columns(), reach) {
            for column in overlap(&near, &short.columns()) {
                let point = short.point(column);
                let squared = long
                    .bounds
                    .squared_distance_to(core.returns.position_m(point));
                if squared > core.returns.eps_squared[point] {
                    continue;
                }
                for stretch in core.windows.stretches(column, reach, reach) {
                    let mut both = overlap(&stretch, &long.columns());
                    if both.any(|column| core.returns.are_neighbours(point, long.point(column))) {
                        return true;
                    }
                }
            }
        }
        false
    }
}

/// All runs, in the order in which the array has their first points. Its buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct Runs {
    /// There are no more than points, so that 16 bits hold the number of one.
    runs: Vec<Run>,
    /// The number of every point's run, or [`Runs::NONE`].
    of: Box<[u16; CAPACITY]>,
    /// Where runs begin, or have just ended.
    edges: Box<[bool; CAPACITY]>,
    /// The runs that go on.
    open: [u16; MAX_LAYERS],
}

impl Runs {
    /// The number of no run.
    pub(super) const NONE: u16 = u16::MAX;

    pub(super) fn new() -> Self {
        Self {
            runs: vec![],
            of: Box::new([Self::NONE; CAPACITY]),
            edges: Box::new([false; CAPACITY]),
            open: [Self::NONE; MAX_LAYERS],
        }
    }

    /// All of them, by their numbers.
    pub(super) fn all(&self) -> &[Run] {
        &self.runs
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
        self.runs.clear();
        self.open = [Self::NONE; MAX_LAYERS];
        let is_core = &density.is_core[..len];
        mark_edges(is_core, &density.follows[..len], &mut self.edges[..len]);
        let is_core = is_core.as_chunks::<MAX_LAYERS>().0.iter();
        for (column, is_core) in is_core.enumerate() {
            let edges = &self.edges.as_chunks().0[column];
            // A byte for each layer, the first one lowest; those that were met are taken out.
            let mut edges = u128::from_le_bytes(edges.map(u8::from));
            while edges != 0 {
                let layer = edges.trailing_zeros() as usize / 8;
                edges &= edges - 1;
                self.end(layer, column, returns);
                if is_core[layer] {
                    self.begin(layer, column);
                }
            }
            let of: &mut [u16; MAX_LAYERS] = &mut self.of.as_chunks_mut().0[column];
            *of = self.open;
        }
        for layer in 0..MAX_LAYERS {
            self.end(layer, len / MAX_LAYERS, returns);
        }
    }

    /// Begins a run.
    fn begin(&mut self, layer: usize, column: usize) {
        self.open[layer] = self.runs.len() as u16;
        let column = column as u16;
        self.runs.push(Run {
            layer: layer as u8,
            columns: column..column,
            // Found when it ends.
            bounds: Bounds::NONE,
        });
    }

    /// Ends the run that goes on in a layer, if there is one, before a column.
    fn end(&mut self, layer: usize, column: usize, returns: &Returns<'_>) {
        let number = std::mem::replace(&mut self.open[layer], Self::NONE);
        if let Some(run) = self.runs.get_mut(usize::from(number)) {
            run.columns.end = column as u16;
            let mut bounds = Bounds::NONE;
            for column in run.columns() {
                let point = run.point(column);
                let [x, y, z] = returns.position_m(point);
                bounds.hold([x, y, z, returns.range_m[point]]);
            }
            run.bounds = bounds;
        }
    }
}

/// The columns of two stretches.
fn overlap(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    a.start.max(b.start)..a.end.min(b.end)
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
