//! All the steps, in order. This is the one place that names them all.

mod status;

use crate::beams::Beams;
use crate::cloud::{Dialect, Extent, Intake, OwnVehicle, PacketIntake, Scan};
use crate::cluster::Dbscan;
use crate::config::Configuration;
use crate::ego::{Ego, Heard, Placement, Sweep};
use crate::grid::{Grid, Perceived};
use crate::ground::{Ground, Origin, Plane};
use crate::publish::{Heading, Publisher};
use crate::roadmap::Roadmap;
use crate::roundabout::{Advice, Sight, Situation, Watcher};
use crate::time::Time;
use crate::track::{Object, Scene, Tracker};
use crate::wire::point_cloud::{CompactPointCloud, POINT_CLOUD_ID};
use crate::wire::velodyne::Packet;
use crate::wire::velodyne::captured::SensorPackets;
use crate::wire::{Envelope, Message, pose};

pub use crate::fault::{Counts, Fault};
pub use crate::report::{Outcome, RevolutionReport, Step};

/// Message numbers that are ours: what we send, heard back.
pub const OWN_IDS: std::ops::RangeInclusive<i32> = 2020..=2039;

/// Message numbers of poses.
const POSE_IDS: [i32; 7] = [
    pose::ApplanixGroup1::ID,
    pose::GeodeticWgs84Reading::ID,
    pose::GeodeticHeadingReading::ID,
    pose::GroundSpeedReading::ID,
    pose::AngularVelocityReading::ID,
    pose::Geolocation::ID,
    pose::SimulationFrame::ID,
];

/// The whole of perception: an envelope in, envelopes out.
///
/// [`Pipeline::handle`] takes every envelope of the session in the order in which they come.
/// When it answers [`Outcome::Revolution`], [`Pipeline::publish_objects`] makes the frames to send,
/// and [`Pipeline::update_map`] and [`Pipeline::publish_map`] see to the map.
/// None of them knows a clock: the caller says when it is.
#[derive(Debug, Clone)]
pub struct Pipeline {
    configuration: Configuration,
    intake: Intake,
    packets: PacketIntake,
    scan: Scan,
    own_vehicle: OwnVehicle,
    ego: Ego,
    sweep: Sweep,
    /// How the points of each column of the last revolution are placed.
    placements: Vec<Placement>,
    ground: Ground,
    beams: Beams,
    clusters: Dbscan,
    tracker: Tracker,
    /// The last revolution's objects in the local frame.
    objects: Vec<Object>,
    grid: Grid,
    roundabouts: Watcher,
    publisher: Publisher,
    last: Option<RevolutionReport>,
    counts: Counts,
}

impl Pipeline {
    /// A pipeline that has seen nothing; it sends as `sender_stamp`.
    pub fn new(configuration: &Configuration, sender_stamp: u32) -> Self {
        Self {
            intake: Intake::default(),
            packets: PacketIntake::default(),
            scan: Scan::default(),
            own_vehicle: OwnVehicle::default(),
            ego: Ego::new(&configuration.ego),
            sweep: Sweep::still(0),
            placements: vec![],
            ground: Ground::new(&configuration.ground),
            beams: Beams::default(),
            clusters: Dbscan::new(&configuration.cluster),
            tracker: Tracker::new(&configuration.track),
            objects: vec![],
            grid: Grid::new(&configuration.grid),
            roundabouts: Watcher::new(&configuration.roundabout),
            publisher: Publisher::new(&configuration.publish, sender_stamp),
            last: None,
            counts: Counts::default(),
            configuration: configuration.clone(),
        }
    }

    /// Takes the map of roads that the configuration names; gives how many roundabouts are in it.
    pub fn take_map(&mut self, map: &Roadmap) -> usize {
        self.roundabouts.take_map(map)
    }

    /// Whether messages of this number are of any interest.
    pub fn concerns(data_type: i32) -> bool {
        data_type == POINT_CLOUD_ID || POSE_IDS.contains(&data_type)
    }

