//! How densely the returns stand: which of them have so many neighbours close by in the array
//! that they are core points for sure.

use std::ops::Range;

use multiversion::multiversion;

use super::ClusterParameters;
use super::returns::Returns;
use crate::cloud::{CAPACITY, MAX_LAYERS, Scan};
use crate::float::least;

/// What is known of every point when its neighbours close by were counted. Its buffers are made
/// once.
#[derive(Debug, Clone)]
pub(super) struct Density {
    /// To the right, if it is looked at; else infinity.
    x_m: Box<[f32; CAPACITY]>,
    eps_squared: Box<[f32; CAPACITY]>,
    /// Neighbours that were counted so far.
    close: Box<[f32; CAPACITY]>,
    /// Which of many pairs are neighbours, while they are counted.
    near: Box<[f32; CHUNK]>,
    /// Whether it is a neighbour of the point in its layer, in the column before.
    pub(super) follows: Box<[bool; CAPACITY]>,
    /// Whether it is a neighbour of the next point of the array, which is the one above it.
    pub(super) meets: Box<[bool; CAPACITY]>,
    /// Whether it is a core point.
    pub(super) is_core: Box<[bool; CAPACITY]>,
    /// Whether the neighbours that were counted do not suffice to call it one.
    is_open: Box<[bool; CAPACITY]>,
}

/// Points that are looked at together, so that they stay in the nearest cache.
const CHUNK: usize = 32 * MAX_LAYERS;
/// In the next column.
const FOLLOWING: usize = MAX_LAYERS;
/// In the next layer.
const ABOVE: usize = 1;
/// Pairs that are counted: how many columns and how many places of the array they are apart. They
/// are those on a surface that suffice, four columns along a layer and three points of the next
/// one.
const PAIRS: [(usize, usize); 7] = [
    (1, FOLLOWING),
    (2, 2 * MAX_LAYERS),
    (3, 3 * MAX_LAYERS),
    (4, 4 * MAX_LAYERS),
    (0, ABOVE),
    (1, MAX_LAYERS + 1),
    (1, MAX_LAYERS - 1),
];
/// No pair reaches beyond the next chunk.
const _: () = assert!(CHUNK > 4 * MAX_LAYERS);

impl Density {
    pub(super) fn new() -> Self {
        let zeros = || Box::new([0.0; CAPACITY]);
        let never = || Box::new([false; CAPACITY]);
        Self {
            x_m: zeros(),
            eps_squared: zeros(),
            close: zeros(),
            near: Box::new([0.0; CHUNK]),
            follows: never(),
            meets: never(),
            is_core: never(),
            is_open: never(),
        }
    }

    /// The points that are looked at.
    pub(super) fn returns<'a>(&'a self, scan: &'a Scan) -> Returns<'a> {
        Returns::of(scan, &self.x_m[..], &self.eps_squared[..])
    }

