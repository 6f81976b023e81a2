//! The lowest returns of every layer in a few columns: the ground, if any of them is.

use std::ops::Range;

use multiversion::multiversion;

use super::SECTORS;
use super::surface::STEEPEST;
use crate::cloud::{MAX_COLUMNS, MAX_LAYERS, Scan};
use crate::float::{LANES, each, greatest_each, least_each};

/// The points of a revolution.
pub(super) struct Points<'a> {
    pub(super) scan: &'a Scan,
    /// Above the plane.
    pub(super) heights_m: &'a [f32],
    pub(super) distances_m: &'a [f32],
}

/// Lowest returns, layer by layer, a lane for each. Its buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct Lowest {
    /// Levels of the returns that may be ground, column by column, each with the number of its
    /// column in its last bits.
    noted_m: Vec<[f32; MAX_LAYERS]>,
    /// The lowest of them, lowest first.
    sorted_m: [[f32; MAX_LAYERS]; KEPT],
    /// How many there are.
    counts: [u32; MAX_LAYERS],
}

/// The level of what is no ground: above all others.
pub(super) const NO_LEVEL_M: f32 = f32::MAX;
/// Columns of a sector, of a sensor that looks all round.
pub(super) const MOST_COLUMNS: usize = MAX_COLUMNS.div_ceil(SECTORS) + 1;
/// The last bits of a level, where its column is written: a level of 1 m changes by 4 um.
const COLUMN_BITS: u32 = MOST_COLUMNS.next_power_of_two() as u32 - 1;
/// Part of a layer's returns in a sector that may lie below the ground: noise and reflections.
const BELOW: f32 = 0.2;
/// As many of them, and the one above.
const KEPT: usize = (MOST_COLUMNS as f32 * BELOW) as usize + 1;
/// Fewer returns of a layer in a sector say nothing.
const FEWEST: u32 = 3;
/// Farther rings are too sparse to follow.
const FARTHEST_M: f32 = 70.0;
/// No ground is higher than this above the steepest slope.
const HIGHEST_M: f32 = 0.5;
/// A rise from one return to the next above that no road has.
pub(super) const STEEP: f32 = 1.0;

impl Lowest {
    pub(super) fn new() -> Self {
        Self {
            noted_m: Vec::with_capacity(MOST_COLUMNS),
            sorted_m: [[NO_LEVEL_M; MAX_LAYERS]; KEPT],
            counts: [0; MAX_LAYERS],
        }
    }

    /// Notes the levels of the returns in at most [`MOST_COLUMNS`] columns that may be ground, and
    /// gives them, so that some can be taken out: [`NO_LEVEL_M`] or more are those that may not.
    pub(super) fn note(
        &mut self,
        points: &Points<'_>,
        columns: Range<usize>,
    ) -> &mut [[f32; MAX_LAYERS]] {
        self.noted_m.clear();
        self.noted_m.resize(columns.len(), [NO_LEVEL_M; MAX_LAYERS]);
        note_levels(points, columns.start, self.noted_m.as_flattened_mut());
        &mut self.noted_m
    }

    /// Finds the lowest of what was noted.
    pub(super) fn sort(&mut self) {
        keep_lowest(&self.noted_m, &mut self.sorted_m, &mut self.counts);
    }

    /// The column, of those that were noted, in which a layer met the ground, if it did.
    pub(super) fn low_column(&self, layer: usize) -> Option<usize> {
        let count = self.counts[layer];
        if count < FEWEST {
            return None;
        }
        let low = (count as f32 * BELOW) as usize;
        Some((self.sorted_m[low][layer].to_bits() & COLUMN_BITS) as usize)
    }
}

