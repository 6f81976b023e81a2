//! Where the vehicle is: its pose at any time, from whatever messages the session has.
//!
//! `reading` brings every message to one set of units, `geodesy` WGS84 to the local frame,
//! `history` reads between and beyond what was heard, `sweep` is the answer. This file chooses
//! among the sources.

pub mod geodesy;

mod history;

mod pose;

mod reading;

mod sweep;

pub use pose::{Placement, Pose, wrapped_rad};
pub use sweep::{Frame, Sweep};

use crate::parameter::{choices, parameters};
use crate::time::{Span, Time};
use crate::wire::{Envelope, WireError};
use geodesy::{Geodetic, LocalFrame};
use history::{Blend, History};
use reading::{Direction, Reading, Source};
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
    /// The vehicle's pose. Without a source of poses everything works in the sensor frame.
    pub struct EgoParameters "ego" {
        /// Whether poses are used at all.
        use_poses: bool = true, "";
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
        /// How long a pose is carried on when no new one comes; then it is lost, and the local
        /// frame is the sensor's again.
        extrapolation_s: f64 = 0.5, in 0.0..=0.9, "s";
        /// A pose that lies this far from where the vehicle was expected is a jump of the
        /// source: the world keeps its place around the vehicle, and the map begins anew.
        jump_m: f64 = 2.0, in 0.1..=1000.0, "m";
        /// The same for its direction.
        jump_deg: f64 = 15.0, in 1.0..=180.0, "degrees";
    }
}

/// The ego step: hears poses, tells where the sensor was.
#[derive(Debug, Clone)]
pub struct Ego {
    parameters: EgoParameters,
    local: Option<LocalFrame>,
    heading_unit: HeadingUnit,
    applanix: History<Pose>,
    geolocation: History<Pose>,
    places: History<[f64; 3]>,
    headings: History<Yaw>,
    simulation: History<Pose>,
    current: Option<Source>,
    epoch: u32,
    jumps: u64,
}

/// An angle that is blended the shorter way round.
#[derive(Debug, Clone, Copy)]
struct Yaw(f64);

impl Blend for Yaw {
    fn blend(&self, other: &Self, share: f64) -> Self {
        Self(wrapped_rad(self.0 + share * wrapped_rad(other.0 - self.0)))
    }
}

impl Blend for Pose {
    fn blend(&self, other: &Self, share: f64) -> Self {
        self.toward(other, share)
    }
}

impl Blend for [f64; 3] {
    fn blend(&self, other: &Self, share: f64) -> Self {
        [0, 1, 2].map(|axis| self[axis] + share * (other[axis] - self[axis]))
    }
}

/// What became of an envelope.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Heard {
    /// It holds no pose.
    Nothing,
    /// It was taken.
    Pose,
    /// Its numbers cannot be a vehicle's.
    Implausible,
}

/// The order in which sources are asked.
const SOURCES: [Source; 4] = [
    Source::Applanix,
    Source::Geolocation,
    Source::Separate,
    Source::Simulation,
];

impl Ego {
    /// An ego step that has heard nothing.
    pub fn new(parameters: &EgoParameters) -> Self {
        let reference = Geodetic {
            latitude_deg: parameters.reference_latitude_deg,
            longitude_deg: parameters.reference_longitude_deg,
            altitude_m: parameters.reference_altitude_m,
        };
        Self {
            local: parameters
                .fixed_reference
                .then(|| LocalFrame::around(reference)),
            heading_unit: parameters.heading_unit,
            parameters: parameters.clone(),
            applanix: History::default(),
            geolocation: History::default(),
            places: History::default(),
            headings: History::default(),
            simulation: History::default(),
            current: None,
            epoch: 0,
            jumps: 0,
        }
    }

    /// Jumps of a source so far.
    pub fn jumps(&self) -> u64 {
        self.jumps
    }

    /// Takes an envelope, if it holds a pose.
    ///
    /// # Errors
    /// [`WireError`] when its bytes do not fit its message.
    pub fn hear(&mut self, envelope: &Envelope<'_>) -> Result<Heard, WireError> {
        let Some(reading) = Reading::decode(envelope)? else {
            return Ok(Heard::Nothing);
        };
        if !reading.is_plausible() {
            return Ok(Heard::Implausible);
        }
        if self.parameters.use_poses {
            self.take(envelope.time(), reading);
        }
        Ok(Heard::Pose)
    }

    fn take(&mut self, time: Time, reading: Reading) {
        match reading {
            Reading::Fix(source, place, direction) => {
                let yaw_rad = self.yaw_rad(direction);
                let position_m = self.local_m(place);
                self.push_pose(
                    source,
                    time,
                    Pose {
                        position_m,
                        yaw_rad,
                    },
                );
            }
            Reading::Local(source, pose) => self.push_pose(source, time, pose),
            Reading::Place(place) => {
                let position_m = self.local_m(place);
                let expected = self.places.at(time, self.limit());
                if expected.is_some_and(|from| self.is_far(from, position_m)) {
                    self.places.clear();
                    self.jump(Source::Separate);
                } else if self.places.is_stale(time, self.limit()) {
                    self.places.clear();
                    self.begin_anew(Source::Separate);
                }
                self.places.push(time, position_m);
            }
            Reading::Heading(direction) => {
                let yaw_rad = self.yaw_rad(direction);
                let expected = self.headings.at(time, self.limit());
                if expected.is_some_and(|Yaw(from_rad)| self.is_turned(from_rad, yaw_rad)) {
                    self.headings.clear();
                    self.jump(Source::Separate);
                }
                self.headings.push(time, Yaw(yaw_rad));
            }
            Reading::Rate => {}
        }
    }

