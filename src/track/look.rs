//! What is seen of an object in one revolution, whatever it is.

use std::ops::RangeInclusive;

use nalgebra::Vector2;

use super::above::same_above;
use super::spots::{Spot, bounds_m};
use crate::beams::Seen;
use crate::cloud::{MAX_LAYERS, Scan};
use crate::float::least;
use crate::time::{Span, Time};

/// Everything that is measured of a group without knowing the object.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    /// Middle of the returns.
    pub(super) middle_m: Vector2<f64>,
    /// Mean time before the end of the sweep.
    pub(super) age_s: f64,
    /// Returns, also those for which others stand.
    pub(super) points: usize,
    pub(super) floor_m: f64,
    pub(super) top_m: f64,
    /// Where the next ray passed over the top.
    pub(super) top_below_m: f64,
    /// Greatest extent of what is higher than a bonnet or a handlebar, if there is any of it.
    pub(super) upper_m: Option<f64>,
    /// Median jump of the range between neighbouring returns of a layer.
    pub(super) roughness_m: f64,
    /// Share of its columns in which it goes on above.
    pub(super) goes_on: f64,
    /// From the sensor to the middle.
    pub(super) range_m: f64,
    /// Hardly anything below the belt of a vehicle is seen.
    pub(super) is_upper: bool,
    /// Its leftmost and rightmost returns, seen from the sensor.
    pub(super) ends_m: [Vector2<f64>; 2],
    /// Something nearer hides what is to the left or to the right.
    pub(super) is_cut: [bool; 2],
    /// Where the sensor is at the end.
    pub(super) sensor_m: Vector2<f64>,
    /// Returns whose place was seen empty before, and something in it.
    pub(super) new: f64,
    pub(super) old: f64,
    /// Rays pass to the left and to the right: across the line of sight it is all of it.
    pub(super) is_apart: bool,
    /// How much likelier it is to be seen of somebody on foot than of anything else, if that is known.
    pub(super) person_log: Option<f64>,
}

/// What begins higher has lost its wheels and bumpers to the ground, or between two layers.
const BELT_M: f32 = 0.55;
/// Share of returns below it that shows a body.
const LOW_SHARE: f64 = 0.15;
/// Bonnets and handlebars are lower, and a few returns show something above them.
const UPPER_M: f32 = 1.1;
const FEWEST_UPPER: usize = 2;
/// A nearer return by this much beside an object hides a part of it.
const OCCLUDER_M: f64 = 0.7;
/// Columns beside an object that are looked at.
const BESIDE: usize = 3;

impl Look {
    /// `spots` must not be empty.
    pub(super) fn at(spots: &[Spot], scan: &Scan, sensor_m: Vector2<f64>) -> Self {
        let count = spots.len() as f64;
        let (mut sum_m, mut age_s, mut returns, mut low) = ([0.0; 2], 0.0, 0.0, 0u32);
        let (mut lowest_layer, mut highest_layer) = (MAX_LAYERS, 0);
        let (mut floor_m, mut top_m, mut top_point) = (f32::INFINITY, f32::NEG_INFINITY, 0);
        for spot in spots {
            for (sum_m, metres) in sum_m.iter_mut().zip(spot.at_m) {
                *sum_m += f64::from(metres);
            }
            age_s += f64::from(spot.age_s);
            returns += spot.returns;
            low += u32::from(spot.above_m <= BELT_M);
            floor_m = least(floor_m, spot.above_m);
            let layer = scan.layer(spot.point as usize);
            lowest_layer = lowest_layer.min(layer);
            highest_layer = highest_layer.max(layer);
            if spot.above_m > top_m {
                (top_m, top_point) = (spot.above_m, spot.point as usize);
            }
        }
        let sight_m = Vector2::from(sum_m) / count;
        let middle_m = sensor_m + sight_m;
        let range_m = sight_m.norm();
        let top_m = f64::from(top_m);
        let top_below_m = passed_m(scan, top_point, top_m, range_m);
        let upper_m = upper_m(spots);
        let returns_seen = |before: Seen| {
            let seen = spots.iter().filter(|spot| spot.before == before);
            seen.map(|spot| f64::from(spot.returns)).sum()
        };
        let [new, old]: [f64; 2] = [Seen::Empty, Seen::Occupied].map(returns_seen);
        let is_upright = may_be_upright(spots, scan, range_m);
        let columns = Columns::of(spots, scan);
        let ends_m = columns
            .ends
            .map(|end| sensor_m + Vector2::from(end.at_m).map(f64::from));
        Self {
            middle_m,
            age_s: age_s / count,
            points: libm::roundf(returns) as usize,
            floor_m: f64::from(floor_m),
            top_m,
            top_below_m,
            upper_m,
            roughness_m: roughness_m(spots, scan),
            goes_on: columns.goes_on(),
            range_m,
            is_upper: f64::from(low) < (LOW_SHARE * count).max(2.0),
            ends_m,
            is_cut: cuts(lowest_layer..=highest_layer, columns.ends, scan),
            sensor_m,
            new: if is_upright { new } else { 0.0 },
            old: if is_upright { old } else { old + new },
            is_apart: false,
            person_log: None,
        }
    }

