//! The classic format: a header, then records of 16 bytes and a frame (libpcap's file format 2.4).

use super::{CaptureError, Captured, Numbers, Record};
use crate::time::Time;
use crate::wire::point_cloud::ByteOrder;

/// Bytes of a file before its first record.
pub(super) const HEADER_LEN: usize = 24;
/// Bytes of a record before its frame.
const RECORD_LEN: usize = 16;
/// Largest frame that is read; a jumbo frame has 9 kB.
pub(super) const LARGEST_FRAME: usize = 1 << 20;
/// What begins a file with time stamps in microseconds, and one in nanoseconds.
const MICROSECONDS: u32 = 0xa1b2_c3d4;
const NANOSECONDS: u32 = 0xa1b2_3c4d;
/// Bits of the link type that name it; the others tell of check sums behind the frames.
const LINK_MASK: u32 = 0x0fff_ffff;

/// A file of Ethernet frames with time stamps in microseconds, little-endian, before its records.
pub const ETHERNET_HEADER: [u8; HEADER_LEN] = [
    0xd4, 0xc3, 0xb2, 0xa1, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0, 0, 1, 0, 0, 0,
];

/// What holds for all records of a file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Header {
    order: ByteOrder,
    is_nanoseconds: bool,
    link: u32,
}

impl Header {
    pub(super) fn is_begun_by(bytes: &[u8]) -> bool {
        resolution(bytes).is_some()
    }

    pub(super) fn read(bytes: &[u8]) -> Option<Self> {
        let (order, is_nanoseconds) = resolution(bytes)?;
        let link = Numbers { bytes, order }.four(20)?;
        Some(Self {
            order,
            is_nanoseconds,
            link: link & LINK_MASK,
        })
    }

    pub(super) fn record<'a>(
        &self,
        bytes: &'a [u8],
        offset: usize,
    ) -> Result<Record<'a>, CaptureError> {
        let order = self.order;
        let number = |at| Numbers { bytes, order }.four(at);
        let cut = CaptureError::Cut { offset };
        let [seconds, fraction, kept] = [number(0), number(4), number(8)];
        let (Some(seconds), Some(fraction), Some(kept)) = (seconds, fraction, kept) else {
            return Err(cut);
        };
        let kept = kept as usize;
        if kept > LARGEST_FRAME {
            return Err(CaptureError::NoRecord { offset });
        }
        let length = RECORD_LEN + kept;
        let frame = bytes.get(RECORD_LEN..length).ok_or(cut)?;
        let per_microsecond = if self.is_nanoseconds { 1000 } else { 1 };
        let micros = i64::from(seconds) * 1_000_000 + i64::from(fraction / per_microsecond);
        Ok(Record {
            length,
            frame: Some(Captured {
                offset,
                time: Time::from_micros(micros),
                link: self.link,
                bytes: frame,
            }),
        })
    }
}

/// Byte order of a file, and whether its time stamps are nanoseconds.
fn resolution(bytes: &[u8]) -> Option<(ByteOrder, bool)> {
    [ByteOrder::Big, ByteOrder::Little]
        .into_iter()
        .find_map(|order| match (Numbers { bytes, order }).four(0)? {
            MICROSECONDS => Some((order, false)),
            NANOSECONDS => Some((order, true)),
            _ => None,
        })
}

/// What goes before a frame of this length in a file that begins with [`ETHERNET_HEADER`].
pub fn record_header(time: Time, length: u32) -> [u8; RECORD_LEN] {
    let seconds = time.micros().div_euclid(1_000_000) as u32;
    let fraction = time.micros().rem_euclid(1_000_000) as u32;
    let mut header = [0; RECORD_LEN];
    for (place, number) in header
        .chunks_exact_mut(4)
        .zip([seconds, fraction, length, length])
    {
        place.copy_from_slice(&number.to_le_bytes());
    }
    header
}

#[cfg(test)]
mod tests {
    use super::super::Frames;
    use super::*;

    fn file(time: Time, frame: &[u8]) -> Vec<u8> {
        let mut file = ETHERNET_HEADER.to_vec();
        file.extend(record_header(time, frame.len() as u32));
        file.extend(frame);
        file
    }

    #[test]
    fn what_is_written_is_read_in_both_byte_orders_and_resolutions() {
        let time = Time::from_micros(1_700_000_000_123_456);
        let file = file(time, b"frame");
        let expected = Captured {
            offset: HEADER_LEN,
            time,
            link: 1,
            bytes: b"frame",
        };
        let frames = |file: &[u8]| {
            let frames = Frames::new(file).unwrap();
            assert!(frames.eq([Ok(expected)]));
        };
        frames(&file);

        let mut nanoseconds = file.clone();
        nanoseconds[..4].copy_from_slice(&NANOSECONDS.to_le_bytes());
        nanoseconds[HEADER_LEN + 4..][..4].copy_from_slice(&123_456_789u32.to_le_bytes());
        frames(&nanoseconds);

        let mut big = nanoseconds;
        for at in [0, 20, 24, 28, 32, 36] {
            big[at..at + 4].reverse();
        }
        frames(&big);
    }

    #[test]
    fn a_record_that_is_cut_or_impossible_ends_the_file() {
        let whole = file(Time::ZERO, b"frame");
        for length in HEADER_LEN + 1..whole.len() {
            let mut frames = Frames::new(&whole[..length]).unwrap();
            let cut = CaptureError::Cut { offset: HEADER_LEN };
            assert_eq!(frames.next(), Some(Err(cut)));
            assert_eq!(frames.next(), None);
        }
        let mut impossible = whole;
        impossible[HEADER_LEN + 11] = 0xff;
        let none = CaptureError::NoRecord { offset: HEADER_LEN };
        assert!(Frames::new(&impossible).unwrap().eq([Err(none)]));
    }
}
