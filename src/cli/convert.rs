//! `kreisel convert`: captured VLP-16 packets to the envelopes that the device service sends.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::Args;
use etherparse::{SlicedPacket, TransportSlice};
use pcap_parser::traits::PcapNGPacketBlock as _;
use pcap_parser::{Block, Linktype, PcapBlockOwned, PcapError, create_reader};

use super::files::{Output, progress};
use super::{Completion, files};
use crate::time::Time;
use crate::wire::envelope::Postmark;
use crate::wire::point_cloud::POINT_CLOUD_ID;
use crate::wire::vlp16_packet::{PACKET_LEN, SweepAssembler};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Capture to read, pcap or pcapng.
    #[arg(value_name = "IN.pcap")]
    input: PathBuf,
    /// Recording to write.
    #[arg(value_name = "OUT.rec")]
    output: PathBuf,
    /// senderStamp of the envelopes.
    #[arg(long, value_name = "STAMP", default_value_t = 0)]
    id: u32,
}

/// Largest record that is read; a jumbo frame has 9 kB.
const LARGEST_RECORD: usize = 1 << 20;

/// One captured packet.
struct Captured<'a> {
    time: Time,
    link: Linktype,
    bytes: &'a [u8],
}

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    let bytes = files::read(&arguments.input)?;
    files::check_distinct(&arguments.input, &[Some(&arguments.output)])?;
    let mut output = None;
    let mut conversion = Conversion::default();
    let bar = progress(bytes.len(), "bytes");
    let damage = walk(&bytes, |offset, captured| {
        bar.set_position(offset as u64);
        conversion.take(arguments, &captured, &mut output)
    })?;
    bar.finish_and_clear();
    output.map_or(Ok(()), Output::finish)?;
    let path = arguments.input.display();
    if conversion.packets == 0 {
        let problem = damage.unwrap_or_else(|| "byte 0: no VLP-16 data packets".into());
        bail!("{path}: {problem}");
    }
    say!(
        "{} packets, {} revolutions; {} columns after the last one not sent",
        conversion.packets,
        conversion.revolutions,
        conversion.assembler.pending_columns(),
    );
    conversion.warn(&arguments.input);
    match damage {
        None if conversion.broken + conversion.cut > 0 => Ok(Completion::Damaged),
        None => Ok(Completion::Done),
        Some(problem) => {
            tell!("kreisel: {path}: {problem}; the rest is skipped");
            Ok(Completion::Damaged)
        }
    }
}

#[derive(Default)]
struct Conversion {
    assembler: SweepAssembler,
    source: Option<Vec<u8>>,
    packets: u64,
    revolutions: u64,
    other_sources: u64,
    broken: u64,
    cut: u64,
    dual_returns: u64,
    frame: Vec<u8>,
}

impl Conversion {
    fn take(
        &mut self,
        arguments: &Arguments,
        captured: &Captured<'_>,
        output: &mut Option<Output>,
    ) -> Result<()> {
        const RETURN_MODE_AT: usize = 1204;
        const DUAL_RETURN: u8 = 0x39;
        let Ok(found) = udp(captured) else {
            self.cut += 1;
            return Ok(());
        };
        let Some((source, payload)) = found else {
            return Ok(());
        };
        if payload.len() != PACKET_LEN {
            return Ok(());
        }
        if *self.source.get_or_insert_with(|| source.clone()) != source {
            self.other_sources += 1;
            return Ok(());
        }
        if output.is_none() {
            *output = Some(Output::create(&arguments.output)?);
        }
        self.packets += 1;
        self.dual_returns += u64::from(payload[RETURN_MODE_AT] == DUAL_RETURN);
        let Ok(sweeps) = self.assembler.take(payload) else {
            self.broken += 1;
            return Ok(());
        };
        for sweep in sweeps {
            // The packet that closes a revolution gives it its time.
            let postmark = Postmark {
                sent: captured.time,
                sampled: captured.time,
                sender_stamp: arguments.id,
            };
            self.frame.clear();
            postmark.put_payload(&mut self.frame, POINT_CLOUD_ID, |out| {
                sweep.cloud().encode(out)
            });
            if let Some(output) = output {
                output.put(&self.frame)?;
            }
            self.revolutions += 1;
        }
        Ok(())
    }

    fn warn(&self, path: &Path) {
        let path = path.display();
        for (count, what) in [
            (self.other_sources, "packets of other sensors left out"),
            (self.broken, "packets without block flags left out"),
            (self.cut, "packets that are no whole frames left out"),
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
fn walk(
    bytes: &[u8],
    mut visit: impl FnMut(usize, Captured<'_>) -> Result<()>,
) -> Result<Option<String>> {
    let mut reader = match create_reader(LARGEST_RECORD, bytes) {
        Ok(reader) => reader,
        Err(_) => return Ok(Some("byte 0: neither pcap nor pcapng".into())),
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
                    visit(offset, captured)?;
                }
                offset += length;
                reader.consume(length);
            }
            Err(PcapError::Eof) => return Ok(None),
            Err(PcapError::Incomplete(_)) if refilled_at != Some(offset) => {
                refilled_at = Some(offset);
                if reader.refill().is_err() {
                    return Ok(Some(format!("byte {offset}: cannot be read")));
                }
            }
            Err(PcapError::Incomplete(_) | PcapError::UnexpectedEof) => {
                return Ok(Some(format!("byte {offset}: the last record is cut off")));
            }
            Err(_) => return Ok(Some(format!("byte {offset}: no record begins here"))),
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

/// Source and payload, if it is a UDP packet; an error if it is cut or damaged.
fn udp<'a>(captured: &Captured<'a>) -> Result<Option<(Vec<u8>, &'a [u8])>> {
    let packet = match captured.link {
        Linktype::ETHERNET => SlicedPacket::from_ethernet(captured.bytes)?,
        Linktype::LINUX_SLL => SlicedPacket::from_linux_sll(captured.bytes)?,
        Linktype::RAW | Linktype::IPV4 => SlicedPacket::from_ip(captured.bytes)?,
        _ => return Ok(None),
    };
    let source = match &packet.net {
        Some(etherparse::NetSlice::Ipv4(ip)) => ip.header().source().to_vec(),
        Some(etherparse::NetSlice::Ipv6(ip)) => ip.header().source().to_vec(),
        _ => return Ok(None),
    };
    Ok(match packet.transport {
        Some(TransportSlice::Udp(udp)) => Some((source, udp.payload())),
        _ => None,
    })
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
        let visit = |_, _: Captured<'_>| Ok(());
        assert_eq!(
            walk(b"no capture at all, is it", visit).unwrap().unwrap(),
            "byte 0: neither pcap nor pcapng"
        );
    }
}
