//! Roundabouts that cars pass in every way, before a vehicle that waits to enter.

use std::f64::consts::TAU;

use super::passage::{Circle, HEADINGS_DEG, Passage, STEERING_M, road_edges_m, roads};
use super::roundabouts::SMALL_CIRCLES;
use super::{LANE_M, RANGE_DEVIATION_M, SENSOR_M, about, actor};
use crate::random::Random;
use crate::roadmap::Roadmap;
use crate::simulate::path::Path;
use crate::simulate::scenario::{Actor, PoseMessages, Scene};
use crate::simulate::scenery::Scenery;
use crate::simulate::terrain::Terrain;
use crate::simulate::variant::Variant;

/// The vehicle stands at the origin, before the cycle path, and looks north.
const SMALL_CENTRE_M: [f64; 2] = [-LANE_M, 21.0];
const TWO_LANE_CENTRE_M: [f64; 2] = [-LANE_M, 27.0];
const MINI_CENTRE_M: [f64; 2] = [-LANE_M, 16.0];
const EGO_DEG: f64 = 90.0;

const SMALL: Passage = Passage {
    centre_m: SMALL_CENTRE_M,
    radius_m: 11.0,
    bend_m: 12.0,
    lane_m: LANE_M,
};

/// Round the inner lane, and round the outer one.
const TWO_LANE: [Passage; 2] = [
    Passage {
        centre_m: TWO_LANE_CENTRE_M,
        radius_m: 15.0,
        bend_m: 14.0,
        lane_m: LANE_M,
    },
    Passage {
        centre_m: TWO_LANE_CENTRE_M,
        radius_m: 19.0,
        bend_m: 14.0,
        lane_m: LANE_M,
    },
];

const TWO_LANE_CIRCLES: [Circle; 4] = [
    Circle::road(13.0, 17.0),
    Circle::road(17.0, 21.0),
    Circle::bikeway(21.6, 23.6),
    Circle::pavement(25.2, 27.8),
];

/// One drives over its middle if one must.
const MINI: Passage = Passage {
    centre_m: MINI_CENTRE_M,
    radius_m: 6.5,
    bend_m: 9.0,
    lane_m: LANE_M,
};

const MINI_CIRCLES: [Circle; 2] = [Circle::road(3.2, 9.0), Circle::pavement(10.4, 12.6)];

pub(super) fn mini_roads() -> Roadmap {
    roads("mini-traffic", &[MINI], &MINI_CIRCLES)
}

pub(super) fn small_roads() -> Roadmap {
    roads("roundabout-traffic", &[SMALL], &SMALL_CIRCLES)
}

pub(super) fn two_lane_roads() -> Roadmap {
    roads("two-lane-roundabout", &TWO_LANE, &TWO_LANE_CIRCLES)
}

/// The scene lasts so long that nobody is missing at its end.
const LONGEST_S: f64 = 70.0;
/// Speed on the arms.
const APPROACH_MPS: f64 = 8.0;
/// How near cars come to each other, and to cyclists and the waiting vehicle, middle to middle.
const APART_M: f64 = 7.0;

pub(super) fn small(random: &mut Random) -> Scene {
    scene(random, &[SMALL], &SMALL_CIRCLES, Some(16.6), 20.5, 9)
}

pub(super) fn two_lane(random: &mut Random) -> Scene {
    scene(random, &TWO_LANE, &TWO_LANE_CIRCLES, Some(22.6), 26.5, 13)
}

pub(super) fn mini(random: &mut Random) -> Scene {
    scene(random, &[MINI], &MINI_CIRCLES, None, 11.5, 8)
}

pub(super) fn mini_entry(random: &mut Random) -> Scene {
    entering(mini(random), &MINI, random)
}

pub(super) fn small_entry(random: &mut Random) -> Scene {
    entering(small(random), &SMALL, random)
}

pub(super) fn two_lane_entry(random: &mut Random) -> Scene {
    let scene = two_lane(random);
    entering(scene, &TWO_LANE[1], random)
}

