//! Which tiles are sent after a revolution: the most changed, and in turn all.

use super::GridParameters;
use super::map::{Map, TILE_CELLS, Tile, level};
use crate::time::Time;
use crate::wire::grid_tile;

/// Chooses tiles within a budget of bytes.
///
/// A tile's urgency is the time that it waits over the time in which all tiles come round, plus a
/// share for its changes, plus one round if it was never sent; from 1 on it wants to be sent, and
/// the most urgent goes first. Changes count for less than a round: however much changes, and
/// however small the budget is, all tiles come in turn.
#[derive(Debug, Clone)]
pub(super) struct Updates {
    budget_bytes_per_s: f64,
    round_s: f64,
    tile_bytes: usize,
    /// Cells that are being encoded.
    encoded: Vec<u8>,
    radius_tiles: f64,
    /// Bytes that may be sent now.
    allowance: f64,
    last: Option<Time>,
    waiting: Vec<Candidate>,
    chosen: Vec<[i32; 2]>,
}

#[derive(Debug, Clone, Copy)]
struct Candidate {
    urgency: f64,
    change: u32,
    place: [i32; 2],
}

/// Cells that became free, unknown or occupied before their tile is sent out of turn.
const URGENT_CELLS: f64 = 24.0;
/// The most that changes count, in rounds: what changes all the time is sent four times in one.
const MOST_FOR_CHANGE: f64 = 0.75;
/// What was not sent in this time is not saved up for later.
const SAVED_S: f64 = 0.25;
/// What a frame has around the cells of its tile, about.
const AROUND_CELLS: usize = 96;
/// Bytes of the cells at most, if every one is a run of its own.
const MOST_BYTES: usize = TILE_CELLS * TILE_CELLS + 1;

impl Updates {
    pub(super) fn new(parameters: &GridParameters) -> Self {
        let tile_m = parameters.cell_m * TILE_CELLS as f64;
        Self {
            budget_bytes_per_s: 1000.0 * parameters.budget_kb_per_s,
            round_s: parameters.refresh_s / parameters.refresh_rounds as f64,
            tile_bytes: parameters.tile_bytes,
            encoded: Vec::with_capacity(MOST_BYTES),
            radius_tiles: parameters.reach_m / tile_m + 1.0,
            allowance: 0.0,
            last: None,
            waiting: vec![],
            chosen: vec![],
        }
    }

    /// The places of the tiles to be sent at a time, for a sensor at a place in tiles. Their
    /// cells are encoded.
    pub(super) fn choose(&mut self, map: &mut Map, now: Time, sensor: [f64; 2]) -> &[[i32; 2]] {
        let passed_s = self.last.map_or(SAVED_S, |last| (now - last).seconds());
        self.last = Some(now);
        let saved = self.allowance + self.budget_bytes_per_s * passed_s.clamp(0.0, SAVED_S);
        self.allowance = saved.min(SAVED_S * self.budget_bytes_per_s);
        self.chosen.clear();
        self.line_up(map, now, sensor);
        for candidate in &self.waiting {
            if self.allowance <= 0.0 {
                break;
            }
            let tile = map.tile_mut(candidate.place);
            encode(tile, self.tile_bytes, &mut self.encoded);
            self.allowance -= (AROUND_CELLS + tile.encoded.len()) as f64;
            (tile.waits_from, tile.change, tile.is_known) = (Some(now), 0, true);
            self.chosen.push(candidate.place);
        }
        &self.chosen
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
            let age = ((now - since).seconds() / self.round_s).max(0.0);
            let urgency = age
                + (f64::from(tile.change) / URGENT_CELLS).min(MOST_FOR_CHANGE)
                + f64::from(u8::from(!tile.is_known));
            if urgency >= 1.0 {
                self.waiting.push(Candidate {
                    urgency,
                    change: tile.change,
                    place: tile.place,
                });
            }
        }
        self.waiting.sort_unstable_by(|a, b| {
            (b.urgency.total_cmp(&a.urgency))
                .then(b.change.cmp(&a.change))
                .then(a.place.cmp(&b.place))
        });
    }
}

