//! A synthetic VLP-16 in a scene of simple solids, with the truth of every revolution.
//!
//! `solid` has the geometry of rays, `scenario` the scenes, this file the sensor: columns one
//! after the other, each at its own time, while the scene moves.

pub mod scenario;

mod solid;

use crate::cloud::sensor::VLP16;
use crate::random::Random;
use crate::time::{Span, Time};
use crate::wire::envelope::Postmark;
use crate::wire::point_cloud::{CompactPointCloud, POINT_CLOUD_ID};
use scenario::{Class, Scenario};
use solid::Ray;

/// When simulated sessions begin.
const EPOCH: Time = Time::from_micros(1_700_000_000_000_000);
/// Revolutions a second.
const ROTATION_HZ: f64 = 10.0;
/// Standard deviation of a range (VLP-16 user manual: accuracy of 3 cm, "typical").
const RANGE_DEVIATION_M: f64 = 0.02;
/// Part of the rays that come back from nothing although they hit something.
const DROPOUTS: f64 = 0.02;
/// Beyond this the road reflects too little to be seen at its grazing angle.
const GROUND_RANGE_M: f64 = 50.0;
/// Range of the sensor.
const RANGE_M: std::ops::Range<f64> = 0.4..100.0;
/// Distances are sent in centimetres.
const UNIT_M: f64 = 0.01;

/// What was true at the end of a revolution.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// End of the sweep.
    pub time: Time,
    /// Height of the sensor above the road.
    pub sensor_height_m: f64,
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
    scenario: Scenario,
    random: Random,
    /// Number of the next column since the beginning.
    column: u64,
    distances: Vec<u8>,
}

impl Simulation {
    /// A simulation of `scenario` whose noise follows from `seed`.
    pub fn new(scenario: Scenario, seed: u64) -> Self {
        Self {
            scenario,
            random: Random::new(seed),
            column: 0,
            distances: vec![],
        }
    }

    /// Turns the sensor once. Appends the revolution as a frame, as the OpenDLV device service
    /// sends it, and gives the truth at its end.
    pub fn revolve(&mut self, out: &mut Vec<u8>) -> Truth {
        self.distances.clear();
        let mut hits = vec![0; self.scenario.actors.len()];
        let first = self.column;
        while turn_of(self.column) == turn_of(first) {
            self.cast_column(&mut hits);
            self.column += 1;
        }
        // The first packet of the next revolution closes this one.
        let time = EPOCH + Span::from_seconds(seconds_of(self.column));
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

    fn cast_column(&mut self, hits: &mut [usize]) {
        let seconds = seconds_of(self.column);
        let azimuth_rad = azimuth_deg(self.column).to_radians();
        let scene = self.scenario.at(seconds, azimuth_rad);
        for elevation_deg in VLP16.elevation_deg {
            let ray = Ray::new(azimuth_rad, elevation_deg.to_radians());
            let hit = scene.nearest(&ray);
            let range_m = self.measure(hit.map(|(range_m, _)| range_m));
            if let (Some((_, Some(actor))), 1..) = (hit, range_m) {
                hits[actor] += 1;
            }
            self.distances.extend_from_slice(&range_m.to_be_bytes());
        }
    }

    /// Centimetres, cut off as the device service does, or 0 where nothing comes back.
    fn measure(&mut self, range_m: Option<f64>) -> u16 {
        // Both are drawn for every ray, so that one scene's noise does not depend on another's.
        let (noise_m, luck) = (
            RANGE_DEVIATION_M * self.random.normal(),
            self.random.uniform(),
        );
        match range_m.map(|range_m| range_m + noise_m) {
            Some(range_m) if RANGE_M.contains(&range_m) && luck >= DROPOUTS => {
                (range_m / UNIT_M) as u16
            }
            _ => 0,
        }
    }

    fn truth(&self, time: Time, hits: &[usize]) -> Truth {
        let seconds = (time - EPOCH).seconds();
        let objects = self.scenario.actors.iter().zip(hits).enumerate();
        Truth {
            time,
            sensor_height_m: self.scenario.sensor_height_m,
            objects: objects
                .map(|(id, (actor, points))| {
                    let pose = actor.path.at(seconds);
                    TrueObject {
                        id: id as u32,
                        class: actor.class,
                        centre_m: pose.centre_m,
                        yaw_rad: pose.yaw_rad,
                        speed_mps: actor.path.speed_mps(),
                        yaw_rate_radps: actor.path.yaw_rate_radps(),
                        size_m: actor.class.size_m(),
                        points: *points,
                    }
                })
                .collect(),
        }
    }
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
mod tests {
    use super::*;
    use crate::wire::Envelope;

    fn revolutions(seed: u64, count: usize) -> (Vec<u8>, Vec<Truth>) {
        let scenario = scenario::find("roundabout").unwrap();
        let mut simulation = Simulation::new(scenario, seed);
        let mut out = vec![];
        let truth = (0..count).map(|_| simulation.revolve(&mut out)).collect();
        (out, truth)
    }

    #[test]
    fn the_same_seed_gives_the_same_bytes_and_another_gives_others() {
        assert_eq!(revolutions(3, 2), revolutions(3, 2));
        assert_ne!(revolutions(3, 2).0, revolutions(4, 2).0);
    }

    #[test]
    fn a_revolution_has_the_columns_of_ten_hertz_and_ends_a_tenth_later() {
        let (out, truth) = revolutions(1, 3);
        let (envelope, _) = Envelope::from_datagram(&out).unwrap();
        let cloud = CompactPointCloud::decode(envelope.payload, 0).unwrap();
        assert!(
            (1808..=1809).contains(&cloud.columns()),
            "{}",
            cloud.columns()
        );
        assert!(cloud.end_azimuth_deg > 359.7);
        let between_s = (truth[2].time - truth[1].time).seconds();
        assert!((between_s - 0.1).abs() < 1e-4);
    }

    #[test]
    fn every_road_user_is_hit() {
        let (_, truth) = revolutions(1, 1);
        assert_eq!(truth[0].objects.len(), 5);
        for object in &truth[0].objects {
            assert!(object.points >= 5, "{object:?}");
        }
    }
}
