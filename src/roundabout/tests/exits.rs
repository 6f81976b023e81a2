use super::*;
use crate::roadmap::LaneKind;

/// On the circle, before the eastern arm's exit.
fn leaving(objects: &[Object]) -> Situation<'_> {
    let at = round(Class::Car, ROAD_M, 300.0, 6.0);
    Situation {
        vehicle: Some(Pose {
            position_m: at.centre_m,
            yaw_rad: at.yaw_rad,
        }),
        vehicle_speed_mps: 6.0,
        ..situation(objects)
    }
}

/// The arm to the east, where one leaves to the right.
fn eastern_exit(watcher: &Watcher) -> &Crossing {
    let arms = watcher.advice().unwrap().arms.iter();
    let eastern = arms.min_by(|a, b| a.bearing_rad.abs().total_cmp(&b.bearing_rad.abs()));
    &eastern.unwrap().exit
}

#[test]
fn one_may_leave_where_nobody_crosses() {
    let mut watcher = watcher();
    watcher.watch(&leaving(&[]));
    let exit = eastern_exit(&watcher);
    assert!(exit.may_go, "{exit:?}");
    // 4.5 m to where the bend out begins and 8 m to the cycle path, less the front and a metre.
    assert!((8.5..10.0).contains(&exit.stop_m), "{exit:?}");
    let [begin_s, end_s] = exit.own_window_s;
    assert!(
        (0.7..1.8).contains(&begin_s) && end_s > begin_s + 1.0,
        "{exit:?}"
    );
}

#[test]
fn one_waits_in_the_exit_for_a_cyclist() {
    let mut watcher = watcher();
    // He comes to the way out, 8 degrees north of east, in two seconds.
    let cyclist = round(Class::Cyclist, BIKEWAY_M, 340.0, 4.2);
    watcher.watch(&leaving(std::slice::from_ref(&cyclist)));
    let exit = eastern_exit(&watcher);
    assert_eq!(exit.hindrance, Some(Hindrance::RoadUser(7)), "{exit:?}");
    let windows = &watcher.advice().unwrap().windows;
    assert!(
        windows
            .iter()
            .any(|window| window.at_exit && window.kind == LaneKind::Bikeway)
    );
    // Past it, he is in nobody's way.
    watcher.forget();
    watcher.watch(&leaving(&[round(Class::Cyclist, BIKEWAY_M, 40.0, 4.2)]));
    assert!(
        eastern_exit(&watcher).may_go,
        "{:?}",
        eastern_exit(&watcher)
    );
}
