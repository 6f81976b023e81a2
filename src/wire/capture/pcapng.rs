//! The next generation: blocks of a type and a length, of which those of interfaces and of packets
//! are read (IETF draft-ietf-opsawg-pcapng, sections 3 and 4).

use super::pcap::LARGEST_FRAME;
use super::{CaptureError, Captured, Numbers, Record};
use crate::time::Time;
use crate::wire::point_cloud::ByteOrder;

/// What begins a section, and with it a file; the same in both byte orders.
pub(super) const SECTION: [u8; 4] = [0x0a, 0x0d, 0x0d, 0x0a];
const INTERFACE_DESCRIPTION: u32 = 1;
const ENHANCED_PACKET: u32 = 6;
/// What a section's byte order shows in.
const BYTE_ORDER_MAGIC: u32 = 0x1a2b_3c4d;
/// Type and length at a block's begin, and the length again at its end.
const HEADING_LEN: usize = 8;
const SHORTEST_BLOCK: usize = 12;
/// A frame and what may stand beside it.
const LONGEST_BLOCK: usize = 2 * LARGEST_FRAME;
/// Options of an interface.
const TIME_RESOLUTION: u16 = 9;
const TIME_OFFSET: u16 = 14;

/// What the blocks before the next one said.
#[derive(Debug, Clone)]
pub(super) struct Section {
    order: ByteOrder,
    interfaces: Vec<Interface>,
}

#[derive(Debug, Clone, Copy)]
struct Interface {
    link: u32,
    /// Ticks in a second: a power of ten, or of two if the highest bit is set.
    resolution: u8,
    offset_s: i64,
}

impl Default for Section {
    fn default() -> Self {
        Self {
            order: ByteOrder::Little,
            interfaces: vec![],
        }
    }
}

impl Section {
    pub(super) fn block<'a>(
        &mut self,
        bytes: &'a [u8],
        offset: usize,
    ) -> Result<Record<'a>, CaptureError> {
        let cut = CaptureError::Cut { offset };
        let none = CaptureError::NoRecord { offset };
        if bytes.starts_with(&SECTION) {
            let magic = |order| Numbers { bytes, order }.four(HEADING_LEN);
            self.interfaces.clear();
            self.order = match magic(ByteOrder::Big) {
                None => return Err(cut),
                Some(BYTE_ORDER_MAGIC) => ByteOrder::Big,
                _ if magic(ByteOrder::Little) == Some(BYTE_ORDER_MAGIC) => ByteOrder::Little,
                _ => return Err(none),
            };
        }
        let order = self.order;
        let number = |at| Numbers { bytes, order }.four(at);
        let (Some(kind), Some(length)) = (number(0), number(4)) else {
            return Err(cut);
        };
        let length = length as usize;
        if !(SHORTEST_BLOCK..=LONGEST_BLOCK).contains(&length) || !length.is_multiple_of(4) {
            return Err(none);
        }
        let block = bytes.get(..length).ok_or(cut)?;
        if number(length - 4) != number(4) {
            return Err(none);
        }
        let body = Numbers {
            bytes: &block[HEADING_LEN..length - 4],
            order,
        };
        let mut frame = None;
        match kind {
            INTERFACE_DESCRIPTION => {
                self.interfaces.push(Interface::read(body).ok_or(none)?);
            }
            ENHANCED_PACKET => frame = self.packet(body, offset),
            _ => {}
        }
        Ok(Record { length, frame })
    }

    /// The frame of a packet's block, if it says when and whence it came.
    fn packet<'a>(&self, body: Numbers<'a>, offset: usize) -> Option<Captured<'a>> {
        let interface = self.interfaces.get(body.four(0)? as usize)?;
        let ticks = u64::from(body.four(4)?) << 32 | u64::from(body.four(8)?);
        let kept = body.four(12)? as usize;
        const FRAME_AT: usize = 20;
        Some(Captured {
            offset,
            time: interface.time(ticks)?,
            link: interface.link,
            bytes: body.bytes.get(FRAME_AT..FRAME_AT.checked_add(kept)?)?,
        })
    }
}

impl Interface {
    fn read(body: Numbers<'_>) -> Option<Self> {
        const DEFAULT_RESOLUTION: u8 = 6;
        let mut interface = Self {
            link: body.two(0)?.into(),
            resolution: DEFAULT_RESOLUTION,
            offset_s: 0,
        };
        const OPTIONS_AT: usize = 8;
        let mut at = OPTIONS_AT;
        while let (Some(option), Some(length)) = (body.two(at), body.two(at + 2)) {
            let (length, value_at) = (usize::from(length), at + 4);
            match (option, length) {
                (TIME_RESOLUTION, 1) => interface.resolution = *body.bytes.get(value_at)?,
                (TIME_OFFSET, 8) => {
                    let [first, second] = [body.four(value_at)?, body.four(value_at + 4)?];
                    let (high, low) = match body.order {
                        ByteOrder::Big => (first, second),
                        ByteOrder::Little => (second, first),
                    };
                    interface.offset_s = (u64::from(high) << 32 | u64::from(low)) as i64;
                }
                _ => {}
            }
            at = value_at + length.next_multiple_of(4);
        }
        Some(interface)
    }

