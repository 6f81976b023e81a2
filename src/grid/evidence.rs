//! From three dimensions to two: what the rays of a column say of the cells below them.

use std::ops::Range;

use multiversion::multiversion;

use super::stretches::{Stretch, Stretches};
use super::{GridParameters, NoReturn};
use crate::cloud::{MAX_LAYERS, Scan};
use crate::float::{greatest, greatest_of, least, least_of};
use crate::ground::Plane;
use crate::marks::{marked, set_bits};

/// The rays of some columns over the ground, by columns and layers. From the side a ray is
/// straight: its height above the ground changes evenly with the horizontal distance.
#[derive(Debug, Clone, Default)]
pub(super) struct Evidence {
    /// Height of the sensor.
    sensor_m: f32,
    /// The columns that are looked at. What is noted of rays is noted of [`BESIDE`] more columns before
    /// them and behind.
    columns: Range<usize>,
    /// How far each ray is known to go.
    ends_m: Vec<[f32; MAX_LAYERS]>,
    /// Horizontal distance in which it rises by a metre; negative where it falls.
    runs: Vec<[f32; MAX_LAYERS]>,
    /// Distance of every return.
    returns_m: Vec<[f32; MAX_LAYERS]>,
    /// Whether each return is an obstacle within reach.
    is_obstacle: Vec<[bool; MAX_LAYERS]>,
    /// Distance of a column's nearest obstacle.
    nearest_m: Vec<f32>,
    /// How far each ray of them is known to be free, by itself and by those beside it.
    free_m: Vec<f32>,
    /// Distance of the nearest obstacle of a column and those beside it.
    before_m: Vec<f32>,
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
    /// Adds a column that there is not.
    fn push_none(&mut self) {
        self.runs.push([0.0; MAX_LAYERS]);
        self.ends_m.push([0.0; MAX_LAYERS]);
        self.returns_m.push([NONE_M; MAX_LAYERS]);
        self.is_obstacle.push([false; MAX_LAYERS]);
        self.nearest_m.push(NONE_M);
    }

    /// The points that are obstacles within reach, in order.
    pub(super) fn obstacles(&self) -> impl Iterator<Item = usize> {
        let own = &self.is_obstacle[BESIDE..BESIDE + self.columns.len()];
        let first = self.columns.start * MAX_LAYERS;
        marked(own.as_flattened()).map(move |place| first + place)
    }

    /// The place of a column among those that are looked at, if it is one of them.
    fn place(&self, column: usize) -> Option<usize> {
        let place = column.checked_sub(self.columns.start)?;
        (place < self.columns.len()).then_some(BESIDE + place)
    }

    /// Whether a point is an obstacle within reach, of a column that is looked at.
    pub(super) fn is_obstacle(&self, column: usize, layer: usize) -> bool {
        self.place(column)
            .is_some_and(|place| self.is_obstacle[place][layer])
    }

    /// How far each ray is known to be free and lower than a height. A single ray that is lost
    /// on a surface does not go through it.
    #[inline(always)]
    fn look_beside(&mut self, height_m: f32, reach_m: f32) {
        let until_m = height_m - self.sensor_m;
        let columns = self.columns.len();
        let layers = columns * MAX_LAYERS;
        let returns_m = self.returns_m.as_flattened();
        let beside: [_; 2 * BESIDE + 1] =
            std::array::from_fn(|column| &returns_m[column * MAX_LAYERS..][..layers]);
        let [ends_m, runs] = [&self.ends_m, &self.runs]
            .map(|rays| &rays.as_flattened()[BESIDE * MAX_LAYERS..][..layers]);
        self.free_m.resize(layers, 0.0);
        let free_m = &mut self.free_m[..layers];
        for ray in 0..layers {
            let nearest_m = least(
                least(beside[0][ray], beside[1][ray]),
                least(beside[3][ray], beside[4][ray]),
            );
            let is_lost = beside[BESIDE][ray] == NONE_M;
            let before_m = if is_lost { nearest_m } else { NONE_M };
            free_m[ray] = least(least(ends_m[ray], before_m), below_m(until_m, runs[ray]));
        }
        let beside: [_; 2 * BESIDE + 1] =
            std::array::from_fn(|column| &self.nearest_m[column..][..columns]);
        self.before_m.resize(columns, 0.0);
        for (column, before_m) in self.before_m[..columns].iter_mut().enumerate() {
            *before_m = beside
                .iter()
                .fold(reach_m, |before_m, beside| least(before_m, beside[column]));
        }
    }

