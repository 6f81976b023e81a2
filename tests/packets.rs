//! A sensor's own packets through the pipeline: damaged, mutated, and of real sensors.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use kreisel::config::Configuration;
use kreisel::pipeline::Pipeline;
use kreisel::random::Random;
use kreisel::simulate::{Simulation, scenario};
use kreisel::time::{Span, Time};
use kreisel::wire::velodyne::Packet;

const SENSOR: [u8; 4] = [192, 168, 1, 201];

/// Packets of so many revolutions.
fn packets(revolutions: usize) -> Vec<(Time, Vec<u8>)> {
    let scenario = scenario::find("roundabout-waiting").unwrap();
    let mut simulation = Simulation::in_packets(scenario, 1);
    let mut packets = vec![];
    for _ in 0..revolutions {
        simulation.revolve_in_packets(|packet| {
            packets.push((packet.arrival, packet.bytes.to_vec()));
        });
    }
    simulation.close_packets(|packet| packets.push((packet.arrival, packet.bytes.to_vec())));
    packets
}

fn pipeline() -> Pipeline {
    Pipeline::new(&Configuration::default(), 0)
}

/// Hands a packet in, and perceives the revolution that it closes.
fn take(pipeline: &mut Pipeline, arrival: Time, bytes: &[u8]) -> Option<Time> {
    let packet = Packet {
        source: SENSOR,
        arrival,
        bytes,
    };
    let is_closed = pipeline.take_packet(&packet) == Ok(true);
    is_closed.then(|| {
        let report = pipeline.perceive_packets(|_| ());
        pipeline.update_map();
        for object in pipeline.objects() {
            assert!(object.centre_m.iter().all(|metres| metres.is_finite()));
        }
        report.time
    })
}

#[test]
fn the_same_packets_give_the_same_objects() {
    let packets = packets(15);
    let objects = || {
        let mut pipeline = pipeline();
        for (arrival, bytes) in &packets {
            take(&mut pipeline, *arrival, bytes);
        }
        format!("{:?}", pipeline.objects())
    };
    let first = objects();
    assert!(first.contains("Car"));
    assert_eq!(first, objects());
}

#[test]
fn mutated_packets_cost_no_revolution_that_is_whole_without_them() {
    let packets = packets(12);
    let mut luck = Random::new(7);
    let mut below = |limit: usize| (luck.uniform() * limit as f64) as usize;
    for round in 0..40 {
        let mut pipeline = pipeline();
        let mut closed = 0;
        for (number, (arrival, bytes)) in packets.iter().enumerate() {
            closed += u32::from(take(&mut pipeline, *arrival, bytes).is_some());
            // Not the very first ones: whoever is heard first decides what a sensor is.
            if number < 100 || below(10) > 0 {
                continue;
            }
            let mut mutated = bytes.clone();
            match below(5) {
                0 => mutated.truncate(below(bytes.len())),
                1 => mutated.extend_from_slice(&bytes[..below(300)]),
                2 => mutated.iter_mut().for_each(|byte| *byte = below(256) as u8),
                // In the heading of a block, and at the end.
                3 => {
                    let at = (below(12) * 100 + below(4)) % bytes.len();
                    mutated[at] = below(256) as u8;
                }
                _ => {
                    let from_end = 1 + below(6);
                    let at = bytes.len() - from_end;
                    mutated[at] = below(256) as u8;
                }
            }
            let later = *arrival + Span::from_micros(below(2000) as i64 - 1000);
            closed += u32::from(take(&mut pipeline, later, &mutated).is_some());
        }
        let counts = pipeline.counts();
        assert!(closed >= 11, "round {round}: {closed}: {:?}", counts.faults);
        assert!(counts.faults.total() > 0);
    }
}

#[test]
fn packets_that_are_all_hostile_are_refused_and_a_sound_sensor_is_heard_after_them() {
    let packets = packets(4);
    let mut pipeline = pipeline();
    let mut luck = Random::new(3);
    let begin = packets[0].0;
    for number in 0..20_000 {
        let mut bytes = packets[number % packets.len()].1.clone();
        for _ in 0..40 {
            let at = (luck.uniform() * bytes.len() as f64) as usize;
            bytes[at] = (luck.uniform() * 256.0) as u8;
        }
        let arrival = begin + Span::from_seconds(-100.0 + 0.001 * number as f64);
        take(&mut pipeline, arrival, &bytes);
    }
    let closed = packets
        .iter()
        .filter(|(arrival, bytes)| take(&mut pipeline, *arrival, bytes).is_some());
    assert!(closed.count() >= 3);
}
