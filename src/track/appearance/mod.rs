//! What a cluster looks like in one revolution: a dozen numbers and a height map of it, by which one network tells vehicles
//! from the rest and another one people. Their weights are fitted.

mod person;
mod vehicle;

use super::Scene;
use super::look::{jump_m, median_jump_m, passed_m};
use crate::cloud::MAX_LAYERS;
use crate::geometry::{Rectangle, turned};

/// How many numbers tell what a cluster looks like: sizes, heights and what is around it, and then its height map.
pub const FEATURES: usize = QUALITIES + CELLS[0] * CELLS[1];
const QUALITIES: usize = 12;
/// Cells of the height map, across the line of sight and along it, and their sides. Coarser ones of a metre find 7 of 100
/// vehicles less in `astyx_dev` at one false in two revolutions.
const CELLS: [usize; 2] = [16, 12];
const CELL_M: f64 = 0.5;

/// What one cluster looks like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Appearance {
    pub(super) features: [f64; FEATURES],
    /// Mean of its returns in the sensor frame.
    pub(super) middle_m: [f64; 2],
}

/// Looks at clusters. Its buffers are made once.
#[derive(Debug, Clone, Default)]
pub(super) struct Eye {
    places_m: Vec<[f64; 2]>,
    depths_m: Vec<f64>,
    beyond_m: Vec<f64>,
    jumps_m: Vec<f32>,
}

/// Fewer returns look like anything.
const FEWEST_RETURNS: usize = 5;
/// Of what is above a cluster, what stands within this distance of it may be a part of it.
const ABOVE_M: f64 = 2.0;
/// Nothing is told apart above this height, and farther behind or before than that.
const HIGHEST_M: f64 = 6.0;
const BEYOND_M: [f64; 2] = [-3.0, 10.0];

impl Eye {
    /// Looks at a cluster, given its points in array order; `None` if they are too few.
    pub(super) fn look(&mut self, points: &[u32], scene: &Scene<'_>) -> Option<Appearance> {
        if points.len() < FEWEST_RETURNS {
            return None;
        }
        let scan = scene.scan;
        let place_m =
            |point: u32| [scan.x_m(), scan.y_m()].map(|axis| f64::from(axis[point as usize]));
        self.places_m.clear();
        self.places_m
            .extend(points.iter().map(|point| place_m(*point)));
        let count = points.len() as f64;
        let sum_m = self
            .places_m
            .iter()
            .fold([0.0; 2], |sum, [x, y]| [sum[0] + x, sum[1] + y]);
        let rectangle = Rectangle::fit(&self.places_m, None);
        let (columns, above_m) = self.look_at_columns(points, scene);
        self.jumps_m.clear();
        let jumps_m = points
            .iter()
            .filter_map(|point| jump_m(scan, *point as usize));
        self.jumps_m.extend(jumps_m);
        let mut range_m = 0.0;
        let (mut top, mut floor_m) = (points[0], f32::INFINITY);
        for point in points {
            range_m += f64::from(scan.distance_m(*point as usize)) / count;
            let height_m = scene.heights_m[*point as usize];
            floor_m = floor_m.min(height_m);
            if height_m > scene.heights_m[top as usize] {
                top = *point;
            }
        }
        let top_m = f64::from(scene.heights_m[top as usize]);
        let middle_m = sum_m.map(|sum_m| sum_m / count);
        let mut features = [0.0; FEATURES];
        let (qualities, height_map) = features.split_at_mut(QUALITIES);
        qualities.copy_from_slice(&[
            libm::log(range_m + 1.0),
            libm::log(rectangle.length_m + 0.1),
            libm::log(rectangle.width_m + 0.1),
            top_m,
            passed_m(scan, top as usize, top_m, range_m).min(HIGHEST_M),
            f64::from(floor_m),
            libm::log(f64::from(columns)),
            above_m.min(HIGHEST_M),
            libm::log(median_jump_m(&mut self.jumps_m) + 0.01),
            libm::log(median(&mut self.depths_m) + 0.02),
            libm::log(mean_off_edge_m(&self.places_m, &rectangle) + 0.02),
            median(&mut self.beyond_m).clamp(BEYOND_M[0], BEYOND_M[1]),
        ]);
        let heights_m = points.iter().map(|point| scene.heights_m[*point as usize]);
        map_heights(height_map, &self.places_m, heights_m, middle_m);
        Some(Appearance { features, middle_m })
    }

