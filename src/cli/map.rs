//! `grid.npz`: a map as an array for numpy.

use anyhow::Result;

use super::npz::Archive;
use crate::ego::Anchor;
use crate::grid::{Grid, TILE_CELLS, Tile, model};
use crate::simulate::map::TrueMap;

/// Writes a true map: `cells[rows][columns]` from the south-west, bits of
/// [`crate::simulate::map::cell`].
pub(super) fn write_truth(mut archive: Archive, map: &TrueMap) -> Result<()> {
    archive.put("cells", &map.shape, map.cells.iter().copied())?;
    archive.put("origin", &[2], map.origin_m.into_iter())?;
    archive.put("cell", &[], std::iter::once(map.cell_m))?;
    archive.finish()
}

/// Writes the map as it is: `probability[rows][columns]` from the south-west, 0.5 unknown,
/// `origin` of that corner in the local frame, and the `cell` size.
pub(super) fn write(mut archive: Archive, grid: &Grid) -> Result<()> {
    let cell_m = grid.cell_m();
    let anchor = grid.anchor();
    let covered = |tile: &Tile| covered(tile, &anchor, cell_m);
    let covers = || grid.map().tiles().map(covered);
    let low = [0, 1].map(|axis| covers().map(|(low, _)| low[axis]).min().unwrap_or(0));
    let high = [0, 1].map(|axis| covers().map(|(_, high)| high[axis]).max().unwrap_or(0));
    let [columns, rows] = [0, 1].map(|axis| (high[axis] - low[axis]) as usize);
    let mut log_odds = vec![0i16; rows * columns];
    for tile in grid.map().tiles() {
        let (from, to) = covered(tile);
        for y in from[1]..to[1] {
            for x in from[0]..to[0] {
                let middle_m = [x, y].map(|cell| (cell as f64 + 0.5) * cell_m);
                let Some(found) = cell_at(tile, anchor.back_m(middle_m), cell_m) else {
                    continue;
                };
                log_odds[(y - low[1]) as usize * columns + (x - low[0]) as usize] = found;
            }
        }
    }
    let probability = log_odds
        .into_iter()
        .map(|cell| model::probability(f64::from(cell) / model::UNITS) as f32);
    archive.put("probability", &[rows, columns], probability)?;
    let origin_m = low.into_iter().map(|cell| cell as f64 * cell_m);
    archive.put("origin", &[2], origin_m)?;
    archive.put("cell", &[], std::iter::once(cell_m))?;
    archive.finish()
}

/// The cells of the local frame that a tile may lie in: the first, and the one after the last.
fn covered(tile: &Tile, anchor: &Anchor, cell_m: f64) -> ([i64; 2], [i64; 2]) {
    let side_m = cell_m * TILE_CELLS as f64;
    let corners = [[0, 0], [0, 1], [1, 0], [1, 1]].map(|[east, north]| {
        let [x, y] = tile.place();
        let corner = [x + east, y + north].map(|tile| f64::from(tile) * side_m);
        anchor.place_m([corner[0], corner[1], 0.0])
    });
    // Where the frames are one, rounding adds no row.
    const SLACK: f64 = 1e-6;
    let cells = |axis: usize| corners.iter().map(move |corner| corner[axis] / cell_m);
    let low = [0, 1].map(|axis| (cells(axis).fold(f64::MAX, f64::min) + SLACK).floor() as i64);
    let high = [0, 1].map(|axis| (cells(axis).fold(f64::MIN, f64::max) - SLACK).ceil() as i64);
    (low, high)
}

/// Log-odds of a tile's cell at a place of the odometry frame, if it lies in the tile.
fn cell_at(tile: &Tile, [x, y]: [f64; 2], cell_m: f64) -> Option<i16> {
    let [east, north] = tile.place();
    let column = (x / cell_m).floor() as i64 - i64::from(east) * TILE_CELLS as i64;
    let row = (y / cell_m).floor() as i64 - i64::from(north) * TILE_CELLS as i64;
    let cells = 0..TILE_CELLS as i64;
    let is_inside = cells.contains(&column) && cells.contains(&row);
    is_inside.then(|| tile.log_odds()[row as usize * TILE_CELLS + column as usize])
}
