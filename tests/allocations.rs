//! Nothing is allocated once everything is warm: a revolution then takes as long as the one
//! before it.
#![allow(unsafe_code, clippy::unwrap_used)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use kreisel::config::Configuration;
use kreisel::pipeline::{Outcome, Pipeline};
use kreisel::simulate::{Simulation, scenario};
use kreisel::time::Time;
use kreisel::wire::envelope::Postmark;
use kreisel::wire::point_cloud::{CompactPointCloud, POINT_CLOUD_ID};
use kreisel::wire::{Envelope, Recording};

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

/// The system's allocator, which counts what each thread asks of it.
struct Counting;

// SAFETY: every call is handed on to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller keeps the contract, which is the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: as above.
        unsafe { System.realloc(block, layout, size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Point clouds of a drive.
fn drive(scenario: &str, revolutions: usize) -> Vec<Vec<u8>> {
    let mut simulation = Simulation::new(scenario::find(scenario).unwrap(), 3);
    let mut bytes = vec![];
    for _ in 0..revolutions {
        simulation.revolve(&mut bytes);
    }
    Recording::new(&bytes)
        .map(|entry| entry.unwrap().frame.to_vec())
        .filter(|frame| Envelope::from_datagram(frame).unwrap().0.data_type == POINT_CLOUD_ID)
        .collect()
}

/// The same revolution at another time.
fn at_time(frame: &[u8], number: usize) -> Vec<u8> {
    let (envelope, _) = Envelope::from_datagram(frame).unwrap();
    let cloud = CompactPointCloud::decode(envelope.payload, 0).unwrap();
    let postmark = Postmark {
        sampled: Time::from_micros(1_700_000_000_000_000 + 100_000 * number as i64),
        ..Postmark::default()
    };
    let mut frame = vec![];
    postmark.put_payload(&mut frame, POINT_CLOUD_ID, |out| cloud.encode(out));
    frame
}

#[test]
fn a_warm_revolution_allocates_nothing() {
    allocates_nothing("roundabout", false);
}

#[test]
fn nor_does_one_at_a_roundabout_of_a_map() {
    allocates_nothing("roundabout-waiting", true);
}

fn allocates_nothing(scenario: &str, has_map: bool) {
    const REVOLUTIONS: usize = 30;
    const ROUNDS: usize = 24;
    let frames = drive(scenario, REVOLUTIONS);
    let mut configuration = Configuration::default();
    // Who drives to and fro turns all the time, and a way that has turned takes memory to look at, once in fifteen metres.
    configuration.roundabout.find = has_map;
    let mut pipeline = Pipeline::new(&configuration, 0);
    if has_map {
        let roads = scenario::find(scenario).unwrap().roads().unwrap();
        assert_eq!(pipeline.take_map(&roads), 1);
    }
    let mut allocations = [0; ROUNDS];
    for (round, allocations) in allocations.iter_mut().enumerate() {
        // There and back again, so that nothing leaps but where the drive turns round.
        let there = 0..REVOLUTIONS;
        for (step, place) in there.clone().chain(there.rev()).enumerate() {
            let frame = at_time(&frames[place], 2 * REVOLUTIONS * round + step);
            let (envelope, _) = Envelope::from_datagram(&frame).unwrap();
            let before = ALLOCATIONS.get();
            let outcome = pipeline.handle(&envelope).unwrap();
            let sent = pipeline.publish_objects(Time::ZERO, 0.0).count();
            pipeline.update_map();
            pipeline.publish_map(Time::ZERO).count();
            *allocations += ALLOCATIONS.get() - before;
            assert!(matches!(outcome, Outcome::Revolution(_)) && sent > usize::from(has_map));
        }
    }
    println!("in each round: {allocations:?}");
    assert!(allocations[0] > 0, "nothing was counted");
    // Odometry does not come back to the last millimetre, so that now and then the map grows by a tile.
    let least = allocations[ROUNDS / 2..].iter().min();
    assert_eq!(least, Some(&0), "in each round: {allocations:?}");
}
