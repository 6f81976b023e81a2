//! Draws the ways of a revolution's rays into the window.

use super::evidence::Stretch;
use super::window::Window;
use crate::cloud::Scan;
use crate::ego::Placement;

/// How rays lie over the cells.
#[derive(Debug, Clone, Default)]
pub(super) struct Casting {
    /// How far each column's first stretch, around the sensor, goes on.
    first_ends_m: Vec<f32>,
}

/// Halvings of the columns that are looked at: near the sensor all the others are left out.
const HALVINGS: u32 = 6;
/// Cells by which the ways of neighbours must go on beyond what they stand for.
const SPARE_CELLS: f64 = 2.0;

impl Casting {
    /// Marks the cells that rays passed on these stretches, which come by column and each
    /// column's first one first.
    ///
    /// Where a ray runs between two others that are less than a cell apart, every cell that it
    /// crosses is crossed by one of the two: a cell is at least as wide as its side from any
    /// direction. There it is left out. A beam is nearly as wide as the step from column to
    /// column (VLP-16 user manual: 3 mrad); where that is more than a cell, it is cast as several
    /// rays beside each other.
    pub(super) fn cast(
        &mut self,
        stretches: &[Stretch],
        scan: &Scan,
        placements: &[Placement],
        cell_m: f64,
        window: &mut Window,
    ) {
        let step_rad = libm::fabs(scan.step_rad()).max(1e-6);
        let dense_m = cell_m / step_rad;
        self.first_ends_m.clear();
        self.first_ends_m.resize(scan.columns(), 0.0);
        for stretch in stretches.iter().filter(|stretch| stretch.from_m == 0.0) {
            self.first_ends_m[stretch.column] = stretch.to_m;
        }
        let (per_cell, corner) = (1.0 / cell_m, window.corner());
        for stretch in stretches {
            let column = stretch.column;
            let [sine, cosine] = scan.direction(column).map(f64::from);
            let at = |metres: f64, aside: f64| {
                let (right, ahead) = (sine + aside * cosine, cosine - aside * sine);
                let at_m = placements[column].local_m([metres * right, metres * ahead]);
                [0, 1].map(|axis| at_m[axis] * per_cell - corner[axis])
            };
            let to_m = f64::from(stretch.to_m);
            let mut from_m = f64::from(stretch.from_m);
            if from_m == 0.0 {
                from_m = self.covered_m(column, dense_m) - SPARE_CELLS * cell_m;
                from_m = from_m.max(0.0);
            }
            if from_m < to_m.min(dense_m) {
                window.pass(at(from_m, 0.0), at(to_m.min(dense_m), 0.0));
            }
            if to_m > dense_m {
                let beams = libm::ceil(to_m / dense_m) as usize;
                for beam in 0..beams {
                    let aside = step_rad * ((beam as f64 + 0.5) / beams as f64 - 0.5);
                    window.pass(at(from_m.max(dense_m), aside), at(to_m, aside));
                }
            }
        }
    }

    /// Up to where the ways of a column's neighbours stand for its own.
    fn covered_m(&self, column: usize, dense_m: f64) -> f64 {
        let halvings = column.trailing_zeros().min(HALVINGS);
        let apart = 1 << halvings;
        let beside = [column.checked_sub(apart), Some(column + apart)];
        beside
            .map(|beside| {
                let end_m = beside.and_then(|column| self.first_ends_m.get(column));
                end_m.map_or(0.0, |end_m| f64::from(*end_m))
            })
            .into_iter()
            .fold(dense_m / (2 * apart) as f64, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::ego::Pose;
    use crate::grid::map::TILE_CELLS;
    use crate::random::Random;

    const CELL_M: f64 = 0.1;

    fn passed(window: &Window) -> Vec<u64> {
        let side = window.side();
        let tiles = (0..side * side).map(|tile| (tile % side, tile / side));
        tiles
            .flat_map(|(x, y)| (0..TILE_CELLS).map(move |row| window.free(x, y, row)))
            .collect()
    }

    #[test]
    fn what_is_left_out_near_the_sensor_marks_no_cell_more_or_less() {
        let scan = scan_of(1810, |_, _| 100);
        let placements = vec![Pose::SENSOR.placement(); scan.columns()];
        let mut random = Random::new(4);
        for round in 0..3 {
            // A few obstacles, each over many columns, and rays that end by chance.
            let mut ends_m = vec![25.0; scan.columns()];
            for end_m in &mut ends_m {
                if random.uniform() < 0.02 * f64::from(round) {
                    *end_m = 1.0 + 24.0 * random.uniform();
                }
            }
            ends_m[300..500].fill(7.3);
            ends_m[900..930].fill(2.2);
            let stretch = |(column, end_m): (usize, &f64)| Stretch {
                column,
                from_m: 0.0,
                to_m: *end_m as f32,
            };
            let stretches: Vec<_> = ends_m.iter().enumerate().map(stretch).collect();
            let (mut thinned, mut plain) = (Window::new(10), Window::new(10));
            thinned.begin([-5, -5]);
            plain.begin([-5, -5]);
            let mut casting = Casting::default();
            casting.cast(&stretches, &scan, &placements, CELL_M, &mut thinned);
            let corner = plain.corner();
            for stretch in &stretches {
                let [sine, cosine] = scan.direction(stretch.column).map(f64::from);
                let at = |metres: f64| {
                    let at_m = [metres * sine, metres * cosine];
                    [0, 1].map(|axis| at_m[axis] / CELL_M - corner[axis])
                };
                plain.pass(at(0.0), at(f64::from(stretch.to_m)));
            }
            assert_eq!(passed(&thinned), passed(&plain), "{round}");
        }
    }
}
