//! What one revolution saw of the cells around the sensor, a bit each.

use std::ops::Range;

use multiversion::multiversion;

use super::map::TILE_CELLS;
use crate::float::{greatest, least};

/// Cells that rays passed and cells in which rays ended, in a square of tiles. A word of the
/// planes is a row of a tile. However many rays meet a cell, it has one bit of each plane: a
/// revolution counts once.
#[derive(Debug, Clone)]
pub(super) struct Window {
    /// Tiles along a side.
    side: usize,
    /// The tile in the south-west corner.
    first_tile: [i32; 2],
    passed: Vec<u64>,
    /// Empty between two revolutions.
    hit: Vec<u64>,
    /// Cells at whose southern edge an outline comes into their row.
    crossed: Vec<u64>,
    /// Rows that have such cells.
    crossed_rows: Range<usize>,
}

impl Window {
    pub(super) fn new(side: usize) -> Self {
        let words = side * side * TILE_CELLS;
        Self {
            side,
            first_tile: [0; 2],
            passed: vec![0; words],
            hit: vec![0; words],
            crossed: vec![0; words],
            crossed_rows: words..0,
        }
    }

    /// Begins a revolution with this tile in the south-west corner. All hits were taken.
    pub(super) fn begin(&mut self, first_tile: [i32; 2]) {
        self.first_tile = first_tile;
        self.passed.fill(0);
    }

    /// Tiles along a side.
    pub(super) fn side(&self) -> usize {
        self.side
    }

    /// The tile at a place counted from the south-west corner.
    pub(super) fn tile(&self, x: usize, y: usize) -> [i32; 2] {
        [self.first_tile[0] + x as i32, self.first_tile[1] + y as i32]
    }

    /// Cells along a side.
    fn cells(&self) -> usize {
        self.side * TILE_CELLS
    }

    /// The south-west corner, in cells of the local frame.
    pub(super) fn corner(&self) -> [f64; 2] {
        self.first_tile
            .map(|tile| f64::from(tile) * TILE_CELLS as f64)
    }

    /// Passes along a straight part of an area's outline, in cells from the south-west corner:
    /// row by row, all cells between where it enters the row and where it leaves it, none left
    /// out but those outside. When the outline is closed, [`Window::pass_outlined`] passes the
    /// cells within.
    pub(super) fn outline(&mut self, from: [f64; 2], to: [f64; 2]) {
        let ([x0, y0], [x1, y1]) = if from[1] <= to[1] {
            (from, to)
        } else {
            (to, from)
        };
        let top = self.cells() as f64;
        if !(y1 >= 0.0 && y0 < top) {
            return;
        }
        let row = |y: f64| (fixed(y) >> FRACTION_BITS) as usize;
        let (first, last) = (row(greatest(y0, 0.0)), row(least(y1, top - 1.0)));
        let is_inside = least(x0, x1) >= 0.0 && greatest(x0, x1) < top;
        if is_inside && first == last && y0 >= 0.0 && y1 < top {
            pass_row(self.passed_row(first), fixed(x0), fixed(x1));
            return;
        }
        let slope = if y1 > y0 { (x1 - x0) / (y1 - y0) } else { 0.0 };
        let step = fixed(slope);
        let mut enters = fixed(x0 + (first as f64 - y0).max(0.0) * slope);
        let mut leaves = fixed(x0 + ((first + 1) as f64 - y0) * slope);
        let words = first * self.side..(last + 1) * self.side;
        let passed = self.passed[words.clone()].chunks_exact_mut(self.side);
        let crossed = self.crossed[words].chunks_exact_mut(self.side);
        for (row, (passed, crossed)) in (first..).zip(passed.zip(crossed)) {
            // A cell that no outline crosses is within if an odd number of outlines passes the
            // row's southern edge to the left of it.
            if row > first || y0 < 0.0 {
                cross_row(crossed, enters);
            }
            if row == last && y1 < top {
                leaves = fixed(x1);
            }
            if is_inside && row < last {
                pass_row(passed, enters, leaves);
            } else {
                pass_row_clipped(passed, enters, leaves);
            }
            (enters, leaves) = (leaves, leaves.wrapping_add(step));
        }
        self.crossed_rows.start = self.crossed_rows.start.min(first);
        self.crossed_rows.end = self.crossed_rows.end.max(last + 1);
    }

    fn passed_row(&mut self, row: usize) -> &mut [u64] {
        &mut self.passed[row * self.side..(row + 1) * self.side]
    }