    /// Whether it is where nothing was before.
    pub(super) fn is_new(&self) -> bool {
        const FEWEST: f64 = 4.0;
        self.new >= FEWEST && self.new > self.old
    }

    /// When the sensor saw it, in a sweep that ended at a time.
    pub(super) fn seen_at(&self, end: Time) -> Time {
        end + Span::from_seconds(-self.age_s)
    }

    /// Direction from the sensor, as a unit vector.
    pub(super) fn sight(&self) -> Vector2<f64> {
        (self.middle_m - self.sensor_m) / self.range_m.max(0.1)
    }
}

/// Whether what is in places that were empty may stand upright: a rail or the rim of a bank, which rays of the past
/// passed above and below, is met by a single layer, where a road user is met by several.
fn may_be_upright(spots: &[Spot], scan: &Scan, range_m: f64) -> bool {
    /// The lowest road users: children, pushchairs, dogs.
    const LOWEST_M: f64 = 0.9;
    let step_m = range_m * (scan.slope(MAX_LAYERS / 2).0 - scan.slope(MAX_LAYERS / 2 - 1).0);
    let new = spots.iter().filter(|spot| spot.before == Seen::Empty);
    let layers = new.fold(0u32, |layers, spot| {
        layers | 1 << scan.layer(spot.point as usize)
    });
    layers.count_ones() > 1 || step_m > LOWEST_M
}

/// Where no ray passed over something, since something nearer hides what is above it.
pub(super) const COVERED_M: f64 = f64::MAX;
/// Where none did, since the highest ray meets it.
pub(super) const OUT_OF_VIEW_M: f64 = f64::INFINITY;

/// Where the next ray passed over the topmost point of something, so high above the ground and so far away: [`COVERED_M`]
/// or [`OUT_OF_VIEW_M`] where none did.
pub(super) fn passed_m(scan: &Scan, top_point: usize, top_m: f64, range_m: f64) -> f64 {
    let layer = scan.layer(top_point);
    if layer + 1 == MAX_LAYERS {
        return OUT_OF_VIEW_M;
    }
    if is_covered(scan, top_point) {
        return COVERED_M;
    }
    top_m + range_m * (scan.slope(layer + 1).0 - scan.slope(layer).0)
}

/// Whether something nearer hides what is above a point.
fn is_covered(scan: &Scan, point: usize) -> bool {
    let above_m = scan.range_m()[point + 1];
    above_m > 0.0 && f64::from(above_m) < f64::from(scan.range_m()[point]) - OCCLUDER_M
}

