//! Every step of the pipeline, and the whole from envelope bytes to envelope bytes: on a real
//! drive (where the shared data is), on the simulated street with its poses, and on a worst case.
//! The steps are timed where they work, one after the other, with the caches as the others left
//! them.
//!
//! Beside microseconds each figure is given in passes: how often a plain polar-to-Cartesian pass
//! over the same array would fit into it, measured in the same run, so that figures compare
//! between machines.
//!
//! `cargo bench` prints the table; `cargo bench -- --rounds 200` sets how many revolutions are
//! timed, `--input street` takes one input alone, `--reach 50` a grid's reach in metres.
//! `scripts/bench` counts instructions, too.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::hint::black_box;
use std::time::Duration;

use kreisel::config::Configuration;
use kreisel::pipeline::{Outcome, Pipeline};
use kreisel::simulate::{Simulation, scenario};
use kreisel::time::Time;
use kreisel::wire::envelope::Postmark;
use kreisel::wire::point_cloud::CompactPointCloud;
use kreisel::wire::{Envelope, Recording};

/// CPU time of this thread: other processes do not count.
fn cpu_time() -> Duration {
    let clock = nix::time::ClockId::CLOCK_THREAD_CPUTIME_ID;
    Duration::from(nix::time::clock_gettime(clock).unwrap())
}

/// Median and 99th percentile.
fn quantiles(times_us: &mut [f64]) -> (f64, f64) {
    times_us.sort_by(f64::total_cmp);
    let count = times_us.len();
    (times_us[count / 2], times_us[count * 99 / 100])
}

/// The unit in microseconds: distances to x, y, z with tables of sines and cosines, nothing else.
fn plain_pass() -> f64 {
    const COLUMNS: usize = 1810;
    let ranges: Vec<f32> = (0..COLUMNS * 16).map(|n| (n % 997) as f32 * 0.1).collect();
    let azimuth: Vec<(f32, f32)> = (0..COLUMNS)
        .map(|n| (n as f32 * 0.0035).sin_cos())
        .collect();
    let elevation: Vec<(f32, f32)> = (0..16)
        .map(|n| (n as f32 * 0.035 - 0.26).sin_cos())
        .collect();
    let mut out = vec![[0.0f32; 3]; ranges.len()];
    let mut pass = || {
        let begin = cpu_time();
        for (column, (sine, cosine)) in azimuth.iter().enumerate() {
            for (layer, (up, flat)) in elevation.iter().enumerate() {
                let range = ranges[column * 16 + layer];
                let level = range * flat;
                out[column * 16 + layer] = [level * sine, level * cosine, range * up];
            }
        }
        black_box(&mut out);
        (cpu_time() - begin).as_secs_f64() * 1e6
    };
    let mut times_us: Vec<f64> = (0..2000).map(|_| pass()).collect();
    quantiles(&mut times_us).0
}

/// Three revolutions of a drive, again and again.
fn real(rounds: usize) -> Option<Vec<Vec<u8>>> {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../shared/data/vlp16-sampleShort.rec"
    );
    let bytes = std::fs::read(path).ok()?;
    // The first message of the recording is the incomplete one of a device that starts.
    let entries = Recording::new(&bytes).skip(1);
    let frames: Vec<_> = entries.map(|entry| entry.unwrap().frame.to_vec()).collect();
    Some(
        (0..rounds)
            .map(|round| at_time(&frames[round % frames.len()], round))
            .collect(),
    )
}

/// Drives of twenty seconds through the street, each with other traffic.
fn street(rounds: usize) -> Vec<Vec<u8>> {
    const REVOLUTIONS: usize = 200;
    let mut frames = vec![];
    for seed in 0..rounds.div_ceil(REVOLUTIONS) {
        let mut simulation = Simulation::new(scenario::find("street").unwrap(), seed as u64 + 1);
        let mut bytes = vec![];
        for _ in 0..REVOLUTIONS.min(rounds - seed * REVOLUTIONS) {
            simulation.revolve(&mut bytes);
        }
        frames.extend(Recording::new(&bytes).map(|entry| entry.unwrap().frame.to_vec()));
    }
    frames
}

/// 2,000 columns of 16 returns at all distances, none of them ground.
fn worst(rounds: usize) -> Vec<Vec<u8>> {
    let distance = |n: u32| match n % 16 {
        layer if layer < 8 => 100 + layer,
        _ => 300 + n * 7919 % 2000,
    };
    let distances: Vec<u8> = (0..2000 * 16)
        .flat_map(|n| (distance(n) as u16).to_be_bytes())
        .collect();
    let cloud = CompactPointCloud {
        start_azimuth_deg: 0.1,
        end_azimuth_deg: 359.92,
        layers: 16,
        distances: &distances,
        ..CompactPointCloud::default()
    };
    let mut frame = vec![];
    Postmark::default().put_payload(&mut frame, 49, |out| cloud.encode(out));
    (0..rounds).map(|round| at_time(&frame, round)).collect()
}

