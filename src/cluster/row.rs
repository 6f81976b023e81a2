//! One layer of the array, in which what is near along it stands side by side.

use std::ops::Range;

use multiversion::multiversion;

use super::ClusterParameters;
use crate::cloud::{CAPACITY, MAX_COLUMNS};
use crate::float::{least, least_of};

/// The points of a layer that are looked at. The others stand at infinity, where nothing is
/// their neighbour.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) x_m: Box<[f32; MAX_COLUMNS]>,
    pub(super) y_m: Box<[f32; MAX_COLUMNS]>,
    pub(super) z_m: Box<[f32; MAX_COLUMNS]>,
    pub(super) range_m: Box<[f32; MAX_COLUMNS]>,
    eps_squared: Box<[f32; MAX_COLUMNS]>,
    /// Neighbours that were counted so far.
    close: Box<[f32; MAX_COLUMNS]>,
    /// Whether it is a neighbour of the point in the column before.
    follows: Box<[bool; MAX_COLUMNS]>,
    /// Whether it is a neighbour of the point above it.
    meets: Box<[bool; MAX_COLUMNS]>,
    /// Whether it is a core point.
    pub(super) core: Box<[bool; MAX_COLUMNS]>,
    /// Whether the neighbours that were counted do not suffice to call it one.
    pub(super) is_open: Box<[bool; MAX_COLUMNS]>,
    /// Number of the run of each core point, or [`Row::NO_RUN`].
    pub(super) run_of: Box<[u16; MAX_COLUMNS]>,
}

/// A point with all that its neighbourhood depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Centre {
    pub(super) column: usize,
    pub(super) layer: usize,
    pub(super) position_m: [f32; 3],
    pub(super) range_m: f32,
    pub(super) eps_m: f32,
}

/// Columns to either side in which a point on a surface has enough neighbours.
const NEXT_FEW: usize = 4;
/// Columns to either side of a point's own in which its neighbours in the next layer are counted.
const BESIDE: usize = 1;

/// No run of any point has the number of none.
const _: () = assert!(CAPACITY < Row::NO_RUN as usize);

impl Row {
    /// The number of no run.
    pub(super) const NO_RUN: u16 = u16::MAX;

    pub(super) fn new() -> Self {
        let zeros = || Box::new([0.0; MAX_COLUMNS]);
        let never = || Box::new([false; MAX_COLUMNS]);
        Self {
            x_m: zeros(),
            y_m: zeros(),
            z_m: zeros(),
            range_m: zeros(),
            eps_squared: zeros(),
            close: zeros(),
            follows: never(),
            meets: never(),
            core: never(),
            is_open: never(),
            run_of: Box::new([0; MAX_COLUMNS]),
        }
    }

    /// The point in a column, with the distance within which others are its neighbours.
    pub(super) fn centre(
        &self,
        layer: usize,
        column: usize,
        parameters: &ClusterParameters,
    ) -> Centre {
        Centre {
            column,
            layer,
            position_m: [self.x_m[column], self.y_m[column], self.z_m[column]],
            range_m: self.range_m[column],
            eps_m: parameters.eps_m(self.range_m[column]),
        }
    }

    /// The coordinates and the ranges of the points in a stretch.
    pub(super) fn points(&self, stretch: Range<usize>) -> ([&[f32]; 3], &[f32]) {
        let at_m = [&self.x_m, &self.y_m, &self.z_m];
        (
            at_m.map(|metres| &metres[stretch.clone()]),
            &self.range_m[stretch],
        )
    }

    /// Whether the point in a column is a neighbour of a point.
    pub(super) fn is_neighbour(&self, column: usize, centre: &Centre) -> bool {
        let [x, y, z] = centre.position_m;
        let (dx, dy, dz) = (
            self.x_m[column] - x,
            self.y_m[column] - y,
            self.z_m[column] - z,
        );
        let squared = dx * dx + dy * dy + dz * dz;
        squared <= least(centre.eps_m * centre.eps_m, self.eps_squared[column])
    }
}

