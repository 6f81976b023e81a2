//! Roundabouts, large and small.

use super::passage::{Circle, Passage, STEERING_M, roads};
use super::{LANE_M, RANGE_DEVIATION_M, SENSOR_M, about, actor};
use crate::random::Random;
use crate::roadmap::Roadmap;
use crate::simulate::path::Path;
use crate::simulate::scenario::{Actor, PoseMessages, Scene};
use crate::simulate::scenery::Scenery;
use crate::simulate::terrain::Terrain;
use crate::simulate::variant::Variant;

const ROUND_CENTRE_M: [f64; 2] = [-LANE_M, 45.0];
const SMALL: Passage = Passage {
    centre_m: ROUND_CENTRE_M,
    radius_m: 11.0,
    bend_m: 12.0,
    lane_m: LANE_M,
};

/// Its circles: lane, cycle path, pavement.
pub(super) const SMALL_CIRCLES: [Circle; 3] = [
    Circle::road(7.0, 15.0),
    Circle::bikeway(15.6, 17.6),
    Circle::pavement(19.2, 21.8),
];

pub(super) fn small_roads() -> Roadmap {
    roads("roundabout", &[SMALL], &SMALL_CIRCLES)
}

/// Without a pose the sensor's first place is the origin: x to the right, y ahead.
pub(super) fn waiting_roads() -> Roadmap {
    let centre_m = [ROUND_CENTRE_M[0] + BACK_M[0], ROUND_CENTRE_M[1] + BACK_M[1]];
    let shifted = Passage { centre_m, ..SMALL };
    roads("roundabout-waiting", &[shifted], &SMALL_CIRCLES)
}

/// How far the waiting sensor's scene is moved so that the sensor is the origin of a frame without poses.
const BACK_M: [f64; 2] = [0.0, -21.0];

/// The scene of the thesis (section 2.2.2): outer diameter 30 m.
pub(super) fn roundabout(random: &mut Random) -> Scene {
    let passage = SMALL;
    let hurry = about(random, 0.01);
    let ego = passage.path(90.0, 26.6, 2).steered(STEERING_M).timed(&[
        (0.0, 8.3),
        (1.6, 8.3),
        (4.4, 0.0),
        (13.8, 0.0),
        (16.8, 6.5),
        (21.2, 6.5),
        (24.2, 9.0),
    ]);
    Scene {
        sensor_height_m: SENSOR_M,
        ego,
        poses: PoseMessages::Applanix,
        actors: round_traffic(random, hurry),
        scenery: round_scenery(),
        terrain: Terrain {
            swells: vec![],
            unevenness_m: 0.02,
        },
        range_deviation_m: RANGE_DEVIATION_M,
    }
}

/// Three cars at 25 to 35 km/h, three cyclists at 15, a pedestrian at 5.
fn round_traffic(random: &mut Random, hurry: f64) -> Vec<Actor> {
    let car = |radius_m, start_deg, speed_mps| {
        Path::circle(ROUND_CENTRE_M, radius_m, start_deg, speed_mps).hurried(hurry)
    };
    let mut actors = vec![];
    // Behind each other on the circle, so that the vehicle finds its gap.
    for (start_deg, speed_mps) in [(20.0, 7.9), (95.0, 7.9), (170.0, 7.9)] {
        actors.push(actor(Variant::car(random), car(11.0, start_deg, speed_mps)));
    }
    for (start_deg, radius_m) in [(200.0, 16.6), (20.0, 16.6), (310.0, 16.6)] {
        let path = Path::circle(ROUND_CENTRE_M, radius_m, start_deg, 4.17);
        actors.push(actor(Variant::cyclist(random), path.hurried(hurry)));
    }
    let walk = Path::circle(ROUND_CENTRE_M, -20.5, 345.0, 1.39).hurried(about(random, 0.1));
    actors.push(actor(Variant::pedestrian(random), walk));
    actors
}