    /// Goes through a cluster column by column: how deep each is, and how far behind its top the next
    /// ray above ends. Gives how many columns there are, and up to which height something stands above
    /// one of them, 0 for nothing.
    fn look_at_columns(&mut self, points: &[u32], scene: &Scene<'_>) -> (u32, f64) {
        let scan = scene.scan;
        let ranges_m = scan.range_m();
        let level_m = |point: usize| f64::from(scan.distance_m(point));
        self.depths_m.clear();
        self.beyond_m.clear();
        let (mut columns, mut highest_m) = (0, 0.0f64);
        for column in points.chunk_by(|a, b| scan.column(*a as usize) == scan.column(*b as usize)) {
            columns += 1;
            let top = column[column.len() - 1] as usize;
            let top_m = level_m(top);
            if column.len() > 1 {
                let count = column.len() as f64;
                let (sum_m, squares) = column.iter().fold((0.0, 0.0), |(sum_m, squares), point| {
                    let metres = level_m(*point as usize);
                    (sum_m + metres, squares + metres * metres)
                });
                let mean_m = sum_m / count;
                let variance = (squares / count - mean_m * mean_m).max(0.0);
                self.depths_m.push(libm::sqrt(variance));
            }
            let higher = top + 1..top + MAX_LAYERS - scan.layer(top);
            if let Some(next) = higher.clone().next() {
                self.beyond_m.push(if ranges_m[next] > 0.0 {
                    level_m(next) - top_m
                } else {
                    f64::INFINITY
                });
            }
            for above in higher {
                if ranges_m[above] > 0.0 && (level_m(above) - top_m).abs() < ABOVE_M {
                    highest_m = highest_m.max(f64::from(scene.heights_m[above]));
                }
            }
        }
        (columns, highest_m)
    }
}

impl Appearance {
    /// Logarithm of the odds that this is a vehicle, had as many been vehicles as where the network
    /// was fitted.
    pub(super) fn vehicle_log_odds(&self) -> f64 {
        vehicle::NETWORK.log_odds(&self.features)
    }

    /// Logarithm of how much likelier this is to be seen of somebody on foot than of anything else.
    pub(super) fn person_log_ratio(&self) -> f64 {
        person::NETWORK.log_odds(&self.features) - person::NETWORK.log_prior
    }
}

/// Hidden units of a network.
const UNITS: usize = 16;

/// A network of one hidden layer.
struct Network {
    units: &'static [Unit; UNITS],
    bias: f64,
    /// Logarithm of the odds before any look where it was fitted.
    log_prior: f64,
}

/// A hidden unit: weights of the features, its bias, and its own weight.
struct Unit {
    weights: [f64; FEATURES],
    bias: f64,
    share: f64,
}

impl Network {
    /// Logarithm of the odds that what looks like this is what the network was fitted to tell.
    fn log_odds(&self, features: &[f64; FEATURES]) -> f64 {
        let mut inner = self.units.each_ref().map(|unit| unit.bias);
        // Most cells of a height map are empty.
        let known = features.iter().enumerate();
        for (number, feature) in known.filter(|(_, feature)| **feature != 0.0) {
            for (sum, unit) in inner.iter_mut().zip(self.units) {
                *sum += unit.weights[number] * feature;
            }
        }
        let units = self.units.iter().zip(inner);
        units.fold(self.bias, |sum, (unit, inner)| {
            sum + unit.share * libm::tanh(inner)
        })
    }
}

/// Maps a cluster's heights: the greatest height above the ground in each, 0 where there is nothing. They lie
/// row by row, from the nearest place on along the line of sight, each row from left to right of the cluster's middle.
fn map_heights(
    height_map: &mut [f64],
    places_m: &[[f64; 2]],
    heights_m: impl Iterator<Item = f32>,
    middle_m: [f64; 2],
) {
    let [across, along] = CELLS;
    let range_m = libm::hypot(middle_m[0], middle_m[1]).max(CELL_M);
    let [cosine, sine] = middle_m.map(|middle_m| middle_m / range_m);
    let in_sight_m = |place_m: &[f64; 2]| turned(place_m, sine, cosine);
    let along_m = places_m.iter().map(|place_m| in_sight_m(place_m)[0]);
    let nearest_m = along_m.fold(f64::INFINITY, f64::min);
    for (place_m, height_m) in places_m.iter().zip(heights_m) {
        let [along_m, left_m] = in_sight_m(place_m);
        let column = libm::floor(-left_m / CELL_M) + (across / 2) as f64;
        let row = (along_m - nearest_m) / CELL_M;
        if (0.0..across as f64).contains(&column) && row < along as f64 {
            let cell = &mut height_map[row as usize * across + column as usize];
            *cell = cell.max(f64::from(height_m));
        }
    }
}

