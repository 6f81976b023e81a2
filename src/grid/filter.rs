//! Takes a revolution's evidence into the map: the binary Bayes filter of every cell.

use multiversion::multiversion;

use super::GridParameters;
use super::evidence::Evidence;
use super::map::{HEIGHT_UNIT_M, Map, TILE_CELLS, Tile, level};
use super::model::{InverseSensorModel, in_units, log_odds};
use super::window::{Cell, Window};
use crate::cloud::Scan;
use crate::ego::Placement;
use crate::float::rounded;
use crate::marks::set_bits;

/// Log-odds that are added to cells, and their bounds.
#[derive(Debug, Clone)]
pub(super) struct Filter {
    /// Of a passed cell by its distance from the sensor in cells.
    passed: Box<[i16; FARTHEST]>,
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

/// More cells than from the sensor to a corner of the window, whose side is little more than
/// twice the reach: 120 m of 0.05 m.
const FARTHEST: usize = 4096;

/// Cells of a row that are taken in together: a vector of log-odds.
const BLOCK: usize = 16;

/// All bits for the cells of a block whose bit is set, none for the others.
#[inline(always)]
fn spread(cells: u16) -> [i16; BLOCK] {
    let mut spread = [0; BLOCK];
    for (cell, all) in spread.iter_mut().enumerate() {
        *all = if cells & (1 << cell) != 0 { -1 } else { 0 };
    }
    spread
}

/// Whether any cell of a block has any bit. A plain loop, as all others over a block: those become
/// vectors, folds do not.
#[inline(always)]
fn any(cells: [i16; BLOCK]) -> bool {
    let mut any = 0;
    for cell in &cells {
        any |= cell;
    }
    any != 0
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
        let mut passed = Box::new([0; FARTHEST]);
        for (cell, passed) in passed.iter_mut().enumerate() {
            *passed = units(model.passed(cell as f64 * cell_m));
        }
        Self {
            passed,
            hit: units(model.hit()),
            lowest: units(parameters.lowest_probability),
            highest: units(parameters.highest_probability),
            cell_m,
        }
    }

    #[inline(always)]
    fn free_row(&self, tile: &mut Tile, row: usize, passed: u64, view: &View<'_>) {
        let cells = passed & !tile.surely_free[row];
        if cells == 0 {
            return;
        }
        // Of the row's first cell from the sensor, in cells.
        let sensor_m = view.sensor.origin_m();
        let [sensor_x, sensor_y] = sensor_m.map(|at| at / self.cell_m);
        let middle = |tile: i32| f64::from(tile) * TILE_CELLS as f64 + 0.5;
        let east = (middle(tile.place[0]) - sensor_x) as f32;
        let north = (middle(tile.place[1]) + row as f64 - sensor_y) as f32;
        for block in 0..TILE_CELLS / BLOCK {
            let mut cells = (cells >> (block * BLOCK)) as u16;
            if cells == 0 {
                continue;
            }
            let east = east + (block * BLOCK) as f32;
            let first = row * TILE_CELLS + block * BLOCK;
            let mut before = [0; BLOCK];
            before.copy_from_slice(&tile.log_odds[first..first + BLOCK]);
            let mut is_occupied = [0; BLOCK];
            for cell in 0..BLOCK {
                is_occupied[cell] = i16::from(before[cell] > 0);
            }
            if any(is_occupied) {
                for cell in set_bits(cells.into()).filter(|cell| before[*cell] > 0) {
                    let place = [f64::from(east) + cell as f64, f64::from(north)];
                    let at_m = [0, 1].map(|axis| sensor_m[axis] + place[axis] * self.cell_m);
                    let distance_m = libm::hypot(place[0], place[1]) * self.cell_m;
                    if !is_gone(tile.top[first + cell], at_m, distance_m, view) {
                        cells &= !(1 << cell);
                    }
                }
            }
            let (mut cells_off, mut passed) = ([0; BLOCK], [0; BLOCK]);
            for (cell, off) in cells_off.iter_mut().enumerate() {
                let east = east + cell as f32;
                *off = rounded((east * east + north * north).sqrt());
            }
            for (passed, off) in passed.iter_mut().zip(cells_off) {
                *passed = self.passed[usize::from(off) % FARTHEST];
            }
            self.free_block(tile, first, cells, before, passed, view.revolution);
        }
    }

