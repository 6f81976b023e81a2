//! Traffic along a road: a street, a hill, and a sensor beside it.

use super::{LANE_M, RANGE_DEVIATION_M, SENSOR_M, about, actor};
use crate::random::Random;
use crate::simulate::path::Path;
use crate::simulate::scenario::{PoseMessages, Scene};
use crate::simulate::scenery::Scenery;
use crate::simulate::terrain::{Swell, Terrain};
use crate::simulate::variant::Variant;

pub(super) fn street(random: &mut Random) -> Scene {
    let terrain = Terrain {
        swells: vec![],
        unevenness_m: 0.015,
    };
    let mut scenery = Scenery::on(&terrain);
    let mut actors = vec![];
    for side in [-1.0, 1.0] {
        let x = -LANE_M + side * 8.6;
        scenery.pavement([x, 60.0], 90.0, [150.0, 4.4]);
        for step in 0..7 {
            let y = 6.0 + 19.0 * f64::from(step);
            scenery.tree([-LANE_M + side * 7.2, y + 4.0], 1.5);
            scenery.pole([-LANE_M + side * 7.0, y - 3.0], 0.08, 6.0);
            if step != 5 || side < 0.0 {
                let front_m = -LANE_M + side * 17.5;
                scenery.house([front_m, y + 2.0], 0.0, [11.0, 15.0], 8.0);
                scenery.hedge([-LANE_M + side * 11.2, y - 6.0], 90.0, 4.0, 1.1);
            }
        }
    }
    // The street that it turns into.
    for step in 0..18 {
        let x = 24.0 + 19.0 * f64::from(step);
        for (side, front_m) in [(1.0, 15.0), (-1.0, 16.0)] {
            let y = 99.5 + side * 7.2;
            scenery
                .tree([x + 4.0, y], 1.5)
                .pole([x - 3.0, y], 0.08, 6.0);
            scenery.house([x + 6.0, 99.5 + side * front_m], 90.0, [9.0, 12.0], 7.0);
        }
    }
    // Parked along both kerbs, with gaps.
    for step in 0..14 {
        let y = 4.0 + 7.5 * f64::from(step) + random.uniform();
        let (left, right) = (random.uniform() < 0.7, random.uniform() < 0.7);
        let slant_deg = 3.0 * (random.uniform() - 0.5);
        let variant = Variant::car(random);
        if left {
            actors.push(actor(
                variant,
                Path::parked([-LANE_M - 5.2, y], -90.0 + slant_deg),
            ));
        }
        let variant = Variant::car(random);
        if right && !(92.0..112.0).contains(&y) {
            actors.push(actor(
                variant,
                Path::parked([-LANE_M + 5.2, y + 2.0], 90.0 + slant_deg),
            ));
        }
    }
    let oncoming =
        |y: f64, speed_mps: f64| Path::straight([-2.0 * LANE_M - 0.1, y], -90.0, speed_mps);
    let pace_mps = 8.5 * about(random, 0.05);
    for y in [70.0, 130.0, 190.0] {
        actors.push(actor(Variant::car(random), oncoming(y, pace_mps)));
    }
    actors.push(actor(Variant::bus(), oncoming(105.0, pace_mps)));
    actors.push(actor(
        Variant::cyclist(random),
        Path::straight([0.6, 22.0], 90.0, 4.8),
    ));
    for (x, y, heading_deg) in [(6.6, 20.0, 90.0), (7.5, 75.0, -90.0), (-10.1, 50.0, 90.0)] {
        let walk = Path::straight([x, y], heading_deg, 1.4 * about(random, 0.15));
        actors.push(actor(Variant::pedestrian(random), walk));
    }
    Scene {
        sensor_height_m: SENSOR_M,
        ego: Path::from([0.0; 2], 90.0)
            .line(92.0)
            .arc(-7.5, 90.0)
            .line(60.0)
            .timed(&[
                (0.0, 7.0),
                (2.0, 7.0),
                (6.0, 5.2),
                (14.0, 5.2),
                (17.0, 4.0),
                (21.0, 4.0),
                (24.0, 7.0),
            ]),
        poses: PoseMessages::Applanix,
        actors,
        scenery,
        terrain,
        range_deviation_m: RANGE_DEVIATION_M,
    }
}

