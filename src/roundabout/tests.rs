mod exits;
mod found;
mod hidden;
mod kept;
mod ways;

use std::f64::consts::PI;

use super::*;
use crate::parameter::Profile;
use crate::simulate::scenario;
use crate::track::Class;

const NOW: Time = Time::from_micros(1_700_000_000_000_000);
/// Of the simulated roundabout, and radii of its lane and its cycle path.
const CENTRE_M: [f64; 2] = [-1.75, 21.0];
const ROAD_M: f64 = 11.0;
const BIKEWAY_M: f64 = 16.6;

fn watcher() -> Watcher {
    watcher_at("roundabout-traffic")
}

/// One that knows the roads of a scenario.
fn watcher_at(name: &str) -> Watcher {
    let mut watcher = Watcher::new(&RoundaboutParameters::profile(Profile::Default));
    let roads = scenario::find(name).unwrap().roads().unwrap();
    assert_eq!(watcher.take_map(&roads), 1);
    watcher
}

/// Somebody who goes round on a radius, at an angle from east.
pub(super) fn round(class: Class, radius_m: f64, angle_deg: f64, speed_mps: f64) -> Object {
    let (sine, cosine) = angle_deg.to_radians().sin_cos();
    let long = if class == Class::Car { 4.4 } else { 1.8 };
    Object {
        id: 7,
        class,
        class_probability: 0.95,
        measured: true,
        centre_m: [
            CENTRE_M[0] + radius_m * cosine,
            CENTRE_M[1] + radius_m * sine,
            0.7,
        ],
        yaw_rad: crate::ego::wrapped_rad((angle_deg + 90.0).to_radians()),
        speed_mps,
        yaw_rate_radps: speed_mps / radius_m,
        length_m: long,
        width_m: 1.8,
        height_m: 1.5,
        position_deviation_m: [0.1; 2],
        yaw_deviation_rad: 0.05,
        speed_deviation_mps: 0.3,
        existence: 0.95,
        first_seen: Time::from_micros(0),
        seen_since: Time::from_micros(0),
        last_measured: NOW,
        points: 100,
    }
}

/// A vehicle that stands before the southern arm's circle.
fn situation(objects: &[Object]) -> Situation<'_> {
    Situation {
        time: NOW,
        reference: None,
        epoch: 0,
        vehicle: Some(Pose {
            position_m: [0.0; 3],
            yaw_rad: PI / 2.0,
        }),
        vehicle_speed_mps: 0.0,
        objects,
        sight: None,
    }
}

/// Who is watched for so long is no newcomer.
fn known(objects: &[Object]) -> Watcher {
    let mut watcher = watcher();
    for micros in [-1_600_000, -100_000] {
        watcher.watch(&Situation {
            time: Time::from_micros(NOW.micros() + micros),
            ..situation(objects)
        });
    }
    watcher
}

fn own_arm(watcher: &Watcher) -> &ArmAdvice {
    let advice = watcher.advice().unwrap();
    &advice.arms[advice.own_arm.unwrap()]
}

#[test]
fn one_may_enter_where_nobody_is() {
    let mut watcher = watcher();
    watcher.watch(&situation(&[]));
    let advice = watcher.advice().unwrap();
    assert_eq!((advice.arms.len(), advice.state), (4, State::Braking));
    assert!(advice.arms.iter().all(|arm| arm.entry.may_go), "{advice:?}");
    assert!((own_arm(&watcher).bearing_rad + PI / 2.0).abs() < 0.1);
    // From 2.3 m before the pose's place to where its rear is past the end of the way in, from standing.
    let [_, end_s] = own_arm(&watcher).entry.own_window_s;
    assert!((2.5..3.6).contains(&end_s), "{end_s}");
}

#[test]
fn one_waits_for_who_comes_round() {
    let mut watcher = watcher();
    // The way in meets the circle 37 degrees to the right of the arm: a third of the way round is left.
    let comes = [round(Class::Car, ROAD_M, 180.0, 7.0)];
    watcher.watch(&situation(&comes));
    let arm = own_arm(&watcher);
    assert_eq!(
        (arm.entry.may_go, arm.entry.hindrance),
        (false, Some(Hindrance::RoadUser(7)))
    );
    assert!((2.0..3.6).contains(&arm.entry.gap_s), "{arm:?}");
    let advice = watcher.advice().unwrap();
    let own = advice.own_arm.unwrap();
    let window = advice
        .windows
        .iter()
        .find(|window| window.arm == own)
        .unwrap();
    let way_m = ROAD_M * (270.0 + 36.7 - 180.0f64).to_radians();
    assert!((window.way_m - way_m).abs() < 0.5, "{window:?} {way_m}");
    assert!(
        (window.expected_s - (way_m - 2.2) / 7.0).abs() < 0.1,
        "{window:?}"
    );
    // Two exits lie before the eastern arm's way in.
    let farther = advice
        .windows
        .iter()
        .find(|window| window.way_m > 40.0)
        .unwrap();
    assert!((farther.probability - 0.36).abs() < 0.05, "{farther:?}");
}

