//! What one column of rays can hit: the scene at a moment, from where the sensor is then.

use super::body;
use super::path::Moment;
use super::scenario::{Actor, Scene};
use super::solid::{Hit, Ray, Solid, Vector};
use super::terrain::Terrain;
use crate::random::Random;

/// What a ray ends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Surface {
    Ground,
    Scenery,
    RoadUser(usize),
}

/// The sensor on its vehicle at a moment.
pub(super) struct Carrier {
    pub(super) moment: Moment,
    pub(super) sensor_m: Vector,
    /// Nose up.
    pitch_rad: f64,
    /// Right side down.
    roll_rad: f64,
}

/// Half of the distance over which a vehicle averages the slope of the road.
const HALF_BASE_M: f64 = 1.35;
/// How much a body pitches and rolls on its springs, radians for each m/s².
const PITCH_PER_MPS2: f64 = 0.006;
const ROLL_PER_MPS2: f64 = 0.008;
/// What remains of bumps, at highest, and how often they come.
const WOBBLE_RAD: f64 = 0.004;
const WOBBLE_HZ: f64 = 1.3;

impl Carrier {
    pub(super) fn of(scene: &Scene, seconds: f64) -> Self {
        let moment = scene.ego.at(seconds);
        let [x, y] = moment.position_m;
        let (sine, cosine) = libm::sincos(moment.yaw_rad);
        let height_m = |ahead_m: f64, left_m: f64| {
            scene.terrain.height_m(
                x + ahead_m * cosine - left_m * sine,
                y + ahead_m * sine + left_m * cosine,
            )
        };
        let slope = |ahead_m: f64, left_m: f64| {
            (height_m(ahead_m, left_m) - height_m(-ahead_m, -left_m)) / (2.0 * HALF_BASE_M)
        };
        let moving = (moment.speed_mps / 5.0).min(1.0);
        let phase = std::f64::consts::TAU * WOBBLE_HZ * seconds;
        Self {
            sensor_m: [x, y, height_m(0.0, 0.0) + scene.sensor_height_m],
            pitch_rad: libm::atan(slope(HALF_BASE_M, 0.0))
                + PITCH_PER_MPS2 * moment.acceleration_mps2
                + moving * WOBBLE_RAD * libm::sin(phase),
            // In a left bend the body leans to the right.
            roll_rad: libm::atan(slope(0.0, HALF_BASE_M))
                + ROLL_PER_MPS2 * moment.speed_mps * moment.yaw_rate_radps
                + moving * WOBBLE_RAD * libm::sin(1.7 * phase + 1.0),
            moment,
        }
    }

    /// A direction of the sensor frame in the local frame.
    fn turned(&self, [x, y, z]: Vector) -> Vector {
        let (sine_r, cosine_r) = libm::sincos(self.roll_rad);
        let (x, z) = (x * cosine_r + z * sine_r, z * cosine_r - x * sine_r);
        let (sine_p, cosine_p) = libm::sincos(self.pitch_rad);
        let (y, z) = (y * cosine_p - z * sine_p, z * cosine_p + y * sine_p);
        let (sine, cosine) = libm::sincos(self.moment.yaw_rad);
        [x * sine + y * cosine, y * sine - x * cosine, z]
    }
}

/// The solids of every road user, as they are around a moment.
pub(super) fn parts(scene: &Scene, seconds: f64) -> Vec<Vec<Solid>> {
    let of = |actor: &Actor| body::parts(&actor.variant, actor.path.at(seconds).travelled_m);
    scene.actors.iter().map(of).collect()
}

/// Things in the direction of a column.
pub(super) struct Sight<'a> {
    carrier: Carrier,
    terrain: &'a Terrain,
    candidates: Vec<Candidate<'a>>,
}

struct Candidate<'a> {
    place_m: Vector,
    sine: f64,
    cosine: f64,
    solid: &'a Solid,
    surface: Surface,
}

impl<'a> Sight<'a> {
    pub(super) fn new(
        scene: &'a Scene,
        parts: &'a [Vec<Solid>],
        seconds: f64,
        azimuth_rad: f64,
    ) -> Self {
        let carrier = Carrier::of(scene, seconds);
        // A degree or so of pitch and roll turn a ray's bearing by less than the margin.
        let bearing = carrier.turned([libm::sin(azimuth_rad), libm::cos(azimuth_rad), 0.0]);
        let length = libm::hypot(bearing[0], bearing[1]);
        let (dx, dy) = (bearing[0] / length, bearing[1] / length);
        let [sensor_x, sensor_y, _] = carrier.sensor_m;
        let in_sight = |x: f64, y: f64, radius_m: f64| {
            let (x, y) = (x - sensor_x, y - sensor_y);
            let (ahead_m, aside_m) = (x * dx + y * dy, y * dx - x * dy);
            let margin_m = 0.02 * ahead_m.abs();
            aside_m.abs() <= radius_m + margin_m && ahead_m >= -radius_m
        };
        let mut candidates = vec![];
        let mut offer = |place_m: Vector, yaw_rad: f64, solid: &'a Solid, surface: Surface| {
            let (sine, cosine) = libm::sincos(yaw_rad);
            let ([u, v], radius_m) = solid.bounds();
            let x = place_m[0] + u * cosine - v * sine;
            let y = place_m[1] + u * sine + v * cosine;
            if in_sight(x, y, radius_m) {
                candidates.push(Candidate {
                    place_m,
                    sine,
                    cosine,
                    solid,
                    surface,
                });
            }
        };
        for thing in &scene.scenery.things {
            let surface = if thing.is_ground {
                Surface::Ground
            } else {
                Surface::Scenery
            };
            offer(thing.place_m, thing.yaw_rad, &thing.solid, surface);
        }
        for (number, (actor, solids)) in scene.actors.iter().zip(parts).enumerate() {
            let moment = actor.path.at(seconds);
            let [x, y] = moment.position_m;
            let reach_m = actor.variant.size_m[0];
            if !in_sight(x, y, reach_m) {
                continue;
            }
            let place_m = [x, y, scene.terrain.height_m(x, y)];
            for solid in solids {
                offer(place_m, moment.yaw_rad, solid, Surface::RoadUser(number));
            }
        }
        Self {
            carrier,
            terrain: &scene.terrain,
            candidates,
        }
    }

    /// A ray in the sensor's convention: azimuth clockwise from forward.
    pub(super) fn ray(&self, azimuth_rad: f64, elevation_rad: f64) -> Ray {
        let (sine_a, cosine_a) = libm::sincos(azimuth_rad);
        let (sine_e, cosine_e) = libm::sincos(elevation_rad);
        Ray {
            origin: self.carrier.sensor_m,
            direction: self
                .carrier
                .turned([cosine_e * sine_a, cosine_e * cosine_a, sine_e]),
        }
    }

    /// What a ray ends on first.
    pub(super) fn nearest(&self, ray: &Ray, luck: &mut Random) -> Option<(Hit, Surface)> {
        let ground = self.terrain.hit(ray).map(|hit| (hit, Surface::Ground));
        let solids = self.candidates.iter().filter_map(|candidate| {
            let turned = ray.seen_from(&candidate.place_m, candidate.sine, candidate.cosine);
            let hit = candidate.solid.hit(&turned, luck)?;
            Some((hit, candidate.surface))
        });
        solids
            .chain(ground)
            .min_by(|(a, _), (b, _)| a.range_m.total_cmp(&b.range_m))
    }
}
