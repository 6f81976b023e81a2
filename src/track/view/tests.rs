use super::*;
use crate::cloud::tests::scan_of;
use crate::track::tests::spots_of;

#[test]
fn a_short_piece_of_the_side_of_what_drives_may_be_any_part_of_it() {
    // A metre of a car that stands across the line of sight, 33 m away.
    let scan = scan_of(1800, |column, layer| match column {
        5..14 if (6..8).contains(&layer) => 3300,
        _ => 0,
    });
    let spots = spots_of(&scan);
    let look = Look::at(&spots, &scan, Vector2::zeros());
    let view = View::of(&look, &spots, 0.0);
    let centre_x_m = |expected_x_m: f64, drives: bool| {
        let expected_m = Vector2::new(expected_x_m, 33.8);
        let (centre_m, noise) = view.centre([4.3, 1.8], [0.1; 2], expected_m, 0.0, drives);
        (centre_m.x, libm::sqrt(noise[(0, 0)]))
    };
    for expected_x_m in [0.0, 2.0] {
        let (x_m, deviation_m) = centre_x_m(expected_x_m, true);
        assert!((x_m - expected_x_m).abs() < 1e-9 && deviation_m > 1.0);
    }
    let (x_m, deviation_m) = centre_x_m(0.0, false);
    assert_eq!(x_m, centre_x_m(2.0, false).0);
    assert!(deviation_m < 0.3);
}

#[test]
fn a_car_may_go_on_beyond_the_end_of_its_side_that_is_seen() {
    // 3 m of a side, 20 m away, of which something nearer hides the right end.
    let scan = scan_of(1800, |column, layer| match column {
        0..43 if (5..8).contains(&layer) => 2000,
        43..60 if (3..12).contains(&layer) => 700,
        _ => 0,
    });
    let mut spots = spots_of(&scan);
    spots.retain(|spot| spot.at_m[1] > 15.0);
    let look = Look::at(&spots, &scan, Vector2::zeros());
    let centre_x_m = |yaw_rad: f64, expected_x_m: f64, drives: bool| {
        let view = View::of(&look, &spots, yaw_rad);
        let expected_m = Vector2::new(expected_x_m, 20.9);
        view.centre([4.3, 1.8], [0.1; 2], expected_m, 0.0, drives)
            .0
            .x
    };
    // Its left end is the rear, and then the front with the bonnet.
    for (yaw_rad, beyond_m) in [(0.0, 0.3), (std::f64::consts::PI, 1.2)] {
        let seen_x_m = centre_x_m(yaw_rad, 0.0, false);
        let expected_x_m = |more_m: f64| centre_x_m(yaw_rad, seen_x_m - more_m, true);
        assert!((expected_x_m(beyond_m) - (seen_x_m - beyond_m)).abs() < 1e-6);
        assert!(expected_x_m(beyond_m + 1.0) > seen_x_m - beyond_m - 0.2);
        assert!((expected_x_m(-0.5) - seen_x_m).abs() < 1e-6);
    }
}

#[test]
fn a_rider_of_whom_a_ray_is_seen_is_in_the_middle_of_the_bicycle() {
    // At the height of a chest, 40 m away and askew.
    let scan = scan_of(1800, |column, layer| match column {
        300..302 if layer == 7 => 4000,
        _ => 0,
    });
    let spots = spots_of(&scan);
    let look = Look::at(&spots, &scan, Vector2::zeros());
    let view = View::of(&look, &spots, 0.0);
    for off_m in [-0.6, 0.6] {
        let expected_m = look.middle_m + Vector2::new(off_m, 0.0);
        let (centre_m, noise) = view.centre([1.7, 0.6], [0.1; 2], expected_m, 0.0, false);
        let deviation_m = libm::sqrt(noise[(0, 0)]);
        assert!((centre_m.x - look.middle_m.x).abs() < 0.01);
        assert!(deviation_m < 0.5, "{deviation_m}");
    }
    // Beside what hides the rest it may be any part of the rider.
    let look = Look {
        is_cut: [true, false],
        ..look
    };
    let view = View::of(&look, &spots, 0.0);
    let (_, noise) = view.centre([1.7, 0.6], [0.1; 2], look.middle_m, 0.0, false);
    assert!(libm::sqrt(noise[(0, 0)]) > 0.55);
}

#[test]
fn the_middle_is_the_less_sure_the_farther_it_is_from_what_is_seen_askew() {
    // The rear of a car straight ahead, 20 m away.
    let scan = scan_of(1800, |column, layer| match column {
        0..26 if (5..8).contains(&layer) => 2000,
        _ => 0,
    });
    let spots = spots_of(&scan);
    let look = Look::at(&spots, &scan, Vector2::zeros());
    let view = View::of(&look, &spots, std::f64::consts::FRAC_PI_2);
    let across_m = |length_m: f64, yaw_variance: f64| {
        let expected_m = Vector2::new(0.9, 20.0 + 0.5 * length_m);
        let (_, noise) = view.centre([length_m, 1.8], [0.0; 2], expected_m, yaw_variance, true);
        libm::sqrt(noise[(0, 0)])
    };
    let sure_m = across_m(4.3, 0.0);
    assert!((across_m(8.0, 0.0) - sure_m).abs() < 1e-9);
    // 0.2 rad over half the length.
    let askew_m = libm::hypot(sure_m, 0.2 * 2.15);
    assert!((across_m(4.3, 0.04) - askew_m).abs() < 0.02);
    assert!(across_m(8.0, 0.04) > across_m(4.3, 0.04));
}

#[test]
fn what_is_seen_of_a_bus_above_the_belt_ends_where_the_bus_ends() {
    // The upper part of a rear, 25 m away.
    let scan = scan_of(1800, |column, layer| match column {
        0..28 if (7..9).contains(&layer) => 2500,
        _ => 0,
    });
    let spots = spots_of(&scan);
    let look = Look {
        is_upper: true,
        ..Look::at(&spots, &scan, Vector2::zeros())
    };
    let view = View::of(&look, &spots, std::f64::consts::FRAC_PI_2);
    let rear_m = |length_m: f64| {
        let expected_m = Vector2::new(1.2, 25.0 + 0.5 * length_m);
        let (centre_m, _) = view.centre([length_m, 2.5], [0.1; 2], expected_m, 0.0, true);
        centre_m.y - 0.5 * length_m
    };
    assert!((rear_m(12.0) - 25.0).abs() < 0.2, "{}", rear_m(12.0));
    assert!(rear_m(4.3) < 24.8, "{}", rear_m(4.3));
}

#[test]
fn a_cabin_lies_behind_the_middle_of_a_car_whose_front_is_known() {
    // The side of a cabin, 2.6 m of it, 40 m away, higher than bonnets.
    let scan = scan_of(1800, |column, layer| match column {
        0..19 if layer == 7 => 4000,
        _ => 0,
    });
    let spots = spots_of(&scan);
    let look = Look {
        floor_m: 1.2,
        is_upper: true,
        ..Look::at(&spots, &scan, Vector2::zeros())
    };
    let view = View::of(&look, &spots, 0.0);
    let ahead_m = |drives: bool| {
        let (centre_m, _) = view.centre([4.3, 1.8], [0.1; 2], look.middle_m, 0.0, drives);
        centre_m.x - look.middle_m.x
    };
    assert!(ahead_m(false).abs() < 0.1, "{}", ahead_m(false));
    assert!((0.3..0.6).contains(&ahead_m(true)));
}