    fn push_pose(&mut self, source: Source, time: Time, pose: Pose) {
        let limit = self.limit();
        let jumped = self.history(source).at(time, limit).is_some_and(|from| {
            self.is_far(from.position_m, pose.position_m)
                || self.is_turned(from.yaw_rad, pose.yaw_rad)
        });
        let is_stale = self.history(source).is_stale(time, limit);
        if jumped {
            self.jump(source);
        } else if is_stale {
            self.begin_anew(source);
        }
        let history = match source {
            Source::Applanix => &mut self.applanix,
            Source::Geolocation => &mut self.geolocation,
            Source::Separate | Source::Simulation => &mut self.simulation,
        };
        if jumped || is_stale {
            history.clear();
        }
        history.push(time, pose);
    }

    fn history(&self, source: Source) -> &History<Pose> {
        match source {
            Source::Applanix => &self.applanix,
            Source::Geolocation => &self.geolocation,
            Source::Separate | Source::Simulation => &self.simulation,
        }
    }

    fn limit(&self) -> Span {
        Span::from_seconds(self.parameters.extrapolation_s)
    }

    fn is_far(&self, from: [f64; 3], to: [f64; 3]) -> bool {
        libm::hypot(to[0] - from[0], to[1] - from[1]) > self.parameters.jump_m
    }

    fn is_turned(&self, from_rad: f64, to_rad: f64) -> bool {
        wrapped_rad(to_rad - from_rad).abs() > self.parameters.jump_deg.to_radians()
    }

    /// A source began anew; that of another one than is used concerns nobody.
    fn jump(&mut self, source: Source) {
        self.jumps += 1;
        self.begin_anew(source);
    }

    /// What a source says now cannot be compared with what it said before.
    fn begin_anew(&mut self, source: Source) {
        if self.current == Some(source) {
            self.epoch = self.epoch.wrapping_add(1);
        }
    }

    fn local_m(&mut self, place: Geodetic) -> [f64; 3] {
        self.local
            .get_or_insert_with(|| LocalFrame::around(place))
            .local_m(place)
    }

    /// Radians lie within half a turn to either side of north, degrees within a whole one.
    fn yaw_rad(&mut self, direction: Direction) -> f64 {
        if let (Direction::Unknown(value), HeadingUnit::Auto) = (direction, self.heading_unit) {
            /// A heading in radians at most, with room for its rounding.
            const MOST_RAD: f64 = 3.2;
            if value > MOST_RAD {
                self.heading_unit = HeadingUnit::Degrees;
                // Those before were read as radians.
                self.headings.clear();
                self.geolocation.clear();
                self.begin_anew(Source::Separate);
                self.begin_anew(Source::Geolocation);
            } else if value < 0.0 {
                self.heading_unit = HeadingUnit::Radians;
            }
        }
        direction.yaw_rad(self.heading_unit)
    }

    /// The vehicle's pose from one source.
    fn pose_from(&self, source: Source, time: Time) -> Option<Pose> {
        let limit = self.limit();
        if source != Source::Separate {
            return self.history(source).at(time, limit);
        }
        let position_m = self.places.at(time, limit)?;
        let Yaw(yaw_rad) = self.headings.at(time, limit)?;
        Some(Pose {
            position_m,
            yaw_rad,
        })
    }

    /// The sensor's poses from `begin` to `end` of a sweep. Poses are taken as the most trusted
    /// source gives them; when it changes, or is lost or found, a new epoch begins.
    pub fn sweep(&mut self, begin: Time, end: Time) -> Sweep {
        let known = SOURCES
            .into_iter()
            .find_map(|source| self.pose_from(source, end).map(|pose| (source, pose)));
        let source = known.map(|(source, _)| source);
        if source != self.current {
            self.current = source;
            self.epoch = self.epoch.wrapping_add(1);
        }
        let Some((source, vehicle)) = known else {
            return Sweep::still(self.epoch);
        };
        let EgoParameters {
            sensor_forward_m,
            sensor_left_m,
            sensor_up_m,
            sensor_yaw_deg,
            ..
        } = self.parameters;
        let mounted = |pose: Pose| {
            pose.mounted(
                [sensor_forward_m, sensor_left_m, sensor_up_m],
                sensor_yaw_deg.to_radians(),
            )
        };
        let swept_s = (end - begin).seconds();
        let knots = std::array::from_fn(|knot| {
            let share = knot as f64 / (KNOTS - 1) as f64;
            let time = begin + Span::from_seconds(share * swept_s);
            mounted(self.pose_from(source, time).unwrap_or(vehicle))
        });
        Sweep {
            frame: match source {
                Source::Simulation => Frame::Simulation,
                _ => Frame::Earth,
            },
            epoch: self.epoch,
            vehicle: Some(vehicle),
            sensor: mounted(vehicle),
            knots,
        }
    }
}
