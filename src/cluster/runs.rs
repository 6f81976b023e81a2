//! Core points of a layer that follow each other: a surface is a few runs, not many points.

use std::ops::Range;

use multiversion::multiversion;

use super::ClusterParameters;
use super::boxes::Bounds;
use super::rows::{Address, LENGTH, Row, Rows};
use super::search::Centre;
use super::window::{Cone, Windows};
use crate::cloud::{CAPACITY, MAX_COLUMNS, MAX_LAYERS};
use crate::float::least;
use crate::marks::marked;

/// What is known of a revolution's core points before they are joined.
#[derive(Clone, Copy)]
pub(super) struct Core<'a> {
    pub(super) parameters: &'a ClusterParameters,
    pub(super) windows: &'a Windows,
    /// Nothing but core points is looked at.
    pub(super) rows: &'a Rows,
}

/// Core points of one layer that follow each other, each a neighbour of the one before.
#[derive(Debug, Clone)]
pub(super) struct Run {
    layer: u16,
    places: Range<u16>,
    /// Around its points.
    pub(super) bounds: Bounds,
}

impl Run {
    /// Its layer.
    pub(super) fn layer(&self) -> usize {
        usize::from(self.layer)
    }

    /// Its places in the row of its layer.
    pub(super) fn places(&self) -> Range<usize> {
        usize::from(self.places.start)..usize::from(self.places.end)
    }

    /// Where its first point stands.
    pub(super) fn first(&self) -> Address {
        Address {
            layer: self.layer(),
            place: usize::from(self.places.start),
        }
    }

    /// Whether any of its points is a neighbour of any of another run.
    pub(super) fn touches(&self, other: &Self, core: &Core<'_>) -> bool {
        // What is short is looked at point by point.
        let (short, long) = if self.places.len() < other.places.len() {
            (self, other)
        } else {
            (other, self)
        };
        touch(short, long, core)
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn touch(short: &Run, long: &Run, core: &Core<'_>) -> bool {
    let Core {
        parameters,
        windows,
        rows,
    } = *core;
    let (row, other) = (rows.of(short.layer()), rows.of(long.layer()));
    // Its nearest point reaches farthest.
    let nearest_m = short.bounds.nearest_m();
    let cone = Cone::around(nearest_m, parameters.eps_m(nearest_m));
    let (_, reach) = windows.extent(short.layer(), cone);
    for place in short.places() {
        let squared = long.bounds.squared_distance_to(row.position_m(place));
        if squared > row.eps_squared[place] {
            continue;
        }
        let address = Address {
            layer: short.layer(),
            place,
        };
        let centre = Centre::of(rows, address, parameters);
        for columns in windows.stretches(centre.column, reach) {
            let places = overlap(&rows.places(long.layer(), &columns), &long.places());
            if centre.count(other, places) > 0 {
                return true;
            }
        }
    }
    false
}

/// All runs, layer by layer. Its buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct Runs {
    /// There are no more than points, so that 16 bits hold the number of one.
    runs: Vec<Run>,
    /// The number of the run of every point of the array, or [`Runs::NONE`].
    of: Box<[u16; CAPACITY]>,
    /// Where runs of a row begin, or have just ended.
    edges: Box<[bool; LENGTH]>,
}

/// No run of any point has the number of none.
const _: () = assert!(CAPACITY < Runs::NONE as usize);

impl Runs {
    /// The number of no run.
    pub(super) const NONE: u16 = u16::MAX;

    pub(super) fn new() -> Self {
        Self {
            runs: vec![],
            of: Box::new([Self::NONE; CAPACITY]),
            edges: Box::new([false; LENGTH]),
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

    /// The numbers of the runs of the first points of the array, or [`Runs::NONE`].
    pub(super) fn of_points(&self, len: usize) -> &[u16] {
        &self.of[..len]
    }

    /// Finds the runs anew.
    pub(super) fn find(&mut self, rows: &Rows, windows: &Windows) {
        let most_columns = windows.most_columns().unwrap_or(MAX_COLUMNS) as u16;
        self.runs.clear();
        self.of[..rows.points()].fill(Self::NONE);
        for (layer, row) in rows.all().iter().enumerate() {
            mark_edges(row, most_columns, &mut self.edges);
            let mut begin = None;
            for edge in marked(&self.edges[..=row.places().end]) {
                if let Some(begin) = begin {
                    let number = self.runs.len() as u16;
                    for column in &row.column[begin..edge] {
                        self.of[usize::from(*column) * MAX_LAYERS + layer] = number;
                    }
                    self.runs.push(Run {
                        layer: layer as u16,
                        places: begin as u16..edge as u16,
                        bounds: bounds_of(row, begin..edge),
                    });
                }
                begin = row.is_core[edge].then_some(edge);
            }
        }
    }
}

/// The box around some places of a row.
fn bounds_of(row: &Row, places: Range<usize>) -> Bounds {
    let mut bounds = Bounds::NONE;
    for place in places {
        let [x, y, z] = row.position_m(place);
        bounds.hold([x, y, z, row.range_m[place]]);
    }
    bounds
}

/// What two stretches have in common.
fn overlap(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    let start = a.start.max(b.start);
    start..a.end.min(b.end).max(start)
}

/// Marks the places where a stretch of core points that follow each other begins, and those
/// behind where one ends.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn mark_edges(row: &Row, most_columns: u16, edges: &mut [bool; LENGTH]) {
    let places = 1..row.places().end + 1;
    let before = 0..row.places().end;
    let pairs = [&row.x_m, &row.y_m, &row.z_m, &row.eps_squared]
        .map(|metres| (&metres[before.clone()], &metres[places.clone()]));
    let [x_m, y_m, z_m, eps_squared] = pairs;
    let columns = (&row.column[before.clone()], &row.column[places.clone()]);
    let is_core = (&row.is_core[before], &row.is_core[places.clone()]);
    let edges = &mut edges[places];
    for (place, edge) in edges.iter_mut().enumerate() {
        let dx = x_m.1[place] - x_m.0[place];
        let dy = y_m.1[place] - y_m.0[place];
        let dz = z_m.1[place] - z_m.0[place];
        let squared = dx * dx + dy * dy + dz * dz;
        let is_near = squared <= least(eps_squared.0[place], eps_squared.1[place]);
        let is_beside = columns.1[place].wrapping_sub(columns.0[place]) <= most_columns;
        let (is_core, was_core) = (is_core.1[place], is_core.0[place]);
        *edge = (is_core | was_core) & !(is_core & was_core & is_near & is_beside);
    }
}
