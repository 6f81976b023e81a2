//! Any text as a map: none panics or takes long, and what is read is read again from what it writes.
#![no_main]

use kreisel::config::Configuration;
use kreisel::ego::Pose;
use kreisel::roadmap::{Elements, Roadmap, osm, roundabouts, scn, simplified, svg};
use kreisel::roundabout::{Situation, Watcher};
use kreisel::time::Time;
use kreisel::track::{Class, Object};
use libfuzzer_sys::fuzz_target;

/// Somebody beside the middle of a roundabout.
fn object(id: u32, [x, y]: [f64; 2], speed_mps: f64) -> Object {
    Object {
        id,
        class: Class::Car,
        class_probability: 0.9,
        measured: true,
        centre_m: [x, y, 0.0],
        yaw_rad: f64::from(id),
        speed_mps,
        yaw_rate_radps: 0.3,
        length_m: 4.0,
        width_m: 1.8,
        height_m: 1.5,
        position_deviation_m: [0.1; 2],
        yaw_deviation_rad: 0.1,
        speed_deviation_mps: 0.3,
        existence: 0.9,
        first_seen: Time::from_micros(0),
        seen_since: Time::from_micros(0),
        last_measured: Time::from_micros(0),
        points: 50,
    }
}

fn watched(map: &Roadmap, centre_m: [f64; 2]) {
    let mut watcher = Watcher::new(&Configuration::default().roundabout);
    watcher.take_map(map);
    let [x, y] = centre_m;
    let around = [[x + 11.0, y], [x, y - 15.0], [x - 20.0, y + 2.0]];
    let objects: Vec<_> = (1..)
        .zip(around)
        .map(|(id, at)| object(id, at, 6.0))
        .collect();
    for step in 0..3 {
        let vehicle = Pose {
            position_m: [x, y - 25.0 + f64::from(step), 0.0],
            yaw_rad: 1.57,
        };
        watcher.watch(&Situation {
            time: Time::from_micros(100_000 * i64::from(step)),
            reference: None,
            epoch: 0,
            vehicle: Some(vehicle),
            vehicle_speed_mps: 3.0,
            objects: &objects,
            sight: None,
        });
        let Some(advice) = watcher.advice() else {
            continue;
        };
        for arm in &advice.arms {
            for crossing in [&arm.entry, &arm.exit] {
                assert!(crossing.gap_s.is_finite() && crossing.margin_s.is_finite());
                assert!(crossing.stop_m.is_finite());
            }
            assert!(arm.bearing_rad.is_finite());
        }
        for window in &advice.windows {
            assert!(
                window.begin_s.is_finite() && window.end_s.is_finite() && window.probability < 1.01
            );
        }
    }
}

fn measured(map: &Roadmap) {
    let found = roundabouts(map);
    let found: Vec<_> = found
        .into_iter()
        .map(|one| (simplified(&one).roundabout, Elements::of(&one)))
        .collect();
    assert!(svg(map, &found).starts_with("<svg"));
    if let Some((first, _)) = found.first() {
        watched(map, first.centre_m());
    }
}

fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes);
    if let Ok(map) = scn::read(&text) {
        measured(&map);
        let again = scn::read(&scn::write(&map)).expect("own text");
        assert_eq!(map.point_count(), again.point_count());
        assert_eq!(map.declared.len(), again.declared.len());
    }
    if let Ok(map) = osm::read(&text, None) {
        measured(&map);
    }
});
