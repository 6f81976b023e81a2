//! Captures of VLP-16 packets, pcap or pcapng: as a recording of them, or of the point clouds that the
//! device service makes of them.

use std::path::Path;

use anyhow::{Result, bail};

use super::Completion;
use super::progress::Progress;
use crate::wire::capture::{CaptureError, Captured, Frames, udp};
use crate::wire::envelope::Postmark;
use crate::wire::point_cloud::POINT_CLOUD_ID;
use crate::wire::velodyne::captured::SensorPackets;
use crate::wire::velodyne::data::{self, BLOCKS, DataPacket, ReturnMode};
use crate::wire::velodyne::device_service::SweepAssembler;
use crate::wire::velodyne::{Packet, position};

/// The packets of sensors in a capture, in order.
#[derive(Default)]
pub(super) struct Capture {
    packets: SensorPackets,
    /// Data packets among them.
    data_packets: u64,
    /// Frames that are not whole.
    cut: u64,
    /// What ended it early, if anything did.
    damage: Option<CaptureError>,
}

impl Capture {
    /// Reads the capture that a file holds.
    ///
    /// # Errors
    /// When there is no data packet of a VLP-16 in it.
    pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Self> {
        let mut capture = Self::default();
        capture.damage = capture.take_all(bytes).err();
        if capture.data_packets == 0 {
            let problem = capture.damage.map(|problem| problem.to_string());
            let problem = problem.unwrap_or_else(|| "byte 0: no VLP-16 data packets".into());
            bail!("{}: {problem}", path.display());
        }
        Ok(capture)
    }

    fn take_all(&mut self, bytes: &[u8]) -> Result<(), CaptureError> {
        let mut progress = Progress::of(bytes.len(), "bytes");
        for frame in Frames::new(bytes)? {
            let frame = frame?;
            progress.set(frame.offset);
            self.take(&frame);
        }
        Ok(())
    }

    fn take(&mut self, frame: &Captured<'_>) {
        let packet = match udp::packet(frame) {
            Ok(Some(packet)) => packet,
            Ok(None) => return,
            Err(udp::CutFrame) => {
                self.cut += 1;
                return;
            }
        };
        let bytes = packet.payload;
        let is_position = bytes.len() == position::PACKET_LEN;
        // Position packets of early firmware have headers that say that they are longer.
        if packet.is_cut && !is_position {
            self.cut += 1;
        } else if is_position || bytes.len() == data::PACKET_LEN {
            self.data_packets += u64::from(!is_position);
            self.packets.push(&Packet {
                source: packet.source,
                arrival: frame.time,
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
