use super::*;
use crate::cloud::sensor::VLP16;
use crate::cloud::tests::scan_of;
use crate::parameter::Profile;

/// Centimetres to a plane at `height_m`, tilted by `tilt_deg` towards forward.
fn tilted_road(height_m: f64, tilt_deg: f64) -> Scan {
    scan_of(1800, |column, layer| {
        let azimuth = (column as f64 * 0.2).to_radians();
        let elevation = VLP16.elevation_deg[layer].to_radians();
        let (sine, cosine) = tilt_deg.to_radians().sin_cos();
        // The ray's slope towards the plane's normal.
        let descent = -(elevation.sin() * cosine + elevation.cos() * azimuth.cos() * sine);
        let wall = column % 180 < 30 && layer > 4;
        let range = if wall { 8.0 } else { height_m / descent };
        if (1.0..100.0).contains(&range) {
            (range * 100.0).round() as u16
        } else {
            0
        }
    })
}

fn process(scan: &Scan, profile: Profile) -> GroundReport {
    Ground::new(&GroundParameters::profile(profile)).process(scan, &[])
}

#[test]
fn height_and_tilt_are_found_whatever_the_vehicle() {
    for (height_m, tilt_deg) in [(0.8, 0.0), (1.6, 3.0), (2.05, -2.0), (3.2, 5.0)] {
        let report = process(&tilted_road(height_m, tilt_deg), Profile::Default);
        assert_eq!(report.origin, Origin::Found);
        assert!(
            (report.plane.height_m() - height_m).abs() < 0.03,
            "{report:?}"
        );
        assert!((report.plane.tilt_rad().to_degrees() - tilt_deg.abs()).abs() < 0.3);
    }
}

#[test]
fn the_thesis_gate_holds_for_one_car_only() {
    assert_eq!(
        process(&tilted_road(2.05, 0.0), Profile::Thesis).origin,
        Origin::Found
    );
    let report = process(&tilted_road(1.6, 0.0), Profile::Thesis);
    assert_eq!(report.origin, Origin::Fallback);
    assert_eq!(report.plane.height_m(), 2.05);
}

#[test]
fn the_last_good_plane_is_held_when_none_is_plausible() {
    let mut ground = Ground::new(&GroundParameters::profile(Profile::Default));
    let found = ground.process(&tilted_road(1.6, 0.0), &[]);
    let held = ground.process(&scan_of(1800, |_, _| 0), &[]);
    assert_eq!(held.origin, Origin::Held);
    assert_eq!(held.plane, found.plane);
}

#[test]
fn a_nod_is_followed_and_a_leap_is_not_until_patience_ends() {
    let mut ground = Ground::new(&GroundParameters::profile(Profile::Default));
    ground.process(&tilted_road(1.6, 0.0), &[]);
    assert_eq!(
        ground.process(&tilted_road(1.65, 2.0), &[]).origin,
        Origin::Found
    );
    let leap = tilted_road(2.6, 2.0);
    let origins: Vec<_> = (0..11).map(|_| ground.process(&leap, &[]).origin).collect();
    assert_eq!(origins[..10], [Origin::Held; 10]);
    assert_eq!(origins[10], Origin::Found);
}

#[test]
fn road_is_marked_and_walls_are_not() {
    let scan = tilted_road(1.6, 2.0);
    let mut ground = Ground::new(&GroundParameters::profile(Profile::Default));
    let report = ground.process(&scan, &[]);
    assert_eq!(
        report.points,
        ground.mask().iter().filter(|mark| **mark).count()
    );
    assert!(ground.mask()[scan.index(100, 2)]);
    assert!(!ground.mask()[scan.index(10, 9)]);
    // No return is no ground.
    assert!(!ground.mask()[scan.index(100, 15)]);
}

#[test]
fn the_foot_of_a_wall_is_no_ground_and_the_road_before_it_is() {
    // Layer 2 meets the wall 8 cm above the ground.
    let wall_m = (1.8 - 0.08) / VLP16.elevation_deg[2].to_radians().tan().abs();
    let scan = scan_of(1800, |column, layer| {
        let elevation = VLP16.elevation_deg[layer].to_radians();
        let road_m = -1.8 / elevation.tan();
        let is_wall = column < 200 && !(0.0..wall_m).contains(&road_m);
        let distance_m = if is_wall { wall_m } else { road_m };
        if (1.0..100.0).contains(&distance_m) {
            (100.0 * distance_m / elevation.cos()).round() as u16
        } else {
            0
        }
    });
    let mut ground = Ground::new(&GroundParameters::profile(Profile::Default));
    ground.process(&scan, &[]);
    assert!(!ground.mask()[scan.index(100, 2)]);
    assert!(ground.mask()[scan.index(100, 1)]);
    assert!(ground.mask()[scan.index(900, 2)]);
}

#[test]
fn a_bumper_where_a_vehicle_is_expected_is_no_ground() {
    // 12 cm above the road, 20 m ahead, and nothing above it.
    let bumper_m = (1.8 - 0.12) / VLP16.elevation_deg[5].to_radians().tan().abs();
    let scan = scan_of(1800, |column, layer| {
        let elevation = VLP16.elevation_deg[layer].to_radians();
        let is_bumper = layer == 5 && !(10..1790).contains(&column);
        let distance_m = if is_bumper {
            bumper_m
        } else {
            -1.8 / elevation.tan()
        };
        if (1.0..100.0).contains(&distance_m) {
            (100.0 * distance_m / elevation.cos()).round() as u16
        } else {
            0
        }
    });
    let car = Rectangle {
        centre_m: [0.0, bumper_m + 1.5],
        yaw_rad: std::f64::consts::FRAC_PI_2,
        length_m: 4.0,
        width_m: 1.8,
    };
    let mut ground = Ground::new(&GroundParameters::profile(Profile::Default));
    let bumper = scan.index(5, 5);
    ground.process(&scan, &[]);
    assert!(ground.mask()[bumper]);
    ground.process(&scan, &[car]);
    assert!(!ground.mask()[bumper]);
    assert!(ground.mask()[scan.index(900, 5)]);
}

#[test]
fn the_same_seed_gives_the_same_plane() {
    let scan = tilted_road(1.9, 1.0);
    assert_eq!(
        process(&scan, Profile::Default),
        process(&scan, Profile::Default)
    );
}