/// Counts, for all points of a layer, themselves and their neighbours among the next few columns,
/// up to `few`, not over the seam.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn count_along(
    row: &mut Row,
    columns: usize,
    few: usize,
    parameters: &ClusterParameters,
    near: &mut [f32; MAX_COLUMNS],
) {
    let (x, y, z) = (
        &row.x_m[..columns],
        &row.y_m[..columns],
        &row.z_m[..columns],
    );
    let range_m = &row.range_m[..columns];
    let eps_squared = &mut row.eps_squared[..columns];
    for column in 0..columns {
        let eps_m = parameters.eps_m(range_m[column]);
        eps_squared[column] = eps_m * eps_m;
    }
    let eps_squared = &row.eps_squared[..columns];
    let close = &mut row.close[..columns];
    close.fill(1.0);
    for apart in 1..=few.min(NEXT_FEW).min(columns.saturating_sub(1)) {
        let pairs = columns - apart;
        let near = &mut near[..pairs];
        let (x2, y2, z2) = (&x[apart..], &y[apart..], &z[apart..]);
        let eps2 = &eps_squared[apart..];
        for pair in 0..pairs {
            let (dx, dy, dz) = (x2[pair] - x[pair], y2[pair] - y[pair], z2[pair] - z[pair]);
            let squared = dx * dx + dy * dy + dz * dz;
            let is_near = squared <= least(eps_squared[pair], eps2[pair]);
            near[pair] = if is_near { 1.0 } else { 0.0 };
        }
        for pair in 0..pairs {
            close[pair] += near[pair];
        }
        let behind = &mut close[apart..];
        for pair in 0..pairs {
            behind[pair] += near[pair];
        }
        if apart == 1 {
            let follows = &mut row.follows[1..columns];
            for pair in 0..pairs {
                follows[pair] = near[pair] > 0.0;
            }
        }
    }
}

/// Counts, for all points of two layers, their neighbours in the other one in their own column
/// and in those beside it, up to `few`, not over the seam.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn count_across(
    row: &mut Row,
    above: &mut Row,
    columns: usize,
    few: usize,
    near: &mut [f32; MAX_COLUMNS],
) {
    let beside = few.min(BESIDE).min(columns.saturating_sub(1));
    for (own, other) in [(0, 0), (0, beside), (beside, 0)] {
        // Columns that the layer begins with, and those that the one above it does.
        let pairs = columns - own.max(other);
        let near = &mut near[..pairs];
        let (x, y, z) = (&row.x_m[own..], &row.y_m[own..], &row.z_m[own..]);
        let (x2, y2, z2) = (
            &above.x_m[other..],
            &above.y_m[other..],
            &above.z_m[other..],
        );
        let (x, y, z) = (&x[..pairs], &y[..pairs], &z[..pairs]);
        let (x2, y2, z2) = (&x2[..pairs], &y2[..pairs], &z2[..pairs]);
        let eps = &row.eps_squared[own..][..pairs];
        let eps2 = &above.eps_squared[other..][..pairs];
        for pair in 0..pairs {
            let (dx, dy, dz) = (x2[pair] - x[pair], y2[pair] - y[pair], z2[pair] - z[pair]);
            let is_near = dx * dx + dy * dy + dz * dz <= least(eps[pair], eps2[pair]);
            near[pair] = if is_near { 1.0 } else { 0.0 };
        }
        let close = &mut row.close[own..][..pairs];
        for pair in 0..pairs {
            close[pair] += near[pair];
        }
        let close = &mut above.close[other..][..pairs];
        for pair in 0..pairs {
            close[pair] += near[pair];
        }
        if own == other {
            let meets = &mut row.meets[..columns];
            for column in 0..columns {
                meets[column] = near[column] > 0.0;
            }
            if beside == 0 {
                break;
            }
        }
    }
}

/// Says which points of a layer are core points for the neighbours that were counted, and which
/// are open.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn judge(row: &mut Row, columns: usize, parameters: &ClusterParameters) {
    let (x, range_m) = (&row.x_m[..columns], &row.range_m[..columns]);
    let close = &row.close[..columns];
    let (core, is_open) = (&mut row.core[..columns], &mut row.is_open[..columns]);
    for column in 0..columns {
        let is_taken = x[column] < f32::INFINITY;
        let suffices = close[column] > parameters.more_than(range_m[column]);
        core[column] = is_taken & suffices;
        is_open[column] = is_taken & !suffices;
    }
}

