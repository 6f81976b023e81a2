use super::*;
use crate::cloud::tests::scan_of;
use crate::cluster::Clusters;
use crate::ego::Pose;
use crate::ground::Plane;
use crate::parameter::Profile;
use crate::roundabout::tests::round;
use crate::roundabout::{RoundaboutParameters, Situation, Watcher};
use crate::simulate::scenario;
use crate::time::Time;
use crate::track::Class;

fn site() -> Site {
    let roads = scenario::find("roundabout-traffic").unwrap().roads();
    let mut watcher = Watcher::new(&RoundaboutParameters::profile(Profile::Default));
    watcher.take_map(&roads.unwrap());
    watcher.place(&Situation {
        time: Time::from_micros(1),
        reference: None,
        epoch: 0,
        vehicle: None,
        vehicle_speed_mps: 0.0,
        objects: &[],
        sight: None,
    });
    watcher.sites.remove(0)
}

/// All is seen to be free.
fn free(site: &Site) -> Unseen {
    let stretch = |count| Stretch {
        may_hold: vec![0; count],
        gone_m: 0.0,
    };
    Unseen {
        rings: site.rings.iter().map(|_| stretch(40)).collect(),
        ways: entries(site).map(|_| stretch(25)).collect(),
        ..Unseen::default()
    }
}

#[test]
fn who_may_come_along_another_way_in_may_come_from_there() {
    let site = site();
    let conflict = *site.arms[0].entries[0].conflicts.last().unwrap();
    let mut unseen = free(&site);
    let before = |unseen: &Unseen| unseen.before(&site, 0, &conflict, 8.0);
    assert_eq!(before(&unseen), (f64::INFINITY, 1.0));
    // The own way in leads nobody across the own way.
    unseen.ways[0].may_hold[3] = 1;
    assert_eq!(before(&unseen).0, f64::INFINITY);
    let soonest_s = (1..4).map(|other| {
        let mut unseen = free(&site);
        unseen.ways[other].may_hold[10] = 1;
        before(&unseen).0
    });
    let mut soonest_s: Vec<f64> = soonest_s.collect();
    soonest_s.sort_by(f64::total_cmp);
    // Ten places back, of which twelve metres are a bend, and a quarter of the circle from arm to arm, of a radius of 11 m.
    let round_mps = VARIES * round_mps(11.0);
    for (quarters, said_s) in (1..4).zip(soonest_s) {
        let bent_m = 12.0 + 11.0 * TAU / 4.0 * f64::from(quarters);
        let due_s = (10.0 * APART_M - 12.0) / 8.0 + bent_m / round_mps;
        assert!((said_s - due_s).abs() < 0.2, "{said_s} {due_s}");
    }
}

#[test]
fn what_is_on_a_way_in_and_not_listed_may_be_somebody() {
    let site = site();
    let (_, entry) = entries(&site).nth(1).unwrap();
    let mut stretch = free(&site).ways.swap_remove(1);
    let (at_m, heading_rad) = entry.way.at(entry.way.length_m() - 9.0);
    let (sine, cosine) = libm::sincos(heading_rad);
    // On the kerb.
    let aside_m = [at_m[0] - 2.0 * sine, at_m[1] + 2.0 * cosine];
    stretch.note_thing(entry, aside_m, false, &[]);
    assert!(stretch.may_hold.iter().all(|&looks| looks == 0));
    stretch.note_thing(entry, at_m, false, &[]);
    assert_eq!(
        stretch.may_hold.iter().position(|&looks| looks > 0),
        Some(4)
    );
}

#[test]
fn what_crosses_a_way_in_comes_along_it_only_where_somebody_was_behind() {
    let site = site();
    let (_, entry) = entries(&site).nth(1).unwrap();
    let at_m = entry.way.at(entry.way.length_m() - 9.0).0;
    let soonest = |held: &[usize]| {
        let mut stretch = free(&site).ways.swap_remove(1);
        for &place in held {
            stretch.may_hold[place] = 1;
        }
        stretch.note_thing(entry, at_m, true, &[]);
        stretch.may_hold.iter().position(|&looks| looks == LOOKS)
    };
    assert_eq!(soonest(&[]), None);
    assert_eq!(soonest(&[3, 7]), None);
    assert_eq!(soonest(&[6]), Some(4));
}

