//! From three dimensions to two: what the rays of a column say of the cells below them.

use super::{GridParameters, NoReturn};
use crate::cloud::{MAX_LAYERS, Scan};
use crate::float::least;
use crate::ground::Plane;

/// The rays of a revolution over the ground, by columns and layers. From the side a ray is
/// straight: its height above the ground changes evenly with the horizontal distance.
#[derive(Debug, Clone, Default)]
pub(super) struct Evidence {
    /// Height of the sensor.
    sensor_m: f32,
    /// How far each ray is known to go.
    ends_m: Vec<[f32; MAX_LAYERS]>,
    /// Change of its height for each metre.
    rises: Vec<[f32; MAX_LAYERS]>,
    /// Distance of every return, and of every one that is an obstacle.
    returns_m: Vec<[f32; MAX_LAYERS]>,
    obstacles_m: Vec<[f32; MAX_LAYERS]>,
    /// Of a column's nearest obstacle.
    nearest_m: Vec<f32>,
    /// Whether the last column stands beside the first.
    is_round: bool,
}

/// A stretch of a column's way, seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stretch {
    pub(super) column: usize,
    pub(super) from_m: f32,
    pub(super) to_m: f32,
}

/// There is nothing.
pub(super) const NONE_M: f32 = f32::MAX;
/// Columns to either side in which a surface is looked for that a ray may have missed: one that
/// was lost on it, or one that found a gap between leaves.
const BESIDE: usize = 2;
/// How far before a return its ray is known to be free: returns scatter along the ray.
const BEFORE_RETURN_M: f32 = 0.05;
/// How unsure the height of a ray that does not land is for each metre of distance: the tilt of
/// the ground is known to a degree.
const UNSURE_PER_M: f32 = 0.02;

impl Evidence {
    /// Takes a revolution's rays in.
    pub(super) fn begin(
        &mut self,
        scan: &Scan,
        plane: &Plane,
        ground: &[bool],
        heights_m: &[f32],
        parameters: &GridParameters,
    ) {
        self.sensor_m = plane.height_m() as f32;
        self.is_round = scan.sensor().sees_all_round();
        let (low_m, high_m) = (parameters.obstacle_low_m, parameters.obstacle_high_m);
        let (low_m, high_m) = (low_m as f32, high_m as f32);
        let no_return_m = match parameters.no_return {
            NoReturn::Clear => parameters.reach_m,
            NoReturn::Limit => parameters.no_return_limit_m,
            NoReturn::Ignore => 0.0,
        } as f32;
        let normal = plane.normal().map(|part| part as f32);
        let slopes: [_; MAX_LAYERS] = std::array::from_fn(|layer| scan.slope(layer));
        let tangents = slopes.map(|(tangent, _)| tangent as f32);
        let cosines = slopes.map(|(_, cosine)| cosine as f32);
        for rays in [
            &mut self.ends_m,
            &mut self.rises,
            &mut self.returns_m,
            &mut self.obstacles_m,
        ] {
            rays.clear();
        }
        self.nearest_m.clear();
        let ranges_m = scan.range_m().as_chunks::<MAX_LAYERS>().0;
        let heights_m = heights_m.as_chunks::<MAX_LAYERS>().0;
        let ground = ground.as_chunks::<MAX_LAYERS>().0;
        for (column, ranges_m) in ranges_m.iter().enumerate() {
            let [sine, cosine] = scan.direction(column);
            let level = normal[0] * sine + normal[1] * cosine;
            let mut rises = [0.0; MAX_LAYERS];
            let mut ends_m = [0.0; MAX_LAYERS];
            let mut returns_m = [NONE_M; MAX_LAYERS];
            let mut obstacles_m = [NONE_M; MAX_LAYERS];
            for layer in 0..MAX_LAYERS {
                let (range_m, height_m) = (ranges_m[layer], heights_m[column][layer]);
                let has_return = range_m > 0.0;
                let distance_m = range_m * cosines[layer];
                let by_return = (height_m - self.sensor_m) / distance_m;
                let by_plane = level + normal[2] * tangents[layer];
                let lands_m = if by_plane < 0.0 {
                    -self.sensor_m / by_plane
                } else {
                    NONE_M
                };
                let unseen_m = if range_m == 0.0 {
                    least(lands_m, no_return_m)
                } else {
                    0.0
                };
                let is_obstacle = has_return
                    & !ground[column][layer]
                    & (height_m >= low_m)
                    & (height_m <= high_m);
                rises[layer] = if has_return { by_return } else { by_plane };
                ends_m[layer] = if has_return {
                    distance_m - BEFORE_RETURN_M
                } else {
                    unseen_m
                };
                returns_m[layer] = if has_return { distance_m } else { NONE_M };
                obstacles_m[layer] = if is_obstacle { distance_m } else { NONE_M };
            }
            self.rises.push(rises);
            self.ends_m.push(ends_m);
            self.returns_m.push(returns_m);
            self.obstacles_m.push(obstacles_m);
            self.nearest_m
                .push(obstacles_m.into_iter().fold(NONE_M, least));
        }
    }

