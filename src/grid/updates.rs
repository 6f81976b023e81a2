//! Which part of the map is sent after a revolution: what changed most, and in turn all.

use super::GridParameters;
use super::map::{Map, TILE_CELLS, Tile, level};
use crate::time::Time;
use crate::wire::grid_tile;

/// Tiles along a side of a sheet: what is sent in one message, so that there are few and full ones.
const SHEET_TILES: usize = 2;
/// Cells along a side of a sheet.
pub(super) const SHEET_CELLS: usize = SHEET_TILES * TILE_CELLS;

/// Some tiles as they are sent.
#[derive(Debug, Clone, Default)]
pub(super) struct Sheet {
    /// Which one: its south-west corner over its side, east and north.
    pub(super) place: [i32; 2],
    /// Revolution of the last change of a level.
    pub(super) revision: u32,
    /// Its cells, encoded.
    pub(super) cells: Vec<u8>,
}

/// Chooses sheets within a budget of bytes.
///
/// A sheet's urgency is the time that it waits over the time in which all come round, plus a share for
/// its changes, plus one round if a tile of it was never sent; from 1 on it wants to be sent, and the
/// most urgent goes first. Changes count for less than a round: however much changes, and however
/// small the budget is, all sheets come in turn.
#[derive(Debug, Clone)]
pub(super) struct Updates {
    budget_bytes_per_s: f64,
    round_s: f64,
    tile_bytes: usize,
    radius_tiles: f64,
    /// Bytes that may be sent now.
    allowance: f64,
    last: Option<Time>,
    waiting: Vec<Candidate>,
    /// Levels of the sheet that is being sent.
    levels: Vec<i16>,
    sheet: Sheet,
}

/// A tile that may be sent, and then its sheet.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    /// Of the sheet.
    place: [i32; 2],
    /// How long it waits, in rounds.
    age: f64,
    change: u32,
    is_known: bool,
}

/// Cells that became free, unknown or occupied before their sheet is sent out of turn.
const URGENT_CELLS: f64 = 24.0;
/// The most that changes count, in rounds: what changes all the time is sent four times in one.
const MOST_FOR_CHANGE: f64 = 0.75;
/// What was not sent in this time is not saved up for later.
const SAVED_S: f64 = 0.25;
/// What a frame has around the cells of its sheet, about.
const AROUND_CELLS: usize = 96;
/// Bytes of the cells at most, if every one is a run of its own.
const MOST_BYTES: usize = SHEET_CELLS * SHEET_CELLS + 1;

impl Candidate {
    fn urgency(&self) -> f64 {
        self.age
            + (f64::from(self.change) / URGENT_CELLS).min(MOST_FOR_CHANGE)
            + f64::from(u8::from(!self.is_known))
    }
}

impl Updates {
    pub(super) fn new(parameters: &GridParameters) -> Self {
        let tile_m = parameters.cell_m * TILE_CELLS as f64;
        Self {
            budget_bytes_per_s: 1000.0 * parameters.budget_kb_per_s,
            round_s: parameters.refresh_s / parameters.refresh_rounds as f64,
            tile_bytes: parameters.tile_bytes,
            radius_tiles: parameters.reach_m / tile_m + 1.0,
            allowance: 0.0,
            last: None,
            waiting: vec![],
            levels: Vec::with_capacity(SHEET_CELLS * SHEET_CELLS),
            sheet: Sheet {
                cells: Vec::with_capacity(MOST_BYTES),
                ..Sheet::default()
            },
        }
    }

    /// Hands the sheets that are to be sent at a time to `send`, for a sensor at a place in tiles.
    pub(super) fn choose(
        &mut self,
        map: &mut Map,
        now: Time,
        sensor: [f64; 2],
        mut send: impl FnMut(&mut Sheet),
    ) {
        let passed_s = self.last.map_or(SAVED_S, |last| (now - last).seconds());
        self.last = Some(now);
        let saved = self.allowance + self.budget_bytes_per_s * passed_s.clamp(0.0, SAVED_S);
        self.allowance = saved.min(SAVED_S * self.budget_bytes_per_s);
        self.line_up(map, now, sensor);
        for candidate in 0..self.waiting.len() {
            if self.allowance <= 0.0 {
                break;
            }
            self.take(map, self.waiting[candidate].place, now);
            self.allowance -= (AROUND_CELLS + self.sheet.cells.len()) as f64;
            send(&mut self.sheet);
        }
    }

