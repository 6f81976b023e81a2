//! `grid.npz`: a map as an array for numpy.

use std::path::Path;

use anyhow::Result;

use super::npz::Archive;
use crate::grid::{Grid, TILE_CELLS, Tile, model};
use crate::simulate::map::TrueMap;

/// Writes a true map: `cells[rows][columns]` from the south-west, bits of
/// [`crate::simulate::map::cell`].
pub(super) fn write_truth(path: &Path, map: &TrueMap) -> Result<()> {
    let mut archive = Archive::create(path)?;
    archive.put("cells", &map.shape, map.cells.iter().copied())?;
    archive.put("origin", &[2], map.origin_m.into_iter())?;
    archive.put("cell", &[], std::iter::once(map.cell_m))?;
    archive.finish()
}

/// Writes the map as it is: `probability[rows][columns]` from the south-west, 0.5 unknown,
/// `origin` of that corner, and the `cell` size.
pub(super) fn write(path: &Path, grid: &Grid) -> Result<()> {
    let places = || grid.map().tiles().map(Tile::place);
    let low = [0, 1].map(|axis| places().map(|place| place[axis]).min().unwrap_or(0));
    let high = [0, 1].map(|axis| places().map(|place| place[axis] + 1).max().unwrap_or(0));
    let [columns, rows] = [0, 1].map(|axis| (high[axis] - low[axis]) as usize * TILE_CELLS);
    let mut probability = vec![0.5f32; rows * columns];
    for tile in grid.map().tiles() {
        let [x, y] = [0, 1].map(|axis| (tile.place()[axis] - low[axis]) as usize * TILE_CELLS);
        for (row, cells) in tile.log_odds().chunks(TILE_CELLS).enumerate() {
            let begin = (y + row) * columns + x;
            for (to, cell) in probability[begin..].iter_mut().zip(cells) {
                *to = model::probability(f64::from(*cell) / model::UNITS) as f32;
            }
        }
    }
    let side_m = grid.cell_m() * TILE_CELLS as f64;
    let mut archive = Archive::create(path)?;
    archive.put("probability", &[rows, columns], probability.into_iter())?;
    archive.put(
        "origin",
        &[2],
        low.into_iter().map(|tile| f64::from(tile) * side_m),
    )?;
    archive.put("cell", &[], std::iter::once(grid.cell_m()))?;
    archive.finish()
}