    /// Takes one envelope.
    ///
    /// # Errors
    /// [`Fault`] when it is damaged or refused. It is counted, and no track, plane or map hears
    /// of it; what the intake remembers of it costs the next good ones at most one.
    pub fn handle(&mut self, envelope: &Envelope<'_>) -> Result<Outcome, Fault> {
        self.handle_watched(envelope, |_| ())
    }

    /// The same, and says after each step of a revolution which one is done.
    ///
    /// # Errors
    /// As [`Pipeline::handle`].
    pub fn handle_watched(
        &mut self,
        envelope: &Envelope<'_>,
        done: impl FnMut(Step),
    ) -> Result<Outcome, Fault> {
        if envelope.data_type == SensorPackets::ID {
            return self.handle_packets(envelope, done);
        }
        let outcome = self.dispatch(envelope, done);
        if let Err(fault) = &outcome {
            self.count(fault);
        }
        outcome
    }

    /// Packets of a recording, of which the last one closes a revolution. The first fault is told, if none does; all
    /// are counted.
    fn handle_packets(
        &mut self,
        envelope: &Envelope<'_>,
        done: impl FnMut(Step),
    ) -> Result<Outcome, Fault> {
        let packets = SensorPackets::decode(envelope.payload, envelope.payload_offset);
        let packets = packets.map_err(|error| {
            let fault = Fault::Damaged {
                data_type: envelope.data_type,
                error,
            };
            self.count(&fault);
            fault
        })?;
        let (mut is_closed, mut first) = (false, Ok(Outcome::Packets));
        for packet in packets.iter() {
            match self.take_packet(&packet) {
                Ok(closes) => is_closed |= closes,
                Err(fault) => first = first.and(Err(fault)),
            }
        }
        if is_closed {
            return Ok(Outcome::Revolution(self.perceive_packets(done)));
        }
        first
    }

    fn count(&mut self, fault: &Fault) {
        self.counts.faults.count(fault.name());
        match fault {
            Fault::Refused(_) => self.counts.refused += 1,
            Fault::Packet(refusal) => self.counts.damaged += u64::from(refusal.is_damage()),
            Fault::Damaged { .. } => self.counts.damaged += 1,
            Fault::Pose { refusal, .. } if refusal.is_damage() => self.counts.damaged += 1,
            Fault::Pose { .. } => self.counts.poses_refused += 1,
        }
    }

    /// Takes one packet as a sensor sends it. Gives whether it closes a revolution, which
    /// [`Pipeline::perceive_packets`] then goes through; it is replaced by the next one.
    ///
    /// # Errors
    /// [`Fault`] when the packet, or the revolution that it closes, is of no use. It is counted.
    pub fn take_packet(&mut self, packet: &Packet<'_>) -> Result<bool, Fault> {
        let result = self.take(packet);
        if let Err(fault) = &result {
            self.count(fault);
        }
        result
    }

    fn take(&mut self, packet: &Packet<'_>) -> Result<bool, Fault> {
        self.counts.packets += 1;
        let taken = self.packets.take(packet, &self.configuration.cloud)?;
        self.counts.packets_lost += taken.lost;
        self.counts.packets_late += u64::from(taken.is_late);
        let Some(closed) = taken.closed else {
            return Ok(false);
        };
        self.counts.revolutions += 1;
        closed?;
        Ok(true)
    }

    /// Perceives the last revolution that packets have closed, and says after each step which one is
    /// done.
    pub fn perceive_packets(&mut self, done: impl FnMut(Step)) -> RevolutionReport {
        let revolution = self.packets.revolution(&self.configuration.cloud);
        self.scan
            .fill(&revolution, &self.own_vehicle, &self.configuration.cloud);
        let (dialect, time_jumped) = (revolution.dialect, revolution.time_jumped);
        self.perceive(dialect, time_jumped, done)
    }

