//! Streets that chance furnishes, so that nothing is fitted to a scene: every seed draws other
//! things, sizes, places, paints, panes, slopes, another height of the sensor and other noise.

use super::actor;
use super::chance::{
    between, bus, car, car_in_bay, lorry, parked, person, pick, range_deviation_m, rider,
    stand_at_kerb,
};
use crate::random::Random;
use crate::simulate::path::Path;
use crate::simulate::scenario::{Actor, PoseMessages, Scene};
use crate::simulate::scenery::Scenery;
use crate::simulate::terrain::{Swell, Terrain};
use crate::simulate::variant::{Build, Class};

/// How far the street reaches to the north and to the south.
const REACH_M: [f64; 2] = [-30.0, 100.0];
/// From the middle of the street to the middle of what stands at the kerb, behind the pavement, and
/// behind that.
const KERB_M: f64 = 4.7;
const BEHIND_M: f64 = 11.5;
const FAR_M: f64 = 17.5;
/// From the middle of the street to where people walk.
const WALK_M: f64 = 7.5;
/// Room along the street for what stands at the kerb and behind the pavement.
const BAY_M: f64 = 6.2;

pub(super) fn strangers(random: &mut Random) -> Scene {
    build(random, true)
}

pub(super) fn furniture(random: &mut Random) -> Scene {
    build(random, false)
}

fn build(random: &mut Random, with_road_users: bool) -> Scene {
    let swell = |random: &mut Random| {
        let turn_rad = between(random, 0.0, std::f64::consts::TAU);
        Swell {
            direction: [libm::cos(turn_rad), libm::sin(turn_rad)],
            from_m: between(random, -30.0, 50.0),
            length_m: between(random, 15.0, 60.0),
            rise_m: between(random, -1.5, 1.5),
        }
    };
    let terrain = Terrain {
        swells: (0..2).map(|_| swell(random)).collect(),
        unevenness_m: between(random, 0.0, 0.03),
    };
    let mut scenery = Scenery::on(&terrain);
    let mut actors = vec![];
    for side in [-1.0, 1.0] {
        if random.uniform() < 0.6 {
            let middle_m = 0.5 * (REACH_M[0] + REACH_M[1]);
            let sizes_m = [REACH_M[1] - REACH_M[0], 2.6];
            scenery.pavement([side * WALK_M, middle_m], 90.0, sizes_m);
        }
        let mut along_m = REACH_M[0];
        while along_m < REACH_M[1] {
            let at_m = [side * KERB_M, along_m];
            let mut room_m = BAY_M;
            if with_road_users && random.uniform() < 0.4 {
                let actor = parked(random, at_m);
                let length_m = actor.variant.size_m[0];
                if length_m > BAY_M - 0.7 {
                    room_m = length_m + 3.5;
                }
                actors.push(actor);
            } else {
                stand_at_kerb(random, &mut scenery, at_m);
            }
            stand_behind(
                random,
                &mut scenery,
                &mut actors,
                with_road_users,
                [side * BEHIND_M, along_m],
            );
            stand_far(random, &mut scenery, [side * FAR_M, along_m]);
            along_m += room_m;
        }
    }
    let speed_mps = if random.uniform() < 0.4 {
        0.0
    } else {
        between(random, 1.0, 9.0)
    };
    if with_road_users {
        add_traffic(random, &mut actors);
        add_column(random, &mut actors, speed_mps);
    }
    if random.uniform() < 0.15 {
        let middle_m = 0.5 * (REACH_M[0] + REACH_M[1]);
        let above_m = between(random, 3.5, 6.0);
        scenery.ceiling([0.0, middle_m], [40.0, REACH_M[1] - REACH_M[0]], above_m);
    }
    Scene {
        sensor_height_m: between(random, 1.2, 2.6),
        ego: along_the_street(speed_mps),
        poses: PoseMessages::None,
        actors,
        scenery,
        terrain,
        range_deviation_m: range_deviation_m(random),
    }
}

/// The way of the sensor's vehicle, north in its lane, at one speed.
pub(super) fn along_the_street(speed_mps: f64) -> Path {
    Path::from([1.75, 0.0], 90.0)
        .line(400.0)
        .timed(&[(0.0, speed_mps), (100.0, speed_mps)])
}