#[test]
fn who_was_hidden_moves_on_as_fast_as_anybody_may() {
    let mut stretch = Stretch {
        may_hold: vec![0, 0, 0, 0, 1],
        gone_m: 0.0,
    };
    assert_eq!(stretch.steps(0.1, 8.0), 0);
    assert_eq!(stretch.steps(0.4, 8.0), 2);
    stretch.come_in();
    assert_eq!(stretch.may_hold, [0, 0, 0, 1, 1]);
    stretch.go_round(false);
    assert_eq!(stretch.may_hold, [1, 0, 0, 1, 1]);
    stretch.may_hold = vec![0, 0, 5, 0, 0];
    stretch.go_round(true);
    assert_eq!(stretch.may_hold, [0, 5, 5, 5, 0]);
}

#[test]
fn who_is_listed_and_hidden_makes_nobody_else_possible_until_he_goes_from_the_list() {
    // 7 m ahead something hides all that is farther away.
    let scan = scan_of(1800, |_, _| 700);
    let sight = Sight {
        scan: &scan,
        sensor: &Pose::SENSOR.rigid(),
        ground: &Plane::level(1.9),
        clusters: &Clusters::default(),
        heights_m: &[],
    };
    let mut stretch = Stretch {
        may_hold: vec![0; 5],
        gone_m: 0.0,
    };
    let place_m = |place: usize| [0.0, 20.0 + 4.0 * place as f64];
    let mut take = |objects: &[Object], missing: &[_]| {
        let look = Look {
            sight: &sight,
            objects,
            missing,
        };
        stretch.take(&look, place_m);
        stretch.may_hold.clone()
    };
    let [x, y] = place_m(2);
    let hidden = Object {
        centre_m: [x, y, 0.7],
        ..round(Class::Car, 11.0, 0.0, 5.0)
    };
    assert_eq!(take(&[hidden], &[]), [0; 5]);
    assert_eq!(take(&[], &[(place_m(2), 3.0)]), [0, 0, LOST_LOOKS, 0, 0]);
    assert_eq!(take(&[], &[]), [0, 0, LOST_LOOKS, 0, 0]);
}

#[test]
fn who_goes_from_the_list_is_missed_where_he_was() {
    let mut unseen = Unseen {
        listed: vec![(7, [1.0, 2.0], 3.0)],
        ..Unseen::default()
    };
    unseen.note_missing(&[]);
    assert_eq!(unseen.missing, [([1.0, 2.0], 3.0)]);
}

#[test]
fn who_goes_from_the_list_may_be_there_until_rays_would_have_met_even_a_low_car() {
    // 35 m ahead the ray 1 degree down passes at 1.3 m; the next one ends there or, behind it, on the ground.
    let ending_at =
        |range_cm: u16| scan_of(1800, move |_, layer| if layer == 6 { range_cm } else { 0 });
    let (met, passed) = (ending_at(3500), ending_at(3620));
    let mut stretch = Stretch {
        may_hold: vec![0],
        gone_m: 0.0,
    };
    let mut take = |scan: &crate::cloud::Scan, missing: &[_]| {
        let look = Look {
            sight: &Sight {
                scan,
                sensor: &Pose::SENSOR.rigid(),
                ground: &Plane::level(1.9),
                clusters: &Clusters::default(),
                heights_m: &[],
            },
            objects: &[],
            missing,
        };
        stretch.take(&look, |_| [0.0, 35.0]);
        stretch.may_hold[0]
    };
    assert_eq!(take(&met, &[([0.0, 35.0], 3.0)]), LOST_LOOKS);
    assert_eq!(take(&met, &[]), LOST_LOOKS - 1);
    let left = LOST_LOOKS - 1 - MEETING_LOOKS;
    assert_eq!(take(&passed, &[]), left);
    assert_eq!(take(&passed, &[]), left - MEETING_LOOKS);
    assert_eq!(take(&passed, &[]), 0);
}
