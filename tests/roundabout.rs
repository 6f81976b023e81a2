//! Accuracy on the simulated roundabout, against its truth.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::BTreeMap;

use kreisel::config::Configuration;
use kreisel::parameter::Profile;
use kreisel::pipeline::{Outcome, Pipeline};
use kreisel::simulate::scenario::{self, Class};
use kreisel::simulate::{Simulation, TrueObject};
use kreisel::track::Object;
use kreisel::wire::Envelope;

/// Farther ones are not asked for.
const REACH_M: f64 = 40.0;
/// With fewer returns a road user is not in view.
const LEAST_POINTS: usize = 5;

#[derive(Debug, Default)]
struct Record {
    errors_m: Vec<f64>,
    ids: Vec<u32>,
}

fn distance_m(object: &Object, truth: &TrueObject) -> f64 {
    let [x, y] = truth.centre_m;
    (object.centre_m[0] - x).hypot(object.centre_m[1] - y)
}

/// Errors and ids of every road user in view, revolution by revolution.
fn drive(profile: Profile, seed: u64, revolutions: usize) -> BTreeMap<u32, (Class, Record)> {
    let mut simulation = Simulation::new(scenario::find("roundabout").unwrap(), seed);
    let mut pipeline = Pipeline::new(&Configuration::profile(profile), 0);
    let mut records: BTreeMap<u32, (Class, Record)> = BTreeMap::new();
    for _ in 0..revolutions {
        let mut frame = vec![];
        let truth = simulation.revolve(&mut frame);
        let (envelope, _) = Envelope::from_datagram(&frame).unwrap();
        let outcome = pipeline.handle(&envelope);
        assert!(matches!(outcome, Ok(Outcome::Revolution(_))), "{outcome:?}");
        for user in &truth.objects {
            let [x, y] = user.centre_m;
            if x.hypot(y) > REACH_M || user.points < LEAST_POINTS {
                continue;
            }
            let by_distance =
                |a: &&Object, b: &&Object| distance_m(a, user).total_cmp(&distance_m(b, user));
            let nearest = pipeline.objects().iter().min_by(by_distance).unwrap();
            let (_, record) = records
                .entry(user.id)
                .or_insert_with(|| (user.class, Record::default()));
            record.errors_m.push(distance_m(nearest, user));
            record.ids.push(nearest.id);
        }
    }
    records
}

#[test]
fn every_road_user_in_view_is_listed_within_a_metre_under_one_id() {
    for seed in [11, 12, 13] {
        for (user, (class, mut record)) in drive(Profile::Default, seed, 100) {
            let count = record.errors_m.len();
            assert!(
                count > 20,
                "{class:?} {user} was in view {count} times only"
            );
            record.ids.dedup();
            assert_eq!(
                record.ids.len(),
                1,
                "seed {seed}, {class:?} {user}: {:?}",
                record.ids
            );
            record.errors_m.sort_by(f64::total_cmp);
            let (median_m, most_m) = (
                record.errors_m[count / 2],
                record.errors_m[count * 95 / 100],
            );
            println!(
                "seed {seed} {class:?} {user}: median {median_m:.2} m, 95th percentile {most_m:.2} m"
            );
            assert!(median_m < 0.6, "seed {seed}, {class:?} {user}: {median_m}");
            assert!(most_m < 1.0, "seed {seed}, {class:?} {user}: {most_m}");
        }
    }
}

#[test]
fn the_thesis_profile_sees_the_same_road_users_and_changes_their_ids() {
    for (user, (class, mut record)) in drive(Profile::Thesis, 11, 100) {
        let count = record.errors_m.len();
        record.ids.dedup();
        record.errors_m.sort_by(f64::total_cmp);
        let (median_m, most_m) = (
            record.errors_m[count / 2],
            record.errors_m[count * 95 / 100],
        );
        let ids = record.ids.len();
        println!(
            "thesis {class:?} {user}: {ids} ids, median {median_m:.2} m, 95th percentile {most_m:.2} m"
        );
        assert!(
            class == Class::Pedestrian || ids > 1,
            "{class:?} {user}: {ids} ids"
        );
    }
}
