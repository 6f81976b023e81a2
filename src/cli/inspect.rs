//! `kreisel inspect`: what is in a recording.

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use super::Completion;
use super::files::Recorded;
use crate::cloud::{Intake, sensor, shown_order};
use crate::config::Configuration;
use crate::pipeline::Pipeline;
use crate::time::Time;
use crate::wire::point_cloud::{ByteOrder, CompactPointCloud, POINT_CLOUD_ID, Schema};
use crate::wire::recording::Entry;
use crate::wire::velodyne::captured::SensorPackets;
use crate::wire::{Message as _, Recording, known_name};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Recording or capture (pcap, pcapng) to look into.
    #[arg(value_name = "FILE")]
    input: PathBuf,
    /// As JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Default, Serialize)]
struct Report {
    bytes: usize,
    envelopes: usize,
    duration_s: f64,
    messages: Vec<MessageReport>,
    point_clouds: Vec<CloudReport>,
    /// What a sensor itself sent, if that was captured.
    packets: Option<PacketsReport>,
    own_vehicle: Option<OwnVehicleReport>,
    damage: Vec<DamageReport>,
}

/// Messages of one number from one sender.
#[derive(Debug, Default, Serialize)]
struct MessageReport {
    id: i32,
    name: &'static str,
    sender_stamp: u32,
    count: usize,
    bytes: usize,
    rate_hz: f64,
    longest_gap_s: f64,
    #[serde(skip)]
    first: Time,
    #[serde(skip)]
    last: Time,
}

#[derive(Debug, Serialize)]
struct CloudReport {
    offset: usize,
    t: f64,
    sender_stamp: u32,
    sensor: &'static str,
    schema: &'static str,
    columns: usize,
    layers: u8,
    start_azimuth_deg: f32,
    end_azimuth_deg: f32,
    byte_order: &'static str,
    intensity_bits: u8,
    /// Why the daemon would not process it.
    refused: Option<String>,
}

/// Packets of a sensor, and what the daemon makes of them.
#[derive(Debug, Serialize)]
struct PacketsReport {
    count: u64,
    lost: u64,
    sensor: String,
    return_mode: String,
    rotation_hz: f32,
    /// Whether a GPS receiver keeps the sensor's time; see `kreisel.Status`.
    clock: String,
    /// How far that is ahead of the time of the packets' arrival.
    clock_ahead_s: f64,
    revolutions: u64,
    refused: String,
}

/// How far the own vehicle is seen in the sensor frame.
#[derive(Debug, Serialize)]
struct OwnVehicleReport {
    left_m: f32,
    right_m: f32,
    back_m: f32,
    front_m: f32,
}

#[derive(Debug, Serialize)]
struct DamageReport {
    offset: usize,
    skipped: usize,
    problem: String,
}

/// Point clouds that are printed line by line; a whole drive is summed up.
const MOST_CLOUD_LINES: usize = 20;

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    let recorded = Recorded::read(&arguments.input)?;
    let packets = match &recorded {
        Recorded::Capture(capture) => inspect_packets(&capture.recording()),
        Recorded::Recording(bytes) => inspect_packets(bytes),
    };
    let (bytes, completion) = recorded.with_clouds(&arguments.input);
    let mut report = inspect(&bytes);
    report.packets = packets;
    if arguments.json {
        say!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        print(&report)?;
    }
    for damage in &report.damage {
        let (path, problem) = (arguments.input.display(), &damage.problem);
        tell!(
            "kreisel: {path}: {problem}; {} bytes skipped",
            damage.skipped
        );
    }
    if report.damage.is_empty() {
        Ok(completion)
    } else {
        Ok(Completion::Damaged)
    }
}

fn inspect(bytes: &[u8]) -> Report {
    let mut report = Report {
        bytes: bytes.len(),
        ..Report::default()
    };
    let mut messages: BTreeMap<(i32, u32), MessageReport> = BTreeMap::new();
    let mut intake = Intake::default();
    let mut configuration = Configuration::default();
    configuration.grid.enabled = false;
    let mut pipeline = Pipeline::new(&configuration, 0);
    for item in Recording::new(bytes) {
        match item {
            Ok(entry) => {
                report.envelopes += 1;
                // What is refused is told below, message by message.
                let _ = pipeline.handle(&entry.envelope);
                let key = (entry.envelope.data_type, entry.envelope.sender_stamp);
                messages.entry(key).or_default().add(&entry);
                if entry.envelope.data_type == POINT_CLOUD_ID {
                    report.add_cloud(&entry, &mut intake);
                }
            }
            Err(damage) => report.damage.push(DamageReport {
                offset: damage.offset,
                skipped: damage.skipped,
                problem: damage.error.to_string(),
            }),
        }
    }
    report.own_vehicle = pipeline.own_vehicle().map(|extent| OwnVehicleReport {
        left_m: extent.low_m[0],
        right_m: extent.high_m[0],
        back_m: extent.low_m[1],
        front_m: extent.high_m[1],
    });
    let times = || messages.values();
    let first = times().map(|message| message.first).min();
    let last = times().map(|message| message.last).max();
    report.duration_s = first
        .zip(last)
        .map_or(0.0, |(first, last)| (last - first).seconds());
    report.messages = messages
        .into_values()
        .map(MessageReport::finished)
        .collect();
    report
}

