//! Packets of a sensor into a capture, as a sensor broadcasts them.

use std::path::Path;

use anyhow::Result;
use etherparse::PacketBuilder;

use super::files::Output;
use crate::wire::velodyne::Packet;

/// A pcap file with time stamps in microseconds, little-endian, of Ethernet frames (libpcap's file format, version 2.4).
const HEADER: [u8; 24] = [
    0xd4, 0xc3, 0xb2, 0xa1, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0, 0, 1, 0, 0, 0,
];
/// Velodyne's part of the address space, and a sensor of it.
const SENSOR_ADDRESS: [u8; 6] = [0x60, 0x76, 0x88, 0, 0, 1];
const BROADCAST: [u8; 4] = [255; 4];
const TIME_TO_LIVE: u8 = 255;

/// A capture that is written.
#[derive(Debug)]
pub(super) struct PcapWriter {
    output: Output,
    frame: Vec<u8>,
}

impl PcapWriter {
    pub(super) fn create(path: &Path) -> Result<Self> {
        let mut output = Output::create(path)?;
        output.put(&HEADER)?;
        Ok(Self {
            output,
            frame: vec![],
        })
    }

    pub(super) fn put(&mut self, packet: &Packet<'_>) -> Result<()> {
        let port = packet.port();
        self.frame.clear();
        PacketBuilder::ethernet2(SENSOR_ADDRESS, [0xff; 6])
            .ipv4(packet.source, BROADCAST, TIME_TO_LIVE)
            .udp(port, port)
            .write(&mut self.frame, packet.bytes)?;
        let micros = packet.arrival.micros();
        let length = self.frame.len() as u32;
        for number in [
            micros.div_euclid(1_000_000) as u32,
            micros.rem_euclid(1_000_000) as u32,
            length,
            length,
        ] {
            self.output.put(&number.to_le_bytes())?;
        }
        self.output.put(&self.frame)
    }

    pub(super) fn finish(self) -> Result<()> {
        self.output.finish()
    }
}