pub(super) fn hill(random: &mut Random) -> Scene {
    let swell = |from_m, length_m, rise_m| Swell {
        direction: [0.0, 1.0],
        from_m,
        length_m,
        rise_m,
    };
    let terrain = Terrain {
        swells: vec![
            swell(15.0, 60.0, 3.4),
            swell(95.0, 60.0, -4.0),
            Swell {
                direction: [1.0, 0.0],
                from_m: 5.0,
                length_m: 12.0,
                rise_m: 0.8,
            },
        ],
        unevenness_m: 0.02,
    };
    let mut scenery = Scenery::on(&terrain);
    for step in 0..25 {
        let y = -30.0 + 20.0 * f64::from(step);
        scenery.tree([9.0, y], 1.8).tree([-13.0, y + 9.0], 2.0);
        scenery.bush([7.5, y + 6.0], 0.9, 1.3);
        scenery.pole([-9.0, y + 3.0], 0.06, 1.1);
    }
    let oncoming = |y: f64, speed_mps: f64| Path::straight([-2.0 * LANE_M, y], -90.0, speed_mps);
    let actors = vec![
        actor(
            Variant::car(random),
            oncoming(60.0, 9.0 * about(random, 0.05)),
        ),
        actor(
            Variant::car(random),
            oncoming(150.0, 8.5 * about(random, 0.05)),
        ),
        actor(Variant::lorry(), oncoming(105.0, 9.0)),
        actor(
            Variant::car(random),
            Path::from([0.0, 17.0], 90.0)
                .line(400.0)
                .timed(&[(0.0, 8.0), (8.0, 8.0), (12.0, 9.5)]),
        ),
        actor(
            Variant::cyclist(random),
            Path::straight([1.6, 48.0], 90.0, 3.2),
        ),
        actor(
            Variant::pedestrian(random),
            Path::straight([3.6, 30.0], 90.0, 1.3),
        ),
    ];
    Scene {
        sensor_height_m: SENSOR_M,
        ego: Path::from([0.0; 2], 90.0)
            .line(400.0)
            .timed(&[(0.0, 7.0), (10.0, 7.0)]),
        poses: PoseMessages::Applanix,
        actors,
        scenery,
        terrain,
        range_deviation_m: RANGE_DEVIATION_M,
    }
}

pub(super) fn standing(random: &mut Random) -> Scene {
    let terrain = Terrain {
        swells: vec![],
        unevenness_m: 0.02,
    };
    let mut scenery = Scenery::on(&terrain);
    scenery.pavement([4.5, 20.0], 90.0, [150.0, 3.0]);
    for step in 0..8 {
        let y = -40.0 + 18.0 * f64::from(step);
        scenery.pole([6.5, y], 0.08, 6.0);
        scenery.tree([-14.0, y + 7.0], 1.8);
        scenery.house([17.0, y + 5.0], 0.0, [12.0, 13.0], 7.0);
    }
    scenery.hedge([-17.0, 20.0], 90.0, 120.0, 1.4);
    let mut actors = vec![];
    for (y, speed_mps) in [(-70.0, 10.0), (-40.0, 10.0), (10.0, 10.0)] {
        let path = Path::straight([-2.4, y], 90.0, speed_mps);
        actors.push(actor(Variant::car(random), path));
    }
    for (y, speed_mps) in [(85.0, 9.0), (45.0, 9.0)] {
        actors.push(actor(
            Variant::car(random),
            Path::straight([-6.0, y], -90.0, speed_mps),
        ));
    }
    actors.push(actor(
        Variant::bus(),
        Path::straight([-6.0, 110.0], -90.0, 9.0),
    ));
    for (x, y, heading_deg, speed_mps) in [(-9.2, 48.0, -90.0, 4.4), (-8.6, -30.0, 90.0, 4.4)] {
        actors.push(actor(
            Variant::cyclist(random),
            Path::straight([x, y], heading_deg, speed_mps),
        ));
    }
    for (x, y, heading_deg) in [(4.3, 5.0, 90.0), (5.2, 48.0, -90.0), (-11.5, 14.0, 90.0)] {
        let speed_mps = 1.4 * about(random, 0.1);
        actors.push(actor(
            Variant::pedestrian(random),
            Path::straight([x, y], heading_deg, speed_mps),
        ));
    }
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
