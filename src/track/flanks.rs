//! What rays show to the left and to the right of a patch.
//!
//! A ray that passes between two things parts them, however near they are to each other: what stands
//! apart from all that is beside it is one thing, and no piece of another. Without, 79 instead of 87 % of
//! the cyclists who ride in groups are listed, and there are three times as many false movers
//! (`scripts/evaluate --seeds 13-16 --duration 15 --scenarios groups`).

use super::placing::Placed;
use crate::cloud::{MAX_LAYERS, Scan};

/// The flanks of a patch.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Flanks {
    /// First and last column of its body; none of what is too low or all around.
    columns: Option<[usize; 2]>,
    /// The layers that meet the body, as bits.
    layers: u32,
    /// Ranges of its left and of its right end.
    ends_m: [f32; 2],
    /// Whether it is all of something: upright, and nothing touches it to the left and to the right.
    pub(super) stand_apart: bool,
}

/// What one column shows beside something.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Beside {
    /// Something is as far away.
    Touching,
    /// All rays end behind it.
    Passed,
    /// Something nearer hides what may be there.
    Hidden,
}

/// Ground, grass and what lies on it are lower, and touch everything. This and the other numbers here were
/// set by hand, on what [`super::crowds`] names.
const LOW_M: f32 = 0.4;
/// What is farther away or nearer by more than this is something else.
const BEHIND_M: f32 = 0.5;
/// How far rays must have passed to the side, in columns at least one and at most so many.
const GAP_M: f64 = 0.1;
const MOST_COLUMNS: usize = 8;
/// What stands upright: where its top is at least, where it begins at most, and in how many layers it
/// is seen.
const LEAST_TOP_M: f32 = 0.9;
const HIGHEST_FLOOR_M: f32 = 0.8;
const FEWEST_LAYERS: u32 = 2;

impl Flanks {
    /// Those of the returns of a patch.
    pub(super) fn of(placed: &[Placed], scan: &Scan) -> Self {
        let body = || placed.iter().filter(|own| own.above_m >= LOW_M);
        let columns = || body().map(|own| scan.column(own.point as usize));
        let (Some(begin), Some(end)) = (columns().min(), columns().max()) else {
            return Self::default();
        };
        // Over the seam of the sweep the least and the greatest column are no ends.
        if end - begin > scan.columns() / 4 {
            return Self::default();
        }
        let ends_m = [begin, end].map(|edge| {
            let at_edge = body().filter(|own| scan.column(own.point as usize).abs_diff(edge) <= 1);
            let ranges_m = at_edge.map(|own| scan.range_m()[own.point as usize]);
            ranges_m.fold(f32::INFINITY, f32::min)
        });
        let mut flanks = Self {
            columns: Some([begin, end]),
            layers: body().fold(0, |layers, own| {
                layers | 1 << scan.layer(own.point as usize)
            }),
            ends_m,
            stand_apart: false,
        };
        let (mut top_m, mut floor_m) = (f32::NEG_INFINITY, f32::INFINITY);
        for own in placed {
            (top_m, floor_m) = (top_m.max(own.above_m), floor_m.min(own.above_m));
        }
        let is_upright = top_m >= LEAST_TOP_M
            && floor_m <= HIGHEST_FLOOR_M
            && flanks.layers.count_ones() >= FEWEST_LAYERS;
        flanks.stand_apart = is_upright && flanks.has_room(scan);
        flanks
    }

    /// Whether nothing touches it to the left and to the right, and not both are hidden.
    fn has_room(&self, scan: &Scan) -> bool {
        let Some([begin, end]) = self.columns else {
            return false;
        };
        let columns = scan.columns();
        let sides = [0, 1].map(|side| {
            let range_m = self.ends_m[side];
            let mut steps = (1..=columns_of_gap(range_m, scan)).map(|step| {
                let column = [begin + columns - step, end + step][side];
                beside(scan, column % columns, self.layers, [range_m; 2])
            });
            steps.find(|beside| *beside != Beside::Passed)
        });
        !sides.contains(&Some(Beside::Touching)) && sides.contains(&None)
    }

    /// Whether rays passed between the body of this patch and that of another.
    pub(super) fn are_parted_from(&self, other: &Self, scan: &Scan) -> bool {
        let (Some([begin, end]), Some([other_begin, other_end])) = (self.columns, other.columns)
        else {
            return false;
        };
        if begin <= other_end && other_begin <= end {
            return false;
        }
        let columns = scan.columns();
        let gaps = [(end, other_begin), (other_end, begin)]
            .map(|(from, to)| (from, (to + columns - from) % columns));
        let is_left = gaps[0].1 < gaps[1].1;
        let (from, count) = if is_left { gaps[0] } else { gaps[1] };
        let ends_m = if is_left {
            [self.ends_m[1], other.ends_m[0]]
        } else {
            [other.ends_m[1], self.ends_m[0]]
        };
        let ends_m = [ends_m[0].min(ends_m[1]), ends_m[0].max(ends_m[1])];
        let least = columns_of_gap(ends_m[1], scan);
        let mut passed = 0;
        (1..count).any(|step| {
            let column = (from + step) % columns;
            let seen = beside(scan, column, self.layers | other.layers, ends_m);
            passed = if seen == Beside::Passed {
                passed + 1
            } else {
                0
            };
            passed >= least
        })
    }
}

/// How many columns make a gap at a range.
fn columns_of_gap(range_m: f32, scan: &Scan) -> usize {
    let columns = GAP_M / (f64::from(range_m) * scan.step_rad().abs()).max(1e-9);
    let columns = (libm::ceil(columns) as usize).clamp(1, MOST_COLUMNS);
    // A damaged sweep may have hardly any.
    columns.min(scan.columns())
}

/// What some layers of a column show beside what is between two ranges.
fn beside(scan: &Scan, column: usize, layers: u32, [least_m, most_m]: [f32; 2]) -> Beside {
    let mut beside = Beside::Passed;
    for layer in (0..MAX_LAYERS).filter(|layer| layers >> layer & 1 == 1) {
        let range_m = scan.range_m()[scan.index(column, layer)];
        if range_m == 0.0 || range_m > most_m + BEHIND_M {
            continue;
        }
        if range_m >= least_m - BEHIND_M {
            return Beside::Touching;
        }
        beside = Beside::Hidden;
    }
    beside
}
