//! Poses from every service's messages: units, gaps, jumps, loss and return.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::f64::consts::{FRAC_PI_2, PI};

use kreisel::cloud::sensor::VLP16;
use kreisel::cloud::{
    ByteOrderSource, CloudParameters, Dialect, OwnVehicle, Revolution, Scan, Source,
};
use kreisel::ego::geodesy::{Geodetic, LocalFrame};
use kreisel::ego::{Ego, EgoParameters, Frame, HeadingUnit, Heard, PoseRefusal, Sweep};
use kreisel::parameter::Profile;
use kreisel::time::{Span, Time};
use kreisel::wire::Envelope;
use kreisel::wire::Message;
use kreisel::wire::envelope::Postmark;
use kreisel::wire::point_cloud::{ByteOrder, CompactPointCloud};
use kreisel::wire::pose::{
    ApplanixGroup1, GeodeticHeadingReading, GeodeticWgs84Reading, Geolocation, SimulationFrame,
};

const GOTHENBURG: Geodetic = Geodetic {
    latitude_deg: 57.7,
    longitude_deg: 11.9,
    altitude_m: 50.0,
};

fn at(seconds: f64) -> Time {
    Time::from_micros(1_700_000_000_000_000) + Span::from_seconds(seconds)
}

fn hear(ego: &mut Ego, seconds: f64, message: &impl Message) -> Heard {
    hear_from(ego, 0, seconds, message)
}

fn hear_from(ego: &mut Ego, sender_stamp: u32, seconds: f64, message: &impl Message) -> Heard {
    let mut frame = vec![];
    let postmark = Postmark {
        sent: at(seconds),
        sampled: at(seconds),
        sender_stamp,
    };
    postmark.put(&mut frame, message);
    let (envelope, _) = Envelope::from_datagram(&frame).unwrap();
    ego.hear(&envelope).unwrap()
}

/// Of one that knows poses alone.
fn parameters() -> EgoParameters {
    EgoParameters {
        odometry: false,
        ..EgoParameters::profile(Profile::Default)
    }
}

fn ego() -> Ego {
    Ego::new(&parameters())
}

/// A sweep of a tenth of a second in which nothing is seen.
fn sweep(ego: &mut Ego, end_s: f64) -> Sweep {
    ego.follow(&blind(end_s), &[])
}

fn blind(end_s: f64) -> Scan {
    const COLUMNS: usize = 1808;
    let mut scan = Scan::default();
    let revolution = Revolution {
        source: Source::Cloud(CompactPointCloud {
            layers: 16,
            distances: &[0; 32 * COLUMNS],
            ..CompactPointCloud::default()
        }),
        columns: COLUMNS,
        column_period_s: VLP16.column_period_s,
        sensor: &VLP16,
        dialect: Dialect {
            byte_order: ByteOrder::Big,
            byte_order_source: ByteOrderSource::Assumed,
            distance_mask: 0xffff,
            unit_m: 0.01,
            intensity_bits: 0,
        },
        start_deg: 0.0,
        step_deg: 360.0 / COLUMNS as f64,
        time: at(end_s),
        time_jumped: false,
    };
    let parameters = CloudParameters::profile(Profile::Default);
    scan.fill(&revolution, &OwnVehicle::default(), &parameters);
    scan
}

/// An Applanix fix east and north of the first one.
fn fix(east_m: f64, north_m: f64, heading_deg: f64) -> ApplanixGroup1 {
    let place = LocalFrame::around(GOTHENBURG).geodetic([east_m, north_m, 0.0]);
    ApplanixGroup1 {
        lat: place.latitude_deg,
        lon: place.longitude_deg,
        alt: place.altitude_m,
        heading: heading_deg,
        ..ApplanixGroup1::default()
    }
}

/// Place and heading in messages of their own.
fn hear_separately(ego: &mut Ego, seconds: f64, north_heading: f32) {
    let place = GeodeticWgs84Reading {
        latitude: GOTHENBURG.latitude_deg,
        longitude: GOTHENBURG.longitude_deg,
    };
    hear(ego, seconds, &place);
    hear(ego, seconds, &GeodeticHeadingReading { north_heading });
}

fn yaw_after(unit: HeadingUnit, headings: &[f32]) -> f64 {
    let mut ego = Ego::new(&EgoParameters {
        heading_unit: unit,
        ..parameters()
    });
    for (step, heading) in headings.iter().enumerate() {
        let seconds = 0.01 * step as f64;
        hear_separately(&mut ego, seconds, *heading);
    }
    sweep(&mut ego, 0.01 * (headings.len() - 1) as f64)
        .vehicle
        .unwrap()
        .yaw_rad
}

