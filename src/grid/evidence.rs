//! From three dimensions to two: what the rays of a column say of the cells below them.

use super::GridParameters;
use super::NoReturn;
use super::intervals::Intervals;
use crate::cloud::{MAX_LAYERS, Scan};
use crate::ground::Plane;

/// One ray from the side: its height above the ground changes linearly with the horizontal
/// distance from the sensor.
#[derive(Debug, Clone, Copy, Default)]
struct Ray {
    /// How far it is known to go.
    end_m: f32,
    /// Change of its height for each metre.
    rise: f32,
    /// Whether it ends on the ground, so that its height is known along all of its way.
    lands: bool,
}

/// The rays of a revolution over the ground.
#[derive(Debug, Clone, Default)]
pub(super) struct Evidence {
    /// Height of the sensor.
    sensor_m: f32,
    rays: Vec<Ray>,
    /// Distance of every return that is an obstacle, and of the nearest one of every column.
    obstacles_m: Vec<f32>,
    nearest_m: Vec<f32>,
}

/// There is no obstacle.
const NONE_M: f32 = f32::MAX;
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
        self.find_obstacles(scan, ground, heights_m, parameters);
        self.sensor_m = plane.height_m() as f32;
        let normal = plane.normal().map(|part| part as f32);
        let no_return_m = match parameters.no_return {
            NoReturn::Clear => parameters.reach_m,
            NoReturn::Limit => parameters.no_return_limit_m,
            NoReturn::Ignore => 0.0,
        } as f32;
        self.rays.clear();
        for column in 0..scan.columns() {
            let [sine, cosine] = scan.direction(column);
            let level = normal[0] * sine + normal[1] * cosine;
            for layer in 0..MAX_LAYERS {
                let point = scan.index(column, layer);
                let range_m = scan.range_m()[point];
                self.rays.push(if range_m > 0.0 {
                    let distance_m = scan.distance_m(point);
                    Ray {
                        end_m: distance_m,
                        rise: (heights_m[point] - self.sensor_m) / distance_m,
                        lands: ground[point],
                    }
                } else if range_m < 0.0 {
                    Ray::default()
                } else {
                    let rise = level + normal[2] * scan.slope(layer).0 as f32;
                    let ground_m = -self.sensor_m / rise;
                    let falls = rise < 0.0 && ground_m < no_return_m;
                    let end_m = if falls { ground_m } else { no_return_m };
                    Ray {
                        end_m: end_m.min(nearest_beside_m(scan, column, layer)),
                        rise,
                        lands: false,
                    }
                });
            }
        }
    }

    /// Finds the returns that stand on the ground within the heights of obstacles.
    fn find_obstacles(
        &mut self,
        scan: &Scan,
        ground: &[bool],
        heights_m: &[f32],
        parameters: &GridParameters,
    ) {
        let low_m = parameters.obstacle_low_m as f32;
        let high_m = parameters.obstacle_high_m as f32;
        let heights = low_m..=high_m;
        self.obstacles_m.clear();
        self.obstacles_m.extend((0..scan.len()).map(|point| {
            let is_obstacle =
                scan.has_return(point) && !ground[point] && heights.contains(&heights_m[point]);
            if is_obstacle {
                scan.distance_m(point)
            } else {
                NONE_M
            }
        }));
        self.nearest_m.clear();
        let columns = self.obstacles_m.chunks_exact(MAX_LAYERS);
        self.nearest_m
            .extend(columns.map(|layers| layers.iter().copied().fold(NONE_M, f32::min)));
    }

    /// Distance of a return, if it is an obstacle.
    pub(super) fn obstacle_m(&self, point: usize) -> Option<f32> {
        Some(self.obstacles_m[point]).filter(|distance_m| *distance_m < NONE_M)
    }

    /// Where a column's rays are known to have passed low enough to say that nothing is there:
    /// before the first obstacle below the height of what hangs over the road; behind it only
    /// where they went over it and come down to the ground again.
    pub(super) fn passed(
        &self,
        column: usize,
        scan: &Scan,
        parameters: &GridParameters,
    ) -> Intervals {
        let reach_m = parameters.reach_m as f32;
        let nearest_m = beside(column, scan.columns())
            .map(|column| self.nearest_m[column])
            .fold(reach_m, f32::min);
        let mut passed = Intervals::default();
        passed.add(0.0, parameters.nearest_m as f32);
        // Of the obstacles that higher rays met: this one goes on under them.
        let mut roof_m = reach_m;
        for layer in (0..MAX_LAYERS).rev() {
            let point = scan.index(column, layer);
            let ray = self.rays[point];
            let end_m = ray.end_m - BEFORE_RETURN_M;
            let (from_m, to_m) = self.below(&ray, parameters.obstacle_high_m as f32);
            passed.add(from_m, to_m.min(end_m).min(nearest_m));
            if scan.has_return(point) {
                let (from_m, to_m) = self.below(&ray, parameters.low_pass_m as f32);
                passed.add(from_m, to_m.min(end_m).min(roof_m));
            }
            roof_m = roof_m.min(self.obstacles_m[point]);
        }
        passed
    }

    /// Distances between which a ray is lower than a height.
    fn below(&self, ray: &Ray, height_m: f32) -> (f32, f32) {
        let until_m = height_m - self.sensor_m;
        if ray.rise < 0.0 {
            ((until_m / ray.rise).max(0.0), f32::MAX)
        } else if until_m <= 0.0 {
            (0.0, 0.0)
        } else {
            (0.0, until_m / ray.rise.max(1e-6))
        }
    }

    /// Height below which a column's lowest ray that goes on beyond a distance is at least.
    pub(super) fn lowest_pass_m(&self, column: usize, distance_m: f32) -> f32 {
        let rays = &self.rays[column * MAX_LAYERS..(column + 1) * MAX_LAYERS];
        let beyond = rays.iter().filter(|ray| ray.end_m > distance_m);
        beyond
            .map(|ray| {
                let unsure_per_m = if ray.lands { 0.0 } else { UNSURE_PER_M };
                self.sensor_m + (ray.rise + unsure_per_m) * distance_m
            })
            .fold(f32::MAX, f32::min)
    }
}

/// A column and those close beside it, over the seam where the sweep begins.
fn beside(column: usize, columns: usize) -> impl Iterator<Item = usize> {
    (columns - BESIDE.min(columns)..=columns + BESIDE).map(move |at| (column + at) % columns)
}

/// Distance of the nearest return in a layer close beside a column.
fn nearest_beside_m(scan: &Scan, column: usize, layer: usize) -> f32 {
    let points = beside(column, scan.columns()).map(|column| scan.index(column, layer));
    points
        .filter(|point| scan.has_return(*point))
        .map(|point| scan.distance_m(point))
        .fold(NONE_M, f32::min)
}
