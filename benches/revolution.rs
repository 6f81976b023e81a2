//! Every stage of the pipeline, and the whole from envelope bytes to envelope bytes, on a real
//! revolution (where the shared data is), on the simulated roundabout, and on a worst case.
//!
//! Beside microseconds each figure is given in passes: how often a plain polar-to-Cartesian pass
//! over the same array would fit into it, measured in the same run, so that figures compare
//! between machines.
//!
//! `cargo bench` prints the table; `cargo bench -- --rounds 200` sets how often each is timed.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::hint::black_box;
use std::time::Duration;

use kreisel::cloud::{Intake, Scan};
use kreisel::cluster::Dbscan;
use kreisel::config::Configuration;
use kreisel::ego::Sweep;
use kreisel::grid::{Grid, Perceived};
use kreisel::ground::Ground;
use kreisel::pipeline::{Outcome, Pipeline};
use kreisel::simulate::{Simulation, scenario};
use kreisel::time::Time;
use kreisel::track::Tracker;
use kreisel::wire::envelope::Postmark;
use kreisel::wire::point_cloud::CompactPointCloud;
use kreisel::wire::{Envelope, Recording};

/// CPU time of this thread: other processes do not count.
fn cpu_time() -> Duration {
    let clock = nix::time::ClockId::CLOCK_THREAD_CPUTIME_ID;
    Duration::from(nix::time::clock_gettime(clock).unwrap())
}

/// Median and 99th percentile in microseconds, once everything is warm.
fn measure(rounds: usize, mut work: impl FnMut(usize)) -> (f64, f64) {
    work(0);
    let mut times: Vec<f64> = (1..=rounds)
        .map(|round| {
            let begin = cpu_time();
            work(round);
            (cpu_time() - begin).as_secs_f64() * 1e6
        })
        .collect();
    times.sort_by(f64::total_cmp);
    (times[rounds / 2], times[rounds * 99 / 100])
}

/// The unit: distances to x, y, z with tables of sines and cosines, nothing else.
fn plain_pass(rounds: usize) -> f64 {
    const COLUMNS: usize = 1810;
    let ranges: Vec<f32> = (0..COLUMNS * 16).map(|n| (n % 997) as f32 * 0.1).collect();
    let azimuth: Vec<(f32, f32)> = (0..COLUMNS)
        .map(|n| (n as f32 * 0.0035).sin_cos())
        .collect();
    let elevation: Vec<(f32, f32)> = (0..16)
        .map(|n| (n as f32 * 0.035 - 0.26).sin_cos())
        .collect();
    let mut out = vec![[0.0f32; 3]; ranges.len()];
    let pass = |_| {
        for (column, (sine, cosine)) in azimuth.iter().enumerate() {
            for (layer, (up, flat)) in elevation.iter().enumerate() {
                let range = ranges[column * 16 + layer];
                let level = range * flat;
                out[column * 16 + layer] = [level * sine, level * cosine, range * up];
            }
        }
        black_box(&mut out);
    };
    measure(rounds, pass).0
}

/// Frames of revolutions, one after the other in time.
fn real() -> Option<Vec<Vec<u8>>> {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../shared/data/vlp16-sampleShort.rec"
    );
    let bytes = std::fs::read(path).ok()?;
    // The first message of the recording is the incomplete one of a device that starts.
    let entries = Recording::new(&bytes).skip(1);
    Some(entries.map(|entry| entry.unwrap().frame.to_vec()).collect())
}

fn simulated() -> Vec<Vec<u8>> {
    let mut simulation = Simulation::new(scenario::find("roundabout-waiting").unwrap(), 1);
    let mut revolve = || {
        let mut frame = vec![];
        simulation.revolve(&mut frame);
        frame
    };
    (0..20).map(|_| revolve()).collect()
}

/// 2,000 columns of 16 returns at all distances, none of them ground.
fn worst() -> Vec<Vec<u8>> {
    let distances: Vec<u8> = (0..2000 * 16u32)
        .flat_map(|n| {
            (if n % 16 < 8 {
                100 + n % 16
            } else {
                300 + n * 7919 % 2000
            } as u16)
                .to_be_bytes()
        })
        .collect();
    let cloud = CompactPointCloud {
        start_azimuth_deg: 0.1,
        end_azimuth_deg: 359.92,
        layers: 16,
        distances: &distances,
        ..CompactPointCloud::default()
    };
    let mut frame = vec![];
    let sampled = Time::from_micros(1_700_000_000_000_000);
    Postmark {
        sampled,
        ..Postmark::default()
    }
    .put_payload(&mut frame, 49, |out| cloud.encode(out));
    vec![frame]
}