/// How far places lie from the nearest edge of the box around them, on average: on a vehicle's sides
/// they lie along two edges, in a bush anywhere.
fn mean_off_edge_m(places_m: &[[f64; 2]], rectangle: &Rectangle) -> f64 {
    let (sine, cosine) = libm::sincos(rectangle.yaw_rad);
    let middle = turned(&rectangle.centre_m, sine, cosine);
    let half_m = [0.5 * rectangle.length_m, 0.5 * rectangle.width_m];
    let off_m = places_m.iter().map(|place_m| {
        let at = turned(place_m, sine, cosine);
        let [along_m, across_m] = [0, 1].map(|axis| half_m[axis] - (at[axis] - middle[axis]).abs());
        along_m.min(across_m)
    });
    off_m.sum::<f64>() / places_m.len() as f64
}

/// The upper median; 0 of nothing.
fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::cloud::Scan;
    use crate::cloud::tests::scan_of;
    use crate::track::tests::with_scene;

    /// Upright walls around a place: where from the sensor, how far they reach to the right and ahead,
    /// and from which height above the ground to which.
    #[derive(Debug, Clone, Copy)]
    pub(in crate::track) struct Block {
        pub(in crate::track) middle_m: [f64; 2],
        pub(in crate::track) sides_m: [f64; 2],
        pub(in crate::track) heights_m: [f64; 2],
    }

    /// A car 7 m ahead and 5 m to the right, or what else has such sizes.
    pub(in crate::track) const CAR: [Block; 2] = [
        Block {
            middle_m: [5.0, 7.0],
            sides_m: [1.75, 4.3],
            heights_m: [0.2, 0.9],
        },
        Block {
            middle_m: [5.0, 6.8],
            sides_m: [1.4, 2.4],
            heights_m: [0.9, 1.5],
        },
    ];

    /// What a sensor 1.9 m above the ground sees of some blocks.
    pub(in crate::track) fn scan_of_blocks(blocks: &[Block]) -> Scan {
        scan_of(1800, |column, layer| {
            let azimuth_rad = (0.2 * column as f64).to_radians();
            let elevation_rad = (2.0 * layer as f64 - 15.0).to_radians();
            let direction = [azimuth_rad.sin(), azimuth_rad.cos()];
            let near_m = |block: &Block| {
                let (mut enter_m, mut leave_m) = (0.0f64, f64::MAX);
                for (axis, rate) in direction.into_iter().enumerate() {
                    let half_m = 0.5 * block.sides_m[axis];
                    let ends_m =
                        [-half_m, half_m].map(|end_m| (block.middle_m[axis] + end_m) / rate);
                    enter_m = enter_m.max(ends_m[0].min(ends_m[1]));
                    leave_m = leave_m.min(ends_m[0].max(ends_m[1]));
                }
                let [low_m, high_m] = block.heights_m;
                let height_m = 1.9 + enter_m * elevation_rad.tan();
                let is_met = enter_m < leave_m && (low_m..high_m).contains(&height_m);
                is_met.then_some(enter_m / elevation_rad.cos())
            };
            let nearest_m = blocks.iter().filter_map(near_m).reduce(f64::min);
            nearest_m.map_or(0, |metres| (100.0 * metres) as u16)
        })
    }

    pub(in crate::track) fn points(scan: &Scan) -> Vec<u32> {
        let all = 0..scan.len() as u32;
        all.filter(|point| scan.has_return(*point as usize))
            .collect()
    }

    fn look(scan: &Scan) -> Appearance {
        let points = points(scan);
        let appearance = with_scene(scan, |scene| Eye::default().look(&points, scene));
        appearance.expect("enough returns")
    }

    #[test]
    fn sizes_heights_and_what_the_rays_above_meet_are_told() {
        let car = look(&scan_of_blocks(&CAR));
        let &[
            range,
            long,
            short,
            top_m,
            passed_m,
            floor_m,
            _,
            above_m,
            _,
            _,
            _,
            beyond_m,
        ] = car.features.first_chunk().expect("they come first");
        let about = |value: f64, expected: f64| (value - expected).abs() < 0.2;
        assert!(about(range.exp() - 1.0, 7.5), "{car:?}");
        assert!(
            about(long.exp() - 0.1, 4.3) && about(short.exp() - 0.1, 1.75),
            "{car:?}"
        );
        assert!(
            about(top_m, 1.4) && about(passed_m, 1.7) && about(floor_m, 0.3),
            "{car:?}"
        );
        assert_eq!((above_m, beyond_m), (0.0, 10.0));
        assert!(
            about(car.middle_m[0], 4.5) && about(car.middle_m[1], 5.9),
            "{car:?}"
        );
    }

    #[test]
    fn what_hangs_over_a_cluster_is_seen_within_two_metres_behind_it_only() {
        let above_m = |behind_cm: u16| {
            let scan = scan_of(1800, |column, layer| match (column, layer) {
                (100..140, 4..7) => 1000,
                (100..140, 10..12) => 1000 + behind_cm,
                _ => 0,
            });
            let mut cluster = points(&scan);
            cluster.retain(|point| scan.layer(*point as usize) < 7);
            let seen = with_scene(&scan, |scene| Eye::default().look(&cluster, scene));
            seen.map(|appearance| appearance.features[7])
        };
        assert!(above_m(150).is_some_and(|above_m| (above_m - 3.3).abs() < 0.2));
        assert_eq!(above_m(250), Some(0.0));
    }

    #[test]
    fn a_car_looks_like_a_vehicle_and_a_wall_a_post_and_a_person_do_not() {
        let odds = |blocks: &[Block]| look(&scan_of_blocks(blocks)).vehicle_log_odds();
        assert!(odds(&CAR) > 0.5, "{}", odds(&CAR));
        for (sides_m, high_m) in [([0.3, 20.0], 2.4), ([0.3, 0.3], 2.4), ([0.6, 0.4], 1.8)] {
            let other = Block {
                sides_m,
                heights_m: [0.1, high_m],
                ..CAR[0]
            };
            assert!(odds(&[other]) < -1.0, "{sides_m:?} {}", odds(&[other]));
        }
    }

    #[test]
    fn somebody_who_stands_looks_like_a_person_and_a_post_a_board_and_a_car_do_not() {
        let ratio = |blocks: &[Block]| look(&scan_of_blocks(blocks)).person_log_ratio();
        let of = |sides_m, heights_m| Block {
            sides_m,
            heights_m,
            ..CAR[0]
        };
        let legs = of([0.3, 0.25], [0.05, 0.85]);
        let trunk = of([0.5, 0.3], [0.85, 1.5]);
        let head = of([0.2, 0.2], [1.5, 1.75]);
        assert!(
            ratio(&[legs, trunk, head]) > 1.0,
            "{}",
            ratio(&[legs, trunk, head])
        );
        let post = of([0.1, 0.1], [0.0, 2.4]);
        let board = of([1.2, 0.05], [0.9, 2.4]);
        for other in [&[post][..], &[board], &CAR] {
            assert!(ratio(other) < -0.5, "{other:?} {}", ratio(other));
        }
    }

    #[test]
    fn the_height_map_of_a_car_is_as_high_as_it_and_of_one_on_the_left_that_of_one_on_the_right_in_a_mirror()
     {
        let on_the_left = CAR.map(|block| Block {
            middle_m: [-block.middle_m[0], block.middle_m[1]],
            ..block
        });
        let [left, right] = [on_the_left, CAR].map(|blocks| {
            let features = look(&scan_of_blocks(&blocks)).features;
            features[QUALITIES..].to_vec()
        });
        let mirrored = right.chunks(CELLS[0]).flat_map(|row| row.iter().rev());
        let off_m = left.iter().zip(mirrored).map(|(a, b)| (a - b).abs());
        assert!(
            off_m.clone().fold(0.0, f64::max) < 0.1,
            "{left:?} {right:?}"
        );
        let highest_m = right.iter().copied().fold(0.0, f64::max);
        assert!((1.2..1.5).contains(&highest_m), "{highest_m}");
        // The nearest corner is in the first row, and the side goes on behind it.
        assert!((0..6).all(|row| {
            right[row * CELLS[0]..][..CELLS[0]]
                .iter()
                .any(|cell_m| *cell_m > 0.0)
        }));
    }

    #[test]
    fn a_few_returns_look_like_nothing() {
        let scan = scan_of(1800, |column, layer| {
            u16::from(layer == 7 && column < 4) * 1000
        });
        let seen = with_scene(&scan, |scene| Eye::default().look(&points(&scan), scene));
        assert_eq!(seen, None);
    }
}
