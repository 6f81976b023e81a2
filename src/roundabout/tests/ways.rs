//! Where somebody comes in and leaves.

use super::*;
use crate::roundabout::lanes::Belief;
use crate::roundabout::leaving::still_there;

/// A car on the western arm's way in, so far before its end.
fn coming(left_m: f64, speed_mps: f64, watcher: &Watcher) -> Object {
    let site = &watcher.sites[0];
    let western = site.arms.iter().max_by(|a, b| {
        let away = |arm: &site::SiteArm| arm.bearing_rad.abs();
        away(a).total_cmp(&away(b))
    });
    let way = &western.unwrap().entries[0].way;
    let ([x, y], yaw_rad) = way.at(way.length_m() - left_m);
    Object {
        centre_m: [x, y, 0.7],
        yaw_rad,
        yaw_rate_radps: 0.0,
        ..round(Class::Car, ROAD_M, 0.0, speed_mps)
    }
}

/// One that has watched a car come.
fn who_saw(left_m: f64, speed_mps: f64) -> Watcher {
    who_saw_at(watcher(), left_m, speed_mps)
}

fn who_saw_at(mut watcher: Watcher, left_m: f64, speed_mps: f64) -> Watcher {
    watcher.watch(&situation(&[]));
    let object = coming(left_m, speed_mps, &watcher);
    for micros in [100_000, 1_200_000, 1_300_000] {
        watcher.watch(&Situation {
            time: Time::from_micros(NOW.micros() + micros),
            ..situation(std::slice::from_ref(&object))
        });
    }
    watcher
}

/// The only road user's window at the southern arm's way in.
fn window(watcher: &Watcher) -> Window {
    let advice = watcher.advice().unwrap();
    let own = advice.own_arm.unwrap();
    let mut windows = advice.windows.iter();
    let at_own = windows.find(|window| window.arm == own && !window.at_exit);
    *at_own.unwrap_or_else(|| panic!("{:?}", advice.windows))
}

#[test]
fn who_comes_in_fast_comes_as_late_as_the_bend_lets_him() {
    let expected_s = |speed_mps| window(&who_saw(30.0, speed_mps)).expected_s;
    let (slow_s, fast_s) = (expected_s(6.0), expected_s(12.0));
    // 12 m of the corner and some of the circle take as long for both.
    let way_m = window(&who_saw(30.0, 6.0)).way_m;
    assert!((way_m / 6.0 - slow_s).abs() < 0.5, "{slow_s}");
    assert!(
        fast_s > 0.7 * slow_s && fast_s < slow_s,
        "{fast_s} {slow_s}"
    );
}

#[test]
fn who_has_just_come_into_view_slows_down_before_the_bend_too() {
    let mut watcher = known(&[]);
    let object = coming(40.0, 0.0, &watcher);
    watcher.watch(&situation(std::slice::from_ref(&object)));
    let window = window(&watcher);
    let road_mps = RoundaboutParameters::profile(Profile::Default).speed_mps;
    let soonest_s = (window.way_m - 5.0) / road_mps;
    assert!(
        window.begin_s > soonest_s + 0.2 && window.begin_s < soonest_s + 1.5,
        "{window:?}"
    );
}

#[test]
fn a_newcomer_on_a_way_in_is_no_faster_than_the_road_allows_unless_he_is_seen_to_be() {
    let begin_s = |speed_mps: f64, deviation_mps: f64| {
        let mut watcher = known(&[]);
        let mut object = coming(40.0, speed_mps, &watcher);
        object.speed_deviation_mps = deviation_mps;
        watcher.watch(&situation(std::slice::from_ref(&object)));
        window(&watcher).begin_s
    };
    let road_mps = RoundaboutParameters::profile(Profile::Default).speed_mps;
    assert!(begin_s(6.0, 3.0) > begin_s(road_mps, 0.0) - 0.5);
    assert!(begin_s(road_mps + 4.0, 0.0) < begin_s(6.0, 3.0) - 0.2);
}

#[test]
fn who_has_most_of_a_small_circle_before_him_comes() {
    let mut watcher = watcher_at("mini-traffic");
    let centre_m = [-1.75, 16.0];
    let mut car = round(Class::Car, 6.1, 60.0, 5.0);
    for axis in 0..2 {
        car.centre_m[axis] += centre_m[axis] - CENTRE_M[axis];
    }
    watcher.watch(&situation(&[car]));
    // Three quarters of it.
    let window = window(&watcher);
    assert!((27.0..30.0).contains(&window.way_m), "{window:?}");
}

#[test]
fn nobody_drives_round_the_other_way() {
    let mut watcher = watcher();
    let mut car = round(Class::Car, ROAD_M, 180.0, 6.0);
    car.yaw_rad = crate::ego::wrapped_rad(car.yaw_rad + 2.0);
    car.yaw_deviation_rad = 1.5;
    watcher.watch(&situation(&[car]));
    let window = window(&watcher);
    assert!((10.0..30.0).contains(&window.way_m), "{window:?}");
}