    /// The time of a time stamp; none if it is beyond those that microseconds can say.
    fn time(&self, ticks: u64) -> Option<Time> {
        let base: u128 = if self.resolution & 0x80 == 0 { 10 } else { 2 };
        let per_second = base.checked_pow((self.resolution & 0x7f).into())?;
        let micros = i64::try_from(u128::from(ticks) * 1_000_000 / per_second).ok()?;
        let offset_us = self.offset_s.checked_mul(1_000_000)?;
        micros.checked_add(offset_us).map(Time::from_micros)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Frames;
    use super::*;

    #[test]
    fn ticks_of_every_resolution_become_microseconds() {
        let micros = |ticks, resolution| {
            let interface = Interface {
                link: 1,
                resolution,
                offset_s: 0,
            };
            interface.time(ticks).map(Time::micros)
        };
        assert_eq!(micros(5_000_000, 6), Some(5_000_000));
        assert_eq!(micros(5_000_000_000, 9), Some(5_000_000));
        assert_eq!(micros(5 << 10, 0x8a), Some(5_000_000));
        assert_eq!(micros(5, 0), Some(5_000_000));
        assert_eq!(micros(1, 0xff), Some(0));
        assert_eq!(micros(u64::MAX, 0), None);
    }

    /// Writes blocks in a byte order.
    #[derive(Clone, Copy)]
    struct Writer(ByteOrder);

    impl Writer {
        fn number<const N: usize>(self, mut little: [u8; N]) -> [u8; N] {
            if self.0 == ByteOrder::Big {
                little.reverse();
            }
            little
        }

        fn four(self, number: u32) -> [u8; 4] {
            self.number(number.to_le_bytes())
        }

        fn block(self, kind: u32, body: &[u8]) -> Vec<u8> {
            let length = self.four((SHORTEST_BLOCK + body.len()) as u32);
            [&self.four(kind), &length, body, &length].concat()
        }

        fn section(self) -> Vec<u8> {
            let magic = self.four(BYTE_ORDER_MAGIC);
            let body = [&magic[..], &[0; 4], &[0xff; 8]].concat();
            self.block(u32::from_le_bytes(SECTION), &body)
        }

        /// An interface whose clock has nanoseconds and begins a minute before 1970.
        fn interface(self) -> Vec<u8> {
            let two = |number: u16| self.number(number.to_le_bytes());
            let body = [
                &two(1)[..],
                &[0; 6],
                &two(TIME_RESOLUTION),
                &two(1),
                &[9, 0, 0, 0],
                &two(TIME_OFFSET),
                &two(8),
                &self.number((-60i64).to_le_bytes()),
                &[0; 4],
            ];
            self.block(INTERFACE_DESCRIPTION, &body.concat())
        }

        fn packet(self, ticks: u64, frame: &[u8; 8]) -> Vec<u8> {
            let [high, low] = [(ticks >> 32) as u32, ticks as u32];
            let head = [0, high, low, 8, 8].map(|number| self.four(number));
            self.block(ENHANCED_PACKET, &[head.as_flattened(), frame].concat())
        }
    }

    const LITTLE: Writer = Writer(ByteOrder::Little);

    #[test]
    fn a_packet_has_the_link_and_the_clock_of_its_interface() {
        for writer in [LITTLE, Writer(ByteOrder::Big)] {
            let before = [
                writer.section(),
                writer.interface(),
                writer.block(5, &[0; 12]),
            ]
            .concat();
            let packet = writer.packet(61_000_001_000, b"of eight");
            let expected = Captured {
                offset: before.len(),
                time: Time::from_micros(1_000_001),
                link: 1,
                bytes: b"of eight",
            };
            let file = [before, packet].concat();
            assert!(Frames::new(&file).unwrap().eq([Ok(expected)]));
        }
    }

    #[test]
    fn a_packet_of_no_interface_is_left_out_and_a_section_forgets_those_before() {
        let file = [
            LITTLE.section(),
            LITTLE.interface(),
            LITTLE.section(),
            LITTLE.packet(0, b"of eight"),
        ]
        .concat();
        assert_eq!(Frames::new(&file).unwrap().next(), None);
    }

    #[test]
    fn a_block_that_is_cut_or_impossible_ends_the_file() {
        let before = [LITTLE.section(), LITTLE.interface()].concat();
        let offset = before.len();
        let whole = [before, LITTLE.packet(0, b"of eight")].concat();
        for length in offset + 1..whole.len() {
            let cut = CaptureError::Cut { offset };
            assert!(Frames::new(&whole[..length]).unwrap().eq([Err(cut)]));
        }
        let none = CaptureError::NoRecord { offset };
        for at in [offset + 4, offset + 7, whole.len() - 1] {
            let mut impossible = whole.clone();
            impossible[at] ^= 0x41;
            assert!(
                Frames::new(&impossible).unwrap().eq([Err(none)]),
                "byte {at}"
            );
        }
    }
}