/// What is in a capture beside the point clouds that a device service would make of it.
fn inspect_packets(recording: &[u8]) -> Option<PacketsReport> {
    let mut configuration = Configuration::default();
    configuration.grid.enabled = false;
    let mut pipeline = Pipeline::new(&configuration, 0);
    for entry in Recording::new(recording).flatten() {
        if entry.envelope.data_type == SensorPackets::ID {
            // What is refused is told by its count.
            let _ = pipeline.handle(&entry.envelope);
        }
    }
    let status = pipeline.status();
    (status.packets_received > 0).then(|| PacketsReport {
        count: status.packets_received,
        lost: status.packets_lost,
        sensor: status.sensor,
        return_mode: status.return_mode,
        rotation_hz: status.rotation_rate,
        clock: status.sensor_clock,
        clock_ahead_s: pipeline.packets().clock_ahead().seconds(),
        revolutions: status.revolutions_published,
        refused: status.faults,
    })
}

impl MessageReport {
    fn add(&mut self, entry: &Entry<'_>) {
        let time = entry.envelope.time();
        if self.count == 0 {
            self.id = entry.envelope.data_type;
            self.name = known_name(self.id).unwrap_or("unknown");
            self.sender_stamp = entry.envelope.sender_stamp;
            (self.first, self.last) = (time, time);
        }
        self.count += 1;
        self.bytes += entry.frame.len();
        self.longest_gap_s = self.longest_gap_s.max((time - self.last).seconds());
        self.last = time;
    }

    fn finished(mut self) -> Self {
        let passed_s = (self.last - self.first).seconds();
        if passed_s > 0.0 {
            self.rate_hz = (self.count - 1) as f64 / passed_s;
        }
        self
    }
}

impl Report {
    fn add_cloud(&mut self, entry: &Entry<'_>, intake: &mut Intake) {
        let envelope = &entry.envelope;
        let cloud = match CompactPointCloud::decode(envelope.payload, envelope.payload_offset) {
            Ok(cloud) => cloud,
            Err(error) => {
                self.damage.push(DamageReport {
                    offset: error.offset(),
                    skipped: entry.frame.len(),
                    problem: error.to_string(),
                });
                return;
            }
        };
        let parameters = Configuration::default().cloud;
        let refused = intake.accept(envelope, cloud, &parameters).err();
        self.point_clouds.push(CloudReport {
            offset: entry.offset,
            t: envelope.time().seconds(),
            sender_stamp: envelope.sender_stamp,
            sensor: sensor::identify(&cloud).map_or("unknown", |sensor| sensor.name),
            schema: match cloud.schema {
                Schema::OpenDaVinci { .. } => "OpenDaVINCI",
                Schema::OpenDlv { .. } => "OpenDLV",
                Schema::Bare => "without fields 6 and 7",
            },
            columns: cloud.columns(),
            layers: cloud.layers,
            start_azimuth_deg: cloud.start_azimuth_deg,
            end_azimuth_deg: cloud.end_azimuth_deg,
            byte_order: shown_order(&cloud).map_or("undecided", ByteOrder::name),
            intensity_bits: cloud.intensity_bits,
            refused: refused.map(|refusal| format!("{}: {refusal}", refusal.name())),
        });
    }
}

fn print(report: &Report) -> Result<()> {
    say!(
        "{} bytes, {} envelopes, {:.3} s",
        report.bytes,
        report.envelopes,
        report.duration_s
    );
    say!(
        "{:>6} {:>10} {:>7} {:>11} {:>8} {:>8}  message",
        "id",
        "sender",
        "count",
        "bytes",
        "Hz",
        "gap s"
    );
    for message in &report.messages {
        say!(
            "{:>6} {:>10} {:>7} {:>11} {:>8.2} {:>8.3}  {}",
            message.id,
            message.sender_stamp,
            message.count,
            message.bytes,
            message.rate_hz,
            message.longest_gap_s,
            message.name
        );
    }
    for cloud in report.point_clouds.iter().take(MOST_CLOUD_LINES) {
        say!(
            "byte {}: {} ({}), {} x {}, {:.3} to {:.3} degrees, {}, {} bits of intensity{}",
            cloud.offset,
            cloud.sensor,
            cloud.schema,
            cloud.columns,
            cloud.layers,
            cloud.start_azimuth_deg,
            cloud.end_azimuth_deg,
            cloud.byte_order,
            cloud.intensity_bits,
            cloud
                .refused
                .as_ref()
                .map_or(String::new(), |why| format!("; refused: {why}")),
        );
    }
    let more = report.point_clouds.len().saturating_sub(MOST_CLOUD_LINES);
    let refused = report
        .point_clouds
        .iter()
        .filter(|cloud| cloud.refused.is_some())
        .count();
    if more > 0 {
        say!("and {more} more point clouds");
    }
    if !report.point_clouds.is_empty() {
        say!(
            "{} point clouds, {refused} refused",
            report.point_clouds.len()
        );
    }
    if let Some(packets) = &report.packets {
        say!(
            "{} packets of a {}, {} lost; {} whole revolutions at {:.1} Hz{}",
            packets.count,
            if packets.sensor.is_empty() {
                "sensor"
            } else {
                &packets.sensor
            },
            packets.lost,
            packets.revolutions,
            packets.rotation_hz,
            match &packets.refused[..] {
                "" => String::new(),
                refused => format!("; refused: {refused}"),
            },
        );
        say!(
            "{}; clock {}, {:.3} s ahead",
            packets.return_mode,
            packets.clock,
            packets.clock_ahead_s
        );
    }
    if let Some(own) = &report.own_vehicle {
        say!(
            "the own vehicle is seen from {:.1} to {:.1} m to the right and from {:.1} to {:.1} m ahead: left out",
            own.left_m,
            own.right_m,
            own.back_m,
            own.front_m
        );
    }
    Ok(())
}
