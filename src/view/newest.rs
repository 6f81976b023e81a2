//! What was published last: what a picture must hold for a viewer who has just come.

use std::collections::BTreeMap;

use crate::wire::grid_tile::GridTile;
use crate::wire::object_list::ObjectList;
use crate::wire::roundabout::Roundabout;
use crate::wire::status::Status;
use crate::wire::{Envelope, Message};

/// More bytes of tiles than this are no map that a daemon keeps: they are let go, and come again in turn.
const MOST_TILE_BYTES: usize = 1 << 20;

/// The newest list, what was said of a roundabout with it, Status and tiles, as the frames that they came in.
#[derive(Debug, Default)]
pub(super) struct Newest {
    list: Vec<u8>,
    /// Of the same revolution.
    roundabout: Vec<u8>,
    status: Vec<u8>,
    map_id: u32,
    tiles: BTreeMap<(i32, i32), Vec<u8>>,
    tile_bytes: usize,
}

impl Newest {
    /// Takes the frame that a datagram begins with, if it is one for the page: a list, what goes with it, a Status or a tile
    /// without damage. Gives it without what follows it.
    pub(super) fn take<'a>(&mut self, datagram: &'a [u8]) -> Option<&'a [u8]> {
        let (envelope, rest) = Envelope::from_datagram(datagram).ok()?;
        let frame = &datagram[..datagram.len() - rest];
        match envelope.data_type {
            ObjectList::ID => {
                ObjectList::decode(envelope.payload, 0).ok()?;
                self.list = frame.to_vec();
                self.roundabout.clear();
            }
            Roundabout::ID => {
                Roundabout::decode(envelope.payload, 0).ok()?;
                self.roundabout = frame.to_vec();
            }
            Status::ID => {
                Status::decode(envelope.payload, 0).ok()?;
                self.status = frame.to_vec();
            }
            GridTile::ID => self.keep_tile(&GridTile::decode(envelope.payload, 0).ok()?, frame),
            _ => return None,
        }
        Some(frame)
    }

    /// Lets go of all of it.
    pub(super) fn clear(&mut self) {
        self.list.clear();
        self.roundabout.clear();
        self.status.clear();
        self.tiles.clear();
        self.tile_bytes = 0;
    }

    fn keep_tile(&mut self, tile: &GridTile, frame: &[u8]) {
        if tile.map_id != self.map_id || self.tile_bytes > MOST_TILE_BYTES {
            self.tiles.clear();
            (self.map_id, self.tile_bytes) = (tile.map_id, 0);
        }
        let before = self
            .tiles
            .insert((tile.tile_x, tile.tile_y), frame.to_vec());
        self.tile_bytes += frame.len();
        self.tile_bytes -= before.map_or(0, |frame| frame.len());
    }

    /// Appends all of it.
    pub(super) fn put(&self, out: &mut Vec<u8>) {
        let tiles = self.tiles.values();
        for frame in tiles.chain([&self.status, &self.list, &self.roundabout]) {
            out.extend_from_slice(frame);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::Recording;
    use crate::wire::envelope::Postmark;

    fn frame(message: &impl Message) -> Vec<u8> {
        let mut frame = vec![];
        Postmark::default().put(&mut frame, message);
        frame
    }

    fn tile(map_id: u32, tile_x: i32, revision: u32) -> Vec<u8> {
        frame(&GridTile {
            map_id,
            tile_x,
            revision,
            ..GridTile::default()
        })
    }

    /// Numbers of the messages that are kept.
    fn kept(newest: &Newest) -> Vec<i32> {
        let mut bytes = vec![];
        newest.put(&mut bytes);
        let entries = Recording::new(&bytes);
        entries
            .map(|entry| entry.unwrap().envelope.data_type)
            .collect()
    }

    #[test]
    fn who_comes_late_gets_the_newest_of_everything() {
        let mut newest = Newest::default();
        for revision in 0..3 {
            newest.take(&tile(1, 0, revision));
            newest.take(&tile(1, 1, revision));
            newest.take(&frame(&ObjectList::default()));
        }
        newest.take(&frame(&Status::default()));
        assert_eq!(kept(&newest), [2022, 2022, 2023, 2021]);
        newest.take(&tile(2, 7, 0));
        newest.take(&frame(&Roundabout::default()));
        assert_eq!(kept(&newest), [2022, 2023, 2021, 2024]);
        // What was said of it holds for its own revolution.
        newest.take(&frame(&ObjectList::default()));
        assert_eq!(kept(&newest), [2022, 2023, 2021]);
    }

    #[test]
    fn what_is_damaged_or_no_business_of_the_page_is_left_out() {
        let mut newest = Newest::default();
        let list = frame(&ObjectList::default());
        assert_eq!(newest.take(&[&list[..], b"more"].concat()), Some(&list[..]));
        assert_eq!(newest.take(&list[..list.len() - 1]), None);
        assert_eq!(newest.take(b"nonsense"), None);
        let mut damaged = vec![];
        let cut = |out: &mut Vec<u8>| out.extend([0x0a, 0xff]);
        Postmark::default().put_payload(&mut damaged, ObjectList::ID, cut);
        assert_eq!(newest.take(&damaged), None);
        let mut other = vec![];
        Postmark::default().put_payload(&mut other, 2030, |_| ());
        assert_eq!(newest.take(&other), None);
        assert_eq!(kept(&newest), [2021]);
    }

    #[test]
    fn a_flood_of_tiles_is_let_go() {
        let mut newest = Newest::default();
        for tile_x in 0..100_000 {
            newest.take(&tile(1, tile_x, 0));
        }
        assert!(newest.tile_bytes <= MOST_TILE_BYTES + 200);
        let held: usize = newest.tiles.values().map(Vec::len).sum();
        assert_eq!(newest.tile_bytes, held);
    }
}
