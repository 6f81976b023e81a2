//! A synthetic VLP-16 that drives through a scene, with the truth of every revolution.
//!
//! `solid` has the geometry of rays, `variant` what road users look like and `body` the same as solids, `terrain` and
//! `scenery` the rest of a scene, `path` motion, `scenes` the scenes, `fixes` the vehicle's pose messages, `packets` what the
//! sensor itself sends, `map` the true map. This file is the sensor: columns one after the other, each at its own time, while
//! the vehicle and the scene move.
//!
//! What it leaves out: second returns, rays split between two surfaces, rain and spray,
//! reflections, other sensors' light, and vehicles that lean with a slope.

mod body;

mod fixes;

pub mod map;

mod packets;

pub mod path;

pub mod scenario;

mod scenery;

mod scenes;

mod sight;

mod solid;

mod terrain;

pub mod variant;

use crate::cloud::sensor::VLP16;
use crate::ego::geodesy::{Geodetic, LocalFrame};
use crate::random::Random;
use crate::time::{Span, Time};
use crate::wire::envelope::Postmark;
use crate::wire::point_cloud::{CompactPointCloud, POINT_CLOUD_ID};
use crate::wire::velodyne::Packet;
use fixes::Receiver;
use map::{Surveyor, TrueMap};
use packets::PacketStream;
use path::Moment;
use path::Path;
use scenario::{PoseMessages, Scenario, Scene};
use sight::{Carrier, Sight, Surface};
use solid::Hit;
use variant::Class;

/// When simulated sessions begin.
const EPOCH: Time = Time::from_micros(1_700_000_000_000_000);
/// Revolutions a second.
const ROTATION_HZ: f64 = 10.0;
/// Full angle of the beam (VLP-16 user manual: 3 mrad).
const BEAM_RAD: f64 = 0.003;
/// Share of the beam's footprint along the ray by which a range at grazing angles scatters.
const FOOTPRINT_SHARE: f64 = 0.08;
/// Share of rays that come back from nothing although they hit something.
const DROPOUTS: f64 = 0.01;
/// What comes back from a white surface at one metre is 1; at this the sensor sees half of the
/// rays. A tenth as bright a surface is then seen to some 75 m.
const THRESHOLD: f64 = 1.8e-5;
/// How sharply seeing ends: the power of signal over threshold.
const SHARPNESS: f64 = 4.0;
/// Range of the sensor.
const RANGE_M: std::ops::Range<f64> = 0.4..100.0;
/// Point clouds have distances in centimetres.
const UNIT_M: f64 = 0.01;

/// What was true at the end of a revolution.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// End of the sweep.
    pub time: Time,
    /// The sensor in the local frame: east, north, up.
    pub sensor_m: [f64; 3],
    /// Forward, counter-clockwise from east.
    pub sensor_yaw_rad: f64,
    /// Along the yaw.
    pub sensor_speed_mps: f64,
    /// All road users, seen or not.
    pub objects: Vec<TrueObject>,
}

/// One road user as it was, in the local frame.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueObject {
    /// Its number in the scenario.
    pub id: u32,
    /// What it is.
    pub class: Class,
    /// Middle of its box.
    pub centre_m: [f64; 2],
    /// Direction in which it moves.
    pub yaw_rad: f64,
    /// Speed along the yaw.
    pub speed_mps: f64,
    /// Counter-clockwise.
    pub yaw_rate_radps: f64,
    /// Length, width, height.
    pub size_m: [f64; 3],
    /// Returns on it in this revolution.
    pub points: usize,
}

/// A running simulation.
#[derive(Debug, Clone)]
pub struct Simulation {
    scene: Scene,
    seed: u64,
    receiver: Receiver,
    /// Number of the next fix.
    fix: u64,
    /// Number of the next column since the beginning.
    column: u64,
    distances: Vec<u8>,
    labels: Vec<i32>,
    packets: Option<PacketStream>,
    surveyor: Option<Surveyor>,
}

/// What a ray of the last revolution ended on, as in the labels of `kreisel process`.
pub mod label {
    /// On nothing.
    pub const NO_RETURN: i32 = 0;
    /// On the ground, a kerb, or a verge.
    pub const GROUND: i32 = 1;
    /// On something that stands.
    pub const SCENERY: i32 = 2;
    /// On the road user with the number that is added to it.
    pub const FIRST_ROAD_USER: i32 = 100;
}

impl Simulation {
    /// A simulation of `scenario` whose road users, noise and fixes follow from `seed`.
    pub fn new(scenario: Scenario, seed: u64) -> Self {
        let scene = scenario.scene(seed);
        Self {
            receiver: Receiver::new(scene.poses, seed),
            scene,
            seed,
            fix: 0,
            column: 0,
            distances: vec![],
            labels: vec![],
            packets: None,
            surveyor: None,
        }
    }

    /// The same, for [`Simulation::revolve_in_packets`]: every laser looks where the sensor has turned to when it
    /// fires, and not all of a column in one direction.
    pub fn in_packets(scenario: Scenario, seed: u64) -> Self {
        Self {
            packets: Some(PacketStream::default()),
            ..Self::new(scenario, seed)
        }
    }