    /// Where a column's rays are known to have passed low enough to say that nothing is there:
    /// around the sensor, and before the first obstacle where a ray is below the height of what
    /// hangs over the road; behind it only where one came over it and down to the ground again.
    #[inline(always)]
    fn pass(&self, number: usize, parameters: &GridParameters, passed: &mut Vec<Stretch>) {
        let reach_m = parameters.reach_m as f32;
        let before_m = self.before_m[number];
        let free_m = &self.free_m.as_chunks::<MAX_LAYERS>().0[number];
        let runs = &self.runs[BESIDE + number];
        let column = self.columns.start + number;
        let until_m = parameters.obstacle_high_m as f32 - self.sensor_m;
        let mut stretches = Stretches::new(column, parameters.nearest_m as f32, passed);
        if until_m >= 0.0 {
            let farthest_m = greatest_of(*free_m);
            stretches.add(0.0, least(farthest_m, before_m));
        } else {
            for layer in 0..MAX_LAYERS {
                let from_m = from_m(until_m, runs[layer]);
                stretches.add(from_m, least(free_m[layer], before_m));
            }
        }
        if before_m < reach_m {
            self.pass_behind(BESIDE + number, before_m, parameters, &mut stretches);
        }
        stretches.finish();
    }

    /// What a column's rays passed behind its nearest obstacle.
    fn pass_behind(
        &self,
        place: usize,
        before_m: f32,
        parameters: &GridParameters,
        stretches: &mut Stretches<'_>,
    ) {
        let returns_m = &self.returns_m[place];
        let (ends_m, runs) = (&self.ends_m[place], &self.runs[place]);
        let until_m = parameters.low_pass_m as f32 - self.sensor_m;
        // A ray below an obstacle that higher rays met goes on under it; what part of a pulse went through is no roof.
        let mut roofs_m = [parameters.reach_m as f32; MAX_LAYERS];
        for layer in (1..MAX_LAYERS).rev() {
            let is_obstacle = self.is_obstacle[place][layer];
            let own_m = if is_obstacle {
                greatest(returns_m[layer], ends_m[layer])
            } else {
                NONE_M
            };
            roofs_m[layer - 1] = least(roofs_m[layer], own_m);
        }
        let (mut froms_m, mut tos_m) = ([0.0; MAX_LAYERS], [0.0; MAX_LAYERS]);
        let mut passes = 0;
        for layer in 0..MAX_LAYERS {
            let landed_m = least(ends_m[layer], below_m(until_m, runs[layer]));
            tos_m[layer] = least(landed_m, roofs_m[layer]);
            froms_m[layer] = greatest(from_m(until_m, runs[layer]), before_m);
            let is_over = (returns_m[layer] < NONE_M) & (ends_m[layer] > before_m);
            passes |= u32::from(is_over & (froms_m[layer] < tos_m[layer])) << layer;
        }
        for layer in set_bits(passes) {
            stretches.add(froms_m[layer], tos_m[layer]);
        }
    }

    /// Height below which the lowest of a column's rays that go on beyond a distance is, as far
    /// as that is known. A ray that lands has a known height all along.
    pub(super) fn lowest_pass_m(&self, column: usize, distance_m: f32, ground: &[bool]) -> f32 {
        let Some(place) = self.place(column) else {
            return f32::MAX;
        };
        let ground = &ground.as_chunks::<MAX_LAYERS>().0[column];
        let (ends_m, runs) = (&self.ends_m[place], &self.runs[place]);
        let mut passes_m = [f32::MAX; MAX_LAYERS];
        for layer in 0..MAX_LAYERS {
            let unsure_per_m = if ground[layer] { 0.0 } else { UNSURE_PER_M };
            let pass_m = self.sensor_m + (1.0 / runs[layer] + unsure_per_m) * distance_m;
            let goes_on = ends_m[layer] > distance_m;
            passes_m[layer] = if goes_on { pass_m } else { f32::MAX };
        }
        least_of(passes_m)
    }
}

/// Distance from which on a ray is lower than a height above the sensor.
#[inline(always)]
fn from_m(until_m: f32, run: f32) -> f32 {
    let at_m = until_m * run;
    if (run < 0.0) & (at_m > 0.0) {
        at_m
    } else {
        0.0
    }
}

/// Distance up to which it is.
#[inline(always)]
fn below_m(until_m: f32, run: f32) -> f32 {
    let at_m = until_m * run;
    let rises_to_m = if at_m > 0.0 { at_m } else { 0.0 };
    if run < 0.0 { NONE_M } else { rises_to_m }
}

