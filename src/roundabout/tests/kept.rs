//! Gaps that have been announced.

use super::super::gap::{Asked, LACKS_S, User, windows};
use super::super::on_lane::{NEW_S, NEW_SLOW_S};
use super::*;

/// What is asked of the way in of a site's first arm.
fn asked(site: &Site, is_seen: bool, is_announced: bool) -> Asked<'_> {
    let entry = &site.arms[0].entries[0];
    Asked {
        site,
        arm: 0,
        at_exit: false,
        conflicts: &entry.conflicts,
        width_m: entry.width_m,
        stop_m: 0.0,
        road_mps: 8.33,
        is_seen,
        is_announced,
    }
}

/// From when to when somebody may be on that way who has been seen for so long.
fn window_s(user: &Object, known_s: f64, is_announced: bool) -> [f64; 2] {
    let mut watcher = watcher();
    watcher.watch(&situation(std::slice::from_ref(user)));
    let mut on = watcher.lanes[0][0];
    on.known_s = known_s;
    let user = User {
        object: user,
        lanes: &[on],
    };
    let mut found = vec![];
    windows(
        &asked(&watcher.sites[0], true, is_announced),
        &user,
        &mut found,
    );
    [found[0].begin_s, found[0].end_s]
}

fn begin_s(user: &Object, known_s: f64, is_announced: bool) -> f64 {
    window_s(user, known_s, is_announced)[0]
}

#[test]
fn a_gap_opens_with_caution_where_road_users_are_seen_and_stays_below_the_margin() {
    let mut watcher = watcher();
    watcher.watch(&situation(&[]));
    assert!(own_arm(&watcher).entry.may_go);
    let site = &watcher.sites[0];
    assert_eq!(asked(site, false, false).cautions_s(), [0.0; 2]);
    let [before_s, behind_s] = asked(site, true, false).cautions_s();
    assert!(before_s > behind_s && behind_s > 0.0);
    assert_eq!(asked(site, true, true).cautions_s(), [-LACKS_S; 2]);
    assert!(watcher.is_announced(1, false));
    watcher.forget();
    assert!(!watcher.is_announced(1, false));
}

#[test]
fn what_may_be_and_is_not_likely_takes_back_no_gap_that_has_been_announced() {
    let mut newcomer = round(Class::Car, ROAD_M, 60.0, 5.0);
    newcomer.speed_deviation_mps = 1.5;
    let [opens_s, stays_s] =
        [false, true].map(|is_announced| begin_s(&newcomer, 0.5, is_announced));
    assert!(stays_s > 1.3 * opens_s, "{opens_s} {stays_s}");
    // Whose speed is known comes as early as he does.
    newcomer.speed_deviation_mps = 0.01;
    newcomer.position_deviation_m = [0.01; 2];
    let [opens_s, stays_s] =
        [false, true].map(|is_announced| begin_s(&newcomer, 5.0, is_announced));
    assert!((stays_s - opens_s).abs() < 0.02, "{opens_s} {stays_s}");
}

#[test]
fn who_is_beside_the_road_is_known_sooner() {
    let known_s = 0.5 * (NEW_S + NEW_SLOW_S);
    let is_new = |class, radius_m, known_s| {
        let mut user = round(class, radius_m, 150.0, 3.0);
        user.speed_deviation_mps = 0.7;
        begin_s(&user, known_s, false) < begin_s(&user, 5.0, false) - 0.2
    };
    assert!(is_new(Class::Car, ROAD_M, known_s));
    assert!(!is_new(Class::Cyclist, BIKEWAY_M, known_s));
    assert!(is_new(Class::Cyclist, BIKEWAY_M, 0.5 * NEW_SLOW_S));
}

#[test]
fn beside_the_road_nobody_comes_earlier_because_his_speed_is_less_known() {
    let earlier_s = |class, radius_m| {
        let begin_s = |deviation_mps| {
            let mut user = round(class, radius_m, 150.0, 4.0);
            user.speed_deviation_mps = deviation_mps;
            begin_s(&user, 5.0, false)
        };
        begin_s(0.1) - begin_s(0.9)
    };
    assert!(earlier_s(Class::Car, ROAD_M) > 0.1);
    assert_eq!(earlier_s(Class::Cyclist, BIKEWAY_M), 0.0);
}

#[test]
fn a_cyclist_of_whom_little_is_seen_is_gone_as_late_as_a_bicycle_is_long() {
    let mut user = round(Class::Cyclist, BIKEWAY_M, 210.0, 4.0);
    let [begins, ends] = [0, 1].map(|end| {
        [0.4, 1.6].map(|length_m| {
            user.length_m = length_m;
            window_s(&user, 5.0, false)[end]
        })
    });
    assert_eq!(ends[0], ends[1]);
    assert!(begins[0] > begins[1] + 0.1, "{begins:?}");
}