    fn dispatch(
        &mut self,
        envelope: &Envelope<'_>,
        done: impl FnMut(Step),
    ) -> Result<Outcome, Fault> {
        let damaged = |error| Fault::Damaged {
            data_type: envelope.data_type,
            error,
        };
        if envelope.data_type == POINT_CLOUD_ID {
            self.counts.revolutions += 1;
            let cloud = CompactPointCloud::decode(envelope.payload, envelope.payload_offset)
                .map_err(damaged)?;
            let accepted = self
                .intake
                .accept(envelope, cloud, &self.configuration.cloud)?;
            self.scan
                .fill(&accepted, &self.own_vehicle, &self.configuration.cloud);
            let (dialect, time_jumped) = (accepted.dialect, accepted.time_jumped);
            return Ok(Outcome::Revolution(self.perceive(
                dialect,
                time_jumped,
                done,
            )));
        }
        if OWN_IDS.contains(&envelope.data_type) {
            return Ok(Outcome::Own);
        }
        match self.ego.hear(envelope).map_err(damaged)? {
            Heard::Nothing => Ok(Outcome::Other),
            Heard::Refused(refusal) => Err(Fault::Pose {
                data_type: envelope.data_type,
                refusal,
            }),
            Heard::Pose => {
                self.counts.poses += 1;
                Ok(Outcome::Pose)
            }
        }
    }

    /// The revolution in the array through all the other steps.
    fn perceive(
        &mut self,
        dialect: Dialect,
        time_jumped: bool,
        mut done: impl FnMut(Step),
    ) -> RevolutionReport {
        done(Step::Cloud);
        if time_jumped {
            self.ego.reset();
            self.ground.reset();
            self.beams.reset();
            self.tracker.reset();
            self.grid.reset();
            self.roundabouts.forget();
        }
        let time = self.scan.time();
        let missed = self.missed_before(time);
        let expected = self.ego.expect(&self.scan);
        let moving = self.tracker.expect_moving(time, &expected);
        let sweep = self.ego.follow(&self.scan, moving);
        done(Step::Ego);
        self.sweep = sweep;
        sweep.placements(self.scan.columns(), &mut self.placements);
        let driving = self.tracker.expect_driving(time, &sweep);
        let ground = self.ground.process(&self.scan, driving);
        let way_m = sweep.way_m();
        self.own_vehicle.learn(
            &self.scan,
            self.ground.heights_m(),
            way_m,
            &self.configuration.cloud,
        );
        done(Step::Ground);
        let (mask, heights_m) = (self.ground.mask(), self.ground.heights_m());
        let clusters = self.clusters.process(&self.scan, mask, heights_m);
        done(Step::Cluster);
        self.beams.begin(&sweep);
        let scene = Scene {
            scan: &self.scan,
            heights_m: self.ground.heights_m(),
            ground: &ground,
            sweep: &sweep,
            placements: &self.placements,
            beams: &self.beams,
        };
        let objects = self.tracker.process(clusters, &scene);
        self.objects.clear();
        let in_local_frame = |object: &Object| object.in_local_frame(&sweep.anchor);
        self.objects.extend(objects.iter().map(in_local_frame));
        let moving = self.tracker.expect_moving(time, &sweep);
        let ground_mask = self.ground.mask();
        self.beams
            .remember(&self.scan, ground_mask, moving, &sweep, &self.placements);
        done(Step::Track);
        let report = RevolutionReport {
            number: self.last.map_or(0, |last| last.number.wrapping_add(1)),
            time,
            missed,
            time_jumped,
            sensor: self.scan.sensor().name,
            dialect,
            columns: self.scan.columns(),
            rotation_hz: self.scan.rotation_hz(),
            airborne: self.scan.airborne_returns(),
            returns: self.scan.returns(),
            ground,
            vehicle: sweep.vehicle,
            frame: sweep.frame,
            ego: self.ego.report(),
            clusters: clusters.len(),
            objects: self.objects.len(),
        };
        self.counts.missed += report.missed;
        self.counts.airborne += report.airborne as u64;
        self.counts.airborne_revolutions += u64::from(report.airborne > 0);
        self.counts.time_jumps += u64::from(report.time_jumped);
        self.counts.ground_held += u64::from(ground.origin == Origin::Held);
        self.counts.ground_fallback += u64::from(ground.origin == Origin::Fallback);
        self.last = Some(report);
        self.watch_roundabouts(time, &ground.plane);
        report
    }

