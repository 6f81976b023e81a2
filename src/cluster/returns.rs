//! The returns that are looked at, where they stand in the array.

use std::ops::Range;

use multiversion::multiversion;

use super::ClusterParameters;
use crate::cloud::{MAX_LAYERS, Scan};
use crate::float::{LANES, each, least, least_each, least_of};

/// All points of a revolution, in array order. Nothing is a neighbour of those that are not looked
/// at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Returns<'a> {
    pub(super) x_m: &'a [f32],
    pub(super) y_m: &'a [f32],
    pub(super) z_m: &'a [f32],
    pub(super) range_m: &'a [f32],
    /// Square of the distance within which others are neighbours, if they are farther off; negative
    /// for points that are not looked at.
    pub(super) eps_squared: &'a [f32],
}

/// A point with all that its neighbourhood depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Centre {
    pub(super) point: usize,
    pub(super) column: usize,
    pub(super) layer: usize,
    pub(super) position_m: [f32; 3],
    pub(super) range_m: f32,
    pub(super) eps_m: f32,
}

/// The first of the layers that are compared at once, as often as it takes for some layers: once, or
/// twice for all of them.
fn starts(layers: &Range<usize>) -> impl Iterator<Item = usize> + use<> {
    let last = MAX_LAYERS - LANES;
    let first = layers.start.min(last);
    let is_one = layers.end <= first + LANES;
    let starts = if is_one {
        [Some(first), None]
    } else {
        [Some(0), Some(last)]
    };
    starts.into_iter().flatten()
}

impl<'a> Returns<'a> {
    /// The points of a scan, given the squares of the distances of their neighbours.
    pub(super) fn of(scan: &'a Scan, eps_squared: &'a [f32]) -> Self {
        let len = scan.len();
        Self {
            x_m: scan.x_m(),
            y_m: scan.y_m(),
            z_m: scan.z_m(),
            range_m: scan.range_m(),
            eps_squared: &eps_squared[..len],
        }
    }

    /// A point, with the distance within which others are its neighbours.
    pub(super) fn centre(&self, point: usize, parameters: &ClusterParameters) -> Centre {
        Centre {
            point,
            column: point / MAX_LAYERS,
            layer: point % MAX_LAYERS,
            position_m: self.position_m(point),
            range_m: self.range_m[point],
            eps_m: parameters.eps_m(self.range_m[point]),
        }
    }

    /// Where a point is.
    #[inline(always)]
    pub(super) fn position_m(&self, point: usize) -> [f32; 3] {
        [self.x_m[point], self.y_m[point], self.z_m[point]]
    }

    /// Whether two points are neighbours.
    #[inline(always)]
    pub(super) fn are_neighbours(&self, a: usize, b: usize) -> bool {
        /// Rounding must not part two points that are as far from each other as neighbours can be.
        const SLACK: f32 = 1.01;
        let most = least(self.eps_squared[a], self.eps_squared[b]);
        // No two points are nearer to each other than their ranges are.
        let deeper_m = self.range_m[a] - self.range_m[b];
        if deeper_m * deeper_m > SLACK * most {
            return false;
        }
        let (dx, dy, dz) = (
            self.x_m[a] - self.x_m[b],
            self.y_m[a] - self.y_m[b],
            self.z_m[a] - self.z_m[b],
        );
        dx * dx + dy * dy + dz * dz <= most
    }

    /// How many points in a stretch of columns are neighbours of a point: all of these layers, and
    /// perhaps of others.
    pub(super) fn count(
        &self,
        columns: &Range<usize>,
        layers: &Range<usize>,
        centre: &Centre,
    ) -> u32 {
        if columns.is_empty() {
            return 0;
        }
        starts(layers)
            .map(|layer| count(self, columns, layer, centre))
            .sum()
    }

    /// The neighbour of a point that is nearest to it, in a stretch of columns: of these layers,
    /// and perhaps of others. Squared distance and place; of equally near ones the first.
    pub(super) fn nearest(
        &self,
        columns: &Range<usize>,
        layers: &Range<usize>,
        centre: &Centre,
    ) -> (f32, usize) {
        if columns.is_empty() {
            return FARTHEST;
        }
        let mut best = FARTHEST;
        for layer in starts(layers) {
            let squared = squared_to_nearest(self, columns, layer, centre);
            if squared <= best.0 && squared < f32::INFINITY {
                let place = first_at(squared, self, columns, layer, centre);
                best = nearer(best, (squared, place));
            }
        }
        best
    }
}

