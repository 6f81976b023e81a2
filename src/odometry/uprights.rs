//! The map of what is upright and has no surface to speak of: poles, trunks, foliage.
//!
//! A cell keeps how returns scatter in it, seen from above: a normal distribution (Biber, Strasser 2003). A pole holds a
//! place to centimetres, a bush to half a metre, and each counts for as much.

use nalgebra::{Matrix2, Vector2, Vector3};

use super::cells::{CELL_M, Cells, cell_of};

/// Sets of cells: half a megabyte.
const SETS: usize = 1 << 11;
/// Returns of a cell after which it learns no more.
const MOST: f32 = 60.0;
/// Returns of a cell before it is relied upon.
const FEWEST: f32 = 5.0;
/// Standard deviation of a return on a pole besides what its cell shows.
const DEVIATION_M: f64 = 0.04;
/// How far from the middle of a cell a pole is still noted there.
const REACH_M: f64 = 0.9 * CELL_M;

/// What is upright in the odometry frame.
#[derive(Debug, Clone)]
pub(super) struct Uprights {
    cells: Cells<Scatter>,
}

/// The returns of a cell from above, relative to its middle.
#[derive(Debug, Clone, Copy, Default)]
struct Scatter {
    sums_m: [f32; 2],
    /// Sums of xx, xy, yy.
    squares_m2: [f32; 3],
    count: f32,
}

/// How a return lies to those of its cell.
#[derive(Debug, Clone, Copy)]
pub(super) struct Off {
    /// From their mean.
    pub(super) off_m: Vector2<f64>,
    /// How much that counts, beside a return on a surface.
    pub(super) weight: Matrix2<f64>,
}

impl Off {
    /// How far off it counts as, squared.
    pub(super) fn square_m2(&self) -> f64 {
        self.off_m.dot(&(self.weight * self.off_m))
    }
}

impl Uprights {
    pub(super) fn new() -> Self {
        Self {
            cells: Cells::new(SETS),
        }
    }

    pub(super) fn clear(&mut self) {
        self.cells.clear();
    }

    pub(super) fn advance(&mut self, way_m: f64) {
        self.cells.advance(way_m);
    }

    /// How a pole lies to the one that the map has near it.
    pub(super) fn off_pole(&self, at_m: &Vector3<f64>) -> Option<Off> {
        self.off(&pole_place(at_m))
    }

    /// How a return from foliage lies to those of its cell.
    pub(super) fn off(&self, at_m: &Vector3<f64>) -> Option<Off> {
        let (key, middle_m) = cell_of(at_m);
        self.cells.get(key)?.off((at_m - middle_m).xy())
    }

    /// Takes a pole in: in its own cell, and in those that it is near to.
    pub(super) fn add_pole(&mut self, at_m: &Vector3<f64>) {
        let at_m = pole_place(at_m);
        for i in [-CELL_M, 0.0, CELL_M] {
            for j in [-CELL_M, 0.0, CELL_M] {
                let (key, middle_m) = cell_of(&(at_m + Vector3::new(i, j, 0.0)));
                let from_m = at_m - middle_m;
                if from_m.x.abs() < REACH_M && from_m.y.abs() < REACH_M {
                    self.cells.meet(key).add(from_m.xy());
                }
            }
        }
    }

    /// Takes a return from foliage in.
    pub(super) fn add(&mut self, at_m: &Vector3<f64>) {
        let (key, middle_m) = cell_of(at_m);
        self.cells.meet(key).add((at_m - middle_m).xy());
    }
}

/// Poles have cells of their own, of all heights: far above what else there is.
fn pole_place(at_m: &Vector3<f64>) -> Vector3<f64> {
    const ABOVE_ALL_M: f64 = 1e5;
    Vector3::new(at_m.x, at_m.y, ABOVE_ALL_M)
}

