//! Captures of VLP-16 packets, pcap or pcapng: as a recording of them, or of the point clouds that the
//! device service makes of them.

use std::path::Path;

use anyhow::{Result, bail};
use etherparse::{LaxNetSlice, LaxSlicedPacket, NetSlice, SlicedPacket, TransportSlice};
use pcap_parser::traits::PcapNGPacketBlock as _;
use pcap_parser::{Block, Linktype, PcapBlockOwned, PcapError, create_reader};

use super::Completion;
use super::files::progress;
use crate::time::Time;
use crate::wire::envelope::Postmark;
use crate::wire::point_cloud::POINT_CLOUD_ID;
use crate::wire::velodyne::captured::SensorPackets;
use crate::wire::velodyne::data::{self, BLOCKS, DataPacket, ReturnMode};
use crate::wire::velodyne::device_service::SweepAssembler;
use crate::wire::velodyne::{Packet, position};

/// Largest record that is read; a jumbo frame has 9 kB.
const LARGEST_RECORD: usize = 1 << 20;

/// What begins a capture: pcap in both byte orders and both resolutions, and pcapng.
const MAGICS: [[u8; 4]; 5] = [
    [0xa1, 0xb2, 0xc3, 0xd4],
    [0xd4, 0xc3, 0xb2, 0xa1],
    [0xa1, 0xb2, 0x3c, 0x4d],
    [0x4d, 0x3c, 0xb2, 0xa1],
    [0x0a, 0x0d, 0x0d, 0x0a],
];

/// Whether bytes are those of a capture.
pub(super) fn is_capture(bytes: &[u8]) -> bool {
    MAGICS.iter().any(|magic| bytes.starts_with(magic))
}

/// One captured frame.
struct Captured<'a> {
    time: Time,
    link: Linktype,
    bytes: &'a [u8],
}

/// The packets of sensors in a capture, in order.
#[derive(Default)]
pub(super) struct Capture {
    packets: SensorPackets,
    /// Data packets among them.
    data_packets: u64,
    /// Frames that are not whole.
    cut: u64,
    /// What ended it early, if anything did.
    damage: Option<String>,
}

impl Capture {
    /// Reads the capture that a file holds.
    ///
    /// # Errors
    /// When there is no data packet of a VLP-16 in it.
    pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Self> {
        let (mut capture, bar) = (Self::default(), progress(bytes.len(), "bytes"));
        capture.damage = walk(bytes, |offset, captured| {
            bar.set_position(offset as u64);
            capture.take(&captured);
        });
        bar.finish_and_clear();
        if capture.data_packets == 0 {
            let nothing = || "byte 0: no VLP-16 data packets".into();
            let problem = capture.damage.unwrap_or_else(nothing);
            bail!("{}: {problem}", path.display());
        }
        Ok(capture)
    }

    fn take(&mut self, captured: &Captured<'_>) {
        let Ok(found) = udp(captured) else {
            self.cut += 1;
            return;
        };
        let Some((source, bytes)) = found else {
            return;
        };
        if bytes.len() == data::PACKET_LEN || bytes.len() == position::PACKET_LEN {
            self.data_packets += u64::from(bytes.len() == data::PACKET_LEN);
            self.packets.push(&Packet {
                source,
                arrival: captured.time,
                bytes,
            });
        }
    }

    /// Its packets.
    pub(super) fn packets(&self) -> &SensorPackets {
        &self.packets
    }

    /// The packets as a recording, a message a revolution.
    pub(super) fn recording(&self) -> Vec<u8> {
        let (mut frames, mut message) = (vec![], SensorPackets::default());
        let mut last = None;
        let mut put = |message: &mut SensorPackets, time| {
            let postmark = Postmark {
                sent: time,
                sampled: time,
                sender_stamp: 0,
            };
            postmark.put(&mut frames, message);
            message.packets.0.clear();
        };
        for packet in self.packets.iter() {
            message.push(&packet);
            let end = DataPacket::new(packet.bytes).map(|data| data.azimuth(BLOCKS - 1));
            let (Ok(end), before) = (end, last) else {
                continue;
            };
            last = end;
            if end < before {
                put(&mut message, packet.arrival);
            }
        }
        if let Some(packet) = message.iter().last() {
            let time = packet.arrival;
            put(&mut message, time);
        }
        frames
    }

    /// The point clouds that the device service makes of the packets of the first sensor.
    pub(super) fn clouds(&self, sender_stamp: u32) -> Clouds {
        let mut clouds = Clouds::default();
        for packet in self.packets.iter() {
            if packet.bytes.len() == data::PACKET_LEN {
                clouds.take(sender_stamp, &packet);
            }
        }
        clouds
    }

