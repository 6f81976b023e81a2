//! The map itself: tiles of cells that are made where something was seen.

use super::model::UNITS;
use crate::time::Time;
use crate::wire::grid_tile::{LEVEL_LOG_ODDS, LEVELS};

/// Cells along a side of a tile: a row is a machine word of bits.
pub const TILE_CELLS: usize = 64;
const CELLS: usize = TILE_CELLS * TILE_CELLS;

/// Log-odds between two levels of what is sent.
const LEVEL_UNITS: i16 = (LEVEL_LOG_ODDS * UNITS) as i16;

/// The level of a cell: 0 unknown, below it free, above it occupied.
pub(super) fn level(log_odds: i16) -> i16 {
    const { assert!(LEVEL_UNITS.count_ones() == 1) };
    let nearest = (log_odds + LEVEL_UNITS / 2) >> LEVEL_UNITS.trailing_zeros();
    nearest.clamp(-LEVELS, LEVELS)
}

/// A square of cells.
#[derive(Debug, Clone)]
pub struct Tile {
    /// Which one: its south-west corner over its side, east and north.
    pub(super) place: [i32; 2],
    /// Log-odds of being occupied, row by row from the south-west.
    pub(super) log_odds: [i16; CELLS],
    /// How high above the ground something was seen in an occupied cell, in
    /// [`HEIGHT_UNIT_M`].
    pub(super) top: [u8; CELLS],
    /// Cells that are as free as a cell can be, a word a row.
    pub(super) surely_free: [u64; TILE_CELLS],
    /// How often a cell of it became free, unknown or occupied since it was sent.
    pub(super) change: u32,
    /// Revolution of the last change of a level.
    pub(super) revision: u32,
    /// Since when it waits: since it was sent, or came into reach.
    pub(super) waits_from: Option<Time>,
    /// Whether it was ever sent.
    pub(super) is_known: bool,
}

/// Unit of the heights in a tile.
pub(super) const HEIGHT_UNIT_M: f32 = 0.05;

impl Tile {
    fn empty(place: [i32; 2]) -> Self {
        Self {
            place,
            log_odds: [0; CELLS],
            top: [0; CELLS],
            surely_free: [0; TILE_CELLS],
            change: 0,
            revision: 0,
            waits_from: None,
            is_known: false,
        }
    }

    fn clear(&mut self, place: [i32; 2]) {
        self.place = place;
        self.log_odds.fill(0);
        self.top.fill(0);
        self.surely_free.fill(0);
        (self.change, self.revision) = (0, 0);
        (self.waits_from, self.is_known) = (None, false);
    }

    /// Sets a cell in a revolution.
    pub(super) fn set(&mut self, cell: usize, log_odds: i16, revolution: u32) {
        let [before, after] = [self.log_odds[cell], log_odds].map(level);
        self.log_odds[cell] = log_odds;
        if log_odds <= 0 {
            self.top[cell] = 0;
        }
        if before != after {
            self.revision = revolution;
            self.change += u32::from(before.signum() != after.signum());
        }
    }

    /// Which one: its south-west corner over its side, east and north.
    pub fn place(&self) -> [i32; 2] {
        self.place
    }

    /// Log-odds of a cell in [`super::model::UNITS`], row by row from the south-west.
    pub fn log_odds(&self) -> &[i16] {
        &self.log_odds
    }

    /// Levels of its cells, row by row from the south-west.
    pub fn levels(&self) -> impl Iterator<Item = i16> {
        self.log_odds.iter().map(|log_odds| level(*log_odds))
    }
}

/// Tiles around the sensor. A tile's slot follows from its place, so that none is searched for,
/// and a tile far behind gives its slot to the one ahead that would have the same.
#[derive(Debug, Clone)]
pub struct Map {
    /// Slots along a side.
    side: i32,
    slots: Vec<Option<Box<Tile>>>,
    spare: Vec<Box<Tile>>,
    /// The tile around which the others are kept.
    home: Option<[i32; 2]>,
}

