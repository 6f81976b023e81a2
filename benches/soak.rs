//! A day of driving, one revolution after the other as fast as they go: what of time and memory stays.
//!
//! Simulated drives follow each other, ten revolutions a second by their stamps, so that the world and the poses jump
//! once a drive. For each tenth of the way the CPU time of a revolution and the resident memory of the process are
//! printed.
//!
//! `cargo bench --bench soak -- --revolutions 864000` is a day; without it, a quarter of an hour.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "common/clock.rs"]
mod clock;

use clock::{cpu_time, quantiles};
use kreisel::config::Configuration;
use kreisel::pipeline::{Outcome, Pipeline};
use kreisel::simulate::{Simulation, scenario};
use kreisel::time::Span;
use kreisel::wire::envelope::Postmark;
use kreisel::wire::point_cloud::POINT_CLOUD_ID;
use kreisel::wire::{Envelope, Recording};

/// The drives, with and without poses, moving and standing.
const DRIVES: [&str; 6] = [
    "street",
    "strangers",
    "roundabout-traffic",
    "car-park",
    "furniture",
    "hill",
];
/// Revolutions of each.
const EACH: usize = 400;
/// From one revolution to the next.
const PERIOD: Span = Span::from_micros(100_000);
const DEFAULT_REVOLUTIONS: usize = 9_000;
const ROWS: usize = 10;

fn simulated(name: &str) -> Vec<Vec<u8>> {
    let mut simulation = Simulation::new(scenario::find(name).unwrap(), 1);
    let mut bytes = vec![];
    for _ in 0..EACH {
        simulation.revolve(&mut bytes);
    }
    let entries = Recording::new(&bytes);
    entries.map(|entry| entry.unwrap().frame.to_vec()).collect()
}

/// The same message, so much later.
fn later(frame: &[u8], by: Span, out: &mut Vec<u8>) {
    let (envelope, _) = Envelope::from_datagram(frame).unwrap();
    let postmark = Postmark {
        sent: envelope.time() + by,
        sampled: envelope.time() + by,
        sender_stamp: envelope.sender_stamp,
    };
    out.clear();
    postmark.put_payload(out, envelope.data_type, |out| {
        out.extend_from_slice(envelope.payload);
    });
}

/// Resident memory of this process.
fn resident_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok());
    kilobytes.map_or(f64::NAN, |kilobytes: f64| kilobytes / 1000.0)
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let at = arguments
        .iter()
        .position(|argument| argument == "--revolutions");
    let revolutions = at.map_or(DEFAULT_REVOLUTIONS, |at| arguments[at + 1].parse().unwrap());
    let drives = DRIVES.iter().take(revolutions.div_ceil(EACH));
    let drives: Vec<_> = drives.map(|name| simulated(name)).collect();
    let own_mb = resident_mb();
    println!("recorded drives take {own_mb:.0} MB of what is resident");
    println!("| revolutions | answered | median us | p99 us | longest us | resident MB |");
    println!("|-:|-:|-:|-:|-:|-:|");
    let mut pipeline = Pipeline::new(&Configuration::default(), 0);
    let (mut frame, mut times_us) = (vec![], Vec::with_capacity(revolutions.div_ceil(ROWS)));
    let (mut sent, mut answered) = (0, 0);
    while sent < revolutions {
        // Every drive begins at the same time.
        let by = Span::from_micros(PERIOD.micros() * sent as i64);
        let drive = &drives[sent / EACH % drives.len()];
        for recorded in drive {
            later(recorded, by, &mut frame);
            let (envelope, _) = Envelope::from_datagram(&frame).unwrap();
            let begin = cpu_time();
            let outcome = pipeline.handle(&envelope);
            if envelope.data_type != POINT_CLOUD_ID {
                continue;
            }
            sent += 1;
            answered += usize::from(matches!(outcome, Ok(Outcome::Revolution(_))));
            times_us.push((cpu_time() - begin).as_secs_f64() * 1e6);
            if sent.is_multiple_of(revolutions.div_ceil(ROWS)) || sent == revolutions {
                let longest_us = times_us.iter().copied().fold(0.0, f64::max);
                let (median_us, p99_us) = quantiles(&mut times_us);
                let resident_mb = resident_mb();
                println!(
                    "| {sent} | {answered} | {median_us:.0} | {p99_us:.0} | {longest_us:.0} | {resident_mb:.1} |"
                );
                times_us.clear();
            }
        }
    }
}
