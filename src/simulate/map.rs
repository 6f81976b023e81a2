//! What stands where, and how much of it the sensor could see: the truth of an occupancy grid.

use std::collections::BTreeMap;

use super::body;
use super::scenario::Scene;
use super::sight::Surface;
use super::solid::{Ray, Solid, Vector};

/// Side of a cell.
const CELL_M: f64 = 0.1;
/// Heights above the ground between which something is an obstacle.
const OBSTACLE_M: std::ops::Range<f64> = 0.3..1.9;
/// Height above the ground below which a ray says that nothing stands under it.
const PASSED_M: f64 = 1.2;
/// How far rays are followed.
const REACH_M: f64 = 55.0;
/// Length of the parts of a ray whose height is looked at.
const PART_M: f64 = 1.0;

/// Bits of a cell.
pub mod cell {
    /// Something stands in it that does not move.
    pub const OCCUPIED: u8 = 1;
    /// A ray ended in it on something that stood still.
    pub const SEEN: u8 = 2;
    /// A ray passed over it, lower than a car.
    pub const PASSED: u8 = 4;
}

/// A map as an array, row by row from the south-west.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueMap {
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Bits of [`cell`].
    pub cells: Vec<u8>,
    /// South-west corner in the local frame.
    pub origin_m: [f64; 2],
    /// Side of a cell.
    pub cell_m: f64,
}

/// Notes what rays meet.
#[derive(Debug, Clone, Default)]
pub(super) struct Surveyor {
    /// Squares of cells by their places.
    squares: BTreeMap<[i32; 2], Box<[u8]>>,
}

/// Cells along a side of a square.
const SQUARE: i32 = 128;

fn cell_of([x, y]: [f64; 2]) -> [i32; 2] {
    [x, y].map(|metres| libm::floor(metres / CELL_M) as i32)
}

impl Surveyor {
    fn mark(&mut self, cell: [i32; 2], bit: u8) {
        let place = cell.map(|at| at.div_euclid(SQUARE));
        let [x, y] = cell.map(|at| at.rem_euclid(SQUARE));
        let empty = || vec![0; (SQUARE * SQUARE) as usize].into_boxed_slice();
        let square = self.squares.entry(place).or_insert_with(empty);
        square[(y * SQUARE + x) as usize] |= bit;
    }

    /// Notes a ray that ends after some way, or goes on, in the frame of the scene; what it
    /// passed only where it is to be followed.
    pub(super) fn note(
        &mut self,
        scene: &Scene,
        seconds: f64,
        ray: &Ray,
        end: Option<(f64, Surface)>,
        follow: bool,
    ) {
        let above_m = |at: &Vector| at[2] - scene.terrain.height_m(at[0], at[1]);
        let end_m = end.map_or(REACH_M, |(range_m, _)| range_m.min(REACH_M));
        let mut from_m = 0.0;
        while follow && from_m < end_m {
            let to_m = (from_m + PART_M).min(end_m);
            let is_low = [from_m, to_m]
                .iter()
                .all(|range_m| above_m(&ray.at(*range_m)) < PASSED_M);
            let mut at_m = from_m;
            while is_low && at_m < to_m {
                let [x, y, _] = ray.at(at_m);
                self.mark(cell_of([x, y]), cell::PASSED);
                at_m += CELL_M;
            }
            from_m = to_m;
        }
        let Some((range_m, surface)) = end else {
            return;
        };
        let stands = match surface {
            Surface::Ground => false,
            Surface::Scenery => true,
            Surface::RoadUser(actor) => scene.actors[actor].path.at(seconds).speed_mps == 0.0,
        };
        let at = ray.at(range_m);
        if stands && OBSTACLE_M.contains(&above_m(&at)) {
            self.mark(cell_of([at[0], at[1]]), cell::SEEN);
        }
    }

    /// The map at a time, of what stands then.
    pub(super) fn map(mut self, scene: &Scene, seconds: f64, begin_m: [f64; 2]) -> TrueMap {
        for thing in &scene.scenery.things {
            if !thing.is_ground {
                self.occupy(scene, thing.place_m, thing.yaw_rad, &thing.solid);
            }
        }
        for actor in &scene.actors {
            let moment = actor.path.at(seconds);
            if moment.speed_mps != 0.0 {
                continue;
            }
            let [x, y] = moment.position_m;
            let place_m = [x, y, scene.terrain.height_m(x, y)];
            for solid in body::parts(&actor.variant, moment.travelled_m) {
                self.occupy(scene, place_m, moment.yaw_rad, &solid);
            }
        }
        self.drawn(begin_m)
    }

    /// Marks the cells that a solid fills between the heights of obstacles.
    fn occupy(&mut self, scene: &Scene, place_m: Vector, yaw_rad: f64, solid: &Solid) {
        let (sine, cosine) = libm::sincos(yaw_rad);
        let ([u, v], radius_m) = solid.bounds();
        let middle_m = [
            place_m[0] + u * cosine - v * sine,
            place_m[1] + u * sine + v * cosine,
        ];
        let low = cell_of(middle_m.map(|metres| metres - radius_m));
        let high = cell_of(middle_m.map(|metres| metres + radius_m));
        for y in low[1]..=high[1] {
            for x in low[0]..=high[0] {
                let fills = (0..9).any(|n| {
                    let [x, y] = [(x, n % 3), (y, n / 3)].map(|(cell, third)| {
                        (f64::from(cell) + 0.1 + 0.4 * f64::from(third)) * CELL_M
                    });
                    let ground_m = scene.terrain.height_m(x, y) - place_m[2];
                    let (dx, dy) = (x - place_m[0], y - place_m[1]);
                    let (u, v) = (dx * cosine + dy * sine, dy * cosine - dx * sine);
                    let heights = (0..9).map(|n| OBSTACLE_M.start + 0.2 * f64::from(n));
                    heights
                        .into_iter()
                        .any(|above_m| solid.contains(&[u, v, ground_m + above_m]))
                });
                if fills {
                    self.mark([x, y], cell::OCCUPIED);
                }
            }
        }
    }

    fn drawn(&self, begin_m: [f64; 2]) -> TrueMap {
        let bound = |axis: usize, pick: fn(i32, i32) -> i32| {
            let places = self.squares.keys().map(|place| place[axis]);
            places.reduce(pick).unwrap_or(0)
        };
        let low = [0, 1].map(|axis| bound(axis, i32::min));
        let side = SQUARE as usize;
        let [columns, rows] =
            [0, 1].map(|axis| ((bound(axis, i32::max) - low[axis]) as usize + 1) * side);
        let mut cells = vec![0; rows * columns];
        for (place, square) in &self.squares {
            let [x, y] = [0, 1].map(|axis| (place[axis] - low[axis]) as usize * side);
            for (row, bits) in square.chunks(side).enumerate() {
                let begin = (y + row) * columns + x;
                cells[begin..begin + side].copy_from_slice(bits);
            }
        }
        TrueMap {
            shape: [rows, columns],
            cells,
            origin_m: [0, 1].map(|axis| f64::from(low[axis] * SQUARE) * CELL_M - begin_m[axis]),
            cell_m: CELL_M,
        }
    }
}
