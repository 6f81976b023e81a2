//! Scenes: who is there, on which path, and what stands around.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::GROUND_RANGE_M;
use super::solid::{Ray, Shape, Solid};

/// What a road user is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// A passenger car.
    Car,
    /// A bicycle with its rider.
    Cyclist,
    /// Somebody on foot.
    Pedestrian,
}

impl Class {
    /// The word in truth files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Car => "car",
            Self::Cyclist => "cyclist",
            Self::Pedestrian => "pedestrian",
        }
    }

    /// Length, width and height.
    pub const fn size_m(self) -> [f64; 3] {
        match self {
            Self::Car => [4.3, 1.8, 1.45],
            Self::Cyclist => [1.8, 0.5, 1.75],
            Self::Pedestrian => [0.5, 0.5, 1.75],
        }
    }
}

/// A scene with a standing sensor.
#[derive(Debug, Clone)]
pub struct Scenario {
    /// The name on the command line.
    pub name: &'static str,
    /// What happens, in a line.
    pub summary: &'static str,
    /// Height of the sensor above the road.
    pub sensor_height_m: f64,
    /// Who is there.
    pub actors: Vec<Actor>,
    /// What stands around, heights above the road.
    statics: Vec<Solid>,
}

/// A road user on its path.
#[derive(Debug, Clone, Copy)]
pub struct Actor {
    /// What it is.
    pub class: Class,
    /// Where it goes.
    pub path: Circle,
}

/// A circle that is driven round and round.
#[derive(Debug, Clone, Copy)]
pub struct Circle {
    centre_m: [f64; 2],
    radius_m: f64,
    /// Where on the circle it is at the beginning, counter-clockwise from x.
    start_rad: f64,
    /// Counter-clockwise; negative the other way round.
    rate_radps: f64,
}

/// Where an actor is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActorPose {
    /// Middle of its box.
    pub centre_m: [f64; 2],
    /// Direction of motion in (-pi, pi].
    pub yaw_rad: f64,
}

impl Circle {
    fn new(radius_m: f64, start_deg: f64, speed_mps: f64) -> Self {
        Self {
            centre_m: ROUNDABOUT_M,
            radius_m,
            start_rad: start_deg.to_radians(),
            rate_radps: speed_mps / radius_m,
        }
    }

    /// Where it is after some time.
    pub fn at(&self, seconds: f64) -> ActorPose {
        let angle_rad = self.start_rad + self.rate_radps * seconds;
        let (sine, cosine) = libm::sincos(angle_rad);
        let ahead_rad = angle_rad + FRAC_PI_2.copysign(self.rate_radps);
        ActorPose {
            centre_m: [
                self.centre_m[0] + self.radius_m * cosine,
                self.centre_m[1] + self.radius_m * sine,
            ],
            yaw_rad: ahead_rad - TAU * libm::ceil((ahead_rad - PI) / TAU),
        }
    }

    /// Speed along the path.
    pub fn speed_mps(&self) -> f64 {
        libm::fabs(self.rate_radps) * self.radius_m
    }

    /// Rate of turn, counter-clockwise.
    pub fn yaw_rate_radps(&self) -> f64 {
        self.rate_radps
    }
}

/// All scenarios.
pub fn all() -> Vec<Scenario> {
    vec![roundabout()]
}

/// A scenario by its name.
pub fn find(name: &str) -> Option<Scenario> {
    all().into_iter().find(|scenario| scenario.name == name)
}

/// Middle of the roundabout as seen from the sensor, which waits at an entry.
const ROUNDABOUT_M: [f64; 2] = [0.0, 24.0];

/// A small roundabout of 30 m outer diameter (thesis section 2.2.2). The circular path is
/// shared by three cars at 29 km/h; a cyclist at 15 km/h and a pedestrian at 5 km/h go round
/// on their own paths outside it.
fn roundabout() -> Scenario {
    let actor = |class, radius_m, start_deg, speed_mps| Actor {
        class,
        path: Circle::new(radius_m, start_deg, speed_mps),
    };
    let upright = |x: f64, y: f64, radius_m: f64, high_m: f64| Solid {
        shape: Shape::Cylinder {
            centre_m: [x, y],
            radius_m,
        },
        low_m: 0.0,
        high_m,
    };
    let wall = |x: f64, y: f64, length_m: f64, yaw_rad: f64, high_m: f64| Solid {
        shape: Shape::Box {
            centre_m: [x, y],
            yaw_rad,
            length_m,
            width_m: 0.4,
        },
        low_m: 0.0,
        high_m,
    };
    let [x, y] = ROUNDABOUT_M;
    Scenario {
        name: "roundabout",
        summary: "a small roundabout of 30 m: three cars, a cyclist, a pedestrian; the sensor stands at an entry",
        sensor_height_m: 2.0,
        actors: vec![
            actor(Class::Car, 12.0, 200.0, 8.0),
            actor(Class::Car, 12.0, 320.0, 8.0),
            actor(Class::Car, 12.0, 80.0, 8.0),
            actor(Class::Cyclist, 16.0, 10.0, 4.17),
            actor(Class::Pedestrian, 20.5, 305.0, -1.39),
        ],
        statics: vec![
            // Planting on the island, lamp posts around it, walls and a house farther off.
            upright(x, y, 3.0, 0.7),
            upright(x - 19.0, y - 19.0, 0.1, 6.0),
            upright(x + 19.0, y - 19.0, 0.1, 6.0),
            upright(x + 19.0, y + 19.0, 0.1, 6.0),
            upright(x - 19.0, y + 19.0, 0.1, 6.0),
            wall(-32.0, y, 30.0, FRAC_PI_2, 1.2),
            wall(30.0, y + 10.0, 12.0, FRAC_PI_2, 6.0),
            wall(5.0, -22.0, 40.0, 0.1, 2.0),
        ],
    }
}

