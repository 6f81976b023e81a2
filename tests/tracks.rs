//! Identities when the world is hidden, when poses are lost, and when nothing moves.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::collections::BTreeMap;

use kreisel::config::Configuration;
use kreisel::parameter::Profile;
use kreisel::pipeline::{Outcome, Pipeline};
use kreisel::simulate::scenario;
use kreisel::simulate::{Simulation, TrueObject};
use kreisel::track::Object;
use kreisel::wire::Recording;

/// Farther off is another object.
const MATCH_M: f64 = 2.0;

fn pipeline() -> Pipeline {
    Pipeline::new(&Configuration::profile(Profile::Default), 0)
}

/// Feeds frames; poses only if they are wanted.
fn feed(pipeline: &mut Pipeline, frames: &[u8], with_poses: bool) {
    for item in Recording::new(frames) {
        let envelope = item.unwrap().envelope;
        let is_cloud = envelope.data_type == 49;
        if is_cloud || with_poses {
            let outcome = pipeline.handle(&envelope).unwrap();
            assert_eq!(is_cloud, matches!(outcome, Outcome::Revolution(_)));
        }
    }
}

/// The id of the object at a road user's place, `place_m` being where an object stands in the
/// world.
fn id_of(
    user: &TrueObject,
    objects: &[Object],
    place_m: impl Fn(&Object) -> [f64; 2],
) -> Option<u32> {
    let near = objects.iter().map(|object| {
        let [x, y] = place_m(object);
        let distance_m = (x - user.centre_m[0]).hypot(y - user.centre_m[1]);
        (distance_m, object.id)
    });
    let nearest = near.min_by(|a, b| a.0.total_cmp(&b.0));
    nearest
        .filter(|(distance_m, _)| *distance_m < MATCH_M)
        .map(|(_, id)| id)
}

