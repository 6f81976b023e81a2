//! What is seen of an object in one revolution.
//!
//! A sensor sees one or two sides of a vehicle. The edges that face it are measured, the others
//! follow from the size, which `shape` knows.

use nalgebra::{Matrix2, Vector2};

use super::rectangle::{Extent, turned};
use super::spots::{Spot, places_m};
use crate::cloud::{MAX_LAYERS, Scan};
use crate::float::{greatest, least};

/// A group of returns in the axes of a box.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// Extent along and across the yaw, relative to the origin of the frame.
    low_m: [f64; 2],
    high_m: [f64; 2],
    /// Whether an end is the object's own: it faces the sensor and nothing stands before it.
    low_is_edge: [bool; 2],
    high_is_edge: [bool; 2],
    /// Whether both ends of an axis can be seen, so that its extent is the object's.
    is_whole: [bool; 2],
    /// Only a cabin or a rider is seen: what is below reaches farther to both ends.
    is_upper: bool,
    sine: f64,
    cosine: f64,
    range_m: f64,
}

/// Everything that is measured of a group without knowing the object.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    /// Middle of the returns.
    pub(super) middle_m: Vector2<f64>,
    /// Mean time before the end of the sweep.
    pub(super) age_s: f64,
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
    is_upper: bool,
    /// Its leftmost and rightmost returns, seen from the sensor.
    pub(super) ends_m: [Vector2<f64>; 2],
    /// Something nearer hides what is to the left or to the right.
    pub(super) is_cut: [bool; 2],
    sensor_m: Vector2<f64>,
}

/// What begins higher has lost its wheels and bumpers to the ground, or between two layers.
const BELT_M: f32 = 0.55;
/// Share of returns below it that shows a body.
const LOW_SHARE: f64 = 0.15;
/// A nearer return by this much beside an object hides a part of it.
const OCCLUDER_M: f64 = 0.7;
/// Columns beside an object that are looked at.
const BESIDE: usize = 3;

impl Look {
    /// `spots` must not be empty.
    pub(super) fn at(spots: &[Spot], scan: &Scan, sensor_m: Vector2<f64>) -> Self {
        let count = spots.len() as f64;
        let (mut sum_m, mut age_s, mut low) = ([0.0; 2], 0.0, 0u32);
        let (mut floor_m, mut top_m, mut top_point) = (f32::INFINITY, f32::NEG_INFINITY, 0);
        for spot in spots {
            for (sum_m, metres) in sum_m.iter_mut().zip(spot.at_m) {
                *sum_m += f64::from(metres);
            }
            age_s += f64::from(spot.age_s);
            low += u32::from(spot.above_m <= BELT_M);
            floor_m = least(floor_m, spot.above_m);
            if spot.above_m > top_m {
                (top_m, top_point) = (spot.above_m, spot.point as usize);
            }
        }
        let sight_m = Vector2::from(sum_m) / count;
        let middle_m = sensor_m + sight_m;
        let range_m = sight_m.norm();
        let top_m = f64::from(top_m);
        let layer = scan.layer(top_point);
        let top_below_m = if layer + 1 < MAX_LAYERS && !is_covered(scan, top_point) {
            top_m + range_m * (scan.slope(layer + 1).0 - scan.slope(layer).0)
        } else {
            f64::MAX
        };
        let ends = ends(spots);
        let ends_m = ends.map(|end| sensor_m + Vector2::from(end.at_m).map(f64::from));
        Self {
            middle_m,
            age_s: age_s / count,
            points: spots.len(),
            floor_m: f64::from(floor_m),
            top_m,
            top_below_m,
            upper_m: upper_m(spots),
            roughness_m: roughness_m(spots, scan),
            goes_on: goes_on(spots, scan),
            range_m,
            is_upper: f64::from(low) < (LOW_SHARE * count).max(2.0),
            ends_m,
            is_cut: cuts(spots, ends, scan),
            sensor_m,
        }
    }

    /// Direction from the sensor, as a unit vector.
    pub(super) fn sight(&self) -> Vector2<f64> {
        (self.middle_m - self.sensor_m) / self.range_m.max(0.1)
    }

