//! Where the vehicle is: in a frame that never jumps, by odometry, and in the world, by what the session says.
//!
//! `reading` brings every pose message to one set of units, `geodesy` WGS84 to the local frame,
//! `history` reads between and beyond what was heard and `lag` follows its clock, `senders` says whom to listen to, `sources`
//! chooses among them and `trust` says whether one goes as the sensor does, `rates` learns what speeds mean. The odometry
//! frame is tied to the local frame by an `anchor` (the frames `odom` and `map` of ROS REP 105); `beginning` says how fast
//! it begins. `sweep` is the answer.

mod anchor;

mod beginning;

pub mod geodesy;

mod history;

mod lag;

mod pose;

mod rates;

mod reading;

mod refusal;

mod senders;

mod sources;

mod sweep;

mod trust;

pub use anchor::Anchor;
pub use pose::{Placement, Pose, wrapped_rad};
pub use refusal::PoseRefusal;
pub use sweep::{Frame, Sweep};

use crate::cloud::Scan;
use crate::geometry::{Outline, Rectangle};
use crate::odometry::{Odometry, OdometryReport, Quality};
use crate::parameter::{choices, parameters};
use crate::time::{Span, Time};
use crate::wire::{Envelope, WireError};
use anchor::Anchoring;
use rates::Rates;
use reading::Source;
use sources::Sources;
use sweep::KNOTS;

choices! {
    /// The unit of headings in messages that do not fix it (1051, 1116).
    pub enum HeadingUnit {
        /// Found from the values: above pi they are degrees, below 0 radians, and radians
        /// until one of the two was seen.
        Auto = "auto",
        /// As gps-pos (Applanix) sends.
        Degrees = "degrees",
        /// As gps-ncom (OxTS) sends, and SI says.
        Radians = "radians",
    }
}

parameters! {
    /// The vehicle's motion: by odometry, and by the poses that the session has.
    pub struct EgoParameters "ego" {
        /// Whether the sensor's motion is found from what it sees. Without it poses alone tell it, their
        /// noise and jumps go into everything, and without poses the sensor is taken for one that stands.
        odometry: bool = true, thesis false, "";
        /// Whether poses are used at all.
        use_poses: bool = true, "";
        /// Standard deviation of the places that poses give, from one revolution to the next.
        pose_deviation_m: f64 = 0.1, in 0.001..=100.0, "m";
        /// The same of their headings.
        pose_deviation_deg: f64 = 0.5, in 0.01..=45.0, "degrees";
        /// Unit of headings in GeodeticHeadingReading and Geolocation.
        heading_unit: HeadingUnit = HeadingUnit::Auto, "";
        /// Whether the local frame lies around the reference below; else around the first fix.
        fixed_reference: bool = false, "";
        /// Latitude of the reference.
        reference_latitude_deg: f64 = 0.0, in -90.0..=90.0, "degrees";
        /// Longitude of the reference.
        reference_longitude_deg: f64 = 0.0, in -180.0..=180.0, "degrees";
        /// Altitude of the reference above the ellipsoid.
        reference_altitude_m: f64 = 0.0, in -1000.0..=10000.0, "m";
        /// How far the sensor stands in front of the point whose pose is sent.
        sensor_forward_m: f64 = 0.0, in -20.0..=20.0, "m";
        /// How far to its left.
        sensor_left_m: f64 = 0.0, in -5.0..=5.0, "m";
        /// How far above it.
        sensor_up_m: f64 = 0.0, in -5.0..=5.0, "m";
        /// How far the sensor looks to the left of the vehicle's forward.
        sensor_yaw_deg: f64 = 0.0, in -180.0..=180.0, "degrees";
        /// How long a pose is carried on when no new one comes; then odometry goes on alone.
        extrapolation_s: f64 = 0.5, in 0.0..=0.9, "s";
        /// A pose that lies this far from where the vehicle was expected is a jump of the
        /// source: when it persists, the local frame is tied to the world anew, and nothing else changes.
        jump_m: f64 = 2.0, in 0.1..=1000.0, "m";
        /// The same for its direction.
        jump_deg: f64 = 15.0, in 1.0..=180.0, "degrees";
    }
}

/// What became of an envelope.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Heard {
    /// It holds no pose.
    Nothing,
    /// It was taken.
    Pose,
    /// It was not, and why.
    Refused(PoseRefusal),
}

/// The ego step: hears poses, follows the sensor, tells where it was.
#[derive(Debug, Clone)]
pub struct Ego {
    parameters: EgoParameters,
    sources: Sources,
    odometry: Odometry,
    anchoring: Option<Anchoring>,
    rates: Rates,
    /// Jumps before the odometry frame began anew.
    past_jumps: u64,
    /// The source of poses in use.
    source: Option<Source>,
    /// When the odometry frame began.
    begun: Option<Time>,
    /// The source by which it began with the last revolution, without telling how fast the sensor goes.
    begun_blindly: Option<Source>,
    epoch: u32,
    /// Columns in which something that moves may be, and its outlines.
    marked: Vec<bool>,
    outlines: Vec<Outline>,
}

