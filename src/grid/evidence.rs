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
}

/// The rays of a revolution over the ground.
#[derive(Debug, Clone, Default)]
pub(super) struct Evidence {
    /// Height of the sensor.
    sensor_m: f32,
    rays: Vec<Ray>,
    /// Returns on road users that move.
    pub(super) is_moving: Vec<bool>,
}

/// How far before a return its ray is known to be free: returns scatter along the ray.
const BEFORE_RETURN_M: f32 = 0.05;
/// Height below the ground down to which a ray that found no ground goes on.
const BELOW_M: f32 = -0.3;

impl Evidence {
    /// Takes a revolution's rays in.
    pub(super) fn begin(
        &mut self,
        scan: &Scan,
        plane: &Plane,
        heights_m: &[f32],
        parameters: &GridParameters,
    ) {
        self.sensor_m = plane.height_m() as f32;
        self.is_moving.clear();
        self.is_moving.resize(scan.len(), false);
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
                    }
                } else if range_m < 0.0 {
                    Ray::default()
                } else {
                    let rise = level + normal[2] * scan.slope(layer).0 as f32;
                    let ground_m = (BELOW_M - self.sensor_m) / rise;
                    let falls = rise < 0.0 && ground_m < no_return_m;
                    let end_m = if falls { ground_m } else { no_return_m };
                    Ray {
                        end_m: end_m.min(nearest_beside_m(scan, column, layer)),
                        rise,
                    }
                });
            }
        }
    }

    /// Whether a return stands on the ground within the heights of obstacles.
    pub(super) fn is_obstacle(
        &self,
        point: usize,
        scan: &Scan,
        ground: &[bool],
        heights_m: &[f32],
        parameters: &GridParameters,
    ) -> bool {
        let low_m = parameters.obstacle_low_m as f32;
        let high_m = parameters.obstacle_high_m as f32;
        scan.has_return(point) && !ground[point] && (low_m..=high_m).contains(&heights_m[point])
    }

    /// Where a column's rays are known to have passed low enough to say that nothing is there:
    /// before the first obstacle below the height of what hangs over the road; behind it only
    /// where they went over it and come down to the ground again. `obstacles_m` are the
    /// distances of the layers' obstacles.
    pub(super) fn passed(
        &self,
        column: usize,
        scan: &Scan,
        obstacles_m: &[f32; MAX_LAYERS],
        parameters: &GridParameters,
    ) -> Intervals {
        let reach_m = parameters.reach_m as f32;
        let nearest_m = obstacles_m.iter().copied().fold(reach_m, f32::min);
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
            roof_m = roof_m.min(obstacles_m[layer]);
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

    /// Height of the lowest ray of a column that goes on beyond a distance.
    pub(super) fn lowest_pass_m(&self, column: usize, distance_m: f32) -> f32 {
        let rays = &self.rays[column * MAX_LAYERS..(column + 1) * MAX_LAYERS];
        let beyond = rays.iter().filter(|ray| ray.end_m > distance_m);
        beyond
            .map(|ray| self.sensor_m + ray.rise * distance_m)
            .fold(f32::MAX, f32::min)
    }
}

/// Distance of the nearest return in a layer a few columns to either side: a single ray that
/// is lost on a surface does not go through it.
fn nearest_beside_m(scan: &Scan, column: usize, layer: usize) -> f32 {
    const BESIDE: usize = 2;
    let columns = scan.columns();
    let beside = (columns - BESIDE.min(columns)..=columns + BESIDE).filter(|at| *at != columns);
    let points = beside.map(|at| scan.index((column + at) % columns, layer));
    points
        .filter(|point| scan.has_return(*point))
        .map(|point| scan.distance_m(point))
        .fold(f32::MAX, f32::min)
}
