//! One layer as a structure of arrays along the columns.

use std::ops::Range;

use crate::cloud::MAX_COLUMNS;
use crate::float::least;

/// The points of a layer that are looked at. The others stand at infinity, where nothing is
/// their neighbour.
#[derive(Debug, Clone)]
pub(super) struct Row {
    x_m: Box<[f32; MAX_COLUMNS]>,
    y_m: Box<[f32; MAX_COLUMNS]>,
    z_m: Box<[f32; MAX_COLUMNS]>,
    eps_squared: Box<[f32; MAX_COLUMNS]>,
    /// How many of the next few to either side are neighbours of a point.
    close: Box<[u32; MAX_COLUMNS]>,
    /// Whether it is a neighbour of the point in the column before.
    follows: Box<[bool; MAX_COLUMNS]>,
    /// Whether it is a core point.
    pub(super) core: Box<[bool; MAX_COLUMNS]>,
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

impl Row {
    pub(super) fn new() -> Self {
        let zeros = || Box::new([0.0; MAX_COLUMNS]);
        let never = || Box::new([false; MAX_COLUMNS]);
        Self {
            x_m: zeros(),
            y_m: zeros(),
            z_m: zeros(),
            eps_squared: zeros(),
            close: Box::new([0; MAX_COLUMNS]),
            follows: never(),
            core: never(),
        }
    }

    /// Takes out the point in a column.
    pub(super) fn remove(&mut self, column: usize) {
        self.x_m[column] = f32::INFINITY;
        self.core[column] = false;
    }

    /// Puts a point into a column.
    pub(super) fn put(&mut self, column: usize, [x, y, z]: [f32; 3], eps_m: f32) {
        self.x_m[column] = x;
        self.y_m[column] = y;
        self.z_m[column] = z;
        self.eps_squared[column] = eps_m * eps_m;
        self.core[column] = false;
    }

    /// Counts the neighbours of all points among the next few columns, up to `few`, not over the
    /// seam. Written so that it vectorises.
    pub(super) fn count_close(&mut self, columns: usize, few: usize) {
        let mut near = [0u32; MAX_COLUMNS];
        self.close[..columns].fill(0);
        for apart in 1..=few.min(NEXT_FEW).min(columns.saturating_sub(1)) {
            let pairs = columns - apart;
            let (x, x2) = (&self.x_m[..pairs], &self.x_m[apart..columns]);
            let (y, y2) = (&self.y_m[..pairs], &self.y_m[apart..columns]);
            let (z, z2) = (&self.z_m[..pairs], &self.z_m[apart..columns]);
            let (eps, eps2) = (
                &self.eps_squared[..pairs],
                &self.eps_squared[apart..columns],
            );
            for (pair, near) in near[..pairs].iter_mut().enumerate() {
                let (dx, dy, dz) = (x2[pair] - x[pair], y2[pair] - y[pair], z2[pair] - z[pair]);
                let squared = dx * dx + dy * dy + dz * dz;
                *near = u32::from(squared <= least(eps[pair], eps2[pair]));
            }
            for (close, near) in self.close[..pairs].iter_mut().zip(&near[..pairs]) {
                *close += near;
            }
            for (close, near) in self.close[apart..columns].iter_mut().zip(&near[..pairs]) {
                *close += near;
            }
            if apart == 1 {
                for (follows, near) in self.follows[1..columns].iter_mut().zip(&near[..pairs]) {
                    *follows = *near == 1;
                }
            }
        }
    }

    /// Neighbours of the point in a column that were found by [`Row::count_close`], itself
    /// included.
    pub(super) fn close(&self, column: usize) -> u32 {
        self.close[column] + 1
    }

    /// Whether the point in a column is a neighbour of the one in the column before.
    pub(super) fn follows(&self, column: usize) -> bool {
        column > 0 && self.follows[column]
    }

    /// How many points of a stretch are neighbours of a point. Written so that it vectorises.
    pub(super) fn count(&self, stretch: Range<usize>, centre: &Centre) -> u32 {
        let [x, y, z] = centre.position_m;
        let eps_squared = centre.eps_m * centre.eps_m;
        let points = self.x_m[stretch.clone()]
            .iter()
            .zip(&self.y_m[stretch.clone()])
            .zip(&self.z_m[stretch.clone()])
            .zip(&self.eps_squared[stretch]);
        let mut found = 0;
        for (((x_m, y_m), z_m), other_squared) in points {
            let (dx, dy, dz) = (x_m - x, y_m - y, z_m - z);
            let near = dx * dx + dy * dy + dz * dz <= least(eps_squared, *other_squared);
            found += u32::from(near);
        }
        found
    }

    /// Whether the point in a column is a neighbour of a point.
    pub(super) fn is_neighbour(&self, column: usize, centre: &Centre) -> bool {
        self.squared_distance(column, centre).is_some()
    }

    /// Squared distance of the point in a column, if it is a neighbour.
    pub(super) fn squared_distance(&self, column: usize, centre: &Centre) -> Option<f32> {
        let [x, y, z] = centre.position_m;
        let (dx, dy, dz) = (
            self.x_m[column] - x,
            self.y_m[column] - y,
            self.z_m[column] - z,
        );
        let squared = dx * dx + dy * dy + dz * dz;
        let eps_squared = least(centre.eps_m * centre.eps_m, self.eps_squared[column]);
        (squared <= eps_squared).then_some(squared)
    }

    /// Whether two core points in a column of two layers are neighbours.
    pub(super) fn meets(&self, other: &Self, column: usize) -> bool {
        let (dx, dy, dz) = (
            self.x_m[column] - other.x_m[column],
            self.y_m[column] - other.y_m[column],
            self.z_m[column] - other.z_m[column],
        );
        let eps_squared = least(self.eps_squared[column], other.eps_squared[column]);
        self.core[column] & other.core[column] && dx * dx + dy * dy + dz * dz <= eps_squared
    }
}