    /// Where the frame of the truth lies on the earth: its origin is where the sensor was at the beginning.
    pub fn reference(&self) -> Geodetic {
        let [x, y, _] = Carrier::of(&self.scene, 0.0).sensor_m;
        LocalFrame::around(fixes::REFERENCE).geodetic([x, y, 0.0])
    }

    /// The way that the vehicle goes.
    pub fn way_of_ego(&self) -> &Path {
        &self.scene.ego
    }

    /// From the end of the last revolution on the vehicle changes its speed evenly, so that it has this one at the end
    /// of the next, whatever its scenario says.
    pub fn drive(&mut self, speed_mps: f64) {
        let from_s = seconds_of(self.column);
        self.scene
            .ego
            .driven(from_s, from_s + 1.0 / ROTATION_HZ, speed_mps);
    }

    /// From now on notes what the true map of the scene looks like, for [`Simulation::map`].
    pub fn survey(&mut self) {
        self.surveyor = Some(Surveyor::default());
    }

    /// The true map as it is now, if it was surveyed.
    pub fn map(&self) -> Option<TrueMap> {
        let [x, y, _] = Carrier::of(&self.scene, 0.0).sensor_m;
        let surveyor = self.surveyor.clone()?;
        Some(surveyor.map(&self.scene, seconds_of(self.column), [x, y]))
    }

    /// What each ray of the last revolution ended on, see [`label`]; columns one after the
    /// other.
    pub fn labels(&self) -> &[i32] {
        &self.labels
    }

    /// Turns the sensor once. Appends the frames of the vehicle's poses up to its end, and then
    /// the revolution as the OpenDLV device service sends it. Gives the truth at its end.
    pub fn revolve(&mut self, out: &mut Vec<u8>) -> Truth {
        let first = self.column;
        let (time, hits) = self.turn();
        self.put_fixes(out);
        let cloud = CompactPointCloud {
            start_azimuth_deg: azimuth_deg(first) as f32,
            end_azimuth_deg: azimuth_deg(self.column - 1) as f32,
            layers: VLP16.elevation_deg.len() as u8,
            distances: &self.distances,
            ..CompactPointCloud::default()
        };
        let postmark = Postmark {
            sent: time,
            sampled: time,
            sender_stamp: 0,
        };
        postmark.put_payload(out, POINT_CLOUD_ID, |out| cloud.encode(out));
        self.truth(time, &hits)
    }

    /// As long as a turn takes, without any ray. Gives the truth at its end.
    pub fn pass(&mut self) -> Truth {
        let turn = turn_of(self.column);
        while turn_of(self.column) == turn {
            self.column += 1;
        }
        let time = EPOCH + Span::from_seconds(seconds_of(self.column));
        self.truth(time, &vec![0; self.scene.actors.len()])
    }

