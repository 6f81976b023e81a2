//! A street among gardens: what stands behind parked vehicles is ragged, close, and hangs over them.

use super::chance::{between, parked, pick, range_deviation_m, stand_at_kerb};
use super::strangers::{add_column, along_the_street};
use crate::random::Random;
use crate::simulate::scenario::{Actor, PoseMessages, Scene};
use crate::simulate::scenery::Scenery;
use crate::simulate::terrain::{Swell, Terrain};

/// How far the street reaches to the north and to the south.
const REACH_M: [f64; 2] = [-20.0, 120.0];
/// From the middle of the street to the middle of what stands at the kerb.
pub(super) const KERB_M: f64 = 4.7;
/// Least and greatest distance from there to the front of the gardens.
const GARDEN_M: [f64; 2] = [1.4, 6.0];

pub(super) fn overgrown(random: &mut Random) -> Scene {
    let turn_rad = between(random, 0.0, std::f64::consts::TAU);
    let terrain = Terrain {
        swells: vec![
            Swell {
                direction: [libm::cos(turn_rad), libm::sin(turn_rad)],
                from_m: between(random, -30.0, 50.0),
                length_m: between(random, 15.0, 60.0),
                rise_m: between(random, -1.2, 1.2),
            },
            // A bank or a ditch beside the street.
            Swell {
                direction: [if random.uniform() < 0.5 { 1.0 } else { -1.0 }, 0.0],
                from_m: between(random, 6.5, 12.0),
                length_m: between(random, 2.0, 12.0),
                rise_m: between(random, -1.0, 1.5),
            },
        ],
        unevenness_m: between(random, 0.0, 0.08),
    };
    let mut scenery = Scenery::on(&terrain);
    let mut actors = vec![];
    for side in [-1.0, 1.0] {
        let shares = [between(random, 0.15, 0.9), 0.5];
        kerb(random, &mut scenery, &mut actors, side, REACH_M, shares);
        let mut front_m = between(random, GARDEN_M[0], GARDEN_M[1]);
        let mut along_m = REACH_M[0];
        while along_m < REACH_M[1] {
            if random.uniform() < 0.15 {
                front_m = between(random, GARDEN_M[0], GARDEN_M[1]);
            }
            let length_m = between(random, 2.0, 12.0);
            garden(
                random,
                &mut scenery,
                side,
                KERB_M + front_m,
                [along_m, along_m + length_m],
            );
            along_m += length_m;
        }
    }
    let speed_mps = between(random, 0.0, 13.0);
    add_column(random, &mut actors, speed_mps);
    Scene {
        sensor_height_m: between(random, 1.5, 2.2),
        ego: along_the_street(speed_mps),
        poses: PoseMessages::None,
        actors,
        scenery,
        terrain,
        range_deviation_m: range_deviation_m(random),
    }
}

/// What stands at the kerb of a side: a share of the places hold a parked vehicle, and a share of the others something else.
pub(super) fn kerb(
    random: &mut Random,
    scenery: &mut Scenery,
    actors: &mut Vec<Actor>,
    side: f64,
    [from_m, to_m]: [f64; 2],
    [parked_share, other_share]: [f64; 2],
) {
    let mut along_m = from_m;
    while along_m < to_m {
        let at_m = [side * KERB_M, along_m];
        let mut room_m = between(random, 5.2, 7.5);
        if random.uniform() < parked_share {
            let actor = parked(random, at_m);
            room_m = room_m.max(2.0 * (actor.path.at(0.0).position_m[1] - along_m) + 7.0);
            actors.push(actor);
        } else if random.uniform() < other_share {
            match pick(random, &[0.2, 0.2]) {
                Some(0) => board(random, scenery, at_m, side),
                Some(1) => bed(random, scenery, at_m, side),
                _ => stand_at_kerb(random, scenery, at_m),
            }
        }
        along_m += room_m;
    }
}

/// A direction sign or an advertisement on two posts: as wide and as high as the rear of a vehicle.
fn board(random: &mut Random, scenery: &mut Scenery, [x, y]: [f64; 2], side: f64) {
    let low_m = between(random, 0.2, 2.8);
    let heights_m = [low_m, low_m + between(random, 0.5, 2.2)];
    let x = x + side * between(random, 0.0, 3.0);
    let turn_deg = between(random, -25.0, 25.0);
    let wide_m = between(random, 1.0, 3.8);
    scenery.panel([x, y], turn_deg, [wide_m, 0.06], heights_m);
    for off_m in [-0.35 * wide_m, 0.35 * wide_m] {
        scenery.pole([x + off_m, y], 0.05, heights_m[1]);
    }
}

/// A raised bed, the kerb of an island, a heap: as low as a bonnet or lower.
fn bed(random: &mut Random, scenery: &mut Scenery, [x, y]: [f64; 2], side: f64) {
    let sizes_m = [between(random, 0.6, 4.5), between(random, 0.4, 2.0)];
    let at_m = [x + side * between(random, -0.5, 3.0), y];
    let turn_deg = between(random, 0.0, 180.0);
    scenery.cabinet(at_m, turn_deg, sizes_m, between(random, 0.12, 0.9));
}