fn in_frame(object: &Object) -> [f64; 2] {
    [object.centre_m[0], object.centre_m[1]]
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn nothing_moves_where_everything_is_parked() {
    let Some(path) = common::data("vlp16-parked-car-85rev.rec") else {
        return;
    };
    let bytes = std::fs::read(path).unwrap();
    let mut pipeline = pipeline();
    let mut revolutions = 0;
    for item in Recording::new(&bytes) {
        let envelope = item.unwrap().envelope;
        let Ok(Outcome::Revolution(_)) = pipeline.handle(&envelope) else {
            continue;
        };
        revolutions += 1;
        let movers: Vec<_> = pipeline
            .objects()
            .iter()
            .filter(|object| object.speed_mps.abs() > 0.5)
            .collect();
        assert!(revolutions <= 10 || movers.is_empty(), "{movers:?}");
    }
    assert!(revolutions > 80);
}

#[test]
fn ids_survive_the_loss_and_the_return_of_poses() {
    const LOST: std::ops::Range<u32> = 70..100;
    let mut kept = 0;
    let mut changed = 0;
    for seed in [11, 12, 13] {
        let mut simulation = Simulation::new(scenario::find("roundabout").unwrap(), seed);
        let mut pipeline = pipeline();
        let mut ids: BTreeMap<u32, u32> = BTreeMap::new();
        for revolution in 0..120 {
            let mut frames = vec![];
            let truth = simulation.revolve(&mut frames);
            feed(&mut pipeline, &frames, !LOST.contains(&revolution));
            let is_switch = [LOST.start + 10, LOST.end + 5].contains(&revolution);
            for user in truth.objects.iter().filter(|user| user.points >= 20) {
                let Some(id) = id_of(user, pipeline.objects(), in_frame) else {
                    continue;
                };
                match ids.insert(user.id, id) {
                    Some(before) if is_switch && before == id => kept += 1,
                    Some(before) if is_switch && before != id => changed += 1,
                    _ => {}
                }
            }
        }
    }
    println!("{kept} ids kept, {changed} changed");
    assert!(kept >= 10 && changed * 10 <= kept, "{kept} {changed}");
}

#[test]
fn what_is_hidden_is_predicted_and_keeps_its_id() {
    let (mut kept, mut lost) = (0, 0);
    let mut predicted = 0;
    for seed in [11, 12, 13] {
        let mut simulation = Simulation::new(scenario::find("occlusion").unwrap(), seed);
        let mut pipeline = pipeline();
        // For every road user its last id and how long it has been hidden since.
        let mut last: BTreeMap<u32, (u32, u32)> = BTreeMap::new();
        for _ in 0..250 {
            let mut frames = vec![];
            let truth = simulation.revolve(&mut frames);
            feed(&mut pipeline, &frames, true);
            for user in &truth.objects {
                let found = id_of(user, pipeline.objects(), in_frame);
                let (id, hidden) = last.get(&user.id).copied().unwrap_or((u32::MAX, 0));
                if user.points == 0 {
                    last.insert(user.id, (id, hidden + 1));
                    let held = pipeline.objects().iter().find(|object| object.id == id);
                    predicted += u32::from(held.is_some_and(|object| !object.measured));
                } else if let (Some(now), true) = (found, user.points >= 5) {
                    if id != u32::MAX && (5..=23).contains(&hidden) {
                        kept += u32::from(now == id);
                        lost += u32::from(now != id);
                    }
                    last.insert(user.id, (now, 0));
                }
            }
        }
    }
    println!("{kept} kept, {lost} lost, predicted in {predicted} revolutions");
    assert!(predicted > 30, "{predicted}");
    assert!(kept >= 8 && kept >= 4 * lost, "{kept} kept, {lost} lost");
}

#[test]
fn a_bus_that_comes_along_and_passes_is_one_object_as_long_as_it_is() {
    for (scene, seed, revolutions) in [("street", 12, 100), ("standing", 5, 140)] {
        let mut simulation = Simulation::new(scenario::find(scene).unwrap(), seed);
        let mut pipeline = pipeline();
        let (mut ids, mut alone, mut looks) = (BTreeMap::<u32, u32>::new(), 0, 0);
        let mut longest_m = 0.0f64;
        for _ in 0..revolutions {
            let mut frames = vec![];
            let truth = simulation.revolve(&mut frames);
            feed(&mut pipeline, &frames, true);
            let is_bus = |user: &&TrueObject| user.size_m[0] > 11.0 && user.points >= 200;
            let Some(bus) = truth.objects.iter().find(is_bus) else {
                continue;
            };
            let objects = pipeline.objects().iter();
            let on_it: Vec<&Object> = objects.filter(|object| is_within(bus, object)).collect();
            looks += 1;
            alone += u32::from(on_it.len() == 1);
            for object in on_it {
                *ids.entry(object.id).or_default() += 1;
                longest_m = longest_m.max(object.length_m);
            }
        }
        println!("{scene}: alone {alone} times of {looks}, {longest_m:.1} m long, {ids:?}");
        assert!(looks > 25 && 10 * alone >= 9 * looks);
        let most = ids.values().max().copied().unwrap_or(0);
        assert!(10 * most >= 9 * looks);
        assert!((10.5..13.5).contains(&longest_m));
    }
}

/// Whether an object's middle lies within a road user, or so close behind it that it is a piece.
fn is_within(user: &TrueObject, object: &Object) -> bool {
    const BEHIND_M: f64 = 2.0;
    let [x, y] = [0, 1].map(|axis| object.centre_m[axis] - user.centre_m[axis]);
    let (sine, cosine) = user.yaw_rad.sin_cos();
    let (along_m, across_m) = (x * cosine + y * sine, y * cosine - x * sine);
    let half_m = user.size_m.map(|side_m| 0.5 * side_m);
    (-half_m[0] - BEHIND_M..half_m[0]).contains(&along_m) && across_m.abs() < half_m[1]
}

#[test]
fn who_drives_ahead_over_the_seam_of_the_sweep_is_one_object_under_one_id() {
    let mut simulation = Simulation::new(scenario::find("hill").unwrap(), 12);
    let mut pipeline = pipeline();
    let (mut ahead, mut ids) = (None, BTreeMap::<Option<u32>, u32>::new());
    let mut doubled = 0;
    for revolution in 0..100 {
        let mut frames = vec![];
        let truth = simulation.revolve(&mut frames);
        feed(&mut pipeline, &frames, true);
        let off_m = |user: &TrueObject| (user.centre_m[0]).hypot(user.centre_m[1] - 17.0);
        let nearest = truth
            .objects
            .iter()
            .min_by(|a, b| off_m(a).total_cmp(&off_m(b)));
        let id = *ahead.get_or_insert(nearest.unwrap().id);
        let car = truth.objects.iter().find(|user| user.id == id).unwrap();
        if revolution >= 15 {
            let objects = pipeline.objects();
            *ids.entry(id_of(car, objects, in_frame)).or_default() += 1;
            let within = objects
                .iter()
                .filter(|object| is_within(car, object))
                .count();
            doubled += u32::from(within > 1);
        }
    }
    println!("{ids:?}, doubled {doubled} times");
    assert!(ids.len() == 1 && !ids.contains_key(&None) && doubled == 0);
}