    /// Whether all of it could be read.
    pub(super) fn completion(&self) -> Completion {
        if self.damage.is_some() || self.cut > 0 {
            Completion::Damaged
        } else {
            Completion::Done
        }
    }

    /// Says what could not be read.
    pub(super) fn warn(&self, path: &Path) {
        let path = path.display();
        if self.cut > 0 {
            let cut = self.cut;
            tell!("kreisel: {path}: {cut} packets that are no whole frames left out");
        }
        if let Some(problem) = &self.damage {
            tell!("kreisel: {path}: {problem}; the rest is skipped");
        }
    }
}

/// Point clouds as the device service sends them.
#[derive(Default)]
pub(super) struct Clouds {
    assembler: SweepAssembler,
    source: Option<[u8; 4]>,
    /// The revolutions, one frame after the other.
    pub(super) frames: Vec<u8>,
    /// Where the first of them ends, which began somewhere on the circle.
    first_end: usize,
    /// Data packets of the sensor.
    pub(super) packets: u64,
    /// Revolutions that they close.
    pub(super) revolutions: u64,
    other_sources: u64,
    broken: u64,
    dual_returns: u64,
}

impl Clouds {
    /// Its revolutions without the first one, of which only the end was captured.
    pub(super) fn whole_revolutions(&self) -> &[u8] {
        &self.frames[self.first_end..]
    }

    /// Columns after the last revolution.
    pub(super) fn pending_columns(&self) -> usize {
        self.assembler.pending_columns()
    }

    /// Whether all packets could be read.
    pub(super) fn completion(&self) -> Completion {
        if self.broken > 0 {
            Completion::Damaged
        } else {
            Completion::Done
        }
    }

    fn take(&mut self, sender_stamp: u32, packet: &Packet<'_>) {
        if *self.source.get_or_insert(packet.source) != packet.source {
            self.other_sources += 1;
            return;
        }
        self.packets += 1;
        let mode = DataPacket::new(packet.bytes).map(|data| data.return_mode());
        self.dual_returns += u64::from(mode == Ok(Some(ReturnMode::Dual)));
        let Ok(sweeps) = self.assembler.take(packet.bytes) else {
            self.broken += 1;
            return;
        };
        for sweep in sweeps {
            // The packet that closes a revolution gives it its time.
            let postmark = Postmark {
                sent: packet.arrival,
                sampled: packet.arrival,
                sender_stamp,
            };
            postmark.put_payload(&mut self.frames, POINT_CLOUD_ID, |out| {
                sweep.cloud().encode(out)
            });
            if self.revolutions == 0 {
                self.first_end = self.frames.len();
            }
            self.revolutions += 1;
        }
    }

    /// Says what was left out.
    pub(super) fn warn(&self, path: &Path) {
        let path = path.display();
        for (count, what) in [
            (self.other_sources, "packets of other sensors left out"),
            (self.broken, "packets without block flags left out"),
            (
                self.dual_returns,
                "packets in dual return mode, which the device service takes for more columns",
            ),
        ] {
            if count > 0 {
                tell!("kreisel: {path}: {count} {what}");
            }
        }
    }
}

