//! What the benches share: the clock, the unit, a drive, and the pipeline's steps one by one.

mod clock;

use std::hint::black_box;
use std::time::Duration;

pub(crate) use clock::{cpu_time, quantiles};
use kreisel::pipeline::{Outcome, Pipeline};
use kreisel::simulate::{Simulation, scenario};
use kreisel::time::Time;
use kreisel::wire::envelope::Postmark;
use kreisel::wire::point_cloud::{CompactPointCloud, POINT_CLOUD_ID};
use kreisel::wire::{Envelope, Recording};

/// The unit in microseconds: distances to x, y, z with tables of sines and cosines, nothing else.
pub(crate) fn plain_pass() -> f64 {
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

/// Drives of twenty seconds through a scenario, each with other traffic.
pub(crate) fn simulated(name: &str, rounds: usize) -> Vec<Vec<u8>> {
    const REVOLUTIONS: usize = 200;
    let mut frames = vec![];
    for seed in 0..rounds.div_ceil(REVOLUTIONS) {
        let mut simulation = Simulation::new(scenario::find(name).unwrap(), seed as u64 + 1);
        let mut bytes = vec![];
        for _ in 0..REVOLUTIONS.min(rounds - seed * REVOLUTIONS) {
            simulation.revolve(&mut bytes);
        }
        frames.extend(Recording::new(&bytes).map(|entry| entry.unwrap().frame.to_vec()));
    }
    frames
}

/// When the revolutions end that are sent ten a second.
pub(crate) fn time_of(round: usize) -> Time {
    Time::from_micros(1_700_000_000_000_000 + 100_000 * round as i64)
}

/// The frame of a revolution that ended at a time.
pub(crate) fn frame_of(cloud: &CompactPointCloud<'_>, sampled: Time) -> Vec<u8> {
    let postmark = Postmark {
        sampled,
        ..Postmark::default()
    };
    let mut frame = vec![];
    postmark.put_payload(&mut frame, POINT_CLOUD_ID, |out| cloud.encode(out));
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
    marks! { step_begins step_cloud step_ego step_ground step_cluster step_track step_objects step_grid step_tiles }

    pub(super) const DONE: [fn(); super::PARTS] = [
        step_cloud,
        step_ego,
        step_ground,
        step_cluster,
        step_track,
        step_objects,
        step_grid,
        step_tiles,
    ];
}

/// What is timed one by one.
const PARTS: usize = 8;
/// Those that are done when the objects are sent.
const BEFORE_MAP: usize = 6;
/// Names of what is timed: the pipeline's steps to the frames of the objects, then the map and
/// the frames of its tiles, all but the map, and all of it.
pub(crate) const NAMES: [&str; PARTS + 2] = [
    "cloud",
    "ego",
    "ground",
    "cluster",
    "track",
    "objects",
    "grid",
    "tiles",
    "without map",
    "whole",
];
/// Revolutions before everything is warm.
pub(crate) const WARM: usize = 5;

/// Times of every part in microseconds, a list each as in [`NAMES`].
pub(crate) fn drive(frames: &[Vec<u8>], pipeline: &mut Pipeline) -> [Vec<f64>; PARTS + 2] {
    let mut times_us: [Vec<f64>; PARTS + 2] = Default::default();
    for frame in frames {
        mark::step_begins();
        let begin = cpu_time();
        let mut ends = Vec::with_capacity(PARTS);
        let done = |ends: &mut Vec<Duration>| {
            mark::DONE[ends.len()]();
            ends.push(cpu_time());
        };
        let (envelope, _) = Envelope::from_datagram(frame).unwrap();
        let outcome = pipeline.handle_watched(&envelope, |_| done(&mut ends));
        match outcome {
            Ok(Outcome::Revolution(_)) => {}
            Ok(Outcome::Pose) => continue,
            other => panic!("{other:?}"),
        }
        black_box(pipeline.publish_objects(Time::ZERO, 0.0).count());
        done(&mut ends);
        pipeline.update_map();
        done(&mut ends);
        black_box(pipeline.publish_map(Time::ZERO).count());
        done(&mut ends);
        let us = |from: Duration, end: Duration| (end - from).as_secs_f64() * 1e6;
        let mut from = begin;
        for (part, end) in ends.iter().enumerate() {
            times_us[part].push(us(from, *end));
            from = *end;
        }
        times_us[PARTS].push(us(begin, ends[BEFORE_MAP - 1]));
        times_us[PARTS + 1].push(us(begin, from));
    }
    times_us.map(|times_us| times_us[WARM..].to_vec())
}