    /// The same group in the axes of a yaw.
    pub(super) fn view(&self, spots: &[Spot], yaw_rad: f64) -> View {
        let (sine, cosine) = libm::sincos(yaw_rad);
        let extent = Extent::of(places_m(spots), sine, cosine);
        let sensor = turned(&self.sensor_m.into(), sine, cosine);
        let [low_m, high_m] =
            [extent.low, extent.high].map(|end| [0, 1].map(|axis| sensor[axis] + end[axis]));
        let sight = self.middle_m - self.sensor_m;
        let left = Vector2::new(-sight.y, sight.x).normalize();
        let left = turned(&left.into(), sine, cosine);
        let mut view = View {
            low_m,
            high_m,
            low_is_edge: [false; 2],
            high_is_edge: [false; 2],
            is_whole: [false; 2],
            is_upper: false,
            sine,
            cosine,
            range_m: self.range_m,
        };
        for axis in 0..2 {
            // An end that lies to a hidden side is not the object's own.
            let hidden = |sign: f64| {
                (self.is_cut[0] && left[axis] * sign > 0.35)
                    || (self.is_cut[1] && -left[axis] * sign > 0.35)
            };
            let middle_m = 0.5 * (low_m[axis] + high_m[axis]);
            let reach_m = 0.5 * (high_m[axis] - low_m[axis]);
            let offset_m = sensor[axis] - middle_m;
            // The side along this axis shows where the line of sight crosses it.
            let is_across = left[axis].abs() > 0.35;
            let faces_low = offset_m < -reach_m;
            let faces_high = offset_m > reach_m;
            view.low_is_edge[axis] = (faces_low || is_across) && !hidden(-1.0);
            view.high_is_edge[axis] = (faces_high || is_across) && !hidden(1.0);
            // Of an end that faces away only the corner is seen.
            if faces_low && !(is_across && reach_m > 0.8) {
                view.high_is_edge[axis] = false;
            }
            if faces_high && !(is_across && reach_m > 0.8) {
                view.low_is_edge[axis] = false;
            }
            view.is_whole[axis] = is_across && !hidden(1.0) && !hidden(-1.0);
        }
        if self.is_upper {
            view.is_whole[0] = false;
            view.is_upper = true;
        }
        view
    }
}

impl View {
    /// Length and width of what is seen.
    pub(super) fn extent_m(&self) -> [f64; 2] {
        [0, 1].map(|axis| self.high_m[axis] - self.low_m[axis])
    }

    /// Whether an extent is the whole of its side.
    pub(super) fn is_whole(&self) -> [bool; 2] {
        self.is_whole
    }

