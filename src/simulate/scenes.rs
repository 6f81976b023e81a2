//! The scenes themselves. Traffic drives on the right; x is east, y north.

use super::path::Path;
use super::scenario::{Actor, PoseMessages, Scenario, Scene, Variant};
use super::scenery::Scenery;
use super::terrain::{Swell, Terrain};
use crate::random::Random;

pub(super) const ALL: &[Scenario] = &[
    Scenario {
        name: "roundabout",
        summary: "a small roundabout of 30 m: three cars, three cyclists, a pedestrian; the \
                  vehicle approaches, gives way, enters and leaves",
        build: roundabout,
    },
    Scenario {
        name: "roundabout-waiting",
        summary: "the same roundabout from an entry, where the vehicle stands and has no pose",
        build: roundabout_waiting,
    },
    Scenario {
        name: "mini-roundabout",
        summary: "a mini roundabout among hedges, trees and verges: two cars, a cyclist, two \
                  pedestrians side by side",
        build: mini_roundabout,
    },
    Scenario {
        name: "street",
        summary: "a street with parked cars, oncoming traffic, a bus, a cyclist, pedestrians, \
                  and a turn to the right",
        build: street,
    },
    Scenario {
        name: "car-park",
        summary: "a car park: two rows of parked cars, one that leaves, two pedestrians",
        build: car_park,
    },
    Scenario {
        name: "hill",
        summary: "a road over a hill, with verges and oncoming traffic",
        build: hill,
    },
    Scenario {
        name: "occlusion",
        summary: "a standing sensor; cars, cyclists and pedestrians pass behind a lorry, a \
                  board and a van for a second or two",
        build: occlusion,
    },
    Scenario {
        name: "standing",
        summary: "a standing sensor beside a road, with traffic at all ranges",
        build: standing,
    },
];

/// Height of the sensor above the road: on the roof of a large car.
const SENSOR_M: f64 = 2.0;
/// From the middle of a road to the middle of a lane.
const LANE_M: f64 = 1.75;

/// A factor around 1.
fn about(random: &mut Random, deviation: f64) -> f64 {
    1.0 + deviation * (2.0 * random.uniform() - 1.0)
}

fn actor(variant: Variant, path: Path) -> Actor {
    Actor { variant, path }
}

/// A way through a roundabout: straight on in the right lane, a bend to the right that touches
/// the circle, round to the exit, out.
struct Passage {
    centre_m: [f64; 2],
    /// Of the way round.
    radius_m: f64,
    /// Of the bends in and out.
    bend_m: f64,
    /// From the middle of the approach road to the way in.
    lane_m: f64,
}

impl Passage {
    /// Driving towards `heading_deg` for `approach_m` before the bend, leaving at the exit with
    /// this number, the right one being 1.
    fn path(&self, heading_deg: f64, approach_m: f64, exit: u32) -> Path {
        let touching_m = self.radius_m + self.bend_m;
        let aside_m = self.bend_m + self.lane_m;
        let before_m = libm::sqrt(touching_m * touching_m - aside_m * aside_m);
        let bend_deg = libm::acos(aside_m / touching_m).to_degrees();
        let round_deg = 2.0 * bend_deg + 90.0 * (f64::from(exit) - 2.0);
        let (sine, cosine) = libm::sincos(heading_deg.to_radians());
        let back_m = before_m + approach_m;
        let [x, y] = self.centre_m;
        let start_m = [
            x - back_m * cosine + self.lane_m * sine,
            y - back_m * sine - self.lane_m * cosine,
        ];
        Path::from(start_m, heading_deg)
            .line(approach_m)
            .arc(-self.bend_m, bend_deg)
            .arc(self.radius_m, round_deg)
            .arc(-self.bend_m, bend_deg)
    }
}

const ROUND_CENTRE_M: [f64; 2] = [-LANE_M, 45.0];