    /// Marks the cells within what was outlined, and begins a new outline.
    pub(super) fn pass_outlined(&mut self) {
        let none = self.cells()..0;
        let rows = std::mem::replace(&mut self.crossed_rows, none);
        if rows.start < rows.end {
            let words = rows.start * self.side..rows.end * self.side;
            let crossed = &mut self.crossed[words.clone()];
            pass_within(crossed, &mut self.passed[words], self.side);
        }
    }

    /// Marks the cell in which a ray ended, in cells from the south-west corner. Gives it, or
    /// `None` where it lies outside.
    pub(super) fn hit(&mut self, [x, y]: [f64; 2]) -> Option<Cell> {
        let inside = 0.0..self.cells() as f64;
        if !inside.contains(&x) || !inside.contains(&y) {
            return None;
        }
        let cell = Cell {
            row: y as u16,
            column: x as u16,
        };
        let (word, bit) = self.place(cell);
        self.hit[word] |= bit;
        Some(cell)
    }

    fn place(&self, cell: Cell) -> (usize, u64) {
        let column = usize::from(cell.column);
        let word = usize::from(cell.row) * self.side + column / TILE_CELLS;
        (word, 1 << (column % TILE_CELLS))
    }

    /// Whether a cell in which rays ended was not asked for before.
    pub(super) fn take_hit(&mut self, cell: Cell) -> bool {
        let (word, bit) = self.place(cell);
        let is_first = self.hit[word] & bit != 0;
        self.hit[word] &= !bit;
        is_first
    }

    /// Cells of a row of a tile that were passed and in which no ray ended: within a revolution
    /// a return weighs more than any ray that went through.
    pub(super) fn free(&self, x: usize, y: usize, row: usize) -> u64 {
        let word = (y * TILE_CELLS + row) * self.side + x;
        self.passed[word] & !self.hit[word]
    }
}

/// Marks the cells of some rows that are within outlines, given where those cross the rows' edges,
/// and forgets the latter.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn pass_within(crossed: &mut [u64], passed: &mut [u64], side: usize) {
    for word in crossed.iter_mut() {
        *word = odd_below(*word);
    }
    let rows = crossed
        .chunks_exact_mut(side)
        .zip(passed.chunks_exact_mut(side));
    for (crossed, passed) in rows {
        let mut is_within = 0;
        for (odd, passed) in crossed.iter_mut().zip(passed) {
            let within = std::mem::take(odd) ^ is_within;
            *passed |= within;
            is_within = ((within as i64) >> (TILE_CELLS - 1)) as u64;
        }
    }
}

/// The bits that have an odd number of ones up to and with themselves.
#[inline(always)]
fn odd_below(mut bits: u64) -> u64 {
    for shift in [1, 2, 4, 8, 16, 32] {
        bits ^= bits << shift;
    }
    bits
}

/// Bits behind the point of places along a row: after a thousand rows they are still right to a
/// millionth of a cell.
const FRACTION_BITS: u32 = 32;

/// A place, or a step from row to row, of less than 2^18 cells. A longer step comes out wrong:
/// only a way that ends in the next row has one, and its end is known.
fn fixed(cells: f64) -> i64 {
    // Around this the last bit of a float counts ones.
    const ONES: f64 = (3u64 << 51) as f64;
    let fractions = cells * (1u64 << FRACTION_BITS) as f64 + ONES;
    fractions.to_bits().wrapping_sub(ONES.to_bits()) as i64
}

/// The row or the column of a place.
pub(super) fn cell_of(cells: f64) -> i64 {
    fixed(cells) >> FRACTION_BITS
}

/// An outline crosses the southern edge of a row, if it does so before the row's end.
#[inline(always)]
fn cross_row(row: &mut [u64], x: i64) {
    let column = (x.max(0) >> FRACTION_BITS) as usize;
    if let Some(word) = row.get_mut(column / TILE_CELLS) {
        *word ^= 1 << (column % TILE_CELLS);
    }
}

/// Marks the cells of a row from one place to another, both within the row.
#[inline(always)]
fn pass_row(row: &mut [u64], a: i64, b: i64) {
    let first = (a.min(b) >> FRACTION_BITS) as usize;
    let last = (a.max(b) >> FRACTION_BITS) as usize;
    let (word, bit, more) = (first / TILE_CELLS, first % TILE_CELLS, last - first);
    if bit + more < TILE_CELLS {
        row[word] |= (!0 >> (TILE_CELLS - 1 - more)) << bit;
        return;
    }
    let last_word = last / TILE_CELLS;
    row[word] |= !0 << bit;
    row[word + 1..last_word].fill(!0);
    row[last_word] |= !0 >> (TILE_CELLS - 1 - last % TILE_CELLS);
}