/// The vehicle comes along its arm to where it waits else, and would leave by the first exit or straight on.
fn entering(scene: Scene, passage: &Passage, random: &mut Random) -> Scene {
    /// Way to where it waits.
    const WAY_M: f64 = 60.0;
    const BRAKES_S: f64 = 4.0;
    let exit = 1 + random.below(2) as u32;
    // From the begin of the way to where the bend into the circle begins.
    let bend_m = -passage.path(EGO_DEG, 0.0, exit).at(0.0).position_m[1];
    let approach_m = WAY_M - bend_m;
    let even_s = (WAY_M - APPROACH_MPS * BRAKES_S / 2.0) / APPROACH_MPS;
    Scene {
        ego: passage
            .path(EGO_DEG, approach_m, exit)
            .steered(STEERING_M)
            .timed(&[
                (0.0, APPROACH_MPS),
                (even_s, APPROACH_MPS),
                (even_s + BRAKES_S, 0.0),
            ]),
        ..scene
    }
}

/// Cars begin as far away as they must to come when they do: nobody stands and waits for his turn.
fn scene(
    random: &mut Random,
    passages: &[Passage],
    circles: &[Circle],
    bikeway_m: Option<f64>,
    pavement_m: f64,
    cars: usize,
) -> Scene {
    let outermost = passages.last().copied().unwrap_or(SMALL);
    let ego = Path::parked([0.0; 2], EGO_DEG);
    let centre_m = outermost.centre_m;
    let mut actors: Vec<Actor> = vec![];
    for bikeway_m in bikeway_m.into_iter().flat_map(|radius_m| [radius_m; 2]) {
        let start_deg = 360.0 * random.uniform();
        let ride = Path::circle(centre_m, bikeway_m, start_deg, 4.17 * about(random, 0.15));
        admit(
            &mut actors,
            &ego,
            actor(Variant::cyclist(random), ride),
            3.0,
        );
    }
    let walk = Path::circle(
        centre_m,
        -pavement_m,
        360.0 * random.uniform(),
        1.39 * about(random, 0.15),
    );
    admit(
        &mut actors,
        &ego,
        actor(Variant::pedestrian(random), walk),
        2.0,
    );
    for _ in 0..cars {
        for _ in 0..40 {
            let comes_s = 2.0 + (LONGEST_S - 10.0) * random.uniform();
            let heading_deg = HEADINGS_DEG[random.below(HEADINGS_DEG.len())];
            let exit = 1 + random.below(3) as u32;
            // Who goes far takes the inner lane.
            let passage = if exit > 2 { passages[0] } else { outermost };
            let round_mps = (5.5 + 2.0 * random.uniform()) * libm::sqrt(passage.radius_m / 11.0);
            let path = passing(&passage, heading_deg, exit, comes_s, round_mps);
            let car = actor(Variant::car(random), path);
            // The arm of the waiting vehicle is taken.
            if heading_deg != EGO_DEG && admit(&mut actors, &ego, car, APART_M) {
                break;
            }
        }
    }
    Scene {
        sensor_height_m: SENSOR_M,
        ego,
        poses: PoseMessages::Applanix,
        actors,
        scenery: scenery(random, passages, circles, pavement_m),
        terrain: Terrain {
            swells: vec![],
            unevenness_m: 0.02,
        },
        range_deviation_m: RANGE_DEVIATION_M,
    }
}

/// At the begin of the corner at a time, round, and away.
fn passing(passage: &Passage, heading_deg: f64, exit: u32, comes_s: f64, round_mps: f64) -> Path {
    const SLOWS_S: f64 = 2.0;
    let slowing_m = SLOWS_S * (APPROACH_MPS + round_mps) / 2.0;
    let approach_m = APPROACH_MPS * comes_s + slowing_m;
    let leaves_s = comes_s + SLOWS_S + passage.inside_m(exit) / round_mps;
    let way = passage.path(heading_deg, approach_m, exit);
    way.steered(STEERING_M).timed(&[
        (0.0, APPROACH_MPS),
        (comes_s, APPROACH_MPS),
        (comes_s + SLOWS_S, round_mps),
        (leaves_s, round_mps),
        (leaves_s + 2.0, APPROACH_MPS),
    ])
}