/// How many points of a stretch of a layer are neighbours of a point.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn count(row: &Row, stretch: Range<usize>, centre: &Centre) -> u32 {
    let [x, y, z] = centre.position_m;
    let own = centre.eps_m * centre.eps_m;
    let (x_m, y_m, z_m) = (
        &row.x_m[stretch.start..stretch.end],
        &row.y_m[stretch.start..stretch.end],
        &row.z_m[stretch.start..stretch.end],
    );
    let eps_squared = &row.eps_squared[stretch.start..stretch.end];
    let mut found = 0;
    for at in 0..x_m.len() {
        let (dx, dy, dz) = (x_m[at] - x, y_m[at] - y, z_m[at] - z);
        let near = dx * dx + dy * dy + dz * dz <= least(own, eps_squared[at]);
        found += u32::from(near);
    }
    found
}

/// The point of a stretch of a layer that is nearest to a point and its neighbour: squared distance
/// and column; of equally near ones the first.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn nearest(row: &Row, stretch: Range<usize>, centre: &Centre) -> Option<(f32, usize)> {
    /// Points that are compared at once.
    const BLOCK: usize = 32;
    let [x, y, z] = centre.position_m;
    let own = centre.eps_m * centre.eps_m;
    let mut best = (f32::INFINITY, 0);
    let mut begin = stretch.start;
    while begin < stretch.end {
        let end = stretch.end.min(begin + BLOCK);
        let (x_m, y_m, z_m) = (
            &row.x_m[begin..end],
            &row.y_m[begin..end],
            &row.z_m[begin..end],
        );
        let eps_squared = &row.eps_squared[begin..end];
        let mut squared = [f32::INFINITY; BLOCK];
        for at in 0..end - begin {
            let (dx, dy, dz) = (x_m[at] - x, y_m[at] - y, z_m[at] - z);
            let distance = dx * dx + dy * dy + dz * dz;
            let is_near = distance <= least(own, eps_squared[at]);
            squared[at] = if is_near { distance } else { f32::INFINITY };
        }
        let nearest = least_of(squared);
        if nearest < best.0 {
            let at = squared.iter().position(|squared| *squared == nearest);
            best = (nearest, begin + at.unwrap_or(0));
        }
        begin = end;
    }
    (best.0 < f32::INFINITY).then_some(best)
}

/// Puts all points of a layer at infinity that are no core points.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn keep_core(row: &mut Row, columns: usize) {
    let (x_m, core) = (&mut row.x_m[..columns], &row.core[..columns]);
    for column in 0..columns {
        let x = x_m[column];
        x_m[column] = if core[column] { x } else { f32::INFINITY };
    }
}

/// Marks the columns in which core points of a layer and of the one above it are neighbours, where
/// it is not the same two runs as in the column before.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn mark_meetings(row: &Row, above: &Row, columns: usize, marks: &mut [bool]) {
    let meets = &row.meets[..columns];
    let (core, core2) = (&row.core[..columns], &above.core[..columns]);
    let (run, run2) = (&row.run_of[..columns], &above.run_of[..columns]);
    let marks = &mut marks[..columns];
    for column in 0..columns {
        marks[column] = meets[column] & core[column] & core2[column];
    }
    if columns == 0 {
        return;
    }
    let (run_before, run2_before) = (&run[..columns - 1], &run2[..columns - 1]);
    let (run, run2) = (&run[1..], &run2[1..]);
    let marks = &mut marks[1..];
    for at in 0..columns - 1 {
        let is_same = (run[at] == run_before[at]) & (run2[at] == run2_before[at]);
        marks[at] &= !(is_same & meets[at]);
    }
}

/// Marks the columns where a stretch of core points that follow each other begins, and those
/// behind where one ends.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn mark_edges(row: &Row, columns: usize, marks: &mut [bool]) {
    if columns == 0 {
        return;
    }
    marks[0] = row.core[0];
    let (before, core) = (&row.core[..columns - 1], &row.core[1..columns]);
    let follows = &row.follows[1..columns];
    let marks = &mut marks[1..columns];
    for at in 0..columns - 1 {
        marks[at] = (before[at] | core[at]) & !(before[at] & core[at] & follows[at]);
    }
}
