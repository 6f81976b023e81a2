use super::*;
use crate::cloud::tests::scan_of;
use crate::parameter::Profile;

/// What a sensor sees for so many revolutions, going so far in each.
fn learned(
    revolutions: usize,
    way_m: f64,
    distance_cm: impl Fn(usize, usize, usize) -> u16,
) -> OwnVehicle {
    let parameters = CloudParameters::profile(Profile::Default);
    let mut own = OwnVehicle::default();
    for revolution in 0..revolutions {
        let scan = scan_of(1800, |column, layer| distance_cm(revolution, column, layer));
        let heights_m: Vec<f32> = scan.z_m().iter().map(|z| z + 1.9).collect();
        own.learn(&scan, &heights_m, way_m, &parameters);
    }
    own
}

#[test]
fn a_mast_behind_the_sensor_is_the_own_vehicle_within_two_seconds() {
    let mast = |_, column: usize, layer: usize| {
        if (890..910).contains(&column) && layer < 4 {
            160
        } else {
            1500
        }
    };
    let own = learned(20, 0.0, mast);
    let extent = own.extent().unwrap();
    assert!(
        extent.low_m[1] < -1.4 && extent.high_m[1] < -1.4,
        "{extent:?}"
    );
    assert!(own.holds(180, 2, 1.62) && !own.holds(180, 2, 2.5) && !own.holds(90, 2, 15.0));
}

#[test]
fn whoever_stirs_beside_the_vehicle_is_not() {
    let walker = |revolution: usize, column: usize, layer: usize| {
        let first = 400 + 6 * revolution;
        let stands = (first..first + 40).contains(&column) && layer < 9;
        if stands {
            180 + 3 * (revolution % 8) as u16
        } else {
            1500
        }
    };
    assert_eq!(learned(40, 0.0, walker).extent(), None);
}

#[test]
fn a_wall_beside_the_way_is_not_however_long_it_keeps_its_distance() {
    let wall = |_, column: usize, _: usize| {
        let off = (column as f64 * 0.2 - 90.0).to_radians();
        if off.abs() < 1.3 {
            (180.0 / off.cos()) as u16
        } else {
            3000
        }
    };
    assert_eq!(learned(60, 0.5, wall).extent(), None);
}

#[test]
fn a_bonnet_farther_away_is_known_after_a_way_only() {
    let bonnet = |_, column: usize, layer: usize| {
        let is_ahead = !(60..1740).contains(&column);
        if is_ahead && layer < 3 { 300 } else { 1500 }
    };
    assert_eq!(learned(60, 0.0, bonnet).extent(), None);
    assert!(learned(60, 0.5, bonnet).extent().is_some());
}
