//! A tile of the occupancy grid as it travels.

use super::message::Bytes;
use super::protobuf::put_varint;
use crate::marks::marked;

/// Levels of occupancy on either side of the unknown one.
pub const LEVELS: i16 = 7;
/// Log-odds of being occupied from one level to the next.
pub const LEVEL_LOG_ODDS: f64 = 0.5;
/// The only encoding so far: runs of differences from the cell to the south.
pub const RUNS: u32 = 1;
/// Sides that a tile may have.
const SIDES: std::ops::RangeInclusive<u32> = 1..=1024;
/// Cell sizes that a map may have, metres.
const CELLS_M: std::ops::RangeInclusive<f64> = 0.001..=100.0;

super::message! {
    /// A square tile of the occupancy grid, to be drawn without any other message: its
    /// south-west corner is at tileX and tileY times cellsPerSide times cellSize in the odometry frame,
    /// which never jumps; the anchor says where that lies in the frame of the objects.
    pub struct GridTile = 2022 "kreisel.GridTile" {
        /// Tells maps apart: tiles of different ones do not fit together, a greater one is newer.
        1 => map_id: u32,
        /// Revolution of the map in which a cell last changed.
        2 => revision: u32,
        /// The frame of the objects. 0: the odometry frame itself, that of the sensor at the start, x right, y forward; 1:
        /// east, north, up around a WGS84 reference; 2: a simulation's own frame.
        3 => frame: u32,
        /// Which tile, counted to the east.
        4 => tile_x: i32,
        /// Which tile, counted to the north.
        5 => tile_y: i32,
        /// Cells along a side.
        6 => cells_per_side: u32,
        /// Side of a cell, metres.
        7 => cell_size: f64,
        /// How cells are written: 1, runs. Cells go row by row from the south-west corner; each
        /// has a level from 0 to 14, of which 7 is unknown, less is free, more is occupied, and
        /// from one to the next the log-odds rise by 0.5. A run is a varint: its low 4 bits are
        /// the level less that of the cell to the south (7 where there is none), modulo 16, the
        /// bits above them how many cells it holds for.
        8 => encoding: u32,
        /// CRC-32 of cells.
        9 => checksum: u32,
        /// The cells.
        10 => cells: Bytes,
        /// Origin of the odometry frame in the frame, metres to the east; that of the newest tile holds for the whole map.
        11 => anchor_x: f64,
        /// Metres to the north.
        12 => anchor_y: f64,
        /// Direction of the odometry frame's x axis in the frame, counter-clockwise from east, radians.
        13 => anchor_yaw: f64,
    }
}

/// Why a tile cannot be drawn.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum TileError {
    /// It belongs to another map.
    #[error("tile of map {found}, not of map {wanted}")]
    OtherMap {
        /// Its map.
        found: u32,
        /// The map that is drawn.
        wanted: u32,
    },
    /// No tile has such a size.
    #[error("a tile of {cells_per_side} cells of {cell_size} m a side is impossible")]
    ImpossibleSize {
        /// What it says.
        cells_per_side: u32,
        /// What it says.
        cell_size: f64,
    },
    /// Its cells are written in a way that is not known.
    #[error("encoding {0} is unknown")]
    UnknownEncoding(u32),
    /// Its cells are not those that were sent.
    #[error("checksum of the cells is {found:08x}, not {announced:08x}")]
    Checksum {
        /// What the tile says.
        announced: u32,
        /// Of the cells that it has.
        found: u32,
    },
    /// Its cells do not fill it, or are none.
    #[error("byte {offset} of the cells: {what}")]
    Damaged {
        /// Where in the cells.
        offset: usize,
        /// What is wrong.
        what: &'static str,
    },
}

/// Cells of a row of which the differences are found together.
const AT_ONCE: usize = 64;