fn stand_behind(
    random: &mut Random,
    scenery: &mut Scenery,
    actors: &mut Vec<Actor>,
    with_road_users: bool,
    [x, y]: [f64; 2],
) {
    let slant_deg = between(random, 80.0, 100.0);
    let length_m = between(random, 2.0, 5.8);
    match pick(random, &[0.2, 0.14, 0.08, 0.1, 0.1, 0.08, 0.1, 0.1]) {
        Some(0) => {
            let high_m = between(random, 0.7, 2.4);
            scenery.hedge([x, y], slant_deg, length_m, high_m);
        }
        Some(1) => {
            let high_m = between(random, 0.5, 2.6);
            scenery.wall([x, y], slant_deg, length_m, high_m);
        }
        Some(2) => {
            let high_m = between(random, 0.8, 2.2);
            let open = between(random, 0.3, 0.9);
            scenery.fence([x, y], slant_deg, length_m, high_m, open);
        }
        Some(3) => {
            let crown_m = between(random, 1.0, 2.2);
            scenery.tree([x, y], crown_m);
        }
        Some(4) => {
            for _ in 0..1 + random.below(3) {
                let at_m = [
                    x + between(random, -1.5, 1.5),
                    y + between(random, -2.0, 2.0),
                ];
                let radius_m = between(random, 0.3, 1.2);
                let high_m = between(random, 0.5, 2.3);
                scenery.bush(at_m, radius_m, high_m);
            }
        }
        // Transformer stations, kiosks, containers, sheds: some are as large as vehicles.
        Some(5) => {
            let sizes_m = [between(random, 0.8, 5.5), between(random, 0.5, 2.4)];
            let high_m = between(random, 1.0, 2.8);
            scenery.cabinet([x, y], slant_deg, sizes_m, high_m);
        }
        Some(6) if with_road_users => {
            let variant = car_in_bay(random);
            let yaw_deg =
                between(random, -10.0, 10.0) + if random.uniform() < 0.5 { 180.0 } else { 0.0 };
            actors.push(actor(variant, Path::parked([x, y], yaw_deg)));
        }
        Some(7) if with_road_users => {
            for number in 0..1 + random.below(3) {
                let place_m = [x + between(random, -0.4, 0.4), y + 1.1 * number as f64];
                let yaw_deg = between(random, -180.0, 180.0);
                actors.push(actor(person(random), Path::parked(place_m, yaw_deg)));
            }
        }
        _ => {}
    }
}

fn stand_far(random: &mut Random, scenery: &mut Scenery, [x, y]: [f64; 2]) {
    let across_m = between(random, 4.0, 6.0);
    match pick(random, &[0.4, 0.15, 0.15, 0.1]) {
        Some(0) => {
            let high_m = between(random, 2.5, 9.0);
            scenery.house([x, y], 90.0, [BAY_M, across_m], high_m);
        }
        Some(1) => {
            let high_m = between(random, 0.8, 3.0);
            scenery.wall([x, y], 90.0, BAY_M, high_m);
        }
        Some(2) => {
            let high_m = between(random, 0.8, 3.0);
            scenery.hedge([x, y], 90.0, BAY_M, high_m);
        }
        Some(3) => {
            let crown_m = between(random, 1.5, 3.0);
            scenery.tree([x, y], crown_m);
        }
        _ => {}
    }
}

/// Vehicles ahead and behind in the lane, as fast as the sensor's: a queue, or traffic that flows.
pub(super) fn add_column(random: &mut Random, actors: &mut Vec<Actor>, speed_mps: f64) {
    for direction in [1.0, -1.0] {
        let mut along_m = between(random, 7.0, 30.0);
        for _ in 0..random.below(4) {
            let variant = match pick(random, &[0.75, 0.17, 0.04]) {
                Some(0) => car(random),
                Some(1) => lorry(random),
                Some(2) => bus(random),
                _ => rider(random),
            };
            along_m += 0.5 * variant.size_m[0];
            let at_m = [1.75 + between(random, -0.3, 0.3), direction * along_m];
            let slant_deg = between(random, -3.0, 3.0);
            let path = if speed_mps > 0.0 {
                Path::straight(at_m, 90.0, speed_mps)
            } else {
                Path::parked(at_m, 90.0 + slant_deg)
            };
            actors.push(actor(variant, path));
            along_m += 0.5 * variant.size_m[0] + between(random, 2.0, 14.0);
        }
    }
}

/// One lane of oncoming vehicles, and people on both pavements, all of a row at one speed.
fn add_traffic(random: &mut Random, actors: &mut Vec<Actor>) {
    let speed_mps = between(random, 3.0, 12.0);
    for number in 0..5 {
        let variant = match pick(random, &[0.5, 0.15, 0.05]) {
            Some(0) => car(random),
            Some(1) => lorry(random),
            Some(2) => bus(random),
            _ => rider(random),
        };
        let begin_m = [
            -1.75,
            20.0 + 28.0 * f64::from(number) + between(random, 0.0, 8.0),
        ];
        let speed_mps = if variant.class == Class::Cyclist && variant.build != Build::Motorcycle {
            speed_mps.min(8.0)
        } else {
            speed_mps
        };
        let path = Path::straight(begin_m, -90.0, speed_mps);
        let is_behind_slow = actors.last().is_some_and(|last| {
            last.path.at(1.0).speed_mps > 0.0 && last.path.at(1.0).speed_mps < speed_mps
        });
        if !is_behind_slow {
            actors.push(actor(variant, path));
        }
    }
    for side in [-1.0, 1.0] {
        for (lane_m, yaw_deg) in [(0.6, 90.0), (-0.7, -90.0)] {
            let speed_mps = between(random, 0.5, 1.9);
            let mut along_m = between(random, -20.0, 10.0);
            while along_m < 70.0 {
                let x = side * WALK_M + lane_m + between(random, -0.1, 0.1);
                let path = Path::straight([x, along_m], yaw_deg, speed_mps);
                actors.push(actor(person(random), path));
                along_m += between(random, 4.0, 30.0);
            }
        }
    }
}