    /// Distance of a column's nearest obstacle.
    pub(super) fn nearest_m(&self, column: usize) -> f32 {
        self.nearest_m[column]
    }

    /// Distances of a column's obstacles, by layers; [`NONE_M`] where there is none.
    pub(super) fn obstacles_m(&self, column: usize) -> &[f32; MAX_LAYERS] {
        &self.obstacles_m[column]
    }

    /// Where a column's rays are known to have passed low enough to say that nothing is there:
    /// around the sensor, and before the first obstacle where a ray is below the height of what
    /// hangs over the road; behind it only where one came over it and down to the ground again.
    pub(super) fn passed(
        &self,
        column: usize,
        parameters: &GridParameters,
        passed: &mut Vec<Stretch>,
    ) {
        let reach_m = parameters.reach_m as f32;
        let (mut nearest_m, mut beside_m) = (reach_m, [NONE_M; MAX_LAYERS]);
        let mut look_beside = |column: usize| {
            nearest_m = least(nearest_m, self.nearest_m[column]);
            for (beside_m, return_m) in beside_m.iter_mut().zip(&self.returns_m[column]) {
                *beside_m = least(*beside_m, *return_m);
            }
        };
        if column >= BESIDE && column + BESIDE < self.nearest_m.len() {
            (column - BESIDE..=column + BESIDE).for_each(&mut look_beside);
        } else {
            beside(column, self.nearest_m.len(), self.is_round).for_each(&mut look_beside);
        }
        let (returns_m, ends_m) = (&self.returns_m[column], &self.ends_m[column]);
        let (from_m, below_m) = self.below(column, parameters.obstacle_high_m as f32);
        let mut to_m = [0.0; MAX_LAYERS];
        for layer in 0..MAX_LAYERS {
            // A single ray that is lost on a surface does not go through it.
            let has_return = returns_m[layer] < NONE_M;
            let before_m = if has_return { NONE_M } else { beside_m[layer] };
            let end_m = least(least(ends_m[layer], before_m), nearest_m);
            to_m[layer] = least(end_m, below_m[layer]);
        }
        let mut stretches = Stretches::new(column, parameters.nearest_m as f32, passed);
        if from_m == [0.0; MAX_LAYERS] {
            stretches.add(0.0, to_m.into_iter().fold(0.0, f32::max));
        } else {
            for (from_m, to_m) in from_m.into_iter().zip(to_m) {
                stretches.add(from_m, to_m);
            }
        }
        let goes_beyond = |layer: usize| (returns_m[layer] < NONE_M) & (ends_m[layer] > nearest_m);
        if nearest_m < reach_m && (0..MAX_LAYERS).any(goes_beyond) {
            let (from_m, below_m) = self.below(column, parameters.low_pass_m as f32);
            // A ray below an obstacle that higher rays met goes on under it.
            let mut roof_m = reach_m;
            for layer in (0..MAX_LAYERS).rev() {
                if goes_beyond(layer) {
                    let end_m = least(least(ends_m[layer], below_m[layer]), roof_m);
                    stretches.add(from_m[layer].max(nearest_m), end_m);
                }
                roof_m = least(roof_m, self.obstacles_m[column][layer]);
            }
        }
        stretches.finish();
    }

    /// Distances between which each ray of a column is lower than a height.
    fn below(&self, column: usize, height_m: f32) -> ([f32; MAX_LAYERS], [f32; MAX_LAYERS]) {
        let until_m = height_m - self.sensor_m;
        let (mut from_m, mut to_m) = ([0.0; MAX_LAYERS], [0.0; MAX_LAYERS]);
        for (layer, rise) in self.rises[column].into_iter().enumerate() {
            let at_m = until_m / rise;
            let falls = rise < 0.0;
            from_m[layer] = if falls & (at_m > 0.0) { at_m } else { 0.0 };
            let rises_to_m = if at_m > 0.0 { at_m } else { 0.0 };
            to_m[layer] = if falls { NONE_M } else { rises_to_m };
        }
        (from_m, to_m)
    }

