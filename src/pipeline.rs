//! All the steps, in order. This is the one place that names them all.

mod dispatch;
mod status;

use crate::beams::Beams;
use crate::cloud::{Dialect, Extent, Intake, OwnVehicle, PacketIntake, Scan};
use crate::cluster::Dbscan;
use crate::config::Configuration;
use crate::ego::{Ego, Placement, Sweep};
use crate::grid::{Grid, Perceived};
use crate::ground::{Ground, Origin, Plane};
use crate::publish::{Heading, Publisher};
use crate::roadmap::{DrivenRoundabout, Roadmap};
use crate::roundabout::{Advice, Sight, Situation, Watcher};
use crate::time::Time;
use crate::track::{APPEARANCE_FEATURES, Object, Scene, Tracker};

pub use crate::fault::{Counts, Fault};
pub use crate::report::{Outcome, RevolutionReport, Step};
pub use dispatch::OWN_IDS;

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
            self.roundabouts.reset();
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
        if let Some(extent) = self.own_vehicle.extent() {
            self.tracker.forget_pieces(&extent, &self.scan, &sweep);
        }
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
            epoch: sweep.epoch,
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

    /// Takes the last revolution into the map, and into that of the odometry; to be called once for
    /// each. It is less urgent than the objects.
    pub fn update_map(&mut self) {
        self.ego.settle();
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

    /// What each of the last revolution's clusters looks like ([`Tracker::appearances`]).
    pub fn appearances(&self) -> impl ExactSizeIterator<Item = [f64; APPEARANCE_FEATURES]> {
        self.tracker.appearances()
    }

    /// The last revolution's objects in the local frame, by id.
    pub fn objects(&self) -> &[Object] {
        &self.objects
    }

    /// What was said of the nearest roundabout in the last revolution.
    pub fn advice(&self) -> Option<&Advice> {
        self.roundabouts.advice()
    }

    /// Roundabouts that no map knows, found by who drives round them, in the local frame.
    pub fn found_roundabouts(&self) -> &[DrivenRoundabout] {
        self.roundabouts.found()
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
