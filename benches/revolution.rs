//! Every step of the pipeline, and the whole from envelope bytes to envelope bytes: on a real drive
//! and on what a parked car saw (where the shared data is), on the simulated street with its poses,
//! at a roundabout with and without its map, and on a worst case.
//! The steps are timed where they work, one after the other, with the caches as the others left
//! them. What the odometry does once the answer is out counts with the grid.
//!
//! Beside microseconds each figure is given in passes: how often a plain polar-to-Cartesian pass
//! over the same array would fit into it, measured in the same run, so that figures compare
//! between machines.
//!
//! `cargo bench` prints the table; `cargo bench -- --rounds 200` sets how many revolutions are
//! timed, `--input street` takes one input alone, `--reach 50` a grid's reach in metres.
//! `scripts/bench` counts instructions, too.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::{NAMES, WARM, drive, frame_of, plain_pass, quantiles, simulated, time_of};
use kreisel::config::Configuration;
use kreisel::pipeline::Pipeline;
use kreisel::roadmap::Roadmap;
use kreisel::simulate::scenario;
use kreisel::wire::point_cloud::CompactPointCloud;
use kreisel::wire::{Envelope, Recording};

/// Revolutions of a real recording, again and again, but for so many at its begin.
fn recorded(name: &str, skipped: usize, rounds: usize) -> Option<Vec<Vec<u8>>> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data");
    let bytes = std::fs::read(format!("{folder}/{name}.rec")).ok()?;
    let entries = Recording::new(&bytes).skip(skipped);
    let frames: Vec<_> = entries.map(|entry| entry.unwrap().frame.to_vec()).collect();
    Some(
        (0..rounds)
            .map(|round| at_time(&frames[round % frames.len()], round))
            .collect(),
    )
}

/// Real inputs: a drive of three revolutions, after the incomplete one of a device that starts, and
/// 85 of a parked car.
const RECORDED: [(&str, &str, usize); 2] = [
    ("real", "vlp16-sampleShort", 1),
    ("parked", "vlp16-parked-car-85rev", 0),
];

/// A revolution's frame with another time.
fn at_time(frame: &[u8], round: usize) -> Vec<u8> {
    let (envelope, _) = Envelope::from_datagram(frame).unwrap();
    let cloud = CompactPointCloud::decode(envelope.payload, 0).unwrap();
    frame_of(&cloud, time_of(round))
}

/// Traffic from all arms.
const ROUNDABOUT: &str = "roundabout-traffic";

/// A distance by the number of its return.
type Distance = fn(u32) -> u32;

/// Distances in centimetres of 2,000 columns of 16 returns that cost much, by the number of the return.
const COSTLY: [(&str, Distance); 7] = [
    // Returns at all distances, none of them ground.
    ("worst", |n| match n % 16 {
        layer if layer < 8 => 100 + layer,
        _ => 300 + n.wrapping_mul(7919) % 2000,
    }),
    // Flakes on every ray.
    ("snow", |n| 200 + mixed(n) % 400),
    // Flakes on three rays of ten, before walls.
    ("snowfall", |n| {
        if mixed(n) % 10 < 3 {
            200 + mixed(n) / 10 % 400
        } else {
            2500
        }
    }),
    // A spiral: every column is a little farther than the one before.
    ("spiral", |n| 150 + n / 16 % 2000),
    // Drops on one ray of thirty, up to 15 m away.
    ("rain", |n| {
        if mixed(n).is_multiple_of(30) {
            100 + mixed(n) / 30 % 1400
        } else {
            2500
        }
    }),
    // Squares at 8 and 14 m in turn.
    ("checkerboard", |n| {
        if (n / 64 + n % 16).is_multiple_of(2) {
            800
        } else {
            1400
        }
    }),
    // Posts 6 m away, half a metre apart, that move on by a column a revolution.
    ("posts", |n| {
        if (n / 16 + n / 32_000) % 26 < 6 {
            600
        } else {
            3000
        }
    }),
];

/// A number of which nothing is left of what it was.
fn mixed(n: u32) -> u32 {
    let n = (n ^ (n >> 16)).wrapping_mul(0x045d_9f3b);
    let n = (n ^ (n >> 16)).wrapping_mul(0x045d_9f3b);
    n ^ (n >> 16)
}

fn costly(distance: Distance, rounds: usize) -> Vec<Vec<u8>> {
    let revolution = |round: usize| -> Vec<u8> {
        let first = (round * 2000 * 16) as u32;
        (first..first + 2000 * 16)
            .flat_map(|n| (distance(n) as u16).to_be_bytes())
            .collect()
    };
    (0..rounds)
        .map(|round| {
            let distances = revolution(round);
            let cloud = CompactPointCloud {
                start_azimuth_deg: 0.1,
                end_azimuth_deg: 359.92,
                layers: 16,
                distances: &distances,
                ..CompactPointCloud::default()
            };
            frame_of(&cloud, time_of(round))
        })
        .collect()
}

fn bench(name: &str, frames: &[Vec<u8>], roads: Option<&Roadmap>, reaches_m: &[f64]) {
    let mut configuration = Configuration::default();
    for reach_m in reaches_m.iter().copied() {
        configuration.grid.reach_m = reach_m;
        // The machine is not as fast all the time.
        let before_us = plain_pass();
        let mut pipeline = Pipeline::new(&configuration, 0);
        if let Some(roads) = roads {
            pipeline.take_map(roads);
        }
        let times_us = drive(frames, &mut pipeline);
        let unit_us = 0.5 * (before_us + plain_pass());
        for (part, mut times_us) in NAMES.into_iter().zip(times_us) {
            let depends_on_reach = ["grid", "tiles", "whole"].contains(&part);
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
    for (name, recording, skipped) in RECORDED {
        if is_wanted(name) {
            match recorded(recording, skipped, rounds) {
                Some(frames) => bench(name, &frames, None, &reaches_m),
                None => eprintln!("skipped: {name}, as {recording} is not beside the checkout"),
            }
        }
    }
    if is_wanted("street") {
        bench("street", &simulated("street", rounds), None, &reaches_m);
    }
    // What advice costs is in the step of the objects.
    let roads = scenario::find(ROUNDABOUT).unwrap().roads();
    for (name, roads) in [("roundabout", None), ("roundabout with map", roads)] {
        if is_wanted(name) {
            let frames = simulated(ROUNDABOUT, rounds);
            bench(name, &frames, roads.as_ref(), &reaches_m);
        }
    }
    for (name, distance) in COSTLY {
        if is_wanted(name) {
            let frames = costly(distance, rounds.min(WARM + 50));
            bench(name, &frames, None, &reaches_m);
        }
    }
}