/// A weight that hardly counts in the direction in which a narrow scatter fills its cell: along a hedge the mean of a cell is in
/// its middle, wherever the sensor is, and thousands of returns that say so hold the sensor back.
fn except_along(weight: Matrix2<f64>, noise: f64) -> Matrix2<f64> {
    /// Variance of what lies anywhere in a cell.
    const EVEN_M2: f64 = CELL_M * CELL_M / 12.0;
    /// How many times the weight of that is still as good as filled, how much more the other direction weighs where the
    /// scatter is narrow, and what remains. Without this 3 of 62 simulated drives fall behind, and the mini roundabout drifts
    /// by 2.5 % instead of 0.6 (`scripts/evaluate-odometry --seeds 95-98 --duration 25 --scenarios mini-roundabout`).
    const FILLED: f64 = 1.6;
    const NARROW: f64 = 3.0;
    const REST: f64 = 0.05;
    let even = noise / (EVEN_M2 + noise);
    let mean = 0.5 * weight.trace();
    let half = 0.5 * (weight.m11 - weight.m22);
    let spread = libm::hypot(half, weight.m12);
    // The eigenvalues lie so far to both sides of their mean; the axes stay.
    let (most, least) = (mean + spread, mean - spread);
    if least > FILLED * even || most < NARROW * least {
        return weight;
    }
    let axes = Matrix2::new(half, weight.m12, weight.m12, -half) / spread;
    let least = REST * least;
    Matrix2::identity() * (0.5 * (most + least)) + axes * (0.5 * (most - least))
}

impl Scatter {
    fn add(&mut self, from_m: Vector2<f64>) {
        if self.count >= MOST {
            return;
        }
        let [x, y] = [from_m.x, from_m.y].map(|metres| metres as f32);
        self.sums_m[0] += x;
        self.sums_m[1] += y;
        for (sum, square) in self.squares_m2.iter_mut().zip([x * x, x * y, y * y]) {
            *sum += square;
        }
        self.count += 1.0;
    }

    fn off(&self, from_m: Vector2<f64>) -> Option<Off> {
        if self.count < FEWEST {
            return None;
        }
        let count = f64::from(self.count);
        let mean_m = Vector2::from(self.sums_m.map(f64::from)) / count;
        let [xx, xy, yy] = self.squares_m2.map(|sum| f64::from(sum) / count);
        let noise = DEVIATION_M * DEVIATION_M;
        let covariance = Matrix2::new(xx, xy, xy, yy) - mean_m * mean_m.transpose()
            + Matrix2::identity() * noise;
        let weight = except_along(covariance.try_inverse()? * noise, noise);
        Some(Off {
            off_m: from_m - mean_m,
            weight,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The weight of a return in a cell that was filled so, to the east and to the north.
    fn weights(east_m: std::ops::Range<i32>, north_m: std::ops::Range<i32>) -> [f64; 2] {
        let mut uprights = Uprights::new();
        for (x, y) in (0..60).map(|n| (n * 7 % 20, n * 11 % 20)) {
            let at = |range: &std::ops::Range<i32>, part: i32| {
                0.01 * (f64::from(range.start) + f64::from(range.len() as i32 * part) / 20.0)
            };
            uprights.add(&Vector3::new(at(&east_m, x), at(&north_m, y), 0.5));
        }
        let off = uprights.off(&Vector3::new(0.5, 0.5, 0.5)).unwrap();
        [off.weight.m11, off.weight.m22]
    }

    #[test]
    fn a_hedge_tells_how_far_it_is_and_not_how_far_along_it() {
        let [across, along] = weights(40..60, 0..100);
        assert!(across > 0.2 && along < 0.002, "{across} {along}");
        let [along, across] = weights(0..100, 40..60);
        assert!(across > 0.2 && along < 0.002, "{across} {along}");
    }

    #[test]
    fn a_bush_and_a_trunk_tell_both() {
        for (size, least) in [(20..80, 0.03), (45..55, 0.3)] {
            let found = weights(size.clone(), size);
            assert!(found.iter().all(|weight| *weight > least), "{found:?}");
        }
    }
}
