use super::*;
use crate::cloud::Scan;
use crate::cloud::tests::later;
use crate::cluster::{ClusterParameters, Dbscan};
use crate::parameter::Profile;
use crate::track::Class;
use crate::track::above::Climber;
use crate::track::appearance::tests::{Block, CAR, scan_of_blocks};
use crate::track::look::{COVERED_M, OUT_OF_VIEW_M};
use crate::track::standing::candidate::PASSED_M;
use crate::track::tests::with_scene;

struct Street {
    standing: Standing,
    parameters: TrackParameters,
    next_id: u32,
    seconds: f64,
}

impl Street {
    fn new() -> Self {
        Self {
            standing: Standing::default(),
            parameters: TrackParameters::profile(Profile::Default),
            next_id: 7,
            seconds: 0.0,
        }
    }

    /// A revolution, and what is listed after it beside what is already.
    fn see(&mut self, scan: &Scan, tracks: &mut [Track], others: &[Object]) -> Vec<Object> {
        let scan = later(scan, self.seconds);
        self.seconds += 0.1;
        let mut dbscan = Dbscan::new(&ClusterParameters::profile(Profile::Default));
        let mut objects = others.to_vec();
        with_scene(&scan, |scene| {
            let clusters = dbscan.process(&scan, &vec![false; scan.len()], scene.heights_m);
            let mut climber = Climber::default();
            climber.begin(scene, clusters.members());
            self.standing
                .process(clusters, &climber, scene, &self.parameters);
        });
        let least = self.parameters.least_confidence;
        self.standing.give_way(tracks, least);
        let next_id = &mut self.next_id;
        self.standing
            .list(scan.time(), least, tracks, next_id, &mut objects);
        objects
    }
}

/// A track of what is seen there, as if it had moved and were a vehicle so probably.
fn mover(scan: &Scan, probability: f64) -> Track {
    let (mut track, _) = crate::track::tests::followed([scan; 6]);
    track.stand_as_vehicle(probability);
    track.moves_for_tests();
    track.was_likely = true;
    track
}

#[test]
fn a_car_is_listed_after_three_looks_keeps_its_id_and_does_not_move() {
    let mut street = Street::new();
    let car = scan_of_blocks(&CAR);
    let counts: Vec<usize> = (0..3)
        .map(|_| street.see(&car, &mut [], &[]).len())
        .collect();
    assert_eq!(counts, [0, 0, 1]);
    for _ in 0..5 {
        let [seen] = &street.see(&car, &mut [], &[])[..] else {
            panic!("it is one");
        };
        assert_eq!((seen.id, seen.speed_mps, seen.class), (7, 0.0, Class::Car));
        assert!(seen.existence > 0.5 && seen.existence < 1.0, "{seen:?}");
    }
}

#[test]
fn what_rays_passed_over_lower_than_any_car_is_none() {
    let listed = |high_m: f64| {
        let block = Block {
            heights_m: [0.2, high_m],
            ..CAR[0]
        };
        let (mut street, scan) = (Street::new(), scan_of_blocks(&[block]));
        (0..8).fold(0, |_, _| street.see(&scan, &mut [], &[]).len())
    };
    assert_eq!([1.3, 0.9, 0.5].map(listed), [1, 1, 0]);
    assert_eq!(PASSED_M.log(OUT_OF_VIEW_M), 0.0);
    assert_eq!(PASSED_M.log(COVERED_M), 0.0);
}

#[test]
fn what_lies_in_the_middle_of_a_box_does_not_take_the_place_of_what_was_seen_there() {
    let mut street = Street::new();
    let car = scan_of_blocks(&CAR);
    (0..2).for_each(|_| drop(street.see(&car, &mut [], &[])));
    let standing = &mut street.standing;
    let mut piece = standing.sightings[0].clone();
    piece.look.middle_m = standing.candidates[0].place().centre_m.into();
    standing.sightings.insert(0, piece);
    standing.pair();
    let first = standing.pairs.first().map(|pair| pair.sighting);
    assert_eq!((standing.pairs.len(), first), (2, Some(1)));
}

#[test]
fn a_better_look_begins_a_candidate_in_the_place_of_a_worse_one() {
    let car = scan_of_blocks(&CAR);
    let begun = |more_log: f64| {
        let mut street = Street::new();
        (0..2).for_each(|_| drop(street.see(&car, &mut [], &[])));
        let Street {
            standing,
            parameters,
            ..
        } = &mut street;
        standing.sightings[0].log_odds += more_log;
        standing.is_taken[0] = false;
        with_scene(&car, |scene| standing.begin(scene, car.time(), parameters));
        standing.candidates.len()
    };
    assert_eq!([0.0, -1.0].map(begun), [1, 1]);
    let mut poor = Street::new();
    poor.see(&car, &mut [], &[]);
    let standing = &mut poor.standing;
    standing.sightings[0].log_odds += 3.0;
    standing.is_taken = vec![false];
    with_scene(&car, |scene| {
        standing.begin(scene, car.time(), &poor.parameters)
    });
    assert_eq!(standing.candidates.len(), 2);
}