    /// Adds to those of a block's cells that a bit is set for.
    #[inline(always)]
    fn free_block(
        &self,
        tile: &mut Tile,
        first: usize,
        cells: u16,
        before: [i16; BLOCK],
        passed: [i16; BLOCK],
        revolution: u32,
    ) {
        let is_passed = spread(cells);
        let (mut after, mut is_free, mut is_lowest) = ([0; BLOCK], [0; BLOCK], [0; BLOCK]);
        let (mut changed, mut turned) = ([0; BLOCK], [0; BLOCK]);
        for cell in 0..BLOCK {
            let sum = (before[cell] + (passed[cell] & is_passed[cell])).max(self.lowest);
            let (old, new) = (level(before[cell]), level(sum));
            changed[cell] = old ^ new;
            turned[cell] = i16::from(old.signum() != new.signum());
            is_lowest[cell] = is_passed[cell] & i16::from(sum == self.lowest);
            is_free[cell] = is_passed[cell] & -i16::from(sum <= 0);
            after[cell] = sum;
        }
        tile.log_odds[first..first + BLOCK].copy_from_slice(&after);
        let mut top = [0; BLOCK];
        top.copy_from_slice(&tile.top[first..first + BLOCK]);
        for cell in 0..BLOCK {
            top[cell] &= !is_free[cell] as u8;
        }
        tile.top[first..first + BLOCK].copy_from_slice(&top);
        if any(changed) {
            tile.revision = revolution;
            let mut count = 0;
            for turned in &turned {
                count += turned;
            }
            tile.change += count as u32;
        }
        if any(is_lowest) {
            let mut lowest = 0u64;
            for (cell, is_lowest) in is_lowest.iter().enumerate() {
                lowest |= u64::from(*is_lowest != 0) << cell;
            }
            tile.surely_free[first / TILE_CELLS] |= lowest << (first % TILE_CELLS);
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
        let tile_of = |(cell, _): &(Cell, u8)| cell.in_tile().0;
        for hits in hits.chunk_by(|a, b| tile_of(a) == tile_of(b)) {
            let [x, y] = tile_of(&hits[0]);
            let tile = map.tile_mut(window.tile(x, y));
            for (cell, top) in hits {
                let (_, place) = cell.in_tile();
                if window.take_hit(*cell) {
                    let after = (tile.log_odds[place] + self.hit).min(self.highest);
                    tile.set(place, after, revolution);
                    tile.surely_free[place / TILE_CELLS] &= !(1 << (place % TILE_CELLS));
                }
                tile.top[place] = tile.top[place].max(*top);
            }
        }
    }
}

/// Takes the cells in that rays passed and in which none ended.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn free(filter: &Filter, window: &Window, view: &View<'_>, map: &mut Map) {
    for y in 0..window.side() {
        for x in 0..window.side() {
            let passed = |row: usize| window.free(x, y, row) != 0;
            if (0..TILE_CELLS).any(passed) {
                let tile = map.tile_mut(window.tile(x, y));
                for row in 0..TILE_CELLS {
                    filter.free_row(tile, row, window.free(x, y, row), view);
                }
            }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::Profile;

    #[test]
    fn every_hit_goes_to_its_own_tile_and_each_cell_counts_once() {
        let filter = Filter::new(&GridParameters::profile(Profile::Default));
        let (mut window, mut map) = (Window::new(2), Map::new(8));
        window.begin([-1, -1]);
        let hits: Vec<(Cell, u8)> = [
            ([10.5, 20.5], 3),
            ([11.5, 20.5], 4),
            ([74.5, 20.5], 5),
            ([74.5, 84.5], 6),
            ([10.5, 84.5], 7),
            ([10.5, 20.5], 9),
        ]
        .into_iter()
        .filter_map(|(at, top)| Some((window.hit(at)?, top)))
        .collect();
        assert_eq!(hits.len(), 6);
        filter.occupy(&hits, &mut window, 1, &mut map);
        let place = 20 * TILE_CELLS + 10;
        for (tile, top) in [([-1, -1], 9), ([0, -1], 5), ([0, 0], 6), ([-1, 0], 7)] {
            let tile = map.tile_mut(tile);
            let occupied = tile.log_odds.iter().filter(|log_odds| **log_odds > 0);
            let expected = if top == 9 { 2 } else { 1 };
            assert_eq!(occupied.count(), expected);
            assert_eq!((tile.log_odds[place], tile.top[place]), (filter.hit, top));
        }
        assert_eq!(map.tile_mut([-1, -1]).top[place + 1], 4);
    }
}