/// What is seen of a group column by column.
struct Columns<'a> {
    /// The leftmost and the rightmost of a group, seen from the sensor, which it does not surround;
    /// of a column, the lowest.
    ends: [&'a Spot; 2],
    /// Columns whose topmost return is not of the highest layer, and those of them in which the ray
    /// above that return met something at the same distance.
    seen_above: u32,
    going_on: u32,
}

impl<'a> Columns<'a> {
    /// `spots` must not be empty.
    fn of(spots: &'a [Spot], scan: &Scan) -> Self {
        let is_to_left = |of: &Spot, spot: &Spot| {
            let [of, spot] = [of, spot].map(|end| Vector2::from(end.at_m));
            of.perp(&spot) > 0.0
        };
        let mut columns = Self {
            ends: [&spots[0]; 2],
            seen_above: 0,
            going_on: 0,
        };
        let mut lowest = &spots[0];
        for (number, spot) in spots.iter().enumerate() {
            let point = spot.point as usize;
            let next = spots.get(number + 1);
            let is_top =
                next.is_none_or(|next| scan.column(next.point as usize) != scan.column(point));
            if !is_top {
                continue;
            }
            let [left, right] = &mut columns.ends;
            if is_to_left(left, lowest) {
                *left = lowest;
            }
            if is_to_left(lowest, right) {
                *right = lowest;
            }
            if scan.layer(point) + 1 < MAX_LAYERS {
                columns.seen_above += 1;
                columns.going_on += u32::from(same_above(scan, point).is_some());
            }
            lowest = next.unwrap_or(lowest);
        }
        columns
    }

    /// Share of the columns in which it goes on above.
    fn goes_on(&self) -> f64 {
        f64::from(self.going_on) / f64::from(self.seen_above.max(1))
    }
}

/// Whether something nearer stands directly to the left and to the right of a group, in its layers.
fn cuts(layers: RangeInclusive<usize>, ends: [&Spot; 2], scan: &Scan) -> [bool; 2] {
    // Azimuths grow clockwise, so that the left is where columns come before.
    let forward = scan.step_rad() > 0.0;
    let directions = [!forward, forward];
    let columns = scan.columns();
    std::array::from_fn(|side| {
        let point = ends[side].point as usize;
        let range_m = f64::from(scan.range_m()[point]);
        (1..=BESIDE).any(|step| {
            let step = if directions[side] {
                step
            } else {
                columns - step
            };
            let next = (scan.column(point) + step) % columns;
            layers.clone().any(|layer| {
                let beside_m = scan.range_m()[scan.index(next, layer)];
                beside_m > 0.0 && f64::from(beside_m) < range_m - OCCLUDER_M
            })
        })
    })
}

/// Diagonal of the returns above a bonnet or a handlebar, if they are not too few.
fn upper_m(spots: &[Spot]) -> Option<f64> {
    let mut count = 0;
    let upper = spots.iter().filter(|spot| spot.above_m > UPPER_M);
    let [low_m, high_m] = bounds_m(upper.inspect(|_| count += 1));
    (count >= FEWEST_UPPER).then(|| {
        let [along_m, across_m] = [0, 1].map(|axis| f64::from(high_m[axis] - low_m[axis]));
        libm::hypot(along_m, across_m)
    })
}

/// Median of the second difference of ranges along the layers: surfaces are smooth, leaves and
/// grass are not.
fn roughness_m(spots: &[Spot], scan: &Scan) -> f64 {
    /// More say nothing new.
    const MOST: usize = 64;
    let mut jumps_m = [0.0; MOST];
    let mut count = 0;
    let stride = spots.len().div_ceil(MOST).max(1);
    let some = spots.iter().step_by(stride);
    for fresh_m in some.filter_map(|spot| jump_m(scan, spot.point as usize)) {
        jumps_m[count] = fresh_m;
        count += 1;
    }
    median_jump_m(&mut jumps_m[..count])
}