/// A revolution's frame with another time.
fn at_time(frame: &[u8], round: usize) -> Vec<u8> {
    let (envelope, _) = Envelope::from_datagram(frame).unwrap();
    let cloud = CompactPointCloud::decode(envelope.payload, 0).unwrap();
    let postmark = Postmark {
        sampled: Time::from_micros(1_700_000_000_000_000 + 100_000 * round as i64),
        ..Postmark::default()
    };
    let mut frame = vec![];
    postmark.put_payload(&mut frame, 49, |out| cloud.encode(out));
    frame
}

/// Where a counter of instructions is told that a step is done: a function for each, so that it
/// can be told by name.
mod mark {
    macro_rules! marks {
        ($($name:ident)*) => {
            $(
                #[inline(never)]
                pub(super) fn $name() {
                    std::hint::black_box(stringify!($name));
                }
            )*
        };
    }
    marks! { step_begins step_cloud step_ground step_cluster step_track step_grid step_publish }

    pub(super) const DONE: [fn(); 5] =
        [step_cloud, step_ground, step_cluster, step_track, step_grid];
}

/// Names of what is timed: the pipeline's steps, making the frames, and all of it.
const NAMES: [&str; 7] = [
    "cloud", "ground", "cluster", "track", "grid", "publish", "whole",
];
/// Revolutions before everything is warm.
const WARM: usize = 5;

/// Times of every part in microseconds, a list each as in [`NAMES`].
fn drive(frames: &[Vec<u8>], configuration: &Configuration) -> [Vec<f64>; 7] {
    let mut pipeline = Pipeline::new(configuration, 0);
    let mut times_us: [Vec<f64>; 7] = Default::default();
    for frame in frames {
        mark::step_begins();
        let begin = cpu_time();
        let mut ends = [begin; 6];
        let (envelope, _) = Envelope::from_datagram(frame).unwrap();
        let outcome = pipeline.handle_watched(&envelope, |step| {
            mark::DONE[step as usize]();
            ends[step as usize] = cpu_time();
        });
        match outcome {
            Ok(Outcome::Revolution(_)) => {}
            Ok(Outcome::Pose) => continue,
            other => panic!("{other:?}"),
        }
        black_box(pipeline.publish(Time::ZERO, 0.0).count());
        mark::step_publish();
        ends[mark::DONE.len()] = cpu_time();
        let mut from = begin;
        for (part, end) in ends.into_iter().enumerate() {
            times_us[part].push((end - from).as_secs_f64() * 1e6);
            from = end;
        }
        times_us[6].push((from - begin).as_secs_f64() * 1e6);
    }
    times_us.map(|times_us| times_us[WARM..].to_vec())
}

fn bench(name: &str, frames: &[Vec<u8>], reaches_m: &[f64]) {
    let mut configuration = Configuration::default();
    for reach_m in reaches_m.iter().copied() {
        configuration.grid.reach_m = reach_m;
        // The machine is not as fast all the time.
        let before_us = plain_pass();
        let times_us = drive(frames, &configuration);
        let unit_us = 0.5 * (before_us + plain_pass());
        for (part, mut times_us) in NAMES.into_iter().zip(times_us) {
            let depends_on_reach = ["grid", "publish", "whole"].contains(&part);
            if !depends_on_reach && reach_m != reaches_m[0] {
                continue;
            }
            let with = if depends_on_reach {
                format!(", {reach_m} m")
            } else {
                String::new()
            };
            let (median_us, p99_us) = quantiles(&mut times_us);
            let passes = median_us / unit_us;
            println!("| {name} | {part}{with} | {median_us:.0} | {p99_us:.0} | {passes:.1} |");
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let after = |name: &str| {
        let at = arguments.iter().position(|argument| argument == name)?;
        arguments.get(at + 1)
    };
    let rounds: usize = after("--rounds").map_or(200, |rounds| rounds.parse().unwrap());
    let rounds = rounds + WARM;
    let reaches_m = after("--reach").map_or(vec![10.0, 50.0], |reach| vec![reach.parse().unwrap()]);
    let is_wanted = |name: &str| after("--input").is_none_or(|input| input == name);
    println!("one plain pass: {:.1} us", plain_pass());
    println!("| input | step | median us | p99 us | passes |");
    println!("|-|-|-:|-:|-:|");
    if is_wanted("real") {
        match real(rounds) {
            Some(frames) => bench("real", &frames, &reaches_m),
            None => eprintln!("skipped: no real recording beside the checkout"),
        }
    }
    if is_wanted("street") {
        bench("street", &street(rounds), &reaches_m);
    }
    if is_wanted("worst") {
        bench("worst", &worst(rounds.min(WARM + 50)), &reaches_m);
    }
}
