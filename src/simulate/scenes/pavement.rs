//! People who walk and wait close to the fronts of a street, before and behind parked vehicles.

use super::actor;
use super::chance::{between, person, pick, range_deviation_m};
use super::overgrown::{KERB_M, front, hedge, kerb};
use super::strangers::along_the_street;
use crate::random::Random;
use crate::simulate::path::Path;
use crate::simulate::scenario::{Actor, PoseMessages, Scene};
use crate::simulate::scenery::Scenery;
use crate::simulate::terrain::Terrain;

/// How far the street reaches to the north and to the south.
const REACH_M: [f64; 2] = [-20.0, 100.0];
/// Least and greatest distance from the middle of what stands at the kerb to the fronts.
const FRONT_M: [f64; 2] = [3.0, 4.8];
/// Least and greatest distance from a front to the middle of who walks along it or waits there.
const BESIDE_M: [f64; 2] = [0.45, 1.0];
/// Share of the sides on which all wait: nobody walks into anybody.
const WAITING: f64 = 0.3;

pub(super) fn pavement(random: &mut Random) -> Scene {
    let terrain = Terrain {
        swells: vec![],
        unevenness_m: between(random, 0.0, 0.03),
    };
    let mut scenery = Scenery::on(&terrain);
    let mut actors = vec![];
    for side in [-1.0, 1.0] {
        let shares = [between(random, 0.1, 0.6), 0.3];
        kerb(random, &mut scenery, &mut actors, side, REACH_M, shares);
        let front_m = KERB_M + between(random, FRONT_M[0], FRONT_M[1]);
        let mut along_m = REACH_M[0];
        while along_m < REACH_M[1] {
            let length_m = between(random, 4.0, 20.0);
            let stretch_m = [along_m, along_m + length_m];
            match pick(random, &[0.5, 0.2, 0.2]) {
                Some(0) => front(random, &mut scenery, side, front_m, stretch_m),
                Some(1) => {
                    let middle_m = [side * front_m, along_m + 0.5 * length_m];
                    let high_m = between(random, 0.6, 3.0);
                    scenery.wall(middle_m, 90.0, length_m, high_m);
                }
                Some(2) => hedge(random, &mut scenery, side, front_m, stretch_m),
                _ => {}
            }
            along_m += length_m;
        }
        add_people(random, &mut actors, side, front_m);
    }
    Scene {
        sensor_height_m: between(random, 1.5, 2.2),
        ego: along_the_street(between(random, 0.0, 8.0)),
        poses: PoseMessages::None,
        actors,
        scenery,
        terrain,
        range_deviation_m: range_deviation_m(random),
    }
}

/// People along the fronts of a side: all walk in one direction at one speed, or all wait.
fn add_people(random: &mut Random, actors: &mut Vec<Actor>, side: f64, front_m: f64) {
    let waits = random.uniform() < WAITING;
    let yaw_deg = if random.uniform() < 0.5 { 90.0 } else { -90.0 };
    let speed_mps = between(random, 0.5, 1.8);
    let mut along_m = REACH_M[0] + between(random, 0.0, 10.0);
    while along_m < REACH_M[1] {
        let beside_m = between(random, BESIDE_M[0], BESIDE_M[1]);
        let at_m = [side * (front_m - beside_m), along_m];
        let path = if waits {
            Path::parked(at_m, between(random, 0.0, 360.0))
        } else {
            Path::straight(at_m, yaw_deg, speed_mps)
        };
        actors.push(actor(person(random), path));
        along_m += between(random, 3.0, 15.0);
    }
}