/// What grows or stands along a stretch of a side, from a distance to the street's middle on.
fn garden(
    random: &mut Random,
    scenery: &mut Scenery,
    side: f64,
    front_m: f64,
    [from_m, to_m]: [f64; 2],
) {
    let (length_m, middle_m) = (to_m - from_m, 0.5 * (from_m + to_m));
    match pick(random, &[0.3, 0.2, 0.15, 0.1, 0.15, 0.05]) {
        Some(0) => thicket(random, scenery, side, front_m, [from_m, to_m]),
        Some(1) => hedge(random, scenery, side, front_m, [from_m, to_m]),
        Some(2) => {
            let high_m = between(random, 0.5, 3.0);
            scenery.wall([side * front_m, middle_m], 90.0, length_m, high_m);
        }
        Some(3) => {
            let (high_m, open) = (between(random, 0.8, 2.0), between(random, 0.3, 0.9));
            scenery.fence([side * front_m, middle_m], 90.0, length_m, high_m, open);
        }
        Some(4) => front(random, scenery, side, front_m, [from_m, to_m]),
        Some(5) => {
            // A shed, a transformer house, a container: no larger than a van.
            let (long_m, deep_m) = (between(random, 1.0, 6.0), between(random, 0.8, 3.0));
            let high_m = between(random, 1.2, 3.2);
            let across_m = side * (front_m + 0.5 * deep_m);
            scenery.house([across_m, middle_m], 90.0, [long_m, deep_m], high_m);
        }
        _ => {}
    }
    // Before it or around it.
    if random.uniform() < 0.5 {
        let wide_m = between(random, 0.6, 5.0);
        let at_m = [side * (front_m + between(random, -1.0, 3.0)), middle_m];
        let high_m = between(random, 0.05, 0.6);
        let way_m = libm::exp(between(random, -2.5, 0.0));
        scenery.grass(at_m, 90.0, [length_m, wide_m], high_m, way_m);
    }
    // Behind it, and over it.
    let behind_m = front_m + between(random, 1.0, 6.0);
    match pick(random, &[0.3, 0.3]) {
        Some(0) => thicket(random, scenery, side, behind_m, [from_m, to_m]),
        Some(1) => front(random, scenery, side, behind_m, [from_m, to_m]),
        _ => {}
    }
    if random.uniform() < 0.5 {
        let across_m = front_m + between(random, -1.0, 3.0);
        let along_m = between(random, from_m, to_m);
        tree(random, scenery, [side * across_m, along_m]);
    }
}

/// A hedge, cut once and grown since.
pub(super) fn hedge(
    random: &mut Random,
    scenery: &mut Scenery,
    side: f64,
    front_m: f64,
    [from_m, to_m]: [f64; 2],
) {
    let high_m = between(random, 0.6, 2.6);
    let mut along_m = from_m;
    while along_m < to_m {
        let radius_m = between(random, 0.3, 0.6);
        let heights_m = [
            between(random, 0.0, 0.2),
            high_m * between(random, 0.75, 1.25),
        ];
        let way_m = between(random, 0.1, 0.5);
        let across_m = front_m + 0.4 + between(random, -0.2, 0.2);
        scenery.clump([side * across_m, along_m], radius_m, heights_m, way_m);
        along_m += between(random, 0.4, 0.9);
    }
}

/// Shrubs of all sizes.
fn thicket(
    random: &mut Random,
    scenery: &mut Scenery,
    side: f64,
    front_m: f64,
    [from_m, to_m]: [f64; 2],
) {
    let high_m = between(random, 0.8, 5.0);
    let density = between(random, 0.5, 2.5);
    let count = (density * (to_m - from_m)) as usize;
    for _ in 0..count {
        let radius_m = between(random, 0.15, 1.1);
        let at_m = [
            side * (front_m + radius_m + between(random, 0.0, 2.5)),
            between(random, from_m, to_m),
        ];
        let low_m = if random.uniform() < 0.6 {
            0.0
        } else {
            between(random, 0.2, 1.5)
        };
        let heights_m = [low_m, low_m + high_m * between(random, 0.2, 1.0)];
        let way_m = libm::exp(between(random, -2.5, 1.0));
        scenery.clump(at_m, radius_m, heights_m, way_m);
    }
}

/// A trunk, branches that begin at any height, and a crown with holes.
fn tree(random: &mut Random, scenery: &mut Scenery, at_m: [f64; 2]) {
    let begins_m = between(random, 1.4, 3.2);
    let crown_m = between(random, 1.0, 3.5);
    let trunk_m = between(random, 0.08, 0.3);
    scenery.pole(at_m, trunk_m, begins_m + 2.0);
    for _ in 0..6 + random.below(10) {
        let (turn_rad, out_m) = (
            between(random, 0.0, std::f64::consts::TAU),
            crown_m * libm::sqrt(random.uniform()),
        );
        let place_m = [
            at_m[0] + out_m * libm::cos(turn_rad),
            at_m[1] + out_m * libm::sin(turn_rad),
        ];
        let low_m = begins_m + between(random, 0.0, 2.5);
        let heights_m = [low_m, low_m + between(random, 0.5, 3.0)];
        let (radius_m, way_m) = (
            between(random, 0.3, 1.3),
            libm::exp(between(random, -1.5, 1.0)),
        );
        scenery.clump(place_m, radius_m, heights_m, way_m);
    }
}

/// A house with bays, steps and recesses.
pub(super) fn front(
    random: &mut Random,
    scenery: &mut Scenery,
    side: f64,
    front_m: f64,
    [from_m, to_m]: [f64; 2],
) {
    let high_m = between(random, 3.0, 9.0);
    let mut along_m = from_m;
    while along_m < to_m {
        let length_m = between(random, 0.6, 3.5).min(to_m - along_m).max(0.3);
        let depth_m = between(random, 0.0, 0.8);
        let low_m = if random.uniform() < 0.25 {
            between(random, 0.8, 2.6)
        } else {
            high_m
        };
        let across_m = side * (front_m + depth_m + 2.5);
        scenery.house(
            [across_m, along_m + 0.5 * length_m],
            90.0,
            [length_m, 5.0],
            low_m,
        );
        if low_m < high_m {
            scenery.house(
                [across_m + side * 0.8, along_m + 0.5 * length_m],
                90.0,
                [length_m, 5.0],
                high_m,
            );
        }
        along_m += length_m;
    }
}