/// Of two points, by squared distance and place, the nearer one, or the first.
pub(super) fn nearer(a: (f32, usize), b: (f32, usize)) -> (f32, usize) {
    if b < a { b } else { a }
}

/// No neighbour at all.
pub(super) const FARTHEST: (f32, usize) = (f32::INFINITY, usize::MAX);

/// A stretch of columns of which some layers are compared with a point at once.
struct Stretch<'a> {
    x_m: &'a [[f32; MAX_LAYERS]],
    y_m: &'a [[f32; MAX_LAYERS]],
    z_m: &'a [[f32; MAX_LAYERS]],
    eps_squared: &'a [[f32; MAX_LAYERS]],
    /// The first of the layers.
    layer: usize,
}

impl<'a> Stretch<'a> {
    #[inline(always)]
    fn of(returns: &Returns<'a>, columns: &Range<usize>, layer: usize) -> Self {
        let (start, end) = (columns.start, columns.end);
        Self {
            x_m: &returns.x_m.as_chunks().0[start..end],
            y_m: &returns.y_m.as_chunks().0[start..end],
            z_m: &returns.z_m.as_chunks().0[start..end],
            eps_squared: &returns.eps_squared.as_chunks().0[start..end],
            layer: layer.min(MAX_LAYERS - LANES),
        }
    }

    /// Squared distances of a column's points from the centre, and those up to which they are its
    /// neighbours.
    #[inline(always)]
    fn compared(&self, column: usize, centre: &Centre) -> ([f32; LANES], [f32; LANES]) {
        let layers = self.layer..self.layer + LANES;
        let (x_m, y_m) = (
            &self.x_m[column][layers.clone()],
            &self.y_m[column][layers.clone()],
        );
        let (z_m, eps) = (
            &self.z_m[column][layers.clone()],
            &self.eps_squared[column][layers],
        );
        let [x, y, z] = centre.position_m;
        let own = centre.eps_m * centre.eps_m;
        let (mut squared, mut most) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let (dx, dy, dz) = (x_m[lane] - x, y_m[lane] - y, z_m[lane] - z);
            squared[lane] = dx * dx + dy * dy + dz * dz;
            most[lane] = least(own, eps[lane]);
        }
        (squared, most)
    }
}

/// How many neighbours a point has in some layers of a stretch of columns.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn count(returns: &Returns<'_>, columns: &Range<usize>, layer: usize, centre: &Centre) -> u32 {
    let stretch = Stretch::of(returns, columns, layer);
    // Counted in floats: sums of integers would be reordered, and columns put into lanes.
    let mut found = [0.0; LANES];
    for column in 0..stretch.x_m.len() {
        let (squared, most) = stretch.compared(column, centre);
        let near = |lane| f32::from(squared[lane] <= most[lane]);
        found = each(|lane| found[lane] + near(lane));
    }
    found.iter().sum::<f32>() as u32
}

/// Squared distance from a point to its nearest neighbour in some layers of a stretch of columns.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn squared_to_nearest(
    returns: &Returns<'_>,
    columns: &Range<usize>,
    layer: usize,
    centre: &Centre,
) -> f32 {
    let stretch = Stretch::of(returns, columns, layer);
    let mut nearest = [f32::INFINITY; LANES];
    for column in 0..stretch.x_m.len() {
        let (squared, most) = stretch.compared(column, centre);
        let near = each(|lane| {
            if squared[lane] <= most[lane] {
                squared[lane]
            } else {
                f32::INFINITY
            }
        });
        nearest = least_each(nearest, near);
    }
    least_of(nearest)
}

/// The first neighbour at a squared distance from a point, in some layers of a stretch of columns.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn first_at(
    wanted: f32,
    returns: &Returns<'_>,
    columns: &Range<usize>,
    layer: usize,
    centre: &Centre,
) -> usize {
    let stretch = Stretch::of(returns, columns, layer);
    for column in 0..stretch.x_m.len() {
        let (squared, most) = stretch.compared(column, centre);
        // The numbers of those that are; of the others a greater one.
        let mut numbers = [LANES as f32; LANES];
        for lane in 0..LANES {
            let is_it = (squared[lane] == wanted) & (wanted <= most[lane]);
            numbers[lane] = if is_it { lane as f32 } else { LANES as f32 };
        }
        let first = least_of(numbers) as usize;
        if first < LANES {
            return (columns.start + column) * MAX_LAYERS + stretch.layer + first;
        }
    }
    FARTHEST.1
}