    /// Height below which the lowest of a column's rays that go on beyond a distance is, as far
    /// as that is known. A ray that lands has a known height all along.
    pub(super) fn lowest_pass_m(&self, column: usize, distance_m: f32, ground: &[bool]) -> f32 {
        let ground = &ground[column * MAX_LAYERS..];
        let rays = self.ends_m[column]
            .iter()
            .zip(&self.rises[column])
            .zip(ground);
        rays.filter(|((end_m, _), _)| **end_m > distance_m)
            .map(|((_, rise), lands)| {
                let unsure_per_m = if *lands { 0.0 } else { UNSURE_PER_M };
                self.sensor_m + (rise + unsure_per_m) * distance_m
            })
            .fold(f32::MAX, f32::min)
    }
}

/// Collects what one column's rays passed. They come in the order of their layers, the lowest
/// first, and so, nearly, in that of their beginnings: what meets the stretch before joins it at
/// once.
struct Stretches<'a> {
    passed: &'a mut Vec<Stretch>,
    /// Of the column's first.
    first: usize,
    last: Stretch,
}

impl<'a> Stretches<'a> {
    /// With the stretch around the sensor.
    fn new(column: usize, nearest_m: f32, passed: &'a mut Vec<Stretch>) -> Self {
        let last = Stretch {
            column,
            from_m: 0.0,
            to_m: nearest_m,
        };
        let first = passed.len();
        Self {
            passed,
            first,
            last,
        }
    }

    fn add(&mut self, from_m: f32, to_m: f32) {
        if from_m >= to_m {
            return;
        }
        if from_m > self.last.to_m || to_m < self.last.from_m {
            self.passed.push(self.last);
            (self.last.from_m, self.last.to_m) = (from_m, to_m);
        } else {
            self.last.from_m = least(self.last.from_m, from_m);
            self.last.to_m = -least(-self.last.to_m, -to_m);
        }
    }

    /// Leaves the column's stretches in order, with a gap between any two.
    fn finish(self) {
        self.passed.push(self.last);
        let of_column = &mut self.passed[self.first..];
        if of_column.is_sorted_by(|a, b| a.to_m < b.from_m) {
            return;
        }
        of_column.sort_unstable_by(|a, b| a.from_m.total_cmp(&b.from_m));
        let mut last = self.first;
        for next in self.first + 1..self.passed.len() {
            let stretch = self.passed[next];
            if stretch.from_m <= self.passed[last].to_m {
                self.passed[last].to_m = self.passed[last].to_m.max(stretch.to_m);
            } else {
                last += 1;
                self.passed[last] = stretch;
            }
        }
        self.passed.truncate(last + 1);
    }
}

/// A column and those close beside it, over the seam if there is one.
fn beside(column: usize, columns: usize, is_round: bool) -> impl Iterator<Item = usize> {
    let offsets = -(BESIDE as isize)..=BESIDE as isize;
    offsets.filter_map(move |offset| {
        let at = column.wrapping_add_signed(offset);
        match (at < columns, is_round) {
            (true, _) => Some(at),
            (false, false) => None,
            // Below 0 it wrapped around at the greatest number.
            (false, true) => Some(if offset < 0 {
                at.wrapping_add(columns)
            } else {
                at - columns
            }),
        }
        .filter(|at| *at < columns)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_that_meet_become_one() {
        let mut passed = vec![];
        let mut stretches = Stretches::new(3, 1.0, &mut passed);
        for (from_m, to_m) in [
            (0.5, 2.0),
            (2.0, 4.0),
            (3.0, 3.0),
            (5.0, 6.0),
            (5.5, 7.0),
            (8.0, 9.0),
            (3.5, 4.5),
            (6.5, 8.5),
        ] {
            stretches.add(from_m, to_m);
        }
        stretches.finish();
        let ends: Vec<_> = passed.iter().map(|at| (at.from_m, at.to_m)).collect();
        assert_eq!(ends, [(0.0, 4.5), (5.0, 9.0)]);
        assert!(passed.iter().all(|stretch| stretch.column == 3));
    }

    #[test]
    fn columns_beside_the_seam_are_on_either_side_of_it() {
        let found = |column, columns, is_round| beside(column, columns, is_round).collect();
        let cases: [(_, &[usize]); 4] = [
            ((0, 10, true), &[8, 9, 0, 1, 2]),
            ((9, 10, true), &[7, 8, 9, 0, 1]),
            ((0, 10, false), &[0, 1, 2]),
            ((9, 10, false), &[7, 8, 9]),
        ];
        for ((column, columns, is_round), expected) in cases {
            let columns: Vec<usize> = found(column, columns, is_round);
            assert_eq!(columns, expected);
        }
    }
}