/// The scene of the thesis (section 2.2.2): outer diameter 30 m.
fn roundabout(random: &mut Random) -> Scene {
    let passage = Passage {
        centre_m: ROUND_CENTRE_M,
        radius_m: 11.0,
        bend_m: 12.0,
        lane_m: LANE_M,
    };
    let hurry = about(random, 0.01);
    let ego = passage.path(90.0, 26.6, 2).timed(&[
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
    scenery
}

/// As in the first figures of the thesis' tracking: standing, without a pose.
fn roundabout_waiting(random: &mut Random) -> Scene {
    // The sensor is the origin of a frame without poses.
    const BACK_M: [f64; 2] = [0.0, -21.0];
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

fn mini_roundabout(random: &mut Random) -> Scene {
    let centre_m = [-LANE_M, 38.0];
    let passage = Passage {
        centre_m,
        radius_m: 6.5,
        bend_m: 9.0,
        lane_m: LANE_M,
    };
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
            Path::from([x + 11.4, y - 30.0], 90.0)
                .line(90.0)
                .timed(&[(0.0, 1.3)]),
        ),
        actor(
            Variant::pedestrian(random),
            Path::from([x + 10.5, y - 30.1], 90.0)
                .line(90.0)
                .timed(&[(0.0, 1.3)]),
        ),
    ];
    Scene {
        sensor_height_m: SENSOR_M,
        ego: passage.path(90.0, 25.0, 3).timed(&[
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
    }
}

fn street(random: &mut Random) -> Scene {
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
    let oncoming = |y: f64, speed_mps: f64| {
        Path::from([-2.0 * LANE_M - 0.1, y], -90.0)
            .line(300.0)
            .timed(&[(0.0, speed_mps)])
    };
    let pace_mps = 8.5 * about(random, 0.05);
    for y in [70.0, 130.0, 190.0] {
        actors.push(actor(Variant::car(random), oncoming(y, pace_mps)));
    }
    actors.push(actor(Variant::bus(), oncoming(105.0, pace_mps)));
    actors.push(actor(
        Variant::cyclist(random),
        Path::from([0.6, 22.0], 90.0)
            .line(200.0)
            .timed(&[(0.0, 4.8)]),
    ));
    for (x, y, heading_deg) in [(6.6, 20.0, 90.0), (7.5, 75.0, -90.0), (-10.1, 50.0, 90.0)] {
        let walk = Path::from([x, y], heading_deg).line(200.0);
        let speed_mps = 1.4 * about(random, 0.15);
        actors.push(actor(
            Variant::pedestrian(random),
            walk.timed(&[(0.0, speed_mps)]),
        ));
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
    }
}

fn car_park(random: &mut Random) -> Scene {
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
    }
}

fn hill(random: &mut Random) -> Scene {
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
    for step in 0..12 {
        let y = -30.0 + 20.0 * f64::from(step);
        scenery.tree([9.0, y], 1.8).tree([-13.0, y + 9.0], 2.0);
        scenery.bush([7.5, y + 6.0], 0.9, 1.3);
        scenery.pole([-9.0, y + 3.0], 0.06, 1.1);
    }
    let oncoming = |y: f64, speed_mps: f64| {
        Path::from([-2.0 * LANE_M, y], -90.0)
            .line(400.0)
            .timed(&[(0.0, speed_mps)])
    };
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
            Path::from([1.6, 48.0], 90.0)
                .line(400.0)
                .timed(&[(0.0, 3.2)]),
        ),
        actor(
            Variant::pedestrian(random),
            Path::from([3.6, 30.0], 90.0)
                .line(400.0)
                .timed(&[(0.0, 1.3)]),
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
    }
}

fn occlusion(random: &mut Random) -> Scene {
    let terrain = Terrain::default();
    let mut scenery = Scenery::on(&terrain);
    scenery.wall([0.0, 60.0], 0.0, 90.0, 2.5);
    scenery.house([-38.0, 20.0], 90.0, [30.0, 8.0], 6.0);
    // A board of 4 m on the left, a transformer house on the right.
    scenery.wall([-8.0, 11.0], 0.0, 4.2, 2.6);
    scenery.house([12.0, 13.0], 0.0, [3.4, 2.0], 2.8);
    let across = |from_m: [f64; 2], heading_deg: f64, speed_mps: f64| {
        Path::from(from_m, heading_deg)
            .line(300.0)
            .timed(&[(0.0, speed_mps)])
    };
    let van = Variant {
        size_m: [4.9, 1.93, 1.97],
        ..Variant::car(random)
    };
    let actors = vec![
        actor(Variant::lorry(), Path::parked([0.5, 12.0], 0.0)),
        actor(van, Path::parked([22.0, 10.0], 0.0)),
        actor(
            Variant::car(random),
            across([-34.0, 27.0], 0.0, 8.0 * about(random, 0.1)),
        ),
        actor(
            Variant::car(random),
            across([36.0, 31.0], 180.0, 7.0 * about(random, 0.1)),
        ),
        actor(
            Variant::cyclist(random),
            across([-26.0, 21.0], 0.0, 4.2 * about(random, 0.1)),
        ),
        actor(
            Variant::cyclist(random),
            across([30.0, 19.0], 180.0, 4.2 * about(random, 0.1)),
        ),
        actor(
            Variant::pedestrian(random),
            across([-13.5, 15.5], 0.0, 1.4 * about(random, 0.1)),
        ),
        actor(
            Variant::pedestrian(random),
            across([19.0, 16.5], 180.0, 1.4 * about(random, 0.1)),
        ),
    ];
    Scene {
        sensor_height_m: SENSOR_M,
        ego: Path::parked([0.0; 2], 90.0),
        poses: PoseMessages::None,
        actors,
        scenery,
        terrain,
    }
}

fn standing(random: &mut Random) -> Scene {
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
    let along = |x: f64, y: f64, heading_deg: f64, speed_mps: f64| {
        Path::from([x, y], heading_deg)
            .line(400.0)
            .timed(&[(0.0, speed_mps)])
    };
    let mut actors = vec![];
    for (y, speed_mps) in [(-70.0, 10.0), (-40.0, 10.0), (10.0, 10.0)] {
        let path = along(-2.4, y, 90.0, speed_mps);
        actors.push(actor(Variant::car(random), path));
    }
    for (y, speed_mps) in [(85.0, 9.0), (45.0, 9.0)] {
        actors.push(actor(
            Variant::car(random),
            along(-6.0, y, -90.0, speed_mps),
        ));
    }
    actors.push(actor(Variant::bus(), along(-6.0, 110.0, -90.0, 9.0)));
    for (x, y, heading_deg, speed_mps) in [(-9.2, 48.0, -90.0, 4.4), (-8.6, -30.0, 90.0, 4.4)] {
        actors.push(actor(
            Variant::cyclist(random),
            along(x, y, heading_deg, speed_mps),
        ));
    }
    for (x, y, heading_deg) in [(4.3, 5.0, 90.0), (5.2, 48.0, -90.0), (-11.5, 14.0, 90.0)] {
        let speed_mps = 1.4 * about(random, 0.1);
        actors.push(actor(
            Variant::pedestrian(random),
            along(x, y, heading_deg, speed_mps),
        ));
    }
    Scene {
        sensor_height_m: SENSOR_M,
        ego: Path::parked([0.0; 2], 90.0),
        poses: PoseMessages::None,
        actors,
        scenery,
        terrain,
    }
}
