//! What the session says of the vehicle's pose: a history for each source of whole poses.

use super::geodesy::{Geodetic, LocalFrame};
use super::history::{Blend, History};
use super::reading::{Direction, Reading, Source};
use super::sweep::KNOTS;
use super::{Anchor, EgoParameters, HeadingUnit, Heard, Pose, Sweep, wrapped_rad};
use crate::time::{Span, Time};
use crate::wire::{Envelope, WireError};

/// What the session says of the vehicle's pose.
#[derive(Debug, Clone)]
pub(super) struct Sources {
    parameters: EgoParameters,
    local: Option<LocalFrame>,
    heading_unit: HeadingUnit,
    applanix: History<Pose>,
    geolocation: History<Pose>,
    places: History<[f64; 3]>,
    headings: History<Yaw>,
    speeds: History<f64>,
    yaw_rates: History<f64>,
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

/// The order in which sources are asked.
const SOURCES: [Source; 4] = [
    Source::Applanix,
    Source::Geolocation,
    Source::Separate,
    Source::Simulation,
];

impl Sources {
    pub(super) fn new(parameters: &EgoParameters) -> Self {
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
            speeds: History::default(),
            yaw_rates: History::default(),
            simulation: History::default(),
            current: None,
            epoch: 0,
            jumps: 0,
        }
    }

    /// Jumps of a source so far.
    pub(super) fn jumps(&self) -> u64 {
        self.jumps
    }

    /// Takes an envelope, if it holds a pose.
    ///
    /// # Errors
    /// [`WireError`] when its bytes do not fit its message.
    pub(super) fn hear(&mut self, envelope: &Envelope<'_>) -> Result<Heard, WireError> {
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
            Reading::Speed(mps) => self.speeds.push(time, mps),
            Reading::YawRate(rate) => self.yaw_rates.push(time, rate),
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
    pub(super) fn pose_from(&self, source: Source, time: Time) -> Option<Pose> {
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

    /// Ground speed and yaw rate as they are sent.
    pub(super) fn rates(&self, time: Time) -> [Option<f64>; 2] {
        [&self.speeds, &self.yaw_rates].map(|history| history.at(time, self.limit()))
    }

    /// The vehicle's pose from the most trusted source that has one.
    pub(super) fn best(&self, time: Time) -> Option<(Source, Pose)> {
        SOURCES
            .into_iter()
            .find_map(|source| self.pose_from(source, time).map(|pose| (source, pose)))
    }

    /// The sensor's poses from `begin` to `end` of a sweep by these sources alone. When another source is the most
    /// trusted one, or one is lost or found, a new epoch begins.
    pub(super) fn sweep(&mut self, begin: Time, end: Time) -> Sweep {
        let known = self.best(end);
        let source = known.map(|(source, _)| source);
        if source != self.current {
            self.current = source;
            self.epoch = self.epoch.wrapping_add(1);
        }
        let Some((source, vehicle)) = known else {
            return Sweep::still(self.epoch);
        };
        let swept_s = (end - begin).seconds();
        let knots = std::array::from_fn(|knot| {
            let share = knot as f64 / (KNOTS - 1) as f64;
            let time = begin + Span::from_seconds(share * swept_s);
            self.parameters
                .sensor(&self.pose_from(source, time).unwrap_or(vehicle))
        });
        Sweep {
            frame: source.frame(),
            epoch: self.epoch,
            vehicle: Some(vehicle),
            sensor: self.parameters.sensor(&vehicle),
            attitude: self.parameters.sensor(&vehicle).rigid(),
            knots,
            anchor: Anchor::IDENTITY,
        }
    }
}