/// Writes the levels of a tile's cells, from -[`LEVELS`] to [`LEVELS`], rows of `side` cells, which is
/// not 0.
pub fn encode_cells(levels: &[i16], side: usize, out: &mut Vec<u8>) {
    out.clear();
    let mut put = |difference: u8, cells: usize| {
        put_varint(out, (cells as u64) << 4 | u64::from(difference));
    };
    let (mut difference, mut begin) = (0, 0);
    for first_of_row in (0..levels.len()).step_by(side) {
        let row = &levels[first_of_row..levels.len().min(first_of_row + side)];
        for (cells, first) in row.chunks(AT_ONCE).zip((first_of_row..).step_by(AT_ONCE)) {
            let souths = first.checked_sub(side).map(|first| &levels[first..]);
            let differences = differences(cells, souths);
            let mut changes = [false; AT_ONCE];
            changes[0] = differences[0] != difference;
            for (change, pair) in changes[1..].iter_mut().zip(differences.windows(2)) {
                *change = pair[0] != pair[1];
            }
            for at in marked(&changes[..cells.len()]) {
                if first + at > begin {
                    put(difference, first + at - begin);
                }
                (difference, begin) = (differences[at], first + at);
            }
        }
    }
    put(difference, levels.len() - begin);
}

/// What a run says of each of some cells: how much higher it is than that to the south, modulo 16. The
/// cells to the south may be followed by others.
fn differences(cells: &[i16], souths: Option<&[i16]>) -> [u8; AT_ONCE] {
    let padded = |levels: &[i16]| {
        let mut padded = [0; AT_ONCE];
        padded[..cells.len()].copy_from_slice(&levels[..cells.len()]);
        padded
    };
    let (own, souths) = (padded(cells), souths.map_or([0; AT_ONCE], padded));
    std::array::from_fn(|at| (own[at] - souths[at]) as u8 & 15)
}

impl GridTile {
    /// The tile with these cells, as [`encode_cells`] wrote them.
    pub fn with_cells(self, cells: Vec<u8>) -> Self {
        Self {
            encoding: RUNS,
            checksum: crc32fast::hash(&cells),
            cells: Bytes(cells),
            ..self
        }
    }

    /// The levels of its cells, from -[`LEVELS`] to [`LEVELS`], row by row from the south-west,
    /// for a subscriber that draws `map_id`.
    ///
    /// # Errors
    /// [`TileError`] when it is of another map, impossible, or damaged.
    pub fn levels(&self, map_id: u32) -> Result<Vec<i16>, TileError> {
        if self.map_id != map_id {
            return Err(TileError::OtherMap {
                found: self.map_id,
                wanted: map_id,
            });
        }
        if !SIDES.contains(&self.cells_per_side) || !CELLS_M.contains(&self.cell_size) {
            return Err(TileError::ImpossibleSize {
                cells_per_side: self.cells_per_side,
                cell_size: self.cell_size,
            });
        }
        if self.encoding != RUNS {
            return Err(TileError::UnknownEncoding(self.encoding));
        }
        let found = crc32fast::hash(&self.cells.0);
        if found != self.checksum {
            return Err(TileError::Checksum {
                announced: self.checksum,
                found,
            });
        }
        decode_cells(&self.cells.0, self.cells_per_side as usize)
    }
}