/// By how much the range of a point jumps out of those of its neighbours in the layer; `None` where one is missing, or
/// of another surface.
pub(super) fn jump_m(scan: &Scan, point: usize) -> Option<f32> {
    /// A jump between two surfaces says nothing of either.
    const EDGE_M: f32 = 0.6;
    let (ranges_m, columns) = (scan.range_m(), scan.columns());
    let (column, layer) = (scan.column(point), scan.layer(point));
    let before = ranges_m[scan.index(scan.over_seam(column + columns - 1), layer)];
    let after = ranges_m[scan.index(scan.over_seam(column + 1), layer)];
    let here = ranges_m[point];
    let near = |other: f32| other > 0.0 && (other - here).abs() < EDGE_M;
    (near(before) && near(after)).then(|| (before + after - 2.0 * here).abs() * 0.5)
}

/// Median of jumps, if they are not too few.
pub(super) fn median_jump_m(jumps_m: &mut [f32]) -> f64 {
    /// Fewer neighbours say nothing; most things are smooth.
    const FEWEST: usize = 4;
    const UNKNOWN_M: f64 = 0.03;
    if jumps_m.len() < FEWEST {
        return UNKNOWN_M;
    }
    let middle = jumps_m.len() / 2;
    let (_, median_m, _) = jumps_m.select_nth_unstable_by(middle, f32::total_cmp);
    f64::from(*median_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::track::tests::spots_of;

    #[test]
    fn the_ends_of_a_group_are_its_outermost_columns_in_whatever_order_it_comes() {
        let columns = 100..120;
        let scan = scan_of(1800, |column, layer| match layer {
            4..9 if columns.contains(&column) => 1000,
            _ => 0,
        });
        let mut spots = spots_of(&scan);
        for turn in [0, 35, 50] {
            spots.rotate_left(turn);
            // Azimuths grow clockwise.
            let ends = Columns::of(&spots, &scan).ends;
            let ends = ends.map(|end| scan.column(end.point as usize));
            assert_eq!(ends, [columns.start, columns.end - 1]);
        }
    }

    #[test]
    fn the_end_of_a_group_is_the_lowest_return_of_its_column() {
        let scan = scan_of(1800, |column, layer| match layer {
            4..9 if (100..120).contains(&column) => 1000,
            _ => 0,
        });
        let mut spots = spots_of(&scan);
        // It begins in the middle, at a column's lowest.
        spots.rotate_left(35);
        let ends = Columns::of(&spots, &scan).ends;
        assert_eq!(ends.map(|end| scan.layer(end.point as usize)), [4, 4]);
    }

    #[test]
    fn a_group_goes_on_in_the_share_of_its_columns_that_could_be_seen_above_it() {
        // Of 20 columns every second is missed; of the ten others two reach the highest layer, and
        // above two more there is something at the same distance.
        let scan = scan_of(1800, |column, layer| match (column, layer) {
            (100 | 102, 4..MAX_LAYERS) => 1000,
            (104 | 106, 4..10) => 1000,
            (100..120, 4..9) if column % 2 == 0 => 1000,
            _ => 0,
        });
        let mut spots = spots_of(&scan);
        spots.retain(|spot| {
            let point = spot.point as usize;
            scan.layer(point) < 9 || scan.column(point) < 104
        });
        let columns = Columns::of(&spots, &scan);
        assert_eq!(columns.goes_on(), 0.25);
    }

    #[test]
    fn what_is_nearer_beside_a_group_cuts_it_in_any_of_its_layers_and_in_no_other() {
        let is_cut = |beside: usize| {
            let scan = scan_of(1800, |column, layer| match column {
                100..120 if (4..9).contains(&layer) => 1000,
                120..123 if layer == beside => 500,
                _ => 0,
            });
            let mut spots = spots_of(&scan);
            spots.retain(|spot| scan.column(spot.point as usize) < 120);
            Look::at(&spots, &scan, Vector2::zeros()).is_cut
        };
        for (layer, cut) in [(3, false), (4, true), (6, true), (8, true), (9, false)] {
            assert_eq!(is_cut(layer), [false, cut], "{layer}");
        }
    }
}
