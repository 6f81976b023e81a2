//! Cyclists and people on foot who keep together: one behind another, side by side, and both.

use std::ops::Range;

use super::actor;
use super::chance::{between, car_in_bay, person, range_deviation_m, stand_at_kerb};
use super::strangers::along_the_street;
use crate::random::Random;
use crate::simulate::path::Path;
use crate::simulate::scenario::{Actor, PoseMessages, Scene};
use crate::simulate::scenery::Scenery;
use crate::simulate::terrain::Terrain;
use crate::simulate::variant::Variant;

/// From the middle of the street to the middle of what stands at the kerb, and its room along it.
const KERB_M: f64 = 6.2;
const BAY_M: f64 = 6.4;
/// From there to where cyclists are overtaken and met, and to where people walk to the north and to the
/// south.
const EDGE_M: f64 = 4.2;
const OTHER_LANE_M: f64 = -1.9;
const WALKS_M: [f64; 2] = [8.4, 10.6];
/// Share of the rows that are two side by side.
const PAIRS: f64 = 0.4;

/// A group: who it consists of, in which rows and files each is, and how they go.
struct Group {
    kind: fn(&mut Random) -> Variant,
    /// The middle of the first row.
    first_m: [f64; 2],
    yaw_deg: f64,
    speed_mps: f64,
    rows: usize,
    /// Share of the rows that are two side by side.
    pairs: f64,
    /// Between the middles of two that follow each other, and of two beside each other.
    behind_m: Range<f64>,
    beside_m: Range<f64>,
}

pub(super) fn groups(random: &mut Random) -> Scene {
    let terrain = Terrain {
        swells: vec![],
        unevenness_m: between(random, 0.0, 0.03),
    };
    let mut scenery = Scenery::on(&terrain);
    let mut actors = vec![];
    for side in [-1.0, 1.0] {
        for bay in 0..20 {
            let at_m = [side * KERB_M, -20.0 + BAY_M * f64::from(bay)];
            if random.uniform() < 0.3 {
                let car = car_in_bay(random);
                actors.push(actor(car, Path::parked(at_m, 90.0)));
            } else {
                stand_at_kerb(random, &mut scenery, at_m);
            }
        }
        add_walkers(random, &mut actors, side);
    }
    let speed_mps = between(random, 2.0, 7.0);
    add_riders(random, &mut actors, speed_mps);
    Scene {
        sensor_height_m: between(random, 1.3, 2.3),
        ego: along_the_street(speed_mps),
        poses: PoseMessages::None,
        actors,
        scenery,
        terrain,
        range_deviation_m: range_deviation_m(random),
    }
}

/// Cyclists who are followed in the lane at the vehicle's speed, overtaken at its edge, and met in the
/// other lane.
fn add_riders(random: &mut Random, actors: &mut Vec<Actor>, speed_mps: f64) {
    let [slower_mps, oncoming_mps] = [
        speed_mps * between(random, 0.4, 0.8),
        between(random, 2.5, 6.5),
    ];
    let followed = |first_m: [f64; 2], rows: usize| Group {
        kind: Variant::cyclist,
        first_m,
        yaw_deg: 90.0,
        speed_mps,
        rows,
        pairs: PAIRS,
        behind_m: 2.1..4.0,
        beside_m: 0.9..1.4,
    };
    let mut along_m = between(random, 5.0, 12.0);
    let rows = 1 + random.below(3);
    add(random, actors, followed([1.75, along_m], rows));
    along_m += 18.0;
    while along_m < 90.0 {
        let rows = 1 + random.below(4);
        let overtaken = Group {
            speed_mps: slower_mps,
            pairs: 0.0,
            ..followed([EDGE_M, along_m], rows)
        };
        add(random, actors, overtaken);
        let rows = 1 + random.below(4);
        let met = Group {
            yaw_deg: -90.0,
            speed_mps: oncoming_mps,
            ..followed([OTHER_LANE_M, along_m + 15.0], rows)
        };
        add(random, actors, met);
        along_m += between(random, 20.0, 40.0);
    }
}

/// People who walk in both directions on one side of the street.
fn add_walkers(random: &mut Random, actors: &mut Vec<Actor>, side: f64) {
    for (walk_m, yaw_deg) in WALKS_M.into_iter().zip([90.0, -90.0]) {
        let speed_mps = between(random, 0.6, 1.8);
        let mut along_m = between(random, -10.0, 10.0);
        while along_m < 80.0 {
            let walkers = Group {
                kind: person,
                first_m: [side * walk_m, along_m],
                yaw_deg,
                speed_mps,
                rows: 1 + random.below(4),
                pairs: PAIRS,
                behind_m: 1.0..1.8,
                beside_m: 0.75..1.0,
            };
            add(random, actors, walkers);
            along_m += between(random, 12.0, 40.0);
        }
    }
}

/// Everybody of a group goes straight on at its speed.
fn add(random: &mut Random, actors: &mut Vec<Actor>, group: Group) {
    let [x_m, mut y_m] = group.first_m;
    let within = |random: &mut Random, range: &Range<f64>| between(random, range.start, range.end);
    for _ in 0..group.rows {
        let is_pair = random.uniform() < group.pairs;
        let off_m = 0.5 * within(random, &group.beside_m);
        let files_m: &[f64] = if is_pair { &[-off_m, off_m] } else { &[0.0] };
        for file_m in files_m {
            let place_m = [
                x_m + file_m + between(random, -0.05, 0.05),
                y_m + between(random, -0.1, 0.1),
            ];
            let path = Path::straight(place_m, group.yaw_deg, group.speed_mps);
            actors.push(actor((group.kind)(random), path));
        }
        y_m += within(random, &group.behind_m);
    }
}