#[test]
fn headings_are_clockwise_from_north_in_degrees_or_radians() {
    let west_rad = PI;
    for headings in [[269.9f32, 270.0], [-1.5706, -1.570_796_4]] {
        let yaw_rad = yaw_after(HeadingUnit::Auto, &headings);
        assert!((yaw_rad.abs() - west_rad).abs() < 1e-3, "{yaw_rad}");
    }
    // A small number is either; the setting decides.
    let degrees = yaw_after(HeadingUnit::Degrees, &[1.5, 1.5]);
    assert!((degrees - (FRAC_PI_2 - 1.5f64.to_radians())).abs() < 1e-4);
    let radians = yaw_after(HeadingUnit::Radians, &[1.5, 1.5]);
    assert!((radians - (FRAC_PI_2 - 1.5)).abs() < 1e-4);
}

#[test]
fn places_lie_east_and_north_of_the_first_fix() {
    let mut ego = ego();
    hear(&mut ego, 0.0, &fix(0.0, 0.0, 90.0));
    hear(&mut ego, 0.1, &fix(1.0, 0.5, 90.0));
    let pose = sweep(&mut ego, 0.1).vehicle.unwrap();
    let [x, y, _] = pose.position_m;
    assert!((x - 1.0).abs() < 1e-3 && (y - 0.5).abs() < 1e-3, "{pose:?}");
    assert!(pose.yaw_rad.abs() < 1e-6);
}

#[test]
fn each_column_has_the_pose_of_its_own_time() {
    let mut ego = ego();
    for step in 0..=20 {
        let seconds = 0.01 * f64::from(step);
        hear(&mut ego, seconds, &fix(10.0 * seconds, 0.0, 90.0));
    }
    let sweep = sweep(&mut ego, 0.2);
    assert_eq!(sweep.frame, Frame::Earth);
    for (share, east_m) in [(0.0, 1.0), (0.25, 1.25), (1.0, 2.0)] {
        let [x, ..] = sweep.pose(share).position_m;
        assert!((x - east_m).abs() < 5e-3, "{share}: {x}");
    }
    let [east_mps, north_mps] = sweep.velocity_mps(0.1);
    assert!((east_mps - 10.0).abs() < 0.1 && north_mps.abs() < 0.1);
}

#[test]
fn poses_are_carried_on_to_a_limit_and_found_again() {
    let mut ego = ego();
    for step in 0..=10 {
        let seconds = 0.01 * f64::from(step);
        hear(&mut ego, seconds, &fix(10.0 * seconds, 0.0, 90.0));
    }
    let known = sweep(&mut ego, 0.1);
    let carried = sweep(&mut ego, 0.4);
    let [x, ..] = carried.vehicle.unwrap().position_m;
    assert!((x - 4.0).abs() < 0.05, "{x}");
    assert_eq!(carried.epoch, known.epoch);

    let lost = sweep(&mut ego, 0.9);
    assert_eq!((lost.frame, lost.vehicle), (Frame::Odometry, None));
    assert_ne!(lost.epoch, known.epoch);

    hear(&mut ego, 1.0, &fix(10.0, 0.0, 90.0));
    let found = sweep(&mut ego, 1.0);
    assert_eq!(found.frame, Frame::Earth);
    assert_ne!(found.epoch, lost.epoch);
}

#[test]
fn a_jump_begins_a_new_epoch_and_a_drive_does_not() {
    let mut ego = ego();
    for step in 0..100 {
        let seconds = 0.1 * f64::from(step);
        hear(&mut ego, seconds, &fix(14.0 * seconds, 0.0, 90.0));
    }
    let before = sweep(&mut ego, 9.9).epoch;
    assert_eq!(ego.report().jumps, 0);
    hear(&mut ego, 10.0, &fix(145.0, 0.0, 90.0));
    assert_ne!(sweep(&mut ego, 10.0).epoch, before);
    hear(&mut ego, 10.1, &fix(146.4, 0.0, 170.0));
    assert_eq!(ego.report().jumps, 2);
}

#[test]
fn the_most_trusted_source_is_used_and_a_simulation_keeps_its_own_frame() {
    let mut ego = ego();
    let frame = SimulationFrame {
        x: 3.0,
        y: 4.0,
        yaw: 0.5,
        ..SimulationFrame::default()
    };
    hear(&mut ego, 0.0, &frame);
    let simulated = sweep(&mut ego, 0.0);
    assert_eq!(simulated.frame, Frame::Simulation);
    assert_eq!(simulated.vehicle.unwrap().position_m, [3.0, 4.0, 0.0]);

    let geolocation = Geolocation {
        latitude: GOTHENBURG.latitude_deg,
        longitude: GOTHENBURG.longitude_deg,
        altitude: 50.0,
        heading: 0.0,
    };
    hear(&mut ego, 0.01, &geolocation);
    let fused = sweep(&mut ego, 0.01);
    assert_eq!(fused.frame, Frame::Earth);
    assert_ne!(fused.epoch, simulated.epoch);
}