/// What the ego step says of itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EgoReport {
    /// What became of the last revolution.
    pub odometry: OdometryReport,
    /// How often the odometry frame began anew.
    pub restarts: u32,
    /// The source of poses in use: none, or its name.
    pub source: &'static str,
    /// How far it and the odometry were apart when they were compared last.
    pub disagreement_m: f64,
    /// How often a source jumped and stayed there.
    pub jumps: u64,
    /// How far the clock of the poses in use is behind that of the revolutions, seconds; 0 if it is the same.
    pub behind_s: f64,
    /// A source that does not go as the sensor does, and is not used.
    pub distrusted: Option<&'static str>,
}

/// Age of the odometry frame up to which it begins anew, along the axes of the local frame, when a first pose comes.
const YOUNG: Span = Span::from_micros(3_000_000);

impl EgoParameters {
    /// The sensor's pose on a vehicle.
    fn sensor(&self, vehicle: &Pose) -> Pose {
        vehicle.mounted(self.mount_m(), self.sensor_yaw_deg.to_radians())
    }

    /// The pose of a vehicle by that of its sensor.
    fn vehicle(&self, sensor: &Pose) -> Pose {
        let turned = sensor.mounted([0.0; 3], -self.sensor_yaw_deg.to_radians());
        turned.mounted(self.mount_m().map(|metres| -metres), 0.0)
    }

    fn mount_m(&self) -> [f64; 3] {
        [self.sensor_forward_m, self.sensor_left_m, self.sensor_up_m]
    }
}

impl Ego {
    /// An ego step that has heard and seen nothing.
    pub fn new(parameters: &EgoParameters) -> Self {
        Self {
            parameters: parameters.clone(),
            sources: Sources::new(parameters),
            odometry: Odometry::default(),
            anchoring: None,
            rates: Rates::new(),
            past_jumps: 0,
            source: None,
            begun: None,
            begun_blindly: None,
            epoch: 0,
            marked: vec![],
            outlines: vec![],
        }
    }

    /// Forgets where the sensor was, for a session that begins anew.
    pub fn reset(&mut self) {
        self.odometry.begin(&Pose::SENSOR.rigid(), None);
        self.keep_jumps();
        self.anchoring = None;
        self.begun = None;
        self.begun_blindly = None;
        self.epoch = self.epoch.wrapping_add(1);
    }

    /// What is to be said of the last revolution.
    pub fn report(&self) -> EgoReport {
        let anchoring = self.anchoring.as_ref();
        let jumps = anchoring.map_or(self.sources.jumps(), Anchoring::jumps);
        EgoReport {
            odometry: *self.odometry.report(),
            restarts: self.odometry.epoch(),
            source: self.source.map_or("none", Source::name),
            disagreement_m: anchoring.map_or(0.0, Anchoring::off_m),
            jumps: self.past_jumps + jumps,
            behind_s: self
                .source
                .map_or(0.0, |source| self.sources.behind_s(source)),
            distrusted: self.sources.distrusted().map(Source::name),
        }
    }

    /// Takes an envelope, if it holds a pose.
    ///
    /// # Errors
    /// [`WireError`] when its bytes do not fit its message.
    pub fn hear(&mut self, envelope: &Envelope<'_>) -> Result<Heard, WireError> {
        self.sources.hear(envelope)
    }

    /// Where the sensor is expected at the end of a scan, once the last one is settled.
    pub fn expect(&mut self, scan: &Scan) -> Sweep {
        self.settle();
        Sweep {
            sensor: Pose::of(&self.odometry.expected(scan)),
            ..Sweep::still(self.whole_epoch())
        }
    }

    /// Counts the frames that began anew, for whatever reason.
    fn whole_epoch(&self) -> u32 {
        self.epoch.wrapping_add(self.odometry.epoch())
    }