    fn watch_roundabouts(&mut self, time: Time, ground: &Plane) {
        let sweep = &self.sweep;
        let [x, y] = sweep.velocity_mps(self.scan.duration_s());
        let sensor = sweep.local_attitude();
        let situation = Situation {
            time,
            reference: sweep.reference,
            vehicle: sweep.vehicle,
            vehicle_speed_mps: libm::hypot(x, y),
            objects: &self.objects,
            sight: Some(Sight {
                scan: &self.scan,
                sensor: &sensor,
                ground,
                clusters: self.clusters.clusters(),
                heights_m: self.ground.heights_m(),
            }),
        };
        self.roundabouts.watch(&situation);
    }

    /// How many revolutions should have been between the last one and one at a time.
    fn missed_before(&self, time: Time) -> u64 {
        /// A longer one is a pause: somebody has stopped what is played.
        const LONGEST_S: f64 = 10.0;
        let passed_s = self.last.map_or(0.0, |last| (time - last.time).seconds());
        let turns = libm::round(passed_s * self.scan.rotation_hz());
        let is_gap = (0.0..LONGEST_S).contains(&passed_s);
        if is_gap {
            (turns as u64).saturating_sub(1)
        } else {
            0
        }
    }

    /// The frames that say what is around in the last revolution, in the order in which they are
    /// to be sent.
    pub fn publish_objects(
        &mut self,
        sent: Time,
        processing_s: f32,
    ) -> impl Iterator<Item = &[u8]> {
        if let Some(last) = self.last {
            let heading = Heading {
                revolution: last.number,
                time: last.time,
                sent,
                processing_s,
                sweep: &self.sweep,
            };
            self.publisher.publish_objects(&heading, &self.objects);
            if let Some(advice) = self.roundabouts.advice() {
                self.publisher.add_roundabout(&heading, advice);
            }
        }
        self.publisher.frames()
    }

    /// Takes the last revolution into the map; to be called once for each. It is less urgent
    /// than the objects.
    pub fn update_map(&mut self) {
        let Some(last) = &self.last else { return };
        self.grid.process(&Perceived {
            scan: &self.scan,
            ground: self.ground.mask(),
            heights_m: self.ground.heights_m(),
            plane: &last.ground.plane,
            objects: self.tracker.objects(),
            sweep: &self.sweep,
            placements: &self.placements,
        });
    }

    /// The frames of what is to be sent of the map, the most urgent first.
    pub fn publish_map(&mut self, sent: Time) -> impl Iterator<Item = &[u8]> {
        if let Some(last) = self.last {
            self.publisher
                .publish_map(last.time, sent, &self.sweep, &mut self.grid);
        }
        self.publisher.frames()
    }

    /// What is known of the sensor whose packets are taken.
    pub fn packets(&self) -> &PacketIntake {
        &self.packets
    }

    /// The last revolution's points.
    pub fn scan(&self) -> &Scan {
        &self.scan
    }

    /// The last revolution's ground mask.
    pub fn ground_mask(&self) -> &[bool] {
        self.ground.mask()
    }

    /// The last revolution's clusters.
    pub fn clusters(&self) -> &crate::cluster::Clusters {
        self.clusters.clusters()
    }

    /// The last revolution's objects in the local frame, by id.
    pub fn objects(&self) -> &[Object] {
        &self.objects
    }

    /// What was said of the nearest roundabout in the last revolution.
    pub fn advice(&self) -> Option<&Advice> {
        self.roundabouts.advice()
    }

    /// Where the sensor was in the last revolution.
    pub fn sweep(&self) -> &Sweep {
        &self.sweep
    }

    /// How the points of each of its columns are placed in the odometry frame.
    pub fn placements(&self) -> &[Placement] {
        &self.placements
    }

    /// How far the own vehicle is seen, if it is.
    pub fn own_vehicle(&self) -> Option<Extent> {
        self.own_vehicle.extent()
    }

    /// The map of the static world.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// What was counted so far.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }
}