#[test]
fn what_is_no_pose_on_the_earth_is_refused() {
    let mut ego = ego();
    let wild = [
        fix(0.0, 0.0, f64::NAN),
        ApplanixGroup1 {
            lat: 91.0,
            ..fix(0.0, 0.0, 0.0)
        },
        ApplanixGroup1 {
            lon: f64::INFINITY,
            ..fix(0.0, 0.0, 0.0)
        },
    ];
    for message in &wild {
        assert_eq!(
            hear(&mut ego, 0.0, message),
            Heard::Refused(PoseRefusal::Implausible)
        );
    }
    assert_eq!(sweep(&mut ego, 0.0).vehicle, None);
}

#[test]
fn a_receiver_without_a_fix_is_refused_and_ties_the_frame_to_nothing() {
    let mut ego = ego();
    let nowhere = ApplanixGroup1 {
        lat: 0.0,
        lon: 0.0,
        ..fix(0.0, 0.0, 0.0)
    };
    assert_eq!(
        hear(&mut ego, 0.0, &nowhere),
        Heard::Refused(PoseRefusal::NoFix)
    );
    assert_eq!(hear(&mut ego, 0.1, &fix(7.0, 0.0, 0.0)), Heard::Pose);
    let place_m = sweep(&mut ego, 0.1).vehicle.unwrap().position_m;
    assert_eq!(place_m, [0.0; 3]);
}

#[test]
fn a_second_sender_of_poses_is_told_and_changes_nothing() {
    let mut ego = ego();
    for step in 0..300 {
        let seconds = 0.01 * f64::from(step);
        assert_eq!(
            hear(&mut ego, seconds, &fix(seconds, 0.0, 90.0)),
            Heard::Pose
        );
        let beside = fix(seconds + 1.2, 0.0, 90.0);
        let expected = Heard::Refused(PoseRefusal::OtherSender {
            sender_stamp: 2,
            listened: 0,
        });
        assert_eq!(hear_from(&mut ego, 2, seconds, &beside), expected);
    }
    let place_m = sweep(&mut ego, 2.99).vehicle.unwrap().position_m;
    assert!((place_m[0] - 2.99).abs() < 1e-3, "{place_m:?}");
}

#[test]
fn a_clock_that_is_steadily_behind_is_made_up_for_and_another_one_is_told() {
    let mut late = ego();
    let mut other = ego();
    let mut told = 0;
    for step in 0..300 {
        let seconds = 0.01 * f64::from(step);
        let message = fix(seconds, 0.0, 90.0);
        hear(&mut late, seconds - 0.8, &message);
        let heard = hear(&mut other, seconds - 3600.0, &message);
        told += u32::from(matches!(
            heard,
            Heard::Refused(PoseRefusal::OtherClock { .. })
        ));
        if step % 10 == 9 {
            let vehicle = sweep(&mut late, seconds).vehicle.expect("a pose");
            // Poses are as old as their clock says, give or take the time from one to the next.
            assert!(
                (vehicle.position_m[0] - seconds).abs() < 0.02,
                "{vehicle:?}"
            );
            assert_eq!(sweep(&mut other, seconds).vehicle, None);
        }
    }
    assert!((late.report().behind_s - 0.8).abs() < 0.02);
    assert!(told > 280, "{told}");
}

#[test]
fn a_mounted_sensor_stands_where_it_is_mounted() {
    let mut ego = Ego::new(&EgoParameters {
        sensor_forward_m: 1.0,
        sensor_left_m: 0.5,
        sensor_yaw_deg: 90.0,
        ..parameters()
    });
    hear(&mut ego, 0.0, &fix(0.0, 0.0, 0.0));
    let sweep = sweep(&mut ego, 0.0);
    let [x, y, _] = sweep.sensor.position_m;
    assert!((x + 0.5).abs() < 1e-6 && (y - 1.0).abs() < 1e-6);
    assert!((sweep.sensor.yaw_rad.abs() - PI).abs() < 1e-6);
}

#[test]
fn a_jump_behind_a_gap_and_a_unit_found_late_begin_a_new_epoch() {
    let mut ego = ego();
    for step in 0..100 {
        hear(&mut ego, 0.01 * f64::from(step), &fix(0.0, 0.0, 0.0));
    }
    let before = sweep(&mut ego, 0.99).epoch;
    // No sweep ends while the pose is lost.
    hear(&mut ego, 1.53, &fix(25.0, 0.0, 0.0));
    assert_eq!(sweep(&mut ego, 1.48).epoch, before + 1);

    let mut ego = Ego::new(&parameters());
    let mut epochs = vec![];
    for (step, heading) in [3.0, 3.1, 3.15, 3.3, 3.4].into_iter().enumerate() {
        let seconds = 0.1 * step as f64;
        hear_separately(&mut ego, seconds, heading);
        epochs.push(sweep(&mut ego, seconds).epoch);
    }
    assert_eq!(epochs[0], epochs[2]);
    assert!(
        epochs[3] > epochs[2] && epochs[4] == epochs[3],
        "{epochs:?}"
    );
}