fn round_scenery() -> Scenery {
    let [x, y] = ROUND_CENTRE_M;
    let mut scenery = Scenery::default();
    scenery.island([x, y], 7.0).bush([x, y], 2.5, 0.9);
    scenery.pole([x - 1.0, y + 4.0], 0.06, 2.4);
    for (east, north) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let corner = |far_m: f64| [x + east * far_m, y + north * far_m];
        scenery.pavement(corner(27.0), 0.0, [14.0, 14.0]);
        scenery.pole(corner(22.5), 0.09, 6.0);
        scenery.tree([x + east * 29.0, y + north * 24.0], 1.8);
    }
    scenery.sign([x + 6.5, y - 21.5], 0.0);
    scenery.wall([x - 35.0, y], 90.0, 30.0, 1.2);
    scenery.house([x + 40.0, y + 22.0], 0.0, [14.0, 12.0], 7.0);
    scenery.hedge([x - 26.0, y - 26.0], 45.0, 12.0, 1.3);
    scenery.house([x - 30.0, y - 38.0], 10.0, [16.0, 10.0], 6.0);
    scenery.wall([x + 12.0, y - 50.0], 90.0, 36.0, 1.6);
    // Along the way out.
    for step in 0..14 {
        let far_m = y + 40.0 + 25.0 * f64::from(step);
        scenery
            .tree([x + 9.0, far_m], 1.6)
            .pole([x - 7.0, far_m + 8.0], 0.08, 6.0);
        scenery.house([x - 18.0, far_m + 4.0], 0.0, [10.0, 12.0], 6.0);
        scenery.hedge([x + 12.0, far_m + 12.0], 90.0, 14.0, 1.4);
    }
    scenery
}

/// As in the first figures of the thesis' tracking: standing, without a pose.
pub(super) fn roundabout_waiting(random: &mut Random) -> Scene {
    let mut scene = roundabout(random);
    for actor in &mut scene.actors {
        actor.path.shift(BACK_M);
    }
    scene.scenery.shift(BACK_M);
    Scene {
        ego: Path::parked([0.0; 2], 90.0),
        poses: PoseMessages::None,
        ..scene
    }
}

const MINI: Passage = Passage {
    centre_m: [-LANE_M, 38.0],
    radius_m: 6.5,
    bend_m: 9.0,
    lane_m: LANE_M,
};

pub(super) fn mini_roads() -> Roadmap {
    roads("mini-roundabout", &[MINI], &[Circle::road(3.2, 9.0)])
}

pub(super) fn mini_roundabout(random: &mut Random) -> Scene {
    let centre_m = MINI.centre_m;
    let passage = MINI;
    let terrain = Terrain {
        swells: vec![],
        unevenness_m: 0.04,
    };
    let [x, y] = centre_m;
    let mut scenery = Scenery::on(&terrain);
    scenery.island(centre_m, 3.2);
    scenery.sign([x, y + 1.0], 0.0);
    for (east, north) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let at = |u: f64, v: f64| [x + east * u, y + north * v];
        scenery.verge(at(22.0, 22.0), 0.0, [24.0, 24.0]);
        scenery.hedge(at(24.0, 13.0), 0.0, 20.0, 1.5);
        scenery.hedge(at(13.0, 25.0), 90.0, 22.0, 1.1);
        scenery.tree(at(16.0, 17.0), 2.0).tree(at(27.0, 21.0), 2.5);
        scenery.bush(at(19.0, 15.5), 0.8, 1.2);
    }
    // Along the way out, to the west.
    for step in 0..8 {
        let far_m = x - 45.0 - 22.0 * f64::from(step);
        scenery
            .tree([far_m, y + 8.0], 2.0)
            .tree([far_m - 9.0, y - 9.0], 2.2);
        scenery
            .hedge([far_m - 4.0, y + 13.0], 0.0, 15.0, 1.3)
            .pole([far_m, y - 6.0], 0.06, 1.1);
    }
    let ride = Path::circle(centre_m, 10.2, 150.0, 3.6);
    let actors = vec![
        actor(
            Variant::car(random),
            Path::circle(centre_m, 6.5, 160.0, 5.5).hurried(about(random, 0.02)),
        ),
        actor(
            Variant::car(random),
            passage
                .path(0.0, 60.0, 1)
                .timed(&[(0.0, 7.0), (6.0, 7.0), (9.0, 4.5), (14.0, 8.0)])
                .hurried(about(random, 0.02)),
        ),
        actor(Variant::cyclist(random), ride),
        actor(
            Variant::pedestrian(random),
            Path::straight([x + 11.4, y - 30.0], 90.0, 1.3),
        ),
        actor(
            Variant::pedestrian(random),
            Path::straight([x + 10.5, y - 30.1], 90.0, 1.3),
        ),
    ];
    Scene {
        sensor_height_m: SENSOR_M,
        ego: passage.path(90.0, 25.0, 3).steered(STEERING_M).timed(&[
            (0.0, 7.0),
            (1.0, 7.0),
            (5.5, 0.0),
            (9.0, 0.0),
            (12.0, 5.0),
        ]),
        poses: PoseMessages::OpenDlv,
        actors,
        scenery,
        terrain,
        range_deviation_m: RANGE_DEVIATION_M,
    }
}