#[test]
fn who_has_passed_is_in_nobodys_way() {
    let mut watcher = watcher();
    let passed = [round(Class::Car, ROAD_M, 345.0, 7.0)];
    watcher.watch(&situation(&passed));
    let arm = own_arm(&watcher);
    assert!(arm.entry.may_go, "{arm:?}");
}

#[test]
fn who_takes_an_exit_does_not_come() {
    let mut watcher = watcher();
    // Along the western arm's way out, which leads away at 180 degrees.
    let mut leaves = round(Class::Car, ROAD_M, 180.0, 7.0);
    leaves.centre_m = [CENTRE_M[0] - 19.0, CENTRE_M[1] + 1.75, 0.7];
    (leaves.yaw_rad, leaves.yaw_rate_radps) = (PI, 0.0);
    watcher.watch(&situation(&[leaves]));
    let user = watcher.advice().unwrap().users[0].on;
    assert!(matches!(user.place, Place::Exit(..)), "{user:?}");
    assert!(
        user.probability > 0.9 && user.offset_m.abs() < 0.3,
        "{user:?}"
    );
    assert!(own_arm(&watcher).entry.may_go);
}

#[test]
fn everybody_is_on_the_lane_of_his_kind() {
    let mut watcher = watcher();
    let mut cyclist = round(Class::Cyclist, BIKEWAY_M, 30.0, 4.2);
    cyclist.id = 8;
    watcher.watch(&situation(&[round(Class::Car, ROAD_M, 90.0, 7.0), cyclist]));
    let users = &watcher.advice().unwrap().users;
    let places: Vec<_> = users
        .iter()
        .map(|user| (user.object_id, user.on.place))
        .collect();
    assert_eq!(places, [(7, Place::Ring(0)), (8, Place::Ring(1))]);
    assert!(
        (users[0].on.along_m - ROAD_M * PI / 2.0).abs() < 0.1,
        "{users:?}"
    );
}

/// A car that slows for the corner of a way in is still waited for; one that stands there gives way.
#[test]
fn who_stands_at_another_arm_gives_way() {
    let mut waits = round(Class::Car, ROAD_M, 180.0, 0.0);
    waits.centre_m = [CENTRE_M[0] - 22.0, CENTRE_M[1] - 1.75, 0.7];
    (waits.yaw_rad, waits.yaw_rate_radps) = (0.0, 0.0);
    let mut watcher = known(std::slice::from_ref(&waits));
    watcher.watch(&situation(std::slice::from_ref(&waits)));
    assert!(own_arm(&watcher).entry.may_go, "{:?}", own_arm(&watcher));
    waits.speed_mps = 6.0;
    watcher.forget();
    watcher.watch(&situation(&[waits]));
    assert_eq!(
        own_arm(&watcher).entry.hindrance,
        Some(Hindrance::RoadUser(7))
    );
}

/// Of somebody far away the direction is not known well; on a way in there is one only.
#[test]
fn who_is_on_a_way_in_comes_whichever_way_he_seems_to_be_turned() {
    let mut comes = round(Class::Car, ROAD_M, 180.0, 6.0);
    comes.centre_m = [CENTRE_M[0] - 22.0, CENTRE_M[1] - 1.75, 0.7];
    comes.yaw_rate_radps = 0.0;
    for yaw_rad in [0.0, 1.0, -2.5] {
        comes.yaw_rad = yaw_rad;
        let mut watcher = watcher();
        watcher.watch(&situation(std::slice::from_ref(&comes)));
        let entry = &own_arm(&watcher).entry;
        assert_eq!(entry.hindrance, Some(Hindrance::RoadUser(7)), "{yaw_rad}");
        assert!(entry.gap_s < 6.5, "{yaw_rad} {entry:?}");
    }
}

/// Who has only just been seen may be faster than he seems, by as much as his speed may be off.
#[test]
fn nothing_is_taken_for_granted_of_newcomers() {
    let gap_s = |mut watcher: Watcher, speed_mps: f64, speed_deviation_mps: f64| {
        let user = Object {
            speed_deviation_mps,
            ..round(Class::Car, ROAD_M, 180.0, speed_mps)
        };
        watcher.watch(&situation(&[user]));
        own_arm(&watcher).entry.gap_s
    };
    let hardly_known_s = gap_s(watcher(), 3.0, 1.5);
    assert!((2.5..4.0).contains(&hardly_known_s), "{hardly_known_s}");
    let not_moving_yet_s = gap_s(watcher(), 0.0, 1.5);
    assert!((2.0..3.5).contains(&not_moving_yet_s), "{not_moving_yet_s}");
    let well_known_s = gap_s(watcher(), 3.0, 0.1);
    assert!(well_known_s > 5.5, "{well_known_s}");
    let newcomer = round(Class::Car, ROAD_M, 180.0, 3.0);
    let seen_for_long_s = gap_s(known(&[newcomer]), 3.0, 1.5);
    assert!(seen_for_long_s > hardly_known_s + 0.5, "{seen_for_long_s}");
}

