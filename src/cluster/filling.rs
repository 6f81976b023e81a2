//! What is clustered of a revolution, put into rows: many columns at once.

use std::ops::Range;

use multiversion::multiversion;

use super::ClusterParameters;
use super::rows::{ABOVE, BELOW, MARGIN, NOT_TAKEN, Row, Rows, squared_distance};
use crate::cloud::{MAX_LAYERS, Scan};
use crate::float::least;
use crate::marks::set_bits;

impl Rows {
    /// Takes over the returns that `ground` does not mark and that are not too high above it.
    pub(super) fn fill(
        &mut self,
        scan: &Scan,
        (ground, heights_m): (&[bool], &[f32]),
        parameters: &ClusterParameters,
    ) {
        self.first.clear();
        for row in &mut self.rows {
            row.end = MARGIN;
        }
        fill(self, &Points::of(scan, ground, heights_m), parameters);
        for row in &mut self.rows {
            find_eps(row, parameters);
            let behind = row.end..row.end + MARGIN;
            row.eps_squared[behind.clone()].fill(NOT_TAKEN);
            row.is_core[behind].fill(false);
        }
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn find_eps(row: &mut Row, parameters: &ClusterParameters) {
    let places = row.places();
    let range_m = &row.range_m[places.clone()];
    for (eps_squared, range_m) in row.eps_squared[places].iter_mut().zip(range_m) {
        let eps_m = parameters.eps_m(*range_m);
        *eps_squared = eps_m * eps_m;
    }
}

/// What a revolution is made of, column by column.
struct Points<'a> {
    x_m: &'a [Column],
    y_m: &'a [Column],
    z_m: &'a [Column],
    ranges_m: &'a [Column],
    heights_m: &'a [Column],
    ground: &'a [[bool; MAX_LAYERS]],
}

type Column = [f32; MAX_LAYERS];

/// Columns that are taken over together.
const AT_ONCE: usize = u32::BITS as usize;

/// A bit for each of some columns, by layer.
type Bits = [u32; MAX_LAYERS];

impl<'a> Points<'a> {
    fn of(scan: &'a Scan, ground: &'a [bool], heights_m: &'a [f32]) -> Self {
        let columns = |metres: &'a [f32]| metres.as_chunks().0;
        Self {
            x_m: columns(scan.x_m()),
            y_m: columns(scan.y_m()),
            z_m: columns(scan.z_m()),
            ranges_m: columns(scan.range_m()),
            heights_m: columns(&heights_m[..scan.len()]),
            ground: ground[..scan.len()].as_chunks().0,
        }
    }

    /// Some of the columns.
    #[inline(always)]
    fn part(&self, columns: &Range<usize>) -> Self {
        Self {
            x_m: &self.x_m[columns.clone()],
            y_m: &self.y_m[columns.clone()],
            z_m: &self.z_m[columns.clone()],
            ranges_m: &self.ranges_m[columns.clone()],
            heights_m: &self.heights_m[columns.clone()],
            ground: &self.ground[columns.clone()],
        }
    }

    /// Which points of a column are to be clustered.
    #[inline(always)]
    fn are_taken(&self, column: usize, highest_m: f32) -> [bool; MAX_LAYERS] {
        let (ranges_m, heights_m) = (&self.ranges_m[column], &self.heights_m[column]);
        let ground = &self.ground[column];
        std::array::from_fn(|layer| {
            (ranges_m[layer] > 0.0) & !ground[layer] & (heights_m[layer] <= highest_m)
        })
    }

    /// Which points of a column would be neighbours of the next ones above; of the last one it means
    /// nothing.
    #[inline(always)]
    fn are_near_above(&self, column: usize, parameters: &ClusterParameters) -> [bool; MAX_LAYERS] {
        let (x_m, y_m) = (&self.x_m[column], &self.y_m[column]);
        let (z_m, ranges_m) = (&self.z_m[column], &self.ranges_m[column]);
        std::array::from_fn(|layer| {
            let above = (layer + 1).min(MAX_LAYERS - 1);
            let own_m = [x_m[layer], y_m[layer], z_m[layer]];
            let squared = squared_distance(own_m, [x_m[above], y_m[above], z_m[above]]);
            let [own, other] = [layer, above].map(|layer| parameters.eps_m(ranges_m[layer]));
            squared <= least(own * own, other * other)
        })
    }
}

/// Puts the returns that are no ground, and not too high above it, into empty rows.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn fill(rows: &mut Rows, points: &Points<'_>, parameters: &ClusterParameters) {
    let highest_m = parameters.highest_m as f32;
    let mut next = [MARGIN as u16; MAX_LAYERS];
    let columns = points.x_m.len();
    for begin in (0..columns).step_by(AT_ONCE) {
        let block = points.part(&(begin..(begin + AT_ONCE).min(columns)));
        let (mut taken, mut near): (Bits, Bits) = Default::default();
        for column in 0..block.x_m.len() {
            rows.first.push(next);
            let (are_taken, are_near) = (
                block.are_taken(column, highest_m),
                block.are_near_above(column, parameters),
            );
            for layer in 0..MAX_LAYERS {
                taken[layer] |= u32::from(are_taken[layer]) << column;
                near[layer] |= u32::from(are_near[layer]) << column;
                next[layer] += u16::from(are_taken[layer]);
            }
        }
        append(&mut rows.rows, &block, begin, &taken, &near);
    }
    rows.first.push(next);
}

/// Appends what is taken of a block of columns to the rows.
#[inline(always)]
fn append(rows: &mut [Row], block: &Points<'_>, begin: usize, taken: &Bits, near: &Bits) {
    let mut below = 0;
    for (layer, row) in rows.iter_mut().enumerate() {
        let taken_above = taken.get(layer + 1).copied().unwrap_or_default();
        let above = near[layer] & taken[layer] & taken_above;
        let mut place = row.end;
        for column in set_bits(taken[layer]) {
            row.x_m[place] = block.x_m[column][layer];
            row.y_m[place] = block.y_m[column][layer];
            row.z_m[place] = block.z_m[column][layer];
            row.range_m[place] = block.ranges_m[column][layer];
            row.column[place] = (begin + column) as u16;
            let [above, below] = [above, below].map(|met| (met >> column) as u8 & 1);
            row.met[place] = above * ABOVE + below * BELOW;
            place += 1;
        }
        row.end = place;
        below = above;
    }
}
