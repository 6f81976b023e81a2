//! Packets in a recording: those that close a revolution and all before them, in one message.

use super::Packet;
use crate::time::Time;
use crate::wire::message::Bytes;

crate::wire::message! {
    /// Packets of one revolution. No session carries it: captures are read as recordings of it.
    pub struct SensorPackets = 2025 "kreisel.SensorPackets" {
        /// Packet after packet: the sensor's IPv4 address, the time of arrival in microseconds since 1970 in 8 bytes, the
        /// length in 2, and as many bytes; numbers are big-endian.
        1 => packets: Bytes,
    }
}

/// Bytes before those of a packet.
const HEADING_LEN: usize = 14;

impl SensorPackets {
    /// Adds a packet; gives whether it is short enough for one.
    pub fn push(&mut self, packet: &Packet<'_>) -> bool {
        let Ok(length) = u16::try_from(packet.bytes.len()) else {
            return false;
        };
        let out = &mut self.packets.0;
        out.extend_from_slice(&packet.source);
        out.extend_from_slice(&packet.arrival.micros().to_be_bytes());
        out.extend_from_slice(&length.to_be_bytes());
        out.extend_from_slice(packet.bytes);
        true
    }

    /// The packets in order; what is cut off at the end is left out.
    pub fn iter(&self) -> impl Iterator<Item = Packet<'_>> {
        let mut rest = &self.packets.0[..];
        std::iter::from_fn(move || {
            let (heading, after) = rest.split_at_checked(HEADING_LEN)?;
            let (source, heading) = heading.split_first_chunk()?;
            let (micros, length) = heading.split_first_chunk()?;
            let length = u16::from_be_bytes(length.try_into().ok()?);
            let (bytes, after) = after.split_at_checked(length.into())?;
            rest = after;
            Some(Packet {
                source: *source,
                arrival: Time::from_micros(i64::from_be_bytes(*micros)),
                bytes,
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packets_come_out_as_they_went_in_and_a_cut_one_does_not() {
        let first = Packet {
            source: [192, 168, 1, 201],
            arrival: Time::from_micros(-5),
            bytes: &[1, 2, 3],
        };
        let second = Packet {
            arrival: Time::from_micros(7),
            bytes: &[],
            ..first
        };
        let mut packets = SensorPackets::default();
        assert!(packets.push(&first) && packets.push(&second));
        assert_eq!(packets.iter().collect::<Vec<_>>(), [first, second]);
        packets.packets.0.pop();
        assert_eq!(packets.iter().collect::<Vec<_>>(), [first]);
        let long = vec![0; 70_000];
        assert!(!packets.push(&Packet {
            bytes: &long,
            ..first
        }));
    }
}
