//! Takes a revolution's evidence into the map: the binary Bayes filter of every cell.

use super::GridParameters;
use super::evidence::Evidence;
use super::map::{HEIGHT_UNIT_M, Map, TILE_CELLS, Tile};
use super::model::{InverseSensorModel, in_units, log_odds};
use super::window::{Cell, Window};
use crate::cloud::Scan;
use crate::ego::Placement;

/// Log-odds that are added to cells, and their bounds.
#[derive(Debug, Clone)]
pub(super) struct Filter {
    /// Of a passed cell by its distance from the sensor in cells.
    passed: Vec<i16>,
    hit: i16,
    lowest: i16,
    highest: i16,
    cell_m: f64,
}

/// A revolution as the cells see it.
pub(super) struct View<'a> {
    pub(super) scan: &'a Scan,
    pub(super) ground: &'a [bool],
    pub(super) evidence: &'a Evidence,
    /// Of its columns.
    pub(super) placements: &'a [Placement],
    /// The sensor at the end of the sweep.
    pub(super) sensor: Placement,
    /// Counts the revolutions of the map.
    pub(super) revolution: u32,
}

/// How far below the top of what was seen in a cell a ray must pass to say that it is gone, and
/// below which share of its height: windows let rays through, doors do not.
const BELOW_TOP_M: f32 = 0.15;
const BELOW_SHARE: f32 = 0.6;

impl Filter {
    pub(super) fn new(parameters: &GridParameters) -> Self {
        let model = InverseSensorModel::new(parameters);
        let cell_m = parameters.cell_m;
        let units = |probability: f64| in_units(log_odds(probability));
        // From corner to corner of the window, whose side is little more than twice the reach.
        let farthest = 2.0 * parameters.reach_m / cell_m;
        let cells = 0..farthest as usize + 4 * TILE_CELLS;
        Self {
            passed: cells
                .map(|cell| units(model.passed((cell as f64 + 0.5) * cell_m)))
                .collect(),
            hit: units(model.hit()),
            lowest: units(parameters.lowest_probability),
            highest: units(parameters.highest_probability),
            cell_m,
        }
    }

    /// Takes the cells in that rays passed and in which none ended.
    pub(super) fn free(&self, window: &Window, view: &View<'_>, map: &mut Map) {
        for y in 0..window.side() {
            for x in 0..window.side() {
                let passed = |row: usize| window.free(x, y, row) != 0;
                if (0..TILE_CELLS).any(passed) {
                    let tile = map.tile_mut(window.tile(x, y));
                    for row in 0..TILE_CELLS {
                        self.free_row(tile, row, window.free(x, y, row), view);
                    }
                }
            }
        }
    }

    fn free_row(&self, tile: &mut Tile, row: usize, passed: u64, view: &View<'_>) {
        let [sensor_x, sensor_y] = view.sensor.origin_m();
        let middle = |tile: i32, cell: usize| {
            (f64::from(tile) * TILE_CELLS as f64 + cell as f64 + 0.5) * self.cell_m
        };
        let north_m = middle(tile.place[1], row);
        let mut cells = passed & !tile.surely_free[row];
        while cells != 0 {
            let column = cells.trailing_zeros() as usize;
            cells &= cells - 1;
            let east_m = middle(tile.place[0], column);
            let (right_m, up_m) = (east_m - sensor_x, north_m - sensor_y);
            let distance_m = libm::sqrt(right_m * right_m + up_m * up_m);
            let cell = row * TILE_CELLS + column;
            let before = tile.log_odds[cell];
            if before > 0 && !is_gone(tile.top[cell], [east_m, north_m], distance_m, view) {
                continue;
            }
            let distance = ((distance_m / self.cell_m) as usize).min(self.passed.len() - 1);
            let after = (before + self.passed[distance]).max(self.lowest);
            tile.set(cell, after, view.revolution);
            if after == self.lowest {
                tile.surely_free[row] |= 1 << column;
            }
        }
    }

    /// Takes the cells in which rays ended in, and how high above the ground.
    pub(super) fn occupy(
        &self,
        hits: &[(Cell, u8)],
        window: &mut Window,
        revolution: u32,
        map: &mut Map,
    ) {
        for (cell, top) in hits {
            let ([x, y], place) = cell.in_tile();
            let tile = map.tile_mut(window.tile(x, y));
            if window.take_hit(*cell) {
                let after = (tile.log_odds[place] + self.hit).min(self.highest);
                tile.set(place, after, revolution);
                tile.surely_free[place / TILE_CELLS] &= !(1 << (place % TILE_CELLS));
            }
            tile.top[place] = tile.top[place].max(*top);
        }
    }
}

/// Whether rays pass through where something of this height was seen.
fn is_gone(top: u8, at_m: [f64; 2], distance_m: f64, view: &View<'_>) -> bool {
    let column_from = |placement: &Placement| {
        let [right_m, ahead_m] = placement.sensor_m(at_m);
        view.scan.column_at(libm::atan2(right_m, ahead_m))
    };
    // Seen from where the sensor was when it looked there.
    let column = column_from(&view.placements[column_from(&view.sensor)]);
    let pass_m = view
        .evidence
        .lowest_pass_m(column, distance_m as f32, view.ground);
    let top_m = f32::from(top) * HEIGHT_UNIT_M;
    pass_m < (BELOW_SHARE * top_m).min(top_m - BELOW_TOP_M)
}
