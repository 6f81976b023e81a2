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

/// What is told of him first may be off.
#[test]
fn who_is_listed_again_with_his_id_is_no_newcomer_unless_he_was_away_for_long() {
    let fast = round(Class::Car, ROAD_M, 180.0, 6.0);
    let slow = Object {
        speed_mps: 3.0,
        ..fast.clone()
    };
    let again = |away_tenths: i64| {
        let mut watcher = known(std::slice::from_ref(&fast));
        for tenth in 0..=away_tenths {
            let listed = usize::from(tenth == away_tenths);
            watcher.watch(&Situation {
                time: Time::from_micros(NOW.micros() + 100_000 * tenth),
                ..situation(&std::slice::from_ref(&slow)[..listed])
            });
        }
        watcher.advice().unwrap().users[0].on
    };
    let (soon, late) = (again(20), again(60));
    assert!(soon.mean_speed_mps > 5.0 && soon.known_s > 1.5, "{soon:?}");
    assert!(late.mean_speed_mps < 3.5 && late.known_s < 0.2, "{late:?}");
}
