//! How densely the returns stand: which of them have so many neighbours close by in the array
//! that they are core points for sure.

use std::ops::Range;

use multiversion::multiversion;

use super::ClusterParameters;
use super::raster::{Given, Raster};
use super::returns::Returns;
use crate::cloud::{CAPACITY, MAX_LAYERS, Scan};

/// What is known of every point when its neighbours close by were counted. Its buffers are made
/// once.
#[derive(Debug, Clone)]
pub(super) struct Density {
    /// Square of the distance within which others are neighbours; negative if it is not looked at.
    eps_squared: Box<[f32; CAPACITY]>,
    /// The points of a chunk and the next one.
    raster: Raster<{ 2 * CHUNK }>,
    /// Neighbours of these that were counted so far.
    close: Box<[u16; 2 * CHUNK]>,
    /// Which of many pairs are neighbours, while they are counted.
    near: Box<[u16; CHUNK]>,
    /// Whether it is for sure a neighbour of the point in its layer, in the column before.
    pub(super) follows: Box<[bool; CAPACITY]>,
    /// Whether it is for sure a neighbour of the next point of the array, the one above it.
    pub(super) meets: Box<[bool; CAPACITY]>,
    /// Whether it is looked at.
    is_taken: Box<[bool; CHUNK]>,
    /// Whether it is a core point; at the end, whether it is of a cluster at all.
    pub(super) is_core: Box<[bool; CAPACITY]>,
    /// Whether the neighbours that were counted do not suffice to call it one.
    is_open: Box<[bool; CAPACITY]>,
}

/// No square of a distance: nothing is within it.
const NOT_TAKEN: f32 = -1.0;
/// Points that are looked at together, so that they stay in the nearest cache.
const CHUNK: usize = 32 * MAX_LAYERS;
/// In the next column.
const FOLLOWING: usize = MAX_LAYERS;
/// In the next layer.
const ABOVE: usize = 1;
/// Pairs that are counted: how many columns and how many places of the array they are apart. They
/// are those on a surface that suffice, six columns along a layer and three points of the next one.
/// With four columns half as many again would be open.
const PAIRS: [(usize, usize); 9] = [
    (1, FOLLOWING),
    (2, 2 * MAX_LAYERS),
    (3, 3 * MAX_LAYERS),
    (4, 4 * MAX_LAYERS),
    (5, 5 * MAX_LAYERS),
    (6, 6 * MAX_LAYERS),
    (0, ABOVE),
    (1, MAX_LAYERS + 1),
    (1, MAX_LAYERS - 1),
];
/// No pair reaches beyond the next chunk.
const _: () = assert!(CHUNK > 6 * MAX_LAYERS);

impl Density {
    pub(super) fn new() -> Self {
        let never = || Box::new([false; CAPACITY]);
        Self {
            eps_squared: Box::new([NOT_TAKEN; CAPACITY]),
            raster: Raster::new(),
            close: Box::new([0; 2 * CHUNK]),
            near: Box::new([0; CHUNK]),
            follows: never(),
            meets: never(),
            is_taken: Box::new([false; CHUNK]),
            is_core: never(),
            is_open: never(),
        }
    }

    /// The points that are looked at.
    pub(super) fn returns<'a>(&'a self, scan: &'a Scan) -> Returns<'a> {
        Returns::of(scan, &self.eps_squared[..])
    }