    /// The points that are looked at, which of them are open, and which are core points.
    pub(super) fn judged<'a>(
        &'a mut self,
        scan: &'a Scan,
    ) -> (Returns<'a>, &'a [bool], &'a mut [bool]) {
        let returns = Returns::of(scan, &self.x_m[..], &self.eps_squared[..]);
        let len = scan.len();
        (returns, &self.is_open[..len], &mut self.is_core[..len])
    }

    /// Counts, for all returns that are no ground, themselves and their neighbours close by, up to
    /// `few` columns off.
    pub(super) fn count(
        &mut self,
        scan: &Scan,
        (ground, heights_m): (&[bool], &[f32]),
        few: usize,
        parameters: &ClusterParameters,
    ) {
        let len = scan.len();
        let chunk = |begin: usize| begin.min(len)..(begin + CHUNK).min(len);
        self.take(scan, (ground, heights_m), chunk(0), parameters);
        for begin in (0..len).step_by(CHUNK) {
            self.take(scan, (ground, heights_m), chunk(begin + CHUNK), parameters);
            let pairs = PAIRS.iter().filter(|(columns, _)| *columns <= few);
            for (_, apart) in pairs {
                self.count_pairs(scan, chunk(begin), *apart);
            }
            // No later pair has a point of this chunk.
            self.judge(scan, chunk(begin), parameters);
        }
    }

    /// Takes the points of a chunk over.
    fn take(
        &mut self,
        scan: &Scan,
        (ground, heights_m): (&[bool], &[f32]),
        chunk: Range<usize>,
        parameters: &ClusterParameters,
    ) {
        take(
            (&scan.x_m()[chunk.clone()], &scan.range_m()[chunk.clone()]),
            (&ground[chunk.clone()], &heights_m[chunk.clone()]),
            parameters,
            (
                &mut self.x_m[chunk.clone()],
                &mut self.eps_squared[chunk.clone()],
            ),
        );
        self.close[chunk.clone()].fill(1.0);
        self.follows[chunk.clone()].fill(false);
        self.meets[chunk].fill(false);
    }

    /// Counts the pairs of points so far apart of which the first is in a chunk.
    fn count_pairs(&mut self, scan: &Scan, chunk: Range<usize>, apart: usize) {
        let returns = Returns::of(scan, &self.x_m[..], &self.eps_squared[..]);
        let end = chunk.end.min(scan.len().saturating_sub(apart));
        let pairs = chunk.start.min(end)..end;
        let near = &mut self.near[..pairs.len()];
        count_pairs(&returns, pairs.clone(), apart, near, &mut self.close[..]);
        let (flags, first) = match apart {
            FOLLOWING => (&mut self.follows, pairs.start + apart),
            ABOVE => (&mut self.meets, pairs.start),
            _ => return,
        };
        flag(near, &mut flags[first..]);
    }

    /// Says which points of a chunk are core points for the neighbours that were counted, and
    /// which are open.
    fn judge(&mut self, scan: &Scan, chunk: Range<usize>, parameters: &ClusterParameters) {
        judge(
            (&self.x_m[chunk.clone()], &scan.range_m()[chunk.clone()]),
            &self.close[chunk.clone()],
            parameters,
            (
                &mut self.is_core[chunk.clone()],
                &mut self.is_open[chunk.clone()],
            ),
        );
    }

    /// Puts all points at infinity that are no core points.
    pub(super) fn keep_core(&mut self, len: usize) {
        keep_core(&mut self.x_m[..len], &self.is_core[..len]);
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn take(
    (x_m, range_m): (&[f32], &[f32]),
    (ground, heights_m): (&[bool], &[f32]),
    parameters: &ClusterParameters,
    (taken_m, eps_squared): (&mut [f32], &mut [f32]),
) {
    let (range_m, ground) = (&range_m[..x_m.len()], &ground[..x_m.len()]);
    let (heights_m, highest_m) = (&heights_m[..x_m.len()], parameters.highest_m as f32);
    let (taken_m, eps_squared) = (&mut taken_m[..x_m.len()], &mut eps_squared[..x_m.len()]);
    for point in 0..x_m.len() {
        let is_taken = (range_m[point] > 0.0) & !ground[point] & (heights_m[point] <= highest_m);
        let x = x_m[point];
        taken_m[point] = if is_taken { x } else { f32::INFINITY };
        let eps_m = parameters.eps_m(range_m[point]);
        eps_squared[point] = eps_m * eps_m;
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn count_pairs(
    returns: &Returns<'_>,
    pairs: Range<usize>,
    apart: usize,
    near: &mut [f32],
    close: &mut [f32],
) {
    let Returns {
        x_m,
        y_m,
        z_m,
        eps_squared,
        ..
    } = returns;
    let (first, count) = (pairs.start, near.len());
    let (x, x2) = (&x_m[first..][..count], &x_m[first + apart..][..count]);
    let (y, y2) = (&y_m[first..][..count], &y_m[first + apart..][..count]);
    let (z, z2) = (&z_m[first..][..count], &z_m[first + apart..][..count]);
    let eps = &eps_squared[first..][..count];
    let eps2 = &eps_squared[first + apart..][..count];
    for pair in 0..count {
        let (dx, dy, dz) = (x2[pair] - x[pair], y2[pair] - y[pair], z2[pair] - z[pair]);
        let is_near = dx * dx + dy * dy + dz * dz <= least(eps[pair], eps2[pair]);
        near[pair] = if is_near { 1.0 } else { 0.0 };
    }
    let before = &mut close[first..][..count];
    for pair in 0..count {
        before[pair] += near[pair];
    }
    let behind = &mut close[first + apart..][..count];
    for pair in 0..count {
        behind[pair] += near[pair];
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn flag(near: &[f32], flags: &mut [bool]) {
    let flags = &mut flags[..near.len()];
    for pair in 0..near.len() {
        flags[pair] = near[pair] > 0.0;
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn judge(
    (x_m, range_m): (&[f32], &[f32]),
    close: &[f32],
    parameters: &ClusterParameters,
    (is_core, is_open): (&mut [bool], &mut [bool]),
) {
    let (range_m, close) = (&range_m[..x_m.len()], &close[..x_m.len()]);
    let (is_core, is_open) = (&mut is_core[..x_m.len()], &mut is_open[..x_m.len()]);
    for point in 0..x_m.len() {
        let is_taken = x_m[point] < f32::INFINITY;
        let suffices = close[point] > parameters.more_than(range_m[point]);
        is_core[point] = is_taken & suffices;
        is_open[point] = is_taken & !suffices;
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn keep_core(x_m: &mut [f32], is_core: &[bool]) {
    let is_core = &is_core[..x_m.len()];
    for point in 0..x_m.len() {
        let x = x_m[point];
        x_m[point] = if is_core[point] { x } else { f32::INFINITY };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::parameter::Profile;

    #[test]
    fn a_surface_is_dense_and_what_stands_alone_or_at_its_corner_is_open() {
        // More columns than are looked at together, and no whole number of chunks.
        let (columns, wall) = (90, 20..60);
        let scan = scan_of(columns, |column, layer| match (column, layer) {
            (80, 3) => 2000,
            (_, 4..12) if wall.contains(&column) => 100,
            (_, 12..) => 100,
            _ => 0,
        });
        let ground: Vec<bool> = (0..scan.len())
            .map(|point| point % MAX_LAYERS >= 12)
            .collect();
        let mut parameters = ClusterParameters::profile(Profile::Default);
        parameters.eps_per_m = 0.0;
        // One column along the wall is 0.07 m, and a layer 0.035 m.
        parameters.eps_m = 0.1;
        let mut density = Density::new();
        for few in [columns, 2] {
            density.count(&scan, (&ground, &vec![0.0; scan.len()]), few, &parameters);
            let (_, is_open, is_core) = density.judged(&scan);
            for column in 0..columns {
                for layer in 0..MAX_LAYERS {
                    let point = column * MAX_LAYERS + layer;
                    let is_wall = wall.contains(&column) && (4..12).contains(&layer);
                    let is_return = is_wall || (column, layer) == (80, 3);
                    assert_eq!(is_open[point] | is_core[point], is_return);
                    assert!(!(is_open[point] & is_core[point]));
                    if (21..59).contains(&column) && (5..11).contains(&layer) {
                        assert!(is_core[point], "{column} {layer}");
                    }
                }
            }
            assert!(is_open[80 * MAX_LAYERS + 3] & is_open[20 * MAX_LAYERS + 4]);
            assert!(density.follows[21 * MAX_LAYERS + 4] & !density.follows[20 * MAX_LAYERS + 4]);
            assert!(density.meets[21 * MAX_LAYERS + 4] & !density.meets[21 * MAX_LAYERS + 11]);
        }
    }
}