    /// Those that want to be sent, the most urgent first.
    fn line_up(&mut self, map: &mut Map, now: Time, [x, y]: [f64; 2]) {
        self.waiting.clear();
        for tile in map.tiles_mut() {
            let [east, north] = tile.place.map(|place| f64::from(place) + 0.5);
            if libm::hypot(east - x, north - y) > self.radius_tiles {
                continue;
            }
            let since = *tile.waits_from.get_or_insert(now);
            self.waiting.push(Candidate {
                place: tile.place.map(|place| place.div_euclid(SHEET_TILES as i32)),
                age: ((now - since).seconds() / self.round_s).max(0.0),
                change: tile.change,
                is_known: tile.is_known,
            });
        }
        self.waiting.sort_unstable_by_key(|tile| tile.place);
        self.waiting.dedup_by(|tile, sheet| {
            let is_of_it = tile.place == sheet.place;
            if is_of_it {
                sheet.age = sheet.age.max(tile.age);
                sheet.change += tile.change;
                sheet.is_known &= tile.is_known;
            }
            is_of_it
        });
        self.waiting.retain(|sheet| sheet.urgency() >= 1.0);
        self.waiting.sort_unstable_by(|a, b| {
            (b.urgency().total_cmp(&a.urgency()))
                .then(b.change.cmp(&a.change))
                .then(a.place.cmp(&b.place))
        });
    }

    /// Makes the sheet at a place, as of now known to all.
    fn take(&mut self, map: &mut Map, place: [i32; 2], now: Time) {
        self.levels.clear();
        self.levels.resize(SHEET_CELLS * SHEET_CELLS, 0);
        self.sheet.place = place;
        self.sheet.revision = 0;
        for north in 0..SHEET_TILES {
            for east in 0..SHEET_TILES {
                let [x, y] = place.map(|place| place * SHEET_TILES as i32);
                let Some(tile) = map.known_mut([x + east as i32, y + north as i32]) else {
                    continue;
                };
                (tile.waits_from, tile.change, tile.is_known) = (Some(now), 0, true);
                self.sheet.revision = self.sheet.revision.max(tile.revision);
                let first = (north * SHEET_CELLS + east) * TILE_CELLS;
                copy(tile, &mut self.levels[first..]);
            }
        }
        encode(&mut self.levels, self.tile_bytes, &mut self.sheet.cells);
    }
}

/// Puts a tile's levels into those of a sheet from its first cell on.
fn copy(tile: &Tile, levels: &mut [i16]) {
    for (row, log_odds) in (levels.chunks_mut(SHEET_CELLS)).zip(tile.log_odds.chunks(TILE_CELLS)) {
        for (level_of, log_odds) in row.iter_mut().zip(log_odds) {
            *level_of = level(*log_odds);
        }
    }
}