impl Map {
    /// A map whose tiles are at most `side` tiles from each other.
    pub(super) fn new(side: usize) -> Self {
        Self {
            side: side as i32,
            slots: vec![None; side * side],
            spare: vec![],
            home: None,
        }
    }

    fn slot(&self, [x, y]: [i32; 2]) -> usize {
        (y.rem_euclid(self.side) * self.side + x.rem_euclid(self.side)) as usize
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        self.spare
            .extend(self.slots.iter_mut().filter_map(Option::take));
    }

    /// Forgets tiles more than half of the map's side away from one of them.
    pub(super) fn keep_around(&mut self, home: [i32; 2]) {
        if self.home.replace(home) == Some(home) {
            return;
        }
        let [x, y] = home;
        let half = self.side / 2;
        for slot in &mut self.slots {
            let is_far = |tile: &Tile| {
                let [tile_x, tile_y] = tile.place;
                tile_x.abs_diff(x) >= half as u32 || tile_y.abs_diff(y) >= half as u32
            };
            if slot.as_deref().is_some_and(is_far) {
                self.spare.extend(slot.take());
            }
        }
    }

    /// The tile at a place, made if there is none.
    pub(super) fn tile_mut(&mut self, place: [i32; 2]) -> &mut Tile {
        let slot = self.slot(place);
        let spare = &mut self.spare;
        let tile = self.slots[slot].get_or_insert_with(|| match spare.pop() {
            Some(mut tile) => {
                tile.clear(place);
                tile
            }
            None => Box::new(Tile::empty(place)),
        });
        if tile.place != place {
            tile.clear(place);
        }
        tile
    }

    /// The tile at a place, if anything was ever seen there, to be changed.
    pub(super) fn known_mut(&mut self, place: [i32; 2]) -> Option<&mut Tile> {
        let slot = self.slot(place);
        let tile = self.slots[slot].as_deref_mut();
        tile.filter(|tile| tile.place == place)
    }

    /// The tile at a place, if anything was ever seen there.
    pub fn tile(&self, place: [i32; 2]) -> Option<&Tile> {
        let tile = self.slots[self.slot(place)].as_deref();
        tile.filter(|tile| tile.place == place)
    }

    pub(super) fn tiles_mut(&mut self) -> impl Iterator<Item = &mut Tile> {
        self.slots.iter_mut().flatten().map(|tile| &mut **tile)
    }

    /// All tiles.
    pub fn tiles(&self) -> impl Iterator<Item = &Tile> {
        self.slots.iter().flatten().map(|tile| &**tile)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_is_made_once_and_given_up_when_it_is_far_behind() {
        let mut map = Map::new(8);
        map.tile_mut([-3, 2]).log_odds[5] = 7;
        assert_eq!(map.tile_mut([-3, 2]).log_odds[5], 7);
        assert!(map.tile([-3, 3]).is_none() && map.tile([5, 2]).is_none());
        map.keep_around([0, 0]);
        assert_eq!(map.tiles().count(), 1);
        map.keep_around([1, 0]);
        assert_eq!(map.tiles().count(), 0);
        assert_eq!(map.tile_mut([9, 9]).log_odds[5], 0);
    }

    #[test]
    fn two_places_with_the_same_slot_never_share_a_tile() {
        let mut map = Map::new(4);
        map.tile_mut([0, 0]).log_odds[0] = 9;
        assert_eq!(map.tile_mut([4, 0]).log_odds[0], 0);
        assert!(map.tile([0, 0]).is_none());
    }

    #[test]
    fn levels_are_alike_on_both_sides_of_unknown() {
        for (log_odds, expected) in [(0, 0), (255, 0), (257, 1), (1024, 2), (32_000, 7)] {
            assert_eq!(level(log_odds), expected);
            assert_eq!(level(-log_odds), -expected);
        }
    }
}