/// The same revolutions again and again, their time going on.
fn at_time(frame: &[u8], round: usize) -> (CompactPointCloud<'_>, Time) {
    let (envelope, _) = Envelope::from_datagram(frame).unwrap();
    let cloud = CompactPointCloud::decode(envelope.payload, 0).unwrap();
    (
        cloud,
        Time::from_micros(1_700_000_000_000_000 + 100_000 * round as i64),
    )
}

fn bench(name: &str, frames: &[Vec<u8>], rounds: usize, unit_us: f64) {
    let configuration = Configuration::default();
    let row = |stage: &str, (median_us, p99_us): (f64, f64)| {
        println!(
            "| {name} | {stage} | {median_us:.0} | {p99_us:.0} | {:.1} |",
            median_us / unit_us
        );
    };
    let frame = &frames[frames.len() / 2];
    let (envelope, _) = Envelope::from_datagram(frame).unwrap();
    let (cloud, _) = at_time(frame, 0);
    let mut intake = Intake::default();
    let revolution = intake
        .accept(&envelope, cloud, &configuration.cloud)
        .unwrap();
    let mut scan = Scan::default();
    row(
        "cloud",
        measure(rounds, |_| {
            scan.fill(black_box(&revolution), &configuration.cloud)
        }),
    );
    let mut ground = Ground::new(&configuration.ground);
    let mut report = ground.process(&scan, &[]);
    row(
        "ground",
        measure(rounds, |_| report = ground.process(black_box(&scan), &[])),
    );
    let mut dbscan = Dbscan::new(&configuration.cluster);
    row(
        "cluster",
        measure(rounds, |_| {
            dbscan.process(black_box(&scan), ground.mask());
        }),
    );
    let mut tracker = Tracker::new(&configuration.track);
    let sweep = Sweep::still(0);
    row(
        "track",
        measure(rounds, |_| {
            let heights_m = ground.heights_m();
            tracker.process(
                black_box(&scan),
                dbscan.clusters(),
                heights_m,
                &report,
                &sweep,
            );
        }),
    );

    for reach_m in [10.0, 50.0] {
        let mut parameters = configuration.grid.clone();
        parameters.reach_m = reach_m;
        let mut grid = Grid::new(&parameters);
        row(
            &format!("grid {reach_m} m"),
            measure(rounds, |_| {
                grid.process(&Perceived {
                    scan: black_box(&scan),
                    ground: ground.mask(),
                    heights_m: ground.heights_m(),
                    plane: &report.plane,
                    objects: tracker.objects(),
                    sweep: &sweep,
                });
            }),
        );
    }

    let inputs: Vec<Vec<u8>> = (0..=rounds)
        .map(|round| {
            let (cloud, sampled) = at_time(&frames[round % frames.len()], round);
            let mut frame = vec![];
            let postmark = Postmark {
                sampled,
                ..Postmark::default()
            };
            postmark.put_payload(&mut frame, 49, |out| cloud.encode(out));
            frame
        })
        .collect();
    let mut pipeline = Pipeline::new(&configuration, 0);
    row(
        "whole",
        measure(rounds, |round| {
            let (envelope, _) = Envelope::from_datagram(&inputs[round]).unwrap();
            let outcome = pipeline.handle(&envelope);
            assert!(matches!(outcome, Ok(Outcome::Revolution(_))), "{outcome:?}");
            black_box(pipeline.publish(Time::ZERO, 0.0).count());
        }),
    );
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let given = arguments.iter().position(|argument| argument == "--rounds");
    let rounds = given.map_or(300, |at| arguments[at + 1].parse().unwrap());
    let unit_us = plain_pass(10 * rounds);
    println!("one plain pass: {unit_us:.1} us");
    println!("| input | stage | median us | p99 us | passes |");
    println!("|-|-|-:|-:|-:|");
    match real() {
        Some(frames) => bench("real", &frames, rounds, unit_us),
        None => eprintln!("skipped: no real recording beside the checkout"),
    }
    bench("roundabout", &simulated(), rounds, unit_us);
    bench("worst case", &worst(), rounds.min(50), unit_us);
}
