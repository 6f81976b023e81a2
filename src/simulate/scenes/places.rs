//! Places: a car park and a course of occlusions.

use super::{RANGE_DEVIATION_M, SENSOR_M, about, actor};
use crate::random::Random;
use crate::simulate::path::Path;
use crate::simulate::scenario::{PoseMessages, Scene};
use crate::simulate::scenery::Scenery;
use crate::simulate::terrain::Terrain;
use crate::simulate::variant::Variant;

pub(super) fn car_park(random: &mut Random) -> Scene {
    let terrain = Terrain {
        swells: vec![],
        unevenness_m: 0.01,
    };
    let mut scenery = Scenery::on(&terrain);
    let mut actors = vec![];
    for (x, heading_deg) in [(-8.5, 0.0), (8.5, 180.0), (14.2, 0.0)] {
        for bay in 0..10 {
            let taken = random.uniform() < 0.75;
            let turned = if random.uniform() < 0.3 { 180.0 } else { 0.0 };
            let variant = Variant::car(random);
            let slant_deg = 4.0 * (random.uniform() - 0.5);
            let y = 2.0 + 2.9 * f64::from(bay);
            // The bay of the one that leaves is its own.
            if taken && !(x < 0.0 && (5..=6).contains(&bay)) {
                let yaw_deg = heading_deg + turned + slant_deg;
                actors.push(actor(variant, Path::parked([x, y], yaw_deg)));
            }
        }
    }
    actors.push(actor(
        Variant::car(random),
        Path::from([-8.5, 2.0 + 2.9 * 5.5], 0.0)
            .line(3.0)
            .arc(5.5, 90.0)
            .line(40.0)
            .timed(&[(0.0, 0.0), (9.0, 0.0), (12.0, 3.0)]),
    ));
    for (x, y, heading_deg, begins_s) in [(2.6, 30.0, -90.0, 0.0), (-3.4, 4.0, 90.0, 3.0)] {
        let walk = Path::from([x, y], heading_deg).line(100.0);
        actors.push(actor(
            Variant::pedestrian(random),
            walk.timed(&[(0.0, 0.0), (begins_s, 0.0), (begins_s + 1.0, 1.35)]),
        ));
    }
    for x in [-5.7, 11.35] {
        for y in [1.0, 17.0, 33.0] {
            scenery.pole([x - 6.0, y - 0.5], 0.08, 5.0);
        }
    }
    scenery.wall([-12.5, 15.0], 90.0, 40.0, 1.8);
    scenery.wall([0.0, 50.0], 0.0, 40.0, 2.5);
    scenery.hedge([18.5, 15.0], 90.0, 36.0, 1.2);
    scenery.house([4.0, -28.0], 0.0, [30.0, 10.0], 5.0);
    // The lane that leads away from it.
    for step in 0..6 {
        let x = 38.0 + 18.0 * f64::from(step);
        scenery
            .wall([x, 42.0], 0.0, 12.0, 1.8)
            .pole([x + 9.0, 28.0], 0.08, 5.0);
        scenery.hedge([x, 27.0], 0.0, 11.0, 1.2);
    }
    Scene {
        sensor_height_m: SENSOR_M,
        ego: Path::from([0.0; 2], 90.0)
            .line(29.0)
            .arc(-5.5, 90.0)
            .line(30.0)
            .timed(&[(0.0, 0.0), (1.0, 0.0), (3.0, 2.5), (12.0, 2.5), (16.0, 2.5)]),
        poses: PoseMessages::OpenDlv,
        actors,
        scenery,
        terrain,
        range_deviation_m: RANGE_DEVIATION_M,
    }
}

pub(super) fn occlusion(random: &mut Random) -> Scene {
    let terrain = Terrain::default();
    let mut scenery = Scenery::on(&terrain);
    scenery.wall([0.0, 60.0], 0.0, 90.0, 2.5);
    scenery.house([-38.0, 20.0], 90.0, [30.0, 8.0], 6.0);
    // A board of 4 m on the left, a transformer house on the right.
    scenery.wall([-8.0, 11.0], 0.0, 4.2, 2.6);
    scenery.house([12.0, 13.0], 0.0, [3.4, 2.0], 2.8);
    let van = Variant {
        size_m: [4.9, 1.93, 1.97],
        ..Variant::car(random)
    };
    let actors = vec![
        actor(Variant::lorry(), Path::parked([0.5, 12.0], 0.0)),
        actor(van, Path::parked([22.0, 10.0], 0.0)),
        actor(
            Variant::car(random),
            Path::straight([-34.0, 27.0], 0.0, 8.0 * about(random, 0.1)),
        ),
        actor(
            Variant::car(random),
            Path::straight([36.0, 31.0], 180.0, 7.0 * about(random, 0.1)),
        ),
        actor(
            Variant::cyclist(random),
            Path::straight([-26.0, 21.0], 0.0, 4.2 * about(random, 0.1)),
        ),
        actor(
            Variant::cyclist(random),
            Path::straight([30.0, 19.0], 180.0, 4.2 * about(random, 0.1)),
        ),
        actor(
            Variant::pedestrian(random),
            Path::straight([-13.5, 15.5], 0.0, 1.4 * about(random, 0.1)),
        ),
        actor(
            Variant::pedestrian(random),
            Path::straight([19.0, 16.5], 180.0, 1.4 * about(random, 0.1)),
        ),
    ];
    Scene {
        sensor_height_m: SENSOR_M,
        ego: Path::parked([0.0; 2], 90.0),
        poses: PoseMessages::None,
        actors,
        scenery,
        terrain,
        range_deviation_m: RANGE_DEVIATION_M,
    }
}