/// Notes the levels of the returns from a column on that are near and low enough to be ground, and
/// from which it does not rise steeply to the next return above. Returns of which the next two
/// layers have none rise to nothing.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn note_levels(points: &Points<'_>, column: usize, levels_m: &mut [f32]) {
    let first = points.scan.index(column, 0);
    let ranges_m = &points.scan.range_m()[first..];
    let heights_m = &points.heights_m[first..];
    let distances_m = &points.distances_m[first..];
    // Nothing follows the last two of all points.
    let count = levels_m.len().min(ranges_m.len().saturating_sub(2));
    let levels_m = &mut levels_m[..count];
    let (ranges_m, next_m, after_m) = (&ranges_m[..count], &ranges_m[1..], &ranges_m[2..]);
    let (next_m, after_m) = (&next_m[..count], &after_m[..count]);
    let (next_height_m, after_height_m) = (&heights_m[1..=count], &heights_m[2..count + 2]);
    let (next_distance_m, after_distance_m) = (&distances_m[1..=count], &distances_m[2..count + 2]);
    let (heights_m, distances_m) = (&heights_m[..count], &distances_m[..count]);
    for point in 0..count {
        let layer = point as u32 % MAX_LAYERS as u32;
        let column = point as u32 / MAX_LAYERS as u32;
        let (height_m, distance_m) = (heights_m[point], distances_m[point]);
        let is_low = (ranges_m[point] > 0.0)
            & (distance_m < FARTHEST_M)
            & (height_m < HIGHEST_M + STEEPEST * distance_m);
        let has_next = (next_m[point] > 0.0) & (layer + 1 < MAX_LAYERS as u32);
        let has_after = (after_m[point] > 0.0) & (layer + 2 < MAX_LAYERS as u32);
        // Steep is what is higher by more than it is farther away, or nearer.
        let allowance_m = height_m - STEEP * distance_m;
        let is_next_steep = next_height_m[point] - STEEP * next_distance_m[point] > allowance_m;
        let is_after_steep = after_height_m[point] - STEEP * after_distance_m[point] > allowance_m;
        let rises_steeply = (has_next & is_next_steep) | (!has_next & has_after & is_after_steep);
        let level_m = f32::from_bits(height_m.to_bits() & !COLUMN_BITS | column);
        levels_m[point] = if is_low & !rises_steeply {
            level_m
        } else {
            NO_LEVEL_M
        };
    }
}

/// Keeps the lowest levels of each layer, lowest first, and counts all.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn keep_lowest(
    rows: &[[f32; MAX_LAYERS]],
    lowest: &mut [[f32; MAX_LAYERS]; KEPT],
    counts: &mut [u32; MAX_LAYERS],
) {
    for half in 0..MAX_LAYERS / LANES {
        let mut kept = [[NO_LEVEL_M; LANES]; KEPT];
        let mut count = [0; LANES];
        for row in rows {
            let mut row: [f32; LANES] = row.as_chunks().0[half];
            count = each(|lane| count[lane] + u32::from(row[lane] < NO_LEVEL_M));
            for kept in &mut kept {
                let lower = least_each(*kept, row);
                row = greatest_each(*kept, row);
                *kept = lower;
            }
        }
        for (lowest, kept) in lowest.iter_mut().zip(kept) {
            lowest.as_chunks_mut().0[half] = kept;
        }
        counts.as_chunks_mut().0[half] = count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;

    #[test]
    fn the_low_column_is_the_fifth_part_from_below() {
        // 20 columns of two flat layers, of which each is a little lower than the one before.
        let scan = scan_of(1800, |_, layer| match layer {
            3 | 11 => 1000,
            _ => 0,
        });
        let heights_m: Vec<f32> = (0..scan.len())
            .map(|point| -0.01 * scan.column(point) as f32)
            .collect();
        let distances_m = vec![10.0; scan.len()];
        let points = Points {
            scan: &scan,
            heights_m: &heights_m,
            distances_m: &distances_m,
        };
        let mut lowest = Lowest::new();
        lowest.note(&points, 100..120);
        lowest.sort();
        assert_eq!([3, 11].map(|layer| lowest.low_column(layer)), [Some(15); 2]);
        assert_eq!(lowest.low_column(4), None);
        // What is taken out does not count.
        for level_m in &mut lowest.note(&points, 100..120)[10..] {
            *level_m = [NO_LEVEL_M; MAX_LAYERS];
        }
        lowest.sort();
        assert_eq!([3, 11].map(|layer| lowest.low_column(layer)), [Some(7); 2]);
    }

    #[test]
    fn what_rises_steeply_to_the_next_return_is_no_ground() {
        for gap in [1, 2] {
            let scan = scan_of(1800, |_, layer| {
                if layer == 3 || layer == 3 + gap {
                    1000
                } else {
                    0
                }
            });
            let rise = |steep: f32| {
                let heights_m: Vec<f32> = (0..scan.len())
                    .map(|point| if scan.layer(point) > 3 { steep } else { 0.0 })
                    .collect();
                let distances_m: Vec<f32> = (0..scan.len())
                    .map(|point| if scan.layer(point) > 3 { 10.5 } else { 10.0 })
                    .collect();
                let points = Points {
                    scan: &scan,
                    heights_m: &heights_m,
                    distances_m: &distances_m,
                };
                let mut lowest = Lowest::new();
                lowest.note(&points, 1780..1800);
                lowest.sort();
                lowest.low_column(3).is_some()
            };
            assert!(rise(0.2));
            assert!(!rise(0.7));
        }
    }
}