/// Takes the rays of some columns in.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn gather(
    evidence: &mut Evidence,
    columns: Range<usize>,
    scan: &Scan,
    plane: &Plane,
    ground: &[bool],
    heights_m: &[f32],
    parameters: &GridParameters,
) {
    evidence.sensor_m = plane.height_m() as f32;
    let (low_m, high_m) = (parameters.obstacle_low_m, parameters.obstacle_high_m);
    let (low_m, high_m) = (low_m as f32, high_m as f32);
    let reach_m = parameters.reach_m as f32;
    let no_return_m = match parameters.no_return {
        NoReturn::Clear => reach_m,
        NoReturn::Limit => parameters.no_return_limit_m as f32,
        NoReturn::Ignore => 0.0,
    };
    let normal = plane.normal().map(|part| part as f32);
    let slopes: [_; MAX_LAYERS] = std::array::from_fn(|layer| scan.slope(layer));
    let tangents = slopes.map(|(tangent, _)| tangent as f32);
    let cosines = slopes.map(|(_, cosine)| cosine as f32);
    for rays in [
        &mut evidence.ends_m,
        &mut evidence.runs,
        &mut evidence.returns_m,
    ] {
        rays.clear();
    }
    evidence.is_obstacle.clear();
    evidence.nearest_m.clear();
    evidence.columns = columns.clone();
    let ranges_m = scan.range_m().as_chunks::<MAX_LAYERS>().0;
    let reached_m = scan.reached_m().as_chunks::<MAX_LAYERS>().0;
    let heights_m = heights_m.as_chunks::<MAX_LAYERS>().0;
    let ground = ground.as_chunks::<MAX_LAYERS>().0;
    let is_round = scan.sensor().sees_all_round();
    for number in columns.start..columns.end + 2 * BESIDE {
        let Some(column) = neighbour(number, scan.columns(), is_round) else {
            evidence.push_none();
            continue;
        };
        let (ranges_m, reached_m) = (&ranges_m[column], &reached_m[column]);
        let [sine, cosine] = scan.direction(column);
        let level = normal[0] * sine + normal[1] * cosine;
        let mut runs = [0.0; MAX_LAYERS];
        let mut ends_m = [0.0; MAX_LAYERS];
        let mut returns_m = [NONE_M; MAX_LAYERS];
        let mut is_obstacle = [false; MAX_LAYERS];
        let mut obstacles_m = [NONE_M; MAX_LAYERS];
        for layer in 0..MAX_LAYERS {
            let (range_m, height_m) = (ranges_m[layer], heights_m[column][layer]);
            let has_return = range_m > 0.0;
            let distance_m = range_m * cosines[layer];
            // Without a return, as the ground lies below it.
            let rise = level + normal[2] * tangents[layer];
            let run = if has_return { distance_m } else { 1.0 }
                / if has_return {
                    height_m - evidence.sensor_m
                } else {
                    rise
                };
            let lands_m = if run < 0.0 {
                -evidence.sensor_m * run
            } else {
                NONE_M
            };
            let unseen_m = if range_m == 0.0 {
                least(lands_m, no_return_m)
            } else {
                0.0
            };
            let is_body = (height_m >= low_m) & (height_m <= high_m);
            let is_near = has_return & (distance_m <= reach_m);
            is_obstacle[layer] = is_near & !ground[column][layer] & is_body;
            runs[layer] = run;
            ends_m[layer] = if has_return {
                reached_m[layer] * cosines[layer] - BEFORE_RETURN_M
            } else {
                unseen_m
            };
            returns_m[layer] = if has_return { distance_m } else { NONE_M };
            obstacles_m[layer] = if is_obstacle[layer] {
                distance_m
            } else {
                NONE_M
            };
        }
        evidence.runs.push(runs);
        evidence.ends_m.push(ends_m);
        evidence.returns_m.push(returns_m);
        evidence.is_obstacle.push(is_obstacle);
        evidence.nearest_m.push(least_of(obstacles_m));
    }
}

/// The column with a number counted from [`BESIDE`] before the first one, if there is one: on the
/// other side of the seam where there is a seam.
#[inline(always)]
fn neighbour(number: usize, columns: usize, is_round: bool) -> Option<usize> {
    match number.checked_sub(BESIDE) {
        Some(column) if column < columns => Some(column),
        Some(beyond) if is_round => beyond
            .checked_sub(columns)
            .filter(|column| *column < columns),
        None if is_round => (columns + number).checked_sub(BESIDE),
        _ => None,
    }
}

/// Collects what the rays of every column passed.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn stretches(
    evidence: &mut Evidence,
    parameters: &GridParameters,
    passed: &mut Vec<Stretch>,
) {
    passed.clear();
    let (high_m, reach_m) = (parameters.obstacle_high_m, parameters.reach_m);
    evidence.look_beside(high_m as f32, reach_m as f32);
    for number in 0..evidence.columns.len() {
        evidence.pass(number, parameters, passed);
    }
}

#[cfg(test)]
mod tests;