    /// Turns the sensor once, and hands over what it sends meanwhile. Gives the truth at the end of the revolution,
    /// which the first packet of the next one closes. There are no poses.
    pub fn revolve_in_packets(&mut self, send: impl FnMut(&Packet<'_>)) -> Truth {
        let (time, hits) = self.turn();
        self.send_packets(send);
        self.truth(time, &hits)
    }

    /// Turns the sensor on by one packet, which closes the last revolution.
    pub fn close_packets(&mut self, send: impl FnMut(&Packet<'_>)) {
        let parts = sight::parts(&self.scene, seconds_of(self.column));
        let mut hits = vec![0; self.scene.actors.len()];
        for _ in 0..packets::FIRINGS {
            self.cast_column(&parts, &mut hits);
            self.column += 1;
        }
        self.send_packets(send);
    }

    fn send_packets(&mut self, send: impl FnMut(&Packet<'_>)) {
        if let Some(packets) = &mut self.packets {
            packets.send(send);
        }
    }

    /// Casts the columns of a turn. Gives when it is over, and how often each road user was hit.
    fn turn(&mut self) -> (Time, Vec<usize>) {
        self.distances.clear();
        self.labels.clear();
        let mut hits = vec![0; self.scene.actors.len()];
        let first = self.column;
        let parts = sight::parts(&self.scene, seconds_of(first));
        while turn_of(self.column) == turn_of(first) {
            self.cast_column(&parts, &mut hits);
            self.column += 1;
        }
        // The first packet of the next revolution closes this one.
        (EPOCH + Span::from_seconds(seconds_of(self.column)), hits)
    }

    fn put_fixes(&mut self, out: &mut Vec<u8>) {
        if self.scene.poses == PoseMessages::None {
            return;
        }
        let until_s = seconds_of(self.column);
        loop {
            let seconds = self.fix as f64 * fixes::PERIOD_S;
            if seconds > until_s {
                return;
            }
            let carrier = Carrier::of(&self.scene, seconds);
            // The frame's origin is where the sensor was at the beginning.
            let height_m = carrier.sensor_m[2] - Carrier::of(&self.scene, 0.0).sensor_m[2];
            let time = EPOCH + Span::from_seconds(seconds);
            self.receiver.put(out, time, &carrier.moment, height_m);
            self.fix += 1;
        }
    }

    fn cast_column(&mut self, parts: &[Vec<solid::Solid>], hits: &mut [usize]) {
        let azimuth_rad = azimuth_deg(self.column).to_radians();
        if let Some(packets) = &mut self.packets {
            packets.begin(self.column);
        }
        let sight = Sight::new(&self.scene, parts, seconds_of(self.column), azimuth_rad);
        for (layer, elevation_deg) in VLP16.elevation_deg.iter().enumerate() {
            // Every ray has its own luck, so that one scene's noise does not depend on another.
            let number = self.column * VLP16.elevation_deg.len() as u64 + layer as u64;
            let luck = &mut Random::new(self.seed ^ number.wrapping_mul(0x2545_f491_4f6c_dd1d));
            let later_rad = self
                .packets
                .as_ref()
                .map_or(0.0, |_| packets::turned_rad(layer));
            let ray = sight.ray(azimuth_rad + later_rad, elevation_deg.to_radians());
            let nearest = sight.nearest(&ray, luck);
            if let Some(surveyor) = &mut self.surveyor {
                let end = nearest.map(|(hit, surface)| (hit.range_m, surface));
                // A third of the columns, every time others, is enough to follow rays along.
                let follow = (self.column + turn_of(self.column)).is_multiple_of(3);
                surveyor.note(&self.scene, seconds_of(self.column), &ray, end, follow);
            }
            let range_m =
                nearest.and_then(|(hit, _)| measured(&hit, self.scene.range_deviation_m, luck));
            if let (Some(packets), Some((hit, _)), Some(range_m)) =
                (&mut self.packets, nearest, range_m)
            {
                packets.put(layer, range_m, hit.reflectance);
            }
            // Cut off, as the device service does.
            let units = range_m.map_or(0, |range_m| (range_m / UNIT_M) as u16);
            let label = match nearest {
                _ if units == 0 => label::NO_RETURN,
                None => label::NO_RETURN,
                Some((_, Surface::Ground)) => label::GROUND,
                Some((_, Surface::Scenery)) => label::SCENERY,
                Some((_, Surface::RoadUser(actor))) => {
                    hits[actor] += 1;
                    label::FIRST_ROAD_USER + actor as i32
                }
            };
            self.labels.push(label);
            self.distances.extend_from_slice(&units.to_be_bytes());
        }
    }

    fn truth(&self, time: Time, hits: &[usize]) -> Truth {
        let seconds = (time - EPOCH).seconds();
        let carrier = Carrier::of(&self.scene, seconds);
        // The frame's origin is where the sensor was at the beginning.
        let begin_m = Carrier::of(&self.scene, 0.0).sensor_m;
        let local_m = |at: [f64; 2]| [at[0] - begin_m[0], at[1] - begin_m[1]];
        let [x, y, z] = [0, 1, 2].map(|axis| carrier.sensor_m[axis] - begin_m[axis]);
        let objects = self.scene.actors.iter().zip(hits).enumerate();
        Truth {
            time,
            sensor_m: [x, y, z],
            sensor_yaw_rad: carrier.moment.yaw_rad,
            sensor_speed_mps: carrier.moment.speed_mps,
            objects: objects
                .map(|(id, (actor, points))| {
                    let Moment {
                        position_m,
                        yaw_rad,
                        speed_mps,
                        yaw_rate_radps,
                        ..
                    } = actor.path.at(seconds);
                    TrueObject {
                        id: id as u32,
                        class: actor.variant.class,
                        centre_m: local_m(position_m),
                        yaw_rad,
                        speed_mps,
                        yaw_rate_radps,
                        size_m: actor.variant.size_m,
                        points: *points,
                    }
                })
                .collect(),
        }
    }
}

/// The range that is measured, if anything comes back.
fn measured(hit: &Hit, range_deviation_m: f64, luck: &mut Random) -> Option<f64> {
    let signal = hit.reflectance * hit.incidence / (hit.range_m * hit.range_m);
    let seen = 1.0 / (1.0 + (THRESHOLD / signal.max(1e-12)).powf(SHARPNESS));
    // At a grazing angle the spot is long, and the range is that of some part of it.
    let footprint_m = hit.range_m * BEAM_RAD / hit.incidence.max(0.02);
    let deviation_m = libm::hypot(range_deviation_m, FOOTPRINT_SHARE * footprint_m);
    let range_m = hit.range_m + deviation_m * luck.normal();
    let comes_back = RANGE_M.contains(&range_m) && luck.uniform() < seen * (1.0 - DROPOUTS);
    comes_back.then_some(range_m)
}

fn seconds_of(column: u64) -> f64 {
    column as f64 * VLP16.column_period_s
}

/// The turn in which a column lies.
fn turn_of(column: u64) -> u64 {
    (seconds_of(column) * ROTATION_HZ) as u64
}

fn azimuth_deg(column: u64) -> f64 {
    let turns = seconds_of(column) * ROTATION_HZ;
    360.0 * (turns - libm::floor(turns))
}

#[cfg(test)]
mod tests;
