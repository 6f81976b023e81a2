//! A simulated session with any damage: the pipeline panics at none, and what it says stays finite.
//!
//! The bytes say what happens to one message after the other: left as it is, lost, sent twice, cut, or with some of its bytes
//! replaced; as point clouds with poses, or as a sensor's packets.
#![no_main]

use std::sync::LazyLock;

use kreisel::config::Configuration;
use kreisel::pipeline::{Outcome, Pipeline};
use kreisel::simulate::{Simulation, scenario};
use kreisel::time::Time;
use kreisel::wire::velodyne::Packet;
use kreisel::wire::{Envelope, Recording};
use libfuzzer_sys::fuzz_target;

const REVOLUTIONS: usize = 3;
const SCENARIO: &str = "roundabout-waiting";

type Messages = Vec<(Time, Vec<u8>)>;

static FRAMES: LazyLock<Messages> = LazyLock::new(|| {
    let mut simulation = Simulation::new(scenario::find(SCENARIO).expect("a scenario"), 1);
    let mut bytes = vec![];
    (0..REVOLUTIONS).for_each(|_| drop(simulation.revolve(&mut bytes)));
    let entries = Recording::new(&bytes).flatten();
    entries
        .map(|entry| (entry.envelope.time(), entry.frame.to_vec()))
        .collect()
});

static PACKETS: LazyLock<Messages> = LazyLock::new(|| {
    let mut simulation = Simulation::in_packets(scenario::find(SCENARIO).expect("a scenario"), 1);
    let mut packets = vec![];
    for _ in 0..REVOLUTIONS {
        simulation
            .revolve_in_packets(|packet| packets.push((packet.arrival, packet.bytes.to_vec())));
    }
    packets
});

/// Messages as bytes that come one after the other say.
fn damaged(messages: &Messages, mut orders: impl Iterator<Item = u8>) -> Messages {
    let mut out = vec![];
    for (time, bytes) in messages {
        let mut bytes = bytes.clone();
        let mut next = || usize::from(orders.next().unwrap_or(0));
        match next() % 8 {
            1 => continue,
            2 => out.push((*time, bytes.clone())),
            3 => bytes.truncate(next() * bytes.len() / 255),
            4..=7 => {
                let place = next() << 8 | next();
                let at = place % bytes.len();
                bytes[at] = next() as u8;
            }
            _ => {}
        }
        out.push((*time, bytes));
    }
    out
}

fn check(pipeline: &mut Pipeline) {
    pipeline.update_map();
    for object in pipeline.objects() {
        let numbers = [
            object.yaw_rad,
            object.speed_mps,
            object.length_m,
            object.width_m,
            object.height_m,
        ];
        assert!(
            numbers
                .iter()
                .chain(&object.centre_m)
                .all(|number| number.is_finite())
        );
    }
    // The list, and each object by itself.
    let frames = 1 + pipeline.objects().len();
    assert_eq!(pipeline.publish_objects(Time::ZERO, 0.0).count(), frames);
    for frame in pipeline.publish_map(Time::ZERO) {
        assert!(Envelope::from_datagram(frame).is_ok());
    }
}

fuzz_target!(|orders: &[u8]| {
    let Some((kind, orders)) = orders.split_first() else {
        return;
    };
    let mut pipeline = Pipeline::new(&Configuration::default(), 0);
    if kind % 2 == 0 {
        for (_, frame) in damaged(&FRAMES, orders.iter().copied()) {
            let Ok((envelope, _)) = Envelope::from_datagram(&frame) else {
                continue;
            };
            if let Ok(Outcome::Revolution(_)) = pipeline.handle(&envelope) {
                check(&mut pipeline);
            }
        }
    } else {
        for (arrival, bytes) in damaged(&PACKETS, orders.iter().copied()) {
            let packet = Packet {
                source: [192, 168, 1, 201],
                arrival,
                bytes: &bytes,
            };
            if pipeline.take_packet(&packet) == Ok(true) {
                pipeline.perceive_packets(|_| ());
                check(&mut pipeline);
            }
        }
    }
});
