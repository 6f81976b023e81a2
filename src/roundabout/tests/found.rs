use super::*;
use crate::simulate::path::Path;

/// Cars from the south to the north and to the west, one after the other, and nobody else.
fn drive_past(watcher: &mut Watcher, centre_m: [f64; 2]) {
    for (id, turn_deg) in [(1, 180.0), (2, 250.0), (3, 180.0)] {
        for step in 0..60 {
            let angle_deg = -90.0 + turn_deg * f64::from(step) / 60.0;
            let mut car = round(Class::Car, ROAD_M, angle_deg, 6.0);
            car.id = id;
            for axis in 0..2 {
                car.centre_m[axis] += centre_m[axis] - CENTRE_M[axis];
            }
            watcher.watch(&situation(&[car]));
        }
    }
    watcher.watch(&situation(&[]));
}

#[test]
fn who_drives_round_makes_a_roundabout() {
    let mut watcher = Watcher::new(&RoundaboutParameters::profile(Profile::Default));
    drive_past(&mut watcher, CENTRE_M);
    let [found] = watcher.found() else {
        panic!("{:?}", watcher.found());
    };
    let ring = found.roundabout.rings[0];
    assert!((ring.circle.radius_m - ROAD_M).abs() < 0.1, "{ring:?}");
    // As is built with this radius.
    assert!((ring.width_m - 8.0).abs() < 0.1, "{ring:?}");
    assert!(
        (0.6..0.95).contains(&found.confidence),
        "{}",
        found.confidence
    );
    let advice = watcher.advice().unwrap();
    assert_eq!(advice.confidence, found.confidence);
    let [x, y] = [0, 1].map(|axis| advice.centre_m[axis] - CENTRE_M[axis]);
    assert!(x.hypot(y) < 0.1, "{advice:?}");
}

#[test]
fn where_one_drives_on_the_left_it_is_driven_round_clockwise() {
    let mut watcher = Watcher::new(&RoundaboutParameters::profile(Profile::Default));
    for (id, turn_deg) in [(1, 180.0), (2, 250.0), (3, 180.0)] {
        for step in 0..60 {
            let angle_deg = -90.0 + turn_deg * f64::from(step) / 60.0;
            let mut car = round(Class::Car, ROAD_M, angle_deg, 6.0);
            car.id = id;
            // As in a mirror.
            car.centre_m[0] = 2.0 * CENTRE_M[0] - car.centre_m[0];
            car.yaw_rad = crate::ego::wrapped_rad(PI - car.yaw_rad);
            car.yaw_rate_radps = -car.yaw_rate_radps;
            watcher.watch(&situation(&[car]));
        }
    }
    watcher.watch(&situation(&[]));
    let [found] = watcher.found() else {
        panic!("{:?}", watcher.found());
    };
    assert!(found.roundabout.is_clockwise);
    assert!((found.roundabout.rings[0].circle.radius_m - ROAD_M).abs() < 0.1);
}

#[test]
fn what_a_map_knows_is_not_found_again() {
    let mut watcher = watcher();
    drive_past(&mut watcher, CENTRE_M);
    assert!(watcher.found().is_empty(), "{:?}", watcher.found());
    assert_eq!(watcher.advice().unwrap().confidence, 1.0);
    // Nor is it there twice where the map comes later.
    let mut watcher = Watcher::new(&RoundaboutParameters::profile(Profile::Default));
    drive_past(&mut watcher, CENTRE_M);
    assert!(watcher.advice().unwrap().confidence < 1.0);
    let roads = scenario::find("roundabout-traffic").unwrap().roads();
    watcher.take_map(&roads.unwrap());
    watcher.watch(&situation(&[]));
    assert_eq!(watcher.advice().unwrap().confidence, 1.0);
    assert_eq!(watcher.sites.len(), 1);
}

#[test]
fn what_was_found_in_another_frame_is_forgotten() {
    let mut watcher = Watcher::new(&RoundaboutParameters::profile(Profile::Default));
    drive_past(&mut watcher, CENTRE_M);
    assert!(watcher.advice().is_some());
    let nobody = situation(&[]);
    watcher.watch(&Situation { epoch: 1, ..nobody });
    assert!(watcher.found().is_empty() && watcher.advice().is_none());
}

/// Each corner has a middle of its own.
#[test]
fn a_block_with_four_corners_is_none() {
    let mut watcher = Watcher::new(&RoundaboutParameters::profile(Profile::Default));
    for id in 0..4 {
        let path = Path::from([0.0, -30.0], 0.0)
            .line(10.0)
            .arc(8.0, 90.0)
            .line(12.0)
            .arc(8.0, 90.0)
            .line(12.0)
            .arc(8.0, 90.0)
            .line(12.0)
            .arc(8.0, 90.0)
            .timed(&[(0.0, 6.0)]);
        for step in 0..170 {
            let at = path.at(0.1 * f64::from(step));
            let mut car = round(Class::Car, ROAD_M, 0.0, 6.0);
            car.id = id;
            car.centre_m = [at.position_m[0], at.position_m[1], 0.7];
            car.yaw_rad = at.yaw_rad;
            watcher.watch(&situation(&[car]));
        }
    }
    assert!(watcher.found().is_empty(), "{:?}", watcher.found());
}
