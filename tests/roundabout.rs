//! Accuracy on the simulated roundabout, against its truth, standing at an entry.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::BTreeMap;

use kreisel::config::Configuration;
use kreisel::parameter::Profile;
use kreisel::pipeline::{Outcome, Pipeline};
use kreisel::simulate::scenario;
use kreisel::simulate::variant::Class;
use kreisel::simulate::{Simulation, TrueObject};
use kreisel::track::Object;
use kreisel::wire::Envelope;

/// Farther ones are not asked for.
const REACH_M: f64 = 30.0;
/// With fewer returns a road user is hardly in view: at 30 m a car has 40.
const LEAST_POINTS: usize = 20;
/// With fewer it counts nowhere.
const FEWEST_POINTS: usize = 5;
/// Revolutions in view before it must be known, and out of view after which it may be forgotten.
const SETTLING: usize = 5;
/// Farther off is another object.
const MATCH_M: f64 = 2.0;

/// What became of a road user.
#[derive(Debug, Default)]
struct Record {
    in_view: usize,
    out_of_view: usize,
    /// Revolutions in which it had to be known, and was not.
    missed: usize,
    errors_m: Vec<f64>,
    id: Option<u32>,
    /// Changes of the id while it was in view.
    changes: usize,
}

fn distance_m(object: &Object, truth: &TrueObject) -> f64 {
    let [x, y] = truth.centre_m;
    (object.centre_m[0] - x).hypot(object.centre_m[1] - y)
}

/// How far the object at a road user's place is from it, and its id.
fn nearest(user: &TrueObject, objects: &[Object]) -> Option<(f64, u32)> {
    let near = objects
        .iter()
        .map(|object| (distance_m(object, user), object.id));
    let nearest = near.min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.filter(|(distance_m, _)| *distance_m < MATCH_M)
}

/// Shows each road user of so many revolutions, with the objects that were found.
fn play(
    profile: Profile,
    seed: u64,
    revolutions: usize,
    mut look: impl FnMut(&TrueObject, &[Object]),
) {
    let scenario = scenario::find("roundabout-waiting").unwrap();
    let mut simulation = Simulation::new(scenario, seed);
    let mut pipeline = Pipeline::new(&Configuration::profile(profile), 0);
    for _ in 0..revolutions {
        let mut frame = vec![];
        let truth = simulation.revolve(&mut frame);
        let (envelope, _) = Envelope::from_datagram(&frame).unwrap();
        let outcome = pipeline.handle(&envelope);
        assert!(matches!(outcome, Ok(Outcome::Revolution(_))), "{outcome:?}");
        for user in &truth.objects {
            look(user, pipeline.objects());
        }
    }
}

impl Record {
    fn note(&mut self, user: &TrueObject, objects: &[Object]) {
        let [x, y] = user.centre_m;
        if x.hypot(y) > REACH_M || user.points < LEAST_POINTS {
            self.out_of_view += 1;
            self.in_view = 0;
            return;
        }
        if self.out_of_view > SETTLING {
            self.id = None;
        }
        self.out_of_view = 0;
        self.in_view += 1;
        if self.in_view <= SETTLING {
            return;
        }
        match nearest(user, objects) {
            None => self.missed += 1,
            Some((distance_m, id)) => {
                self.errors_m.push(distance_m);
                self.changes += usize::from(self.id.is_some_and(|before| before != id));
                self.id = Some(id);
            }
        }
    }

    /// Errors that half and 95 percent of the revolutions do not exceed.
    fn errors_m(&mut self) -> (f64, f64) {
        self.errors_m.sort_by(f64::total_cmp);
        let count = self.errors_m.len();
        (self.errors_m[count / 2], self.errors_m[count * 95 / 100])
    }
}

/// What became of every road user in so many revolutions.
fn drive(profile: Profile, seed: u64, revolutions: usize) -> BTreeMap<u32, (Class, Record)> {
    let mut records: BTreeMap<u32, (Class, Record)> = BTreeMap::new();
    play(profile, seed, revolutions, |user, objects| {
        let (_, record) = records
            .entry(user.id)
            .or_insert_with(|| (user.class, Record::default()));
        record.note(user, objects);
    });
    records.retain(|_, (_, record)| record.errors_m.len() > 10);
    records
}

#[test]
fn every_road_user_in_view_is_listed_within_a_metre_under_one_id() {
    for seed in [11, 12, 13] {
        let records = drive(Profile::Default, seed, 150);
        assert!(records.len() >= 5, "{}", records.len());
        for (user, (class, mut record)) in records {
            let (median_m, most_m) = record.errors_m();
            let Record {
                missed, changes, ..
            } = record;
            println!(
                "seed {seed} {class:?} {user}: {} revolutions, {missed} missed, {changes} changes \
                 of id, median {median_m:.2} m, 95th percentile {most_m:.2} m",
                record.errors_m.len()
            );
            assert!(median_m < 0.4 && most_m < 1.0, "{class:?} {user}");
            assert!(missed * 50 <= record.errors_m.len(), "{class:?} {user}");
            assert_eq!(changes, 0, "{class:?} {user}");
        }
    }
}

#[test]
fn the_thesis_profile_sees_the_same_road_users_and_changes_their_ids() {
    let mut changes = 0;
    for (user, (class, mut record)) in drive(Profile::Thesis, 11, 150) {
        let (median_m, most_m) = record.errors_m();
        println!(
            "thesis {class:?} {user}: {} missed, {} changes of id, median {median_m:.2} m, 95th \
             percentile {most_m:.2} m",
            record.missed, record.changes
        );
        changes += record.changes;
    }
    assert!(changes > 0);
}

#[test]
fn what_drives_around_the_island_keeps_its_id() {
    let (mut changes, mut minutes) = (0, 0.0);
    for seed in [13, 16, 24] {
        let mut ids: BTreeMap<u32, u32> = BTreeMap::new();
        play(Profile::Default, seed, 250, |user, objects| {
            if user.points < FEWEST_POINTS {
                return;
            }
            minutes += 1.0 / 600.0;
            if let Some((_, id)) = nearest(user, objects) {
                changes += u32::from(ids.insert(user.id, id).is_some_and(|was| was != id));
            }
        });
    }
    println!("{changes} changes of id in {minutes:.1} minutes of objects");
    assert!(f64::from(changes) < 0.2 * minutes, "{changes}");
}
