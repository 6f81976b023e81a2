//! Packets of a sensor into a capture, as a sensor broadcasts them.

use std::path::Path;

use anyhow::Result;

use super::files::Output;
use crate::wire::capture::{pcap, udp};
use crate::wire::velodyne::Packet;

/// Velodyne's part of the address space, and a sensor of it.
const SENSOR_ADDRESS: [u8; 6] = [0x60, 0x76, 0x88, 0, 0, 1];

/// A capture that is written.
#[derive(Debug)]
pub(super) struct PcapWriter {
    output: Output,
    frame: Vec<u8>,
}

impl PcapWriter {
    pub(super) fn create(path: &Path) -> Result<Self> {
        let mut output = Output::create(path)?;
        output.put(&pcap::ETHERNET_HEADER)?;
        Ok(Self {
            output,
            frame: vec![],
        })
    }

    pub(super) fn put(&mut self, packet: &Packet<'_>) -> Result<()> {
        self.frame.clear();
        let (source, port) = (packet.source, packet.port());
        udp::put_broadcast(&mut self.frame, SENSOR_ADDRESS, source, port, packet.bytes)?;
        let length = self.frame.len() as u32;
        self.output
            .put(&pcap::record_header(packet.arrival, length))?;
        self.output.put(&self.frame)
    }

    pub(super) fn finish(self) -> Result<()> {
        self.output.finish()
    }
}