#[test]
fn nobody_comes_faster_than_anybody_may_however_little_is_known_of_his_speed() {
    let mut watcher = watcher();
    let mut hardly_known = round(Class::Car, ROAD_M, 60.0, 0.0);
    hardly_known.speed_deviation_mps = 5.0;
    watcher.watch(&situation(&[hardly_known]));
    let advice = watcher.advice().unwrap();
    let mut windows = advice.windows.iter();
    let window = windows.find(|window| Some(window.arm) == advice.own_arm);
    // More than half of the way round is left.
    let window = window.unwrap();
    let fastest_mps = RoundaboutParameters::profile(Profile::Default).speed_mps;
    let soonest_s = (window.way_m - 6.0) / fastest_mps;
    assert!(window.begin_s > soonest_s, "{window:?}");
}

#[test]
fn nothing_is_said_without_a_map_or_far_from_it() {
    let mut none = Watcher::new(&RoundaboutParameters::profile(Profile::Default));
    none.watch(&situation(&[]));
    assert_eq!(none.advice(), None);
    let mut watcher = watcher();
    let mut far = situation(&[]);
    far.vehicle = Some(Pose {
        position_m: [0.0, 400.0, 0.0],
        yaw_rad: 0.0,
    });
    watcher.watch(&far);
    assert_eq!(watcher.advice(), None);
}

/// The map lies where its origin says, whatever the local frame lies around.
#[test]
fn a_map_on_the_earth_follows_the_local_frame() {
    let roads = scenario::find("roundabout-traffic")
        .unwrap()
        .roads()
        .unwrap();
    let origin = roads.origin.unwrap().place;
    let mut watcher = watcher();
    let mut there = situation(&[]);
    there.reference = Some(Geodetic {
        latitude_deg: origin.latitude_deg - 0.0001,
        ..origin
    });
    there.vehicle = Some(Pose {
        position_m: [0.0, 11.0, 0.0],
        yaw_rad: PI / 2.0,
    });
    watcher.watch(&there);
    let [x, y] = watcher.advice().unwrap().centre_m;
    assert!((x - CENTRE_M[0]).abs() < 0.01, "{x}");
    // A ten thousandth of a degree of latitude is 11.1 m.
    assert!((y - CENTRE_M[1] - 11.14).abs() < 0.02, "{y}");
    assert!(watcher.advice().unwrap().own_arm.is_some());
}

#[test]
fn a_vehicle_on_its_way_has_states() {
    let mut watcher = watcher();
    for (y, speed_mps, yaw_deg, expected) in [
        (-25.0, 8.0, 90.0, State::Approaching),
        (-5.0, 8.0, 90.0, State::Braking),
        (12.0, 5.0, 0.0, State::Circling),
    ] {
        let mut at = situation(&[]);
        at.vehicle = Some(Pose {
            position_m: [0.0, y, 0.0],
            yaw_rad: f64::to_radians(yaw_deg),
        });
        at.vehicle_speed_mps = speed_mps;
        watcher.watch(&at);
        assert_eq!(watcher.advice().unwrap().state, expected, "{y}");
    }
}

/// He may go on at any time.
#[test]
fn who_stands_on_the_circle_is_waited_for() {
    let mut watcher = watcher();
    let mut stands = round(Class::Car, ROAD_M, 255.0, 0.0);
    stands.yaw_rate_radps = 0.0;
    watcher.watch(&situation(&[stands]));
    let arm = own_arm(&watcher);
    assert_eq!(arm.entry.hindrance, Some(Hindrance::RoadUser(7)), "{arm:?}");
}

#[test]
fn who_stands_on_the_own_way_in_is_in_the_way() {
    let mut watcher = watcher();
    let mut ahead = round(Class::Pedestrian, ROAD_M, 0.0, 0.0);
    ahead.centre_m = [0.2, 4.6, 0.7];
    watcher.watch(&situation(std::slice::from_ref(&ahead)));
    assert_eq!(
        own_arm(&watcher).entry.hindrance,
        Some(Hindrance::RoadUser(7))
    );
    // Beside the lane he is in nobody's way.
    ahead.centre_m = [6.0, 0.0, 0.7];
    watcher.forget();
    watcher.watch(&situation(&[ahead]));
    assert!(own_arm(&watcher).entry.may_go);
}

/// Past the ends of other ways in.
#[test]
fn who_is_on_the_circle_is_at_no_arm() {
    let mut watcher = watcher();
    for angle_deg in (-60..250).step_by(10) {
        let at = round(Class::Car, ROAD_M, f64::from(angle_deg), 6.0);
        let mut circling = situation(&[]);
        circling.vehicle = Some(Pose {
            position_m: at.centre_m,
            yaw_rad: at.yaw_rad,
        });
        watcher.watch(&circling);
        let advice = watcher.advice().unwrap();
        assert_eq!(
            (advice.state, advice.own_arm),
            (State::Circling, None),
            "{angle_deg}"
        );
    }
}