    /// Takes a scan in, and tells where the sensor was meanwhile. What `moving` boxes hold, in the sensor frame at the end
    /// of the scan, tells nothing of the sensor's motion.
    pub fn follow(&mut self, scan: &Scan, moving: &[Rectangle]) -> Sweep {
        let swept = Span::from_seconds(-scan.duration_s());
        let (begin, end) = (scan.time() + swept, scan.time());
        self.sources.note_lags(end);
        if !self.parameters.odometry {
            self.source = self.sources.best(end).map(|(source, _)| source);
            return self.sources.sweep(begin, end);
        }
        let middle = scan.time() + Span::from_seconds(-0.5 * scan.duration_s());
        if let (Some(anew), Some(anchoring)) = (self.sources.recentre(middle), &mut self.anchoring)
        {
            anchoring.reframe(&Pose::of(&self.odometry.pose()), anew);
        }
        let heard = self.sources.best(middle);
        self.source = heard.map(|(source, _)| source);
        let sensor = heard.map(|(source, vehicle)| (source, self.parameters.sensor(&vehicle)));
        let is_young = self.begun.is_none_or(|begun| (end - begun) < YOUNG);
        let begins = self.odometry.begins() || (self.anchoring.is_none() && is_young);
        let begun_blindly = self.begun_blindly.take();
        if let (Some((source, sensor)), true) = (&sensor, begins) {
            if !self.odometry.begins() {
                self.epoch = self.epoch.wrapping_add(1);
            }
            self.keep_jumps();
            let velocity = self.begin_velocity(*source, sensor, middle, scan.duration_s());
            self.odometry.begin(&sensor.rigid(), velocity);
            let is_known = velocity.is_some_and(|(_, within_mps)| within_mps.is_finite());
            self.begun_blindly = (!is_known).then_some(*source);
            let mut anchoring = Anchoring::begin(source.frame(), &self.parameters);
            if velocity.is_none() {
                anchoring.doubt_begin();
            }
            self.anchoring = Some(anchoring);
        }
        if begun_blindly.is_some() && begun_blindly == self.source {
            self.lead(scan);
        }
        self.begun.get_or_insert(end);
        self.mark(scan, moving);
        let (marked, outlines) = (&self.marked, &self.outlines);
        self.odometry.predict(scan);
        if let (Some((_, sensor)), Some(anchoring)) = (&sensor, &self.anchoring) {
            anchoring.guide(&mut self.odometry, sensor, &self.parameters);
        }
        let [speed, yaw_rate] = self.sources.rates(middle);
        let ahead_rad = self.ahead_rad();
        self.rates
            .guide(&mut self.odometry, speed, yaw_rate, ahead_rad);
        self.odometry.process(scan, |column, [x, y, _]| {
            let at_m = [f64::from(x), f64::from(y)];
            !marked[column] || outlines.iter().all(|outline| !outline.contains(at_m))
        });
        self.rates
            .learn(&self.odometry, speed, yaw_rate, self.ahead_rad());
        let pose = Pose::of(&self.odometry.pose_at(scan, -0.5 * scan.duration_s()));
        let is_sure = self.odometry.report().quality == Quality::Following;
        self.sources.compare(middle, is_sure.then_some(pose));
        if let Some((source, sensor)) = &sensor {
            self.anchoring
                .get_or_insert_with(|| {
                    Anchoring::at(source.frame(), &pose, sensor, &self.parameters)
                })
                .take(middle, &pose, source.frame(), sensor, &self.parameters);
        }
        self.sweep(scan)
    }

    /// Does what the answer to the last revolution need not wait for ([`Odometry::settle`]).
    pub fn settle(&mut self) {
        self.odometry.settle();
    }

    /// Marks the columns in which something that moves may be.
    fn mark(&mut self, scan: &Scan, moving: &[Rectangle]) {
        self.marked.clear();
        self.marked.resize(scan.columns(), false);
        self.outlines.clear();
        self.outlines.extend(moving.iter().map(Rectangle::outline));
        for rectangle in moving {
            match scan.columns_across(&rectangle.corners()) {
                None => self.marked.fill(true),
                Some(_) => {
                    for columns in scan.stretches_across(&rectangle.corners()) {
                        self.marked[columns].fill(true);
                    }
                }
            }
        }
    }

    /// Where the vehicle looks in the odometry frame.
    fn ahead_rad(&self) -> f64 {
        Pose::of(&self.odometry.pose()).yaw_rad - self.parameters.sensor_yaw_deg.to_radians()
    }

    fn keep_jumps(&mut self) {
        self.past_jumps += self.anchoring.as_ref().map_or(0, Anchoring::jumps);
    }

    fn sweep(&self, scan: &Scan) -> Sweep {
        let knots = std::array::from_fn(|knot| {
            let left = 1.0 - knot as f64 / (KNOTS - 1) as f64;
            Pose::of(&self.odometry.pose_at(scan, -left * scan.duration_s()))
        });
        let attitude = self.odometry.pose_at(scan, 0.0);
        let sensor = knots[KNOTS - 1];
        let (frame, anchor) = self
            .anchoring
            .as_ref()
            .map_or((Frame::Odometry, Anchor::IDENTITY), Anchoring::anchor);
        Sweep {
            frame,
            reference: self.sources.reference().filter(|_| frame == Frame::Earth),
            epoch: self.whole_epoch(),
            vehicle: Some(self.parameters.vehicle(&anchor.pose(&sensor))),
            sensor,
            attitude,
            knots,
            anchor,
        }
    }
}
