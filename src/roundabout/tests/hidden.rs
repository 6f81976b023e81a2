use super::*;

/// Where he goes straight on is not where he is.
#[test]
fn who_is_hidden_goes_on_along_his_lane() {
    // Along the northern arm's way in, which leads to the circle in a bend.
    let mut comes = round(Class::Car, ROAD_M, 90.0, 7.0);
    comes.centre_m = [CENTRE_M[0] - 1.75, CENTRE_M[1] + 25.0, 0.7];
    (comes.yaw_rad, comes.yaw_rate_radps) = (-PI / 2.0, 0.0);
    let mut watcher = known(std::slice::from_ref(&comes));
    let place = |watcher: &Watcher| watcher.advice().unwrap().users[0].on.place;
    assert!(matches!(place(&watcher), Place::Entry(..)));
    comes.measured = false;
    let mut hidden = |tenths: i64| {
        comes.centre_m[1] -= 0.7;
        watcher.watch(&Situation {
            time: Time::from_micros(NOW.micros() + 100_000 * tenths),
            ..situation(std::slice::from_ref(&comes))
        });
        watcher.advice().unwrap().users[0].on
    };
    let before = hidden(0);
    let after = hidden(1);
    assert!(
        (after.along_m - before.along_m - 0.7).abs() < 0.01,
        "{after:?}"
    );
    // Three seconds later straight on would have led across the circle.
    let on = (2..30).map(&mut hidden).last().unwrap();
    assert_eq!(on.place, Place::Ring(0));
    assert!(on.probability > 0.9, "{on:?}");
}

#[test]
fn who_is_hidden_goes_round_as_one_drives_there() {
    let comes = round(Class::Car, ROAD_M, 90.0, 7.0);
    let mut watcher = known(std::slice::from_ref(&comes));
    let on = watcher.advice().unwrap().users[0].on;
    let site = &mut watcher.sites[0];
    let counter_clockwise_m = on.moved_on(site, 2.0).along_m;
    site.is_clockwise = true;
    let clockwise_m = on.moved_on(site, 2.0).along_m;
    assert_eq!(
        [counter_clockwise_m - on.along_m, clockwise_m - on.along_m],
        [2.0, -2.0]
    );
}