#[test]
fn who_came_in_is_remembered_on_the_circle() {
    let mut watcher = who_saw(3.0, 6.0);
    let arm = match watcher.lanes[0][0].place {
        Place::Entry(arm, _) => arm,
        other => panic!("{other:?}"),
    };
    let on_circle = round(Class::Car, ROAD_M, 250.0, 6.0);
    for micros in [1_400_000, 1_500_000, 1_600_000] {
        watcher.watch(&Situation {
            time: Time::from_micros(NOW.micros() + micros),
            ..situation(std::slice::from_ref(&on_circle))
        });
    }
    let on = watcher.lanes[0][0];
    assert!(matches!(on.place, Place::Ring(_)), "{on:?}");
    assert_eq!(on.came_in_by, Some(arm));
}

#[test]
fn nobody_is_likely_to_pass_the_last_exit_before_his_own() {
    let watcher = known(&[]);
    let site = &watcher.sites[0];
    let angle_rad = site.arms[0].entries[0].mouth_rad;
    let quarters = |count: f64| still_there(site, angle_rad, count * PI / 2.0, Some(0));
    let unknown = |count: f64| still_there(site, angle_rad, count * PI / 2.0, None);
    // A quarter of the way round is the first exit, and so on; as many leave by each.
    let shares = [1.0, 2.0, 3.0, 4.0].map(quarters);
    let leave = [
        1.0 - shares[0],
        shares[0] - shares[1],
        shares[1] - shares[2],
    ];
    assert!((leave[0] - leave[1]).abs() < 1e-9 && (leave[1] - leave[2]).abs() < 1e-9);
    assert!(
        shares[2] < 0.1 && shares[3] < shares[2] && shares[3] > 0.03,
        "{shares:?}"
    );
    // Of somebody whose way in was not seen, each exit is as good as another.
    assert!((unknown(2.0) - unknown(1.0) * unknown(1.0)).abs() < 1e-9);
}

#[test]
fn who_is_on_the_inner_lane_may_leave_where_the_mouth_of_the_exit_begins() {
    const INNER_M: f64 = 15.0;
    let mut watcher = who_saw_at(watcher_at("two-lane-roundabout"), 3.0, 8.0);
    // He has come in from the west and is 2 m past where the outer lane's exit to the north begins.
    let northern = |arm: &site::SiteArm| (arm.bearing_rad - PI / 2.0).abs() < 0.1;
    let site = &watcher.sites[0];
    let number = site.arms.iter().position(northern).unwrap();
    let angle_rad = site.arms[number].exits[0].mouth_rad + 2.0 / INNER_M;
    let (sine, cosine) = angle_rad.sin_cos();
    let on_inner = Object {
        centre_m: [
            site.centre_m[0] + INNER_M * cosine,
            site.centre_m[1] + INNER_M * sine,
            0.7,
        ],
        ..round(Class::Car, INNER_M, angle_rad.to_degrees(), 8.0)
    };
    for micros in [1_400_000, 1_500_000, 1_600_000] {
        watcher.watch(&Situation {
            time: Time::from_micros(NOW.micros() + micros),
            ..situation(std::slice::from_ref(&on_inner))
        });
    }
    assert_eq!(watcher.lanes[0][0].place, Place::Ring(0));
    let windows = watcher.advice().unwrap().windows.iter();
    let at_arm = |window: &&Window| window.arm == number && !window.at_exit;
    let probability: f64 = windows
        .filter(at_arm)
        .map(|window| window.probability)
        .sum();
    assert!((0.01..0.5).contains(&probability), "{probability}");
}

#[test]
fn who_gathers_speed_before_the_bend_does_not_brake_for_it() {
    const TOLD_LATE_S: f64 = 0.5;
    let mut watcher = watcher();
    watcher.watch(&situation(&[]));
    // Speed now and in the mean, after three seconds in which he is told to become faster by so much.
    let speeds_mps = |faster_mps2: f64| {
        let (mut belief, mut found) = (Belief::default(), vec![]);
        for revolution in -30..=0 {
            let told_mps = 8.0 + faster_mps2 * 0.1 * f64::from(revolution);
            let object = coming(20.0, told_mps, &watcher);
            let site = &watcher.sites[0];
            belief.update(site, &object, [0.1, TOLD_LATE_S], &mut vec![], &mut found);
        }
        [found[0].speed_mps, found[0].mean_speed_mps]
    };
    // As hard as drivers brake, though it was told late.
    let [now_mps, mean_mps] = speeds_mps(0.0);
    assert!((8.0 - now_mps - TOLD_LATE_S * 1.3).abs() < 0.2, "{now_mps}");
    assert!((now_mps - mean_mps).abs() < 0.2, "{mean_mps}");
    let [now_mps, mean_mps] = speeds_mps(0.4);
    assert_eq!(now_mps, 8.0);
    assert!((7.5..7.9).contains(&mean_mps), "{mean_mps}");
}
