//! Gaps that have been announced.

use super::super::gap::{Asked, CAUTION_S, LACKS_S, User, windows};
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

/// When somebody may come to that way who has been seen for so long.
fn begin_s(user: &Object, known_s: f64, is_announced: bool) -> f64 {
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
    found[0].begin_s
}

#[test]
fn a_gap_opens_with_caution_where_road_users_are_seen_and_stays_below_the_margin() {
    let mut watcher = watcher();
    watcher.watch(&situation(&[]));
    assert!(own_arm(&watcher).entry.may_go);
    let site = &watcher.sites[0];
    assert_eq!(asked(site, false, false).caution_s(), 0.0);
    assert_eq!(asked(site, true, false).caution_s(), CAUTION_S);
    assert_eq!(asked(site, true, true).caution_s(), -LACKS_S);
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