    /// Where the middle of a box of this size is, given where it is expected, and how sure
    /// that is, as a covariance in the local frame.
    pub(super) fn centre(
        &self,
        size_m: [f64; 2],
        size_deviation_m: [f64; 2],
        expected_m: Vector2<f64>,
    ) -> (Vector2<f64>, Matrix2<f64>) {
        /// Standard deviation of an edge: noise of ranges and roundness of corners.
        const EDGE_M: f64 = 0.07;
        /// Share of what is missing below a cabin by which its middle is off the vehicle's.
        const UPPER: f64 = 0.4;
        /// Share of the length that reaches out below a cabin to either end.
        const INSET: f64 = 0.1;
        /// What half a step between columns adds for each metre of range.
        const EDGE_PER_M: f64 = 0.002;
        let expected = [
            expected_m.x * self.cosine + expected_m.y * self.sine,
            expected_m.y * self.cosine - expected_m.x * self.sine,
        ];
        let edge_m = EDGE_M + EDGE_PER_M * self.range_m;
        let mut centre = [0.0; 2];
        let mut deviation = [0.0; 2];
        for axis in 0..2 {
            let (low, high) = (self.low_m[axis], self.high_m[axis]);
            let half_m = 0.5 * size_m[axis].max(high - low);
            let unsure_m = 0.5 * size_deviation_m[axis];
            let is_inset = self.is_upper && axis == 0;
            let inset_m = if is_inset {
                (INSET * size_m[axis]).min((half_m - 0.5 * (high - low)).max(0.0))
            } else {
                0.0
            };
            let edge_m = edge_m + inset_m;
            (centre[axis], deviation[axis]) =
                match (self.low_is_edge[axis], self.high_is_edge[axis]) {
                    (true, true) if is_inset => {
                        let slack_m = half_m - 0.5 * (high - low);
                        (0.5 * (low + high), edge_m + UPPER * slack_m)
                    }
                    // Seen from end to end; if it is shorter than known, some of it was missed.
                    (true, true) => {
                        let missed_m = half_m - 0.5 * (high - low);
                        (
                            expected[axis].clamp(
                                0.5 * (low + high) - 0.5 * missed_m,
                                0.5 * (low + high) + 0.5 * missed_m,
                            ),
                            edge_m + 0.5 * missed_m,
                        )
                    }
                    (true, false) => (low - inset_m + half_m, libm::hypot(edge_m, unsure_m)),
                    (false, true) => (high + inset_m - half_m, libm::hypot(edge_m, unsure_m)),
                    (false, false) => {
                        let slack_m = half_m - 0.5 * (high - low);
                        let middle = 0.5 * (low + high);
                        (
                            expected[axis].clamp(middle - slack_m, middle + slack_m),
                            edge_m + slack_m,
                        )
                    }
                };
        }
        let local = |u: f64, v: f64| {
            Vector2::new(
                u * self.cosine - v * self.sine,
                u * self.sine + v * self.cosine,
            )
        };
        let turn = Matrix2::new(self.cosine, -self.sine, self.sine, self.cosine);
        let spread = Matrix2::new(
            deviation[0] * deviation[0],
            0.0,
            0.0,
            deviation[1] * deviation[1],
        );
        (
            local(centre[0], centre[1]),
            turn * spread * turn.transpose(),
        )
    }
}

/// The return directly above one, if it is there and of the same thing.
pub(super) fn same_above(scan: &Scan, point: usize) -> Option<usize> {
    /// Difference of ranges within which it is.
    const SAME_M: f32 = 0.8;
    let ranges_m = scan.range_m();
    let above = point + 1;
    let is_same = scan.layer(above) > 0
        && ranges_m[above] > 0.0
        && (ranges_m[above] - ranges_m[point]).abs() < SAME_M;
    is_same.then_some(above)
}

/// Whether something nearer hides what is above a point.
fn is_covered(scan: &Scan, point: usize) -> bool {
    let above_m = scan.range_m()[point + 1];
    above_m > 0.0 && f64::from(above_m) < f64::from(scan.range_m()[point]) - OCCLUDER_M
}

/// Share of a group's columns in which the ray above its topmost return met something at the
/// same distance.
fn goes_on(spots: &[Spot], scan: &Scan) -> f64 {
    let (mut columns, mut on) = (0u32, 0u32);
    for (number, spot) in spots.iter().enumerate() {
        let point = spot.point as usize;
        let is_top = spots
            .get(number + 1)
            .is_none_or(|next| scan.column(next.point as usize) != scan.column(point));
        if is_top && scan.layer(point) + 1 < MAX_LAYERS {
            columns += 1;
            on += u32::from(same_above(scan, point).is_some());
        }
    }
    f64::from(on) / f64::from(columns.max(1))
}

/// The leftmost and the rightmost of a group, seen from the sensor, which it does not surround; of
/// a column, the lowest.
fn ends(spots: &[Spot]) -> [&Spot; 2] {
    let column_of = |spot: &Spot| spot.point as usize / MAX_LAYERS;
    let is_to_left =
        |of: &Spot, spot: &Spot| of.at_m[0] * spot.at_m[1] - of.at_m[1] * spot.at_m[0] > 0.0;
    spots
        .chunk_by(|a, b| column_of(a) == column_of(b))
        .map(|column| &column[0])
        .fold([&spots[0]; 2], |[left, right], spot| {
            [
                if is_to_left(left, spot) { spot } else { left },
                if is_to_left(spot, right) { spot } else { right },
            ]
        })
}