/// Lets somebody in who never comes near to anybody.
fn admit(actors: &mut Vec<Actor>, ego: &Path, newcomer: Actor, apart_m: f64) -> bool {
    let is_clear = (0..(4.0 * LONGEST_S) as u32).all(|quarter| {
        let seconds = 0.25 * f64::from(quarter);
        let [x, y] = newcomer.path.at(seconds).position_m;
        let others = actors.iter().map(|other| &other.path).chain([ego]);
        others
            .map(|path| path.at(seconds).position_m)
            .all(|[u, v]| {
                // The waiting vehicle stands in nobody's lane but its own, across which cycle path and pavement lead.
                libm::hypot(u - x, v - y) > apart_m
            })
    });
    if is_clear {
        actors.push(newcomer);
    }
    is_clear
}

/// Kerbs, and corners that differ from seed to seed.
fn scenery(
    random: &mut Random,
    passages: &[Passage],
    circles: &[Circle],
    pavement_m: f64,
) -> Scenery {
    /// The middle of a mini roundabout is driven over.
    const DRIVEN_OVER_M: f64 = 4.0;
    let mut scenery = Scenery::default();
    let centre_m = passages.first().unwrap_or(&SMALL).centre_m;
    let [island_m, edge_m] = road_edges_m(circles);
    scenery.island(centre_m, island_m);
    kerb(&mut scenery, passages, centre_m, edge_m);
    if island_m > DRIVEN_OVER_M {
        scenery.bush(
            centre_m,
            1.5 + 2.0 * random.uniform(),
            0.5 + 0.8 * random.uniform(),
        );
    }
    for (east, north) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let [x, y] = centre_m;
        let corner = |far_m: f64| [x + east * far_m, y + north * far_m];
        scenery.pole(corner(pavement_m + 1.0), 0.09, 6.0);
        scenery.tree(corner(pavement_m + 6.0 + 4.0 * random.uniform()), 1.8);
        scenery.house(corner(pavement_m + 22.0), 0.0, [14.0, 12.0], 7.0);
    }
    scenery
}

/// Stones around the circle's outer edge, but where somebody drives in or out.
fn kerb(scenery: &mut Scenery, passages: &[Passage], centre_m: [f64; 2], edge_m: f64) {
    const STONE_M: [f64; 2] = [1.2, 0.4];
    /// From the middle of a car.
    const CLEAR_M: f64 = 1.7;
    let exits = passages
        .iter()
        .flat_map(|passage| [1, 2, 3].map(|exit| (passage, exit)));
    let ways = exits.flat_map(|(passage, exit)| {
        HEADINGS_DEG.map(|heading_deg| {
            let way = passage.path(heading_deg, 0.0, exit);
            way.points(0.0, way.length_m())
        })
    });
    let driven_m = ways.flatten().collect::<Vec<_>>();
    let middle_m = edge_m + STONE_M[1] / 2.0;
    let stones = (TAU * middle_m / STONE_M[0]) as usize;
    for stone in 0..stones {
        let angle_rad = TAU * stone as f64 / stones as f64;
        let (sine, cosine) = libm::sincos(angle_rad);
        let at_m = [
            centre_m[0] + middle_m * cosine,
            centre_m[1] + middle_m * sine,
        ];
        let is_clear = |&[x, y]: &[f64; 2]| libm::hypot(x - at_m[0], y - at_m[1]) > CLEAR_M;
        if driven_m.iter().all(is_clear) {
            scenery.pavement(at_m, 90.0 + angle_rad.to_degrees(), STONE_M);
        }
    }
}