/// Writes a tile's cells as they are sent, if they changed since. Where they take too many bytes
/// all that is free becomes alike, and all that is occupied.
fn encode(tile: &mut Tile, most_bytes: usize, encoded: &mut Vec<u8>) {
    if tile.encoded_revision == Some(tile.revision) {
        return;
    }
    tile.encoded_revision = Some(tile.revision);
    let mut levels = [0; TILE_CELLS * TILE_CELLS];
    for (level_of, log_odds) in levels.iter_mut().zip(&tile.log_odds) {
        *level_of = level(*log_odds);
    }
    grid_tile::encode_cells(&levels, TILE_CELLS, encoded);
    if encoded.len() + AROUND_CELLS > most_bytes {
        levels = levels.map(|level| level.signum() * grid_tile::LEVELS);
        grid_tile::encode_cells(&levels, TILE_CELLS, encoded);
    }
    tile.encoded.clear();
    tile.encoded.reserve(most_bytes.min(MOST_BYTES));
    tile.encoded.extend_from_slice(encoded);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::Profile;
    use crate::time::Span;

    fn updates() -> Updates {
        Updates::new(&GridParameters::profile(Profile::Default))
    }

    fn map(tiles: i32, log_odds: i16) -> Map {
        let mut map = Map::new(64);
        for n in 0..tiles {
            let tile = map.tile_mut([n % 8, n / 8]);
            tile.log_odds.fill(log_odds);
            note(tile, 4096, 1);
        }
        map
    }

    fn note(tile: &mut Tile, cells: u32, revolution: u32) {
        tile.change += cells;
        tile.revision = revolution;
    }

    fn at(seconds: f64) -> Time {
        Time::from_micros(1_700_000_000_000_000) + Span::from_seconds(seconds)
    }

    #[test]
    fn the_most_changed_tile_goes_first_and_a_quiet_one_waits_its_turn() {
        let (mut updates, mut map) = (updates(), map(3, 1000));
        assert_eq!(updates.choose(&mut map, at(0.0), [0.0; 2]).len(), 3);
        note(map.tile_mut([2, 0]), 300, 2);
        note(map.tile_mut([1, 0]), 200, 2);
        note(map.tile_mut([0, 0]), 3, 2);
        assert_eq!(
            updates.choose(&mut map, at(0.2), [0.0; 2]),
            [[2, 0], [1, 0]]
        );
        assert_eq!(updates.choose(&mut map, at(0.3), [0.0; 2]).len(), 0);
        assert_eq!(updates.choose(&mut map, at(0.7), [0.0; 2])[0], [0, 0]);
    }

    #[test]
    fn no_more_bytes_are_sent_than_the_budget_allows() {
        let (mut updates, mut map) = (updates(), map(256, 1000));
        updates.budget_bytes_per_s = 40_000.0;
        let mut bytes = 0;
        for step in 0..100 {
            for n in 0..256 {
                let tile = map.tile_mut([n % 8, n / 8]);
                tile.log_odds[step as usize] = -2000;
                note(tile, 1000, step);
            }
            let now = at(0.1 * f64::from(step));
            let chosen = updates.choose(&mut map, now, [4.0; 2]).to_vec();
            let lens = chosen
                .iter()
                .map(|place| map.tile(*place).unwrap().encoded.len());
            bytes += lens.map(|len| len + AROUND_CELLS).sum::<usize>();
        }
        // Ten seconds and what was saved before them.
        assert!((395_000..412_000).contains(&bytes), "{bytes}");
    }

    #[test]
    fn whatever_changes_no_tile_waits_longer_than_the_refresh_time() {
        let (mut updates, mut map) = (updates(), map(300, 1000));
        let mut sent = std::collections::BTreeMap::new();
        for step in 0..200u32 {
            // Every other tile flickers all the time.
            for n in (0..300).step_by(2) {
                note(map.tile_mut([n % 8, n / 8]), 5000, step);
            }
            let now = at(0.1 * f64::from(step));
            for place in updates.choose(&mut map, now, [4.0, 4.0]) {
                sent.insert(*place, step);
            }
            let within = |place: [i32; 2]| {
                libm::hypot(f64::from(place[0]) - 3.5, f64::from(place[1]) - 3.5) < 8.0
            };
            if step > 60 {
                for tile in map.tiles().filter(|tile| within(tile.place)) {
                    assert!(step - sent[&tile.place] <= 50, "{:?}", tile.place);
                }
            }
        }
    }

    #[test]
    fn a_tile_that_takes_too_many_bytes_is_sent_plainer() {
        let mut map = map(1, 0);
        let tile = map.tile_mut([0, 0]);
        for (n, cell) in tile.log_odds.iter_mut().enumerate() {
            *cell = if n % 128 < 64 {
                600 * (n % 5) as i16 + 600
            } else {
                -600
            };
        }
        encode(tile, 65_000, &mut vec![]);
        let full = tile.encoded.len();
        note(tile, 1, 2);
        encode(tile, 1400, &mut vec![]);
        assert!(
            full > 1400 && tile.encoded.len() < 1400,
            "{full} {}",
            tile.encoded.len()
        );
    }
}