/// Whether something nearer stands directly to the left and to the right of a group.
fn cuts(spots: &[Spot], ends: [&Spot; 2], scan: &Scan) -> [bool; 2] {
    let layers = spots.iter().map(|spot| scan.layer(spot.point as usize));
    let (low, high) = layers.fold((MAX_LAYERS, 0), |(low, high), layer| {
        (low.min(layer), high.max(layer))
    });
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
            (low..=high).any(|layer| {
                let beside_m = scan.range_m()[scan.index(next, layer)];
                beside_m > 0.0 && f64::from(beside_m) < range_m - OCCLUDER_M
            })
        })
    })
}

/// Diagonal of the returns above the height of bonnets and handlebars.
fn upper_m(spots: &[Spot]) -> Option<f64> {
    const UPPER_M: f32 = 1.1;
    let (mut low_m, mut high_m, mut count) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2], 0u32);
    for spot in spots {
        let is_upper = spot.above_m > UPPER_M;
        for (axis, metres) in spot.at_m.into_iter().enumerate() {
            low_m[axis] = least(low_m[axis], if is_upper { metres } else { f32::INFINITY });
            high_m[axis] = greatest(
                high_m[axis],
                if is_upper { metres } else { f32::NEG_INFINITY },
            );
        }
        count += u32::from(is_upper);
    }
    let side_m = |axis: usize| f64::from(high_m[axis] - low_m[axis]);
    (count >= 2).then(|| libm::hypot(side_m(0), side_m(1)))
}

/// Median of the second difference of ranges along the layers: surfaces are smooth, leaves and
/// grass are not.
fn roughness_m(spots: &[Spot], scan: &Scan) -> f64 {
    /// More say nothing new.
    const MOST: usize = 128;
    /// A jump between two surfaces says nothing of either.
    const EDGE_M: f32 = 0.6;
    let mut jumps = [0.0f32; MOST];
    let mut count = 0;
    let ranges = scan.range_m();
    let columns = scan.columns();
    let stride = spots.len().div_ceil(MOST).max(1);
    for spot in spots.iter().step_by(stride) {
        let point = spot.point as usize;
        let (column, layer) = (scan.column(point), scan.layer(point));
        let before = ranges[scan.index(scan.over_seam(column + columns - 1), layer)];
        let after = ranges[scan.index(scan.over_seam(column + 1), layer)];
        let here = ranges[point];
        let near = |other: f32| other > 0.0 && (other - here).abs() < EDGE_M;
        if near(before) && near(after) {
            jumps[count] = (before + after - 2.0 * here).abs() * 0.5;
            count += 1;
        }
    }
    /// Fewer neighbours say nothing; most things are smooth.
    const FEWEST: usize = 4;
    if count < FEWEST {
        return UNKNOWN_ROUGHNESS_M;
    }
    let middle = count / 2;
    let (_, median, _) = jumps[..count].select_nth_unstable_by(middle, f32::total_cmp);
    f64::from(*median)
}

const UNKNOWN_ROUGHNESS_M: f64 = 0.03;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::track::tests::with_scene;

    #[test]
    fn the_ends_of_a_group_are_its_outermost_columns_in_whatever_order_it_comes() {
        let columns = 100..120;
        let scan = scan_of(1800, |column, layer| match layer {
            4..9 if columns.contains(&column) => 1000,
            _ => 0,
        });
        let mut spots: Vec<Spot> = with_scene(&scan, |scene| {
            let points = columns
                .clone()
                .flat_map(|column| (4..9).map(move |layer| column * MAX_LAYERS + layer));
            points
                .map(|point| {
                    let [x, y, _] = scan.point_m(point);
                    Spot::new(scene, point as u32, [x, y], 0)
                })
                .collect()
        });
        for turn in [0, 35, 50] {
            spots.rotate_left(turn);
            // Azimuths grow clockwise.
            let ends = ends(&spots).map(|end| scan.column(end.point as usize));
            assert_eq!(ends, [columns.start, columns.end - 1]);
        }
    }
}
