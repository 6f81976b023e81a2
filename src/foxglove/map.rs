//! The map around the vehicle as a grid.

use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{Grid as Message, PackedElementField, Pose, Vector2};

use super::{LOCAL, stamp, turned, vector};
use crate::grid::model::{UNITS, probability};
use crate::grid::{Grid, TILE_CELLS};
use crate::time::Time;
use crate::view::Around;

/// Tiles to each side of the one with the vehicle.
const REACH: i32 = 8;
const SIDE: usize = (2 * REACH as usize + 1) * TILE_CELLS;
/// Half a chance of being occupied: nobody knows.
const UNKNOWN: u8 = 50;

/// Per cent of the probability that a cell is occupied, row by row from the south-west.
pub(super) fn message(grid: &Grid, around: &Around<'_>, time: Time) -> Message {
    let anchor = grid.anchor();
    let [x, y, _] = around.sensor.position_m;
    let tile_m = grid.cell_m() * TILE_CELLS as f64;
    let middle = anchor
        .back_m([x, y])
        .map(|metres| libm::floor(metres / tile_m) as i32);
    let first = middle.map(|place| place.saturating_sub(REACH));
    let mut cells = vec![UNKNOWN; SIDE * SIDE];
    for tile in grid.map().tiles() {
        let [column, row] =
            [0, 1].map(|axis| i64::from(tile.place()[axis]) - i64::from(first[axis]));
        let is_near = |place: i64| (0..=2 * i64::from(REACH)).contains(&place);
        if !is_near(column) || !is_near(row) {
            continue;
        }
        let begin = row as usize * TILE_CELLS * SIDE + column as usize * TILE_CELLS;
        for (number, line) in tile.log_odds().chunks(TILE_CELLS).enumerate() {
            let own = &mut cells[begin + number * SIDE..][..TILE_CELLS];
            for (cell, log_odds) in own.iter_mut().zip(line) {
                *cell = (100.0 * probability(f64::from(*log_odds) / UNITS)) as u8;
            }
        }
    }
    let corner = first.map(|place| f64::from(place) * tile_m);
    let mut corner_m = anchor.place_m([corner[0], corner[1], 0.0]);
    corner_m[2] = around.sensor.position_m[2] - around.ground_below_m;
    let cell_m = grid.cell_m();
    Message {
        timestamp: Some(stamp(time)),
        frame_id: LOCAL.into(),
        pose: Some(Pose {
            position: Some(vector(corner_m)),
            orientation: Some(turned(anchor.yaw_rad)),
        }),
        column_count: SIDE as u32,
        cell_size: Some(Vector2 {
            x: cell_m,
            y: cell_m,
        }),
        row_stride: SIDE as u32,
        cell_stride: 1,
        fields: vec![PackedElementField {
            name: "occupied".into(),
            offset: 0,
            r#type: NumericType::Uint8.into(),
        }],
        data: cells.into(),
    }
}