/// The same, of which some may lie outside.
fn pass_row_clipped(row: &mut [u64], a: i64, b: i64) {
    let end = ((row.len() * TILE_CELLS) as i64) << FRACTION_BITS;
    if a.max(b) >= 0 && a.min(b) < end {
        pass_row(row, a.clamp(0, end - 1), b.clamp(0, end - 1));
    }
}

/// A cell of the window, counted from the south-west corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cell {
    row: u16,
    column: u16,
}

impl Cell {
    /// Its tile, counted from the south-west corner, and its place in it.
    pub(super) fn in_tile(self) -> ([usize; 2], usize) {
        let (row, column) = (usize::from(self.row), usize::from(self.column));
        let place = row % TILE_CELLS * TILE_CELLS + column % TILE_CELLS;
        ([column / TILE_CELLS, row / TILE_CELLS], place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn passed(window: &Window) -> Vec<[usize; 2]> {
        let cells = window.cells();
        let all = (0..cells * cells).map(|n| [n % cells, n / cells]);
        let is_passed = |[x, y]: &[usize; 2]| {
            let word = window.passed[y * window.side + x / TILE_CELLS];
            word >> (x % TILE_CELLS) & 1 == 1
        };
        all.filter(is_passed).collect()
    }

    /// Length of the part of a way that lies in a cell (Liang, Barsky 1984).
    fn length_within([x, y]: [usize; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
        let (mut enter, mut leave) = (0.0f64, 1.0f64);
        for (axis, low) in [x as f64, y as f64].into_iter().enumerate() {
            let rate = to[axis] - from[axis];
            let (a, b) = ((low - from[axis]) / rate, (low + 1.0 - from[axis]) / rate);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (leave - enter) * f64::hypot(to[0] - from[0], to[1] - from[1])
    }

    #[test]
    fn a_way_marks_exactly_the_cells_that_it_crosses() {
        let mut random = Random::new(1);
        let mut window = Window::new(2);
        for _ in 0..300 {
            let mut place = || [130.0 * random.uniform(), 127.9 * random.uniform()];
            let (from, to) = (place(), place());
            window.begin([0, 0]);
            window.outline(from, to);
            let marked = passed(&window);
            for cell in &marked {
                assert!(length_within(*cell, from, to) > -1e-6, "{cell:?}");
            }
            for x in 0..128 {
                for y in 0..128 {
                    if length_within([x, y], from, to) > 1e-6 {
                        assert!(marked.contains(&[x, y]), "{x} {y} {from:?} {to:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn ways_along_a_row_a_column_and_in_one_cell_are_marked() {
        for (from, to, expected) in [
            ([3.5, 7.5], [9.5, 7.5], 7),
            ([3.5, 7.5], [3.5, 1.5], 7),
            ([3.2, 7.5], [3.7, 7.6], 1),
            ([60.5, 0.5], [70.5, 0.5], 11),
        ] {
            let mut window = Window::new(2);
            window.outline(from, to);
            assert_eq!(passed(&window).len(), expected, "{from:?}");
        }
    }

    #[test]
    fn what_lies_outside_is_left_out() {
        let mut window = Window::new(1);
        window.outline([-30.5, -30.0], [100.0, 100.5]);
        let across = passed(&window);
        window.begin([5, 5]);
        window.outline([0.0, 0.5], [63.5, 64.0]);
        assert_eq!(across, passed(&window));
        window.begin([5, 5]);
        for (from, to) in [
            ([-9.0, 3.0], [-1.0, 60.0]),
            ([70.0, 3.0], [90.0, 60.0]),
            ([3.0, 64.0], [60.0, 99.0]),
            ([3.0, -64.0], [60.0, -9.0]),
        ] {
            window.outline(from, to);
        }
        assert_eq!(passed(&window).len(), 0);
        for outside in [[-0.1, 3.0], [64.0, 3.0], [3.0, f64::NAN]] {
            assert_eq!(window.hit(outside), None);
        }
    }

    #[test]
    fn a_return_counts_once_and_outweighs_the_rays_that_pass() {
        let mut window = Window::new(1);
        window.outline([0.5, 0.5], [10.5, 0.5]);
        let cell = window.hit([4.2, 0.9]).unwrap();
        assert_eq!(window.hit([4.8, 0.1]), Some(cell));
        assert_eq!(window.free(0, 0, 0), 0b111_1110_1111);
        assert!(window.take_hit(cell));
        assert!(!window.take_hit(cell));
        assert_eq!(cell.in_tile(), ([0, 0], 4));
    }
}