/// Everything that a column of rays can hit at one moment.
pub(super) struct Scene {
    road_m: f64,
    solids: Vec<(Solid, Option<usize>)>,
}

impl Scenario {
    /// The part of the scene that lies in a direction at a moment, in the sensor frame.
    pub(super) fn at(&self, seconds: f64, azimuth_rad: f64) -> Scene {
        let road_m = -self.sensor_height_m;
        let (sine, cosine) = libm::sincos(azimuth_rad);
        let in_sight = |solid: &Solid| {
            let ([x, y], radius_m) = solid.bounds();
            let (ahead_m, aside_m) = (x * sine + y * cosine, x * cosine - y * sine);
            libm::fabs(aside_m) <= radius_m && ahead_m >= -radius_m
        };
        let lowered = |solid: Solid| Solid {
            low_m: solid.low_m + road_m,
            high_m: solid.high_m + road_m,
            ..solid
        };
        let statics = self.statics.iter().map(|solid| (*solid, None));
        let moving = self.actors.iter().enumerate().flat_map(|(actor, who)| {
            let parts = parts(who.class, who.path.at(seconds));
            parts.into_iter().map(move |solid| (solid, Some(actor)))
        });
        let solids = statics
            .chain(moving)
            .filter(|(solid, _)| in_sight(solid))
            .map(|(solid, actor)| (lowered(solid), actor))
            .collect();
        Scene { road_m, solids }
    }
}

impl Scene {
    /// The nearest thing on a ray: its distance, and the actor that it belongs to.
    pub(super) fn nearest(&self, ray: &Ray) -> Option<(f64, Option<usize>)> {
        let road = Some(self.road_m / ray.direction[2])
            .filter(|range_m| (0.0..GROUND_RANGE_M).contains(range_m))
            .map(|range_m| (range_m, None));
        let solids = self.solids.iter();
        let hits = solids.filter_map(|(solid, actor)| solid.hit(ray).map(|range| (range, *actor)));
        hits.chain(road).min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// The solids that make up a road user.
fn parts(class: Class, pose: ActorPose) -> Vec<Solid> {
    let ActorPose { centre_m, yaw_rad } = pose;
    let block = |ahead_m: f64, length_m: f64, width_m: f64, low_m: f64, high_m: f64| Solid {
        shape: Shape::Box {
            centre_m: [
                centre_m[0] + ahead_m * libm::cos(yaw_rad),
                centre_m[1] + ahead_m * libm::sin(yaw_rad),
            ],
            yaw_rad,
            length_m,
            width_m,
        },
        low_m,
        high_m,
    };
    let body = |radius_m: f64, low_m: f64, high_m: f64| Solid {
        shape: Shape::Cylinder { centre_m, radius_m },
        low_m,
        high_m,
    };
    match class {
        // Body, and a cabin that begins behind the bonnet.
        Class::Car => vec![
            block(0.0, 4.3, 1.8, 0.2, 0.9),
            block(-0.4, 2.4, 1.6, 0.9, 1.45),
        ],
        // Wheels and frame as one thin plate, the rider above it.
        Class::Cyclist => vec![block(0.0, 1.8, 0.1, 0.05, 0.9), body(0.25, 0.7, 1.75)],
        Class::Pedestrian => vec![body(0.25, 0.0, 1.75)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_moves_along_its_yaw() {
        for actor in roundabout().actors {
            let (now, next) = (actor.path.at(1.0), actor.path.at(1.001));
            let moved = [0, 1].map(|axis| (next.centre_m[axis] - now.centre_m[axis]) / 0.001);
            let [vx, vy] = moved;
            assert!((vx.hypot(vy) - actor.path.speed_mps()).abs() < 1e-3);
            let difference = (vy.atan2(vx) - now.yaw_rad).sin();
            assert!(difference.abs() < 1e-2, "{difference}");
            assert!(now.yaw_rad > -PI && now.yaw_rad <= PI);
        }
    }

    #[test]
    fn the_road_lies_below_the_sensor() {
        let scene = roundabout().at(0.0, 3.0);
        let down = Ray::new(3.0, -0.2);
        let (range_m, actor) = scene.nearest(&down).unwrap();
        assert!((range_m * down.direction[2] + 2.0).abs() < 1e-9);
        assert_eq!(actor, None);
    }

    #[test]
    fn names_find_their_scenarios() {
        for scenario in all() {
            assert_eq!(
                find(scenario.name).map(|found| found.name),
                Some(scenario.name)
            );
        }
        assert!(find("nowhere").is_none());
    }
}