/// Walks over the packets of a capture. Gives what ended it early, if anything did.
fn walk(bytes: &[u8], mut visit: impl FnMut(usize, Captured<'_>)) -> Option<String> {
    let mut reader = match create_reader(LARGEST_RECORD, bytes) {
        Ok(reader) => reader,
        Err(_) => return Some("byte 0: neither pcap nor pcapng".into()),
    };
    let (mut offset, mut links, mut nanoseconds) = (0, vec![], false);
    let mut refilled_at = None;
    loop {
        match reader.next() {
            Ok((length, block)) => {
                match &block {
                    PcapBlockOwned::LegacyHeader(header) => {
                        nanoseconds = header.is_nanosecond_precision();
                        links = vec![(header.network, 0, 0)];
                    }
                    PcapBlockOwned::NG(Block::SectionHeader(_)) => links.clear(),
                    PcapBlockOwned::NG(Block::InterfaceDescription(interface)) => {
                        links.push((
                            interface.linktype,
                            interface.if_tsoffset,
                            interface.if_tsresol,
                        ));
                    }
                    _ => {}
                }
                if let Some(captured) = captured(&block, &links, nanoseconds) {
                    visit(offset, captured);
                }
                offset += length;
                reader.consume(length);
            }
            Err(PcapError::Eof) => return None,
            Err(PcapError::Incomplete(_)) if refilled_at != Some(offset) => {
                refilled_at = Some(offset);
                if reader.refill().is_err() {
                    return Some(format!("byte {offset}: cannot be read"));
                }
            }
            Err(PcapError::Incomplete(_) | PcapError::UnexpectedEof) => {
                return Some(format!("byte {offset}: the last record is cut off"));
            }
            Err(_) => return Some(format!("byte {offset}: no record begins here")),
        }
    }
}

/// The packet in a record, if it holds one.
fn captured<'a>(
    block: &'a PcapBlockOwned<'_>,
    links: &[(Linktype, i64, u8)],
    nanoseconds: bool,
) -> Option<Captured<'a>> {
    match block {
        PcapBlockOwned::Legacy(record) => {
            let fraction = i64::from(record.ts_usec);
            let micros = if nanoseconds {
                fraction / 1000
            } else {
                fraction
            };
            Some(Captured {
                time: Time::from_micros(i64::from(record.ts_sec) * 1_000_000 + micros),
                link: links.first()?.0,
                bytes: record.data,
            })
        }
        PcapBlockOwned::NG(Block::EnhancedPacket(packet)) => {
            let (link, offset_s, resolution) = *links.get(packet.if_id as usize)?;
            let ticks = u64::from(packet.ts_high) << 32 | u64::from(packet.ts_low);
            let micros =
                micros(ticks, resolution)?.checked_add(offset_s.checked_mul(1_000_000)?)?;
            Some(Captured {
                time: Time::from_micros(micros),
                link,
                bytes: packet.packet_data(),
            })
        }
        _ => None,
    }
}

/// Time stamp ticks to microseconds (pcapng, option if_tsresol): a power of ten, or of two if
/// the highest bit is set.
fn micros(ticks: u64, resolution: u8) -> Option<i64> {
    const DEFAULT_RESOLUTION: u8 = 6;
    let resolution = if resolution == 0 {
        DEFAULT_RESOLUTION
    } else {
        resolution
    };
    let exponent = u32::from(resolution & 0x7f);
    let base: u128 = if resolution & 0x80 == 0 { 10 } else { 2 };
    let per_second = base.checked_pow(exponent)?;
    i64::try_from(u128::from(ticks) * 1_000_000 / per_second).ok()
}

/// Source and payload, if it is a UDP packet over IPv4, which sensors send; an error if it is cut or damaged.
fn udp<'a>(captured: &Captured<'a>) -> Result<Option<([u8; 4], &'a [u8])>> {
    let packet = match captured.link {
        Linktype::ETHERNET => SlicedPacket::from_ethernet(captured.bytes),
        Linktype::LINUX_SLL => SlicedPacket::from_linux_sll(captured.bytes),
        Linktype::RAW | Linktype::IPV4 => SlicedPacket::from_ip(captured.bytes),
        _ => return Ok(None),
    };
    let packet = match packet {
        Ok(packet) => packet,
        Err(error) => return position(captured).map(Some).ok_or(error.into()),
    };
    let (Some(NetSlice::Ipv4(ip)), Some(TransportSlice::Udp(udp))) =
        (&packet.net, &packet.transport)
    else {
        return Ok(None);
    };
    Ok(Some((ip.header().source(), udp.payload())))
}

/// A position packet of early firmware, whose IP header says that it is longer than it is.
fn position<'a>(captured: &Captured<'a>) -> Option<([u8; 4], &'a [u8])> {
    let packet = LaxSlicedPacket::from_ethernet(captured.bytes).ok()?;
    match (&packet.net, &packet.transport) {
        (Some(LaxNetSlice::Ipv4(ip)), Some(TransportSlice::Udp(udp)))
            if udp.payload().len() == position::PACKET_LEN =>
        {
            Some((ip.header().source(), udp.payload()))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_of_every_resolution_become_microseconds() {
        assert_eq!(micros(5_000_000, 0), Some(5_000_000));
        assert_eq!(micros(5_000_000_000, 9), Some(5_000_000));
        assert_eq!(micros(5 << 10, 0x8a), Some(5_000_000));
        assert_eq!(micros(1, 0xff), Some(0));
    }

    #[test]
    fn what_is_no_capture_says_so() {
        let visit = |_, _: Captured<'_>| ();
        assert_eq!(
            walk(b"no capture at all, is it", visit).unwrap(),
            "byte 0: neither pcap nor pcapng"
        );
    }
}