fn decode_cells(bytes: &[u8], side: usize) -> Result<Vec<i16>, TileError> {
    let mut levels: Vec<i16> = Vec::with_capacity(side * side);
    let (mut run, mut shift, mut begin) = (0u64, 0, 0);
    for (offset, byte) in bytes.iter().enumerate() {
        let damaged = |what| TileError::Damaged {
            offset: begin,
            what,
        };
        if shift > 28 {
            return Err(damaged("a run without end"));
        }
        run |= u64::from(byte & 0x7f) << shift;
        shift += 7;
        if byte & 0x80 != 0 {
            continue;
        }
        let (difference, count) = ((run & 15) as i16, (run >> 4) as usize);
        if count > side * side - levels.len() {
            return Err(damaged("a run beyond the last cell"));
        }
        for _ in 0..count {
            let south = levels.len().checked_sub(side);
            let south = south.map_or(0, |at| levels[at]);
            let level = (south + LEVELS + difference) % 16 - LEVELS;
            if level > LEVELS {
                return Err(damaged("no such level"));
            }
            levels.push(level);
        }
        (run, shift, begin) = (0, 0, offset + 1);
    }
    if shift != 0 || levels.len() < side * side {
        return Err(TileError::Damaged {
            offset: bytes.len(),
            what: "cells are missing",
        });
    }
    Ok(levels)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn tile(levels: &[i16], side: usize) -> GridTile {
        let mut cells = vec![];
        encode_cells(levels, side, &mut cells);
        let tile = GridTile {
            map_id: 7,
            cells_per_side: side as u32,
            cell_size: 0.1,
            ..GridTile::default()
        };
        tile.with_cells(cells)
    }

    #[test]
    fn any_cells_come_back_as_they_were() {
        let mut random = Random::new(1);
        for side in [1, 5, 64, 65, 130] {
            for spread in [0.0, 3.0, 14.99] {
                let mut level = || (spread * random.uniform()) as i16 - LEVELS;
                let levels: Vec<i16> = (0..side * side).map(|_| level()).collect();
                assert_eq!(tile(&levels, side).levels(7), Ok(levels));
            }
        }
    }

    #[test]
    fn a_run_goes_on_over_the_ends_of_rows_whatever_their_length() {
        for side in [5, 64, 65, 130] {
            let levels: Vec<i16> = (0..5 * side).map(|cell| (cell / side) as i16 + 1).collect();
            let (mut cells, mut one) = (vec![], vec![]);
            encode_cells(&levels, side, &mut cells);
            put_varint(&mut one, (5 * side as u64) << 4 | 1);
            assert_eq!(cells, one, "{side}");
        }
    }

    #[test]
    fn a_tile_that_is_all_alike_takes_a_few_bytes() {
        assert!(tile(&[0; 4096], 64).cells.0.len() <= 3);
        assert!(tile(&[-4; 4096], 64).cells.0.len() <= 5);
    }

    #[test]
    fn a_tile_of_another_map_an_impossible_or_a_damaged_one_is_refused_by_name() {
        let good = tile(&[3; 4096], 64);
        let told = |tile: &GridTile| tile.levels(7).unwrap_err().to_string();
        let other = GridTile {
            map_id: 8,
            ..good.clone()
        };
        assert_eq!(told(&other), "tile of map 8, not of map 7");
        let impossible = GridTile {
            cells_per_side: 1 << 20,
            ..good.clone()
        };
        assert!(told(&impossible).contains("1048576 cells of 0.1 m"));
        for cell_size in [0.0, f64::NAN, f64::INFINITY] {
            let impossible = GridTile {
                cell_size,
                ..good.clone()
            };
            assert!(told(&impossible).contains("impossible"));
        }
        let unknown = GridTile {
            encoding: 2,
            ..good.clone()
        };
        assert_eq!(told(&unknown), "encoding 2 is unknown");
        let mut flipped = good.clone();
        flipped.cells.0[1] ^= 4;
        assert!(told(&flipped).starts_with("checksum"));
        for (cells, what) in [
            (&[0x10u8][..], "byte 1 of the cells: cells are missing"),
            (&[0x80, 0x80], "byte 2 of the cells: cells are missing"),
            (
                &[0x10, 0x80, 0x80, 0x80, 0x80, 0x80, 0],
                "byte 1 of the cells: a run without end",
            ),
            (
                &[0x80, 0x80, 0x08],
                "byte 0 of the cells: a run beyond the last cell",
            ),
            (&[0x10, 0x18], "byte 1 of the cells: no such level"),
        ] {
            assert_eq!(told(&good.clone().with_cells(cells.to_vec())), what);
        }
    }

    #[test]
    fn random_bytes_are_refused_and_never_panic() {
        let mut random = Random::new(3);
        for _ in 0..2000 {
            let len = (20.0 * random.uniform()) as usize;
            let bytes = (0..len).map(|_| (256.0 * random.uniform()) as u8).collect();
            let _ = tile(&[0; 64], 8).with_cells(bytes).levels(7);
        }
    }
}