    /// The points that are looked at, which of them are open, and which are core points.
    pub(super) fn judged<'a>(
        &'a mut self,
        scan: &'a Scan,
    ) -> (Returns<'a>, &'a [bool], &'a mut [bool]) {
        let returns = Returns::of(scan, &self.eps_squared[..]);
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
        // Where nothing is counted: at the begin and the end, or everywhere.
        let counted = if few > 0 { len } else { 0 };
        self.follows[..counted.min(FOLLOWING)].fill(false);
        self.follows[counted..len].fill(false);
        self.meets[len.saturating_sub(ABOVE)..len].fill(false);
        self.take(scan, (ground, heights_m), (chunk(0), 0), parameters);
        self.close.fill(1);
        for begin in (0..len).step_by(CHUNK) {
            let next = (chunk(begin + CHUNK), CHUNK);
            self.take(scan, (ground, heights_m), next, parameters);
            let pairs = PAIRS.iter().filter(|(columns, _)| *columns <= few);
            for (_, apart) in pairs {
                self.count_pairs(len, chunk(begin), *apart);
            }
            // No later pair has a point of this chunk.
            self.judge(scan, chunk(begin), parameters);
            self.raster.advance();
            self.close.copy_within(CHUNK.., 0);
            self.close[CHUNK..].fill(1);
        }
    }

    /// Takes the points of a chunk over, and puts them in a place of the raster.
    fn take(
        &mut self,
        scan: &Scan,
        (ground, heights_m): (&[bool], &[f32]),
        (chunk, place): (Range<usize>, usize),
        parameters: &ClusterParameters,
    ) {
        let range_m = &scan.range_m()[chunk.clone()];
        let is_taken = &mut self.is_taken[..chunk.len()];
        take(
            range_m,
            (&ground[chunk.clone()], &heights_m[chunk.clone()]),
            parameters,
            (&mut self.eps_squared[chunk.clone()], is_taken),
        );
        let given = Given {
            at_m: [scan.x_m(), scan.y_m(), scan.z_m()].map(|metres| &metres[chunk.clone()]),
            range_m,
            is_taken,
        };
        self.raster
            .put(place..place + chunk.len(), given, parameters);
    }

    /// Counts the pairs of points so far apart of which the first is in a chunk.
    fn count_pairs(&mut self, len: usize, chunk: Range<usize>, apart: usize) {
        let end = chunk.end.min(len.saturating_sub(apart));
        let near = &mut self.near[..end.saturating_sub(chunk.start)];
        self.raster.compare(apart, near);
        add(near, &mut self.close[..]);
        add(near, &mut self.close[apart..]);
        let (flags, first) = match apart {
            FOLLOWING => (&mut self.follows, chunk.start + apart),
            ABOVE => (&mut self.meets, chunk.start),
            _ => return,
        };
        flag(near, &mut flags[first.min(len)..]);
    }

    /// Says which points of a chunk are core points for the neighbours that were counted, and
    /// which are open.
    fn judge(&mut self, scan: &Scan, chunk: Range<usize>, parameters: &ClusterParameters) {
        judge(
            &scan.range_m()[chunk.clone()],
            (&self.eps_squared[chunk.clone()], &self.close[..chunk.len()]),
            parameters,
            (
                &mut self.is_core[chunk.clone()],
                &mut self.is_open[chunk.clone()],
            ),
        );
    }

    /// Looks at core points alone from here on.
    pub(super) fn keep_core(&mut self, len: usize) {
        keep_core(&mut self.eps_squared[..len], &self.is_core[..len]);
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn take(
    range_m: &[f32],
    (ground, heights_m): (&[bool], &[f32]),
    parameters: &ClusterParameters,
    (eps_squared, is_taken): (&mut [f32], &mut [bool]),
) {
    let (count, highest_m) = (range_m.len(), parameters.highest_m as f32);
    let (ground, heights_m) = (&ground[..count], &heights_m[..count]);
    let (eps_squared, is_taken) = (&mut eps_squared[..count], &mut is_taken[..count]);
    for point in 0..count {
        is_taken[point] = (range_m[point] > 0.0) & !ground[point] & (heights_m[point] <= highest_m);
        let eps_m = parameters.eps_m(range_m[point]);
        eps_squared[point] = if is_taken[point] {
            eps_m * eps_m
        } else {
            NOT_TAKEN
        };
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn add(near: &[u16], close: &mut [u16]) {
    let close = &mut close[..near.len()];
    for pair in 0..near.len() {
        close[pair] += near[pair];
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn flag(near: &[u16], flags: &mut [bool]) {
    let flags = &mut flags[..near.len()];
    for pair in 0..near.len() {
        flags[pair] = near[pair] > 0;
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn judge(
    range_m: &[f32],
    (eps_squared, close): (&[f32], &[u16]),
    parameters: &ClusterParameters,
    (is_core, is_open): (&mut [bool], &mut [bool]),
) {
    let count = range_m.len();
    let (eps_squared, close) = (&eps_squared[..count], &close[..count]);
    let (is_core, is_open) = (&mut is_core[..count], &mut is_open[..count]);
    for point in 0..count {
        let is_taken = eps_squared[point] >= 0.0;
        let suffices = f32::from(close[point]) > parameters.more_than(range_m[point]);
        is_core[point] = is_taken & suffices;
        is_open[point] = is_taken & !suffices;
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn keep_core(eps_squared: &mut [f32], is_core: &[bool]) {
    let is_core = &is_core[..eps_squared.len()];
    for point in 0..eps_squared.len() {
        // Only the sign changes: a choice between what is there and another value would be a
        // masked store.
        let sign = u32::from(!is_core[point]) << (u32::BITS - 1);
        eps_squared[point] = f32::from_bits(eps_squared[point].to_bits() | sign);
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
        parameters.eps_m = 0.12;
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