/// Writes the cells of a sheet as they are sent. Where they take too many bytes all that is free becomes
/// alike, and all that is occupied.
fn encode(levels: &mut [i16], most_bytes: usize, cells: &mut Vec<u8>) {
    grid_tile::encode_cells(levels, SHEET_CELLS, cells);
    if cells.len() + AROUND_CELLS > most_bytes {
        for level in levels.iter_mut() {
            *level = level.signum() * grid_tile::LEVELS;
        }
        grid_tile::encode_cells(levels, SHEET_CELLS, cells);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::Profile;
    use crate::time::Span;

    fn updates() -> Updates {
        Updates::new(&GridParameters::profile(Profile::Default))
    }

    /// A map of so many sheets, of which one tile each is known.
    fn map(sheets: i32, log_odds: i16) -> Map {
        let mut map = Map::new(64);
        for n in 0..sheets {
            let tile = tile(&mut map, n);
            tile.log_odds.fill(log_odds);
            note(tile, 4096, 1);
        }
        map
    }

    /// The tile of a sheet by its number, eight of them in a row.
    fn tile(map: &mut Map, n: i32) -> &mut Tile {
        map.tile_mut([n % 8, n / 8].map(|place| place * SHEET_TILES as i32 + 1))
    }

    fn note(tile: &mut Tile, cells: u32, revolution: u32) {
        tile.change += cells;
        tile.revision = revolution;
    }

    fn at(seconds: f64) -> Time {
        Time::from_micros(1_700_000_000_000_000) + Span::from_seconds(seconds)
    }

    fn places(updates: &mut Updates, map: &mut Map, now: Time, sensor: [f64; 2]) -> Vec<[i32; 2]> {
        let mut places = vec![];
        updates.choose(map, now, sensor, |sheet| places.push(sheet.place));
        places
    }

    #[test]
    fn the_most_changed_sheet_goes_first_and_a_quiet_one_waits_its_turn() {
        let (mut updates, mut map) = (updates(), map(3, 1000));
        let mut at = |map: &mut Map, seconds| places(&mut updates, map, at(seconds), [0.0; 2]);
        assert_eq!(at(&mut map, 0.0).len(), 3);
        for (n, cells) in [(2, 300), (1, 200), (0, 3)] {
            note(tile(&mut map, n), cells, 2);
        }
        assert_eq!(at(&mut map, 0.2), [[2, 0], [1, 0]]);
        assert_eq!(at(&mut map, 0.3).len(), 0);
        assert_eq!(at(&mut map, 0.8)[0], [0, 0]);
    }

    #[test]
    fn a_sheet_holds_its_tiles_where_they_lie_and_nothing_where_none_is() {
        let mut map = Map::new(8);
        let north_east = [-1, 1];
        map.tile_mut(north_east).log_odds[TILE_CELLS + 3] = 5000;
        note(map.tile_mut(north_east), 1, 4);
        let mut sheets = vec![];
        updates().choose(&mut map, at(0.0), [0.0; 2], |sheet| {
            sheets.push(sheet.clone())
        });
        let [sheet] = &mut sheets[..] else {
            panic!("{sheets:?}")
        };
        assert_eq!((sheet.place, sheet.revision), ([-1, 0], 4));
        let message = grid_tile::GridTile {
            cells_per_side: SHEET_CELLS as u32,
            cell_size: 0.1,
            ..grid_tile::GridTile::default()
        };
        let levels = message
            .with_cells(std::mem::take(&mut sheet.cells))
            .levels(0);
        let occupied = (TILE_CELLS + 1) * SHEET_CELLS + TILE_CELLS + 3;
        for (cell, found) in levels.unwrap().into_iter().enumerate() {
            let expected = if cell == occupied {
                grid_tile::LEVELS
            } else {
                0
            };
            assert_eq!(found, expected, "{cell}");
        }
    }

    #[test]
    fn no_more_bytes_are_sent_than_the_budget_allows() {
        let (mut updates, mut map) = (updates(), map(64, 1000));
        updates.budget_bytes_per_s = 10_000.0;
        let mut bytes = 0;
        for step in 0..100 {
            for n in 0..64 {
                let tile = tile(&mut map, n);
                tile.log_odds[step as usize] = -2000;
                note(tile, 1000, step);
            }
            let now = at(0.1 * f64::from(step));
            updates.choose(&mut map, now, [8.0; 2], |sheet| {
                bytes += sheet.cells.len() + AROUND_CELLS;
            });
        }
        // Ten seconds and what was saved before them.
        assert!((98_000..103_000).contains(&bytes), "{bytes}");
    }

    #[test]
    fn whatever_changes_no_sheet_waits_longer_than_the_refresh_time() {
        let (mut updates, mut map) = (updates(), map(64, 1000));
        updates.budget_bytes_per_s = 10_000.0;
        let mut sent = std::collections::BTreeMap::new();
        for step in 0..200u32 {
            // Every other sheet flickers all the time.
            for n in (0..64).step_by(2) {
                note(tile(&mut map, n), 5000, step);
            }
            let now = at(0.1 * f64::from(step));
            for place in places(&mut updates, &mut map, now, [8.0; 2]) {
                sent.insert(place, step);
            }
            let within = |[x, y]: [i32; 2]| {
                let tiles = |place| 2.0 * f64::from(place) + 1.5;
                libm::hypot(tiles(x) - 8.0, tiles(y) - 8.0) < 8.0
            };
            if step > 60 {
                for n in 0..64 {
                    let place = [n % 8, n / 8];
                    if within(place) {
                        assert!(step - sent[&place] <= 50, "{place:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_sheet_that_takes_too_many_bytes_is_sent_plainer() {
        let mut levels: Vec<i16> = (0..(SHEET_CELLS * SHEET_CELLS) as i16)
            .map(|n| if n % 256 < 128 { n % 5 + 1 } else { -3 })
            .collect();
        let [mut full, mut plain] = [vec![], vec![]];
        encode(&mut levels, 65_000, &mut full);
        encode(&mut levels, 1400, &mut plain);
        assert!(full.len() > 1400, "{}", full.len());
        assert!(plain.len() < 1400, "{}", plain.len());
    }
}