#[test]
fn walls_are_not_listed() {
    let mut street = Street::new();
    let wall = scan_of_blocks(&[Block {
        sides_m: [0.3, 20.0],
        heights_m: [0.1, 2.4],
        ..CAR[0]
    }]);
    assert!((0..6).all(|_| street.see(&wall, &mut [], &[]).is_empty()));
}

#[test]
fn poor_looks_do_not_erase_what_many_clear_ones_told() {
    let mut street = Street::new();
    let car = scan_of_blocks(&CAR);
    street.see(&car, &mut [], &[]);
    let standing = &mut street.standing;
    let (candidate, mut sighting) = (&mut standing.candidates[0], standing.sightings[0].clone());
    let mut judged = |log_odds: f64, times: usize| {
        sighting.log_odds = log_odds;
        (0..times).for_each(|_| candidate.judge(&sighting));
        candidate.probability()
    };
    assert!(judged(3.0, 10) > 0.9);
    assert!(judged(-2.0, 3) > 0.5);
    assert!(judged(-2.0, 10) < 0.5);
}

#[test]
fn what_is_longer_or_higher_than_any_vehicle_is_none_whatever_it_looks_like() {
    let car = scan_of_blocks(&CAR);
    let left = |change: fn(&mut TrackParameters)| {
        let mut street = Street::new();
        change(&mut street.parameters);
        (0..3).for_each(|_| drop(street.see(&car, &mut [], &[])));
        street.standing.candidates.len()
    };
    assert_eq!(left(|_| {}), 1);
    assert_eq!(left(|parameters| parameters.longest_object_m = 3.0), 0);
    assert_eq!(left(|parameters| parameters.highest_object_m = 1.2), 0);
}

#[test]
fn what_stands_in_the_place_of_a_track_tells_that_it_looks_like_a_vehicle() {
    let mut street = Street::new();
    let car = scan_of_blocks(&CAR);
    let mut tracks = [mover(&car, 0.0)];
    (0..2).for_each(|_| drop(street.see(&car, &mut [], &[])));
    street.standing.tell_looks(&mut tracks);
    assert!(!tracks[0].looks_like_vehicle);
    street.see(&car, &mut [], &[]);
    street.standing.tell_looks(&mut tracks);
    assert!(tracks[0].looks_like_vehicle);
}

#[test]
fn what_drives_by_is_not_listed_though_it_looks_like_a_car() {
    let mut street = Street::new();
    let looks = (0..8).map(|revolution| {
        let gone_m = 0.6 * f64::from(revolution);
        let moved = CAR.map(|block| Block {
            middle_m: [block.middle_m[0], block.middle_m[1] + gone_m],
            ..block
        });
        street.see(&scan_of_blocks(&moved), &mut [], &[]).len()
    });
    assert_eq!(looks.sum::<usize>(), 0);
}

#[test]
fn what_drives_off_takes_the_identity_along_and_leaves_nothing_behind() {
    let mut street = Street::new();
    let car = scan_of_blocks(&CAR);
    (0..4).for_each(|_| drop(street.see(&car, &mut [], &[])));
    let mut tracks = [mover(&car, 1.0)];
    assert!(street.see(&car, &mut tracks, &[]).is_empty());
    assert_eq!((tracks[0].id, tracks[0].is_listed), (7, true));
    let empty = scan_of_blocks(&[]);
    assert!(street.see(&empty, &mut tracks, &[]).is_empty());
}

#[test]
fn what_moves_and_is_hardly_a_road_user_hides_no_car() {
    let mut street = Street::new();
    let car = scan_of_blocks(&CAR);
    (0..4).for_each(|_| drop(street.see(&car, &mut [], &[])));
    let mut tracks = [mover(&car, 0.1)];
    assert_eq!(street.see(&car, &mut tracks, &[]).len(), 1);
}

#[test]
fn what_came_to_rest_and_what_was_lost_is_the_same_again() {
    let car = scan_of_blocks(&CAR);
    let mut street = Street::new();
    let (mut rested, _) = crate::track::tests::followed([&car]);
    (rested.id, rested.was_likely, rested.is_listed) = (3, true, true);
    rested.stand_as_vehicle(1.0);
    let mut tracks = [rested];
    let last = |street: &mut Street, tracks: &mut [Track]| {
        let seen = (0..4).map(|_| street.see(&car, tracks, &[]));
        seen.last().map(|objects| objects[0].id)
    };
    assert_eq!(last(&mut street, &mut tracks), Some(3));
    assert!(!tracks[0].is_listed && tracks[0].id == 7);
    let empty = scan_of_blocks(&[]);
    (0..40).for_each(|_| drop(street.see(&empty, &mut [], &[])));
    assert!(street.standing.candidates.is_empty());
    assert_eq!(last(&mut street, &mut []), Some(3));
}

#[test]
fn what_is_listed_already_is_not_listed_twice() {
    let car = scan_of_blocks(&CAR);
    let mut street = Street::new();
    let others = (0..4).map(|_| street.see(&car, &mut [], &[])).last();
    let others = others.unwrap_or_default();
    assert_eq!(street.see(&car, &mut [], &others).len(), 1);
}
