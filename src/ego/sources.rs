//! What the session says of the vehicle's pose: a history for each source of whole poses.

use super::geodesy::{Geodetic, LocalFrame};
use super::history::{History, Yaw};
use super::lag::Clock;
use super::reading::{Direction, Reading, Source};
use super::senders::Senders;
use super::sweep::KNOTS;
use super::trust::Trust;
use super::{
    Anchor, EgoParameters, Frame, HeadingUnit, Heard, Pose, PoseRefusal, Sweep, wrapped_rad,
};
use crate::time::{Span, Time};
use crate::wire::{Envelope, WireError};

/// What the session says of the vehicle's pose.
#[derive(Debug, Clone)]
pub(super) struct Sources {
    parameters: EgoParameters,
    local: Option<LocalFrame>,
    heading_unit: HeadingUnit,
    /// How far north is turned where the vehicle was last, against the local frame's.
    north_turn_rad: f64,
    applanix: History<Pose>,
    geolocation: History<Pose>,
    places: History<[f64; 3]>,
    headings: History<Yaw>,
    speeds: History<f64>,
    yaw_rates: History<f64>,
    simulation: History<Pose>,
    senders: Senders,
    /// In the order of [`SOURCES`].
    trusts: [Trust; SOURCES.len()],
    current: Option<Source>,
    epoch: u32,
    jumps: u64,
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
            north_turn_rad: 0.0,
            parameters: parameters.clone(),
            applanix: History::default(),
            geolocation: History::default(),
            places: History::default(),
            headings: History::default(),
            speeds: History::default(),
            yaw_rates: History::default(),
            simulation: History::default(),
            senders: Senders::default(),
            trusts: Default::default(),
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
            return Ok(Heard::Refused(PoseRefusal::Implausible));
        }
        if reading.is_without_fix() {
            return Ok(Heard::Refused(PoseRefusal::NoFix));
        }
        let (time, sender_stamp) = (envelope.time(), envelope.sender_stamp);
        let admitted = self.senders.admit(envelope.data_type, sender_stamp, time);
        if let Err(listened) = admitted {
            return Ok(Heard::Refused(PoseRefusal::OtherSender {
                sender_stamp,
                listened,
            }));
        }
        if !self.parameters.use_poses {
            return Ok(Heard::Pose);
        }
        self.take(time, reading);
        if let Clock::Another(behind) = self.clock_of(&reading) {
            return Ok(Heard::Refused(PoseRefusal::OtherClock { behind }));
        }
        Ok(Heard::Pose)
    }

    /// The clock that stamps a kind of reading.
    fn clock_of(&self, reading: &Reading) -> Clock {
        match reading {
            Reading::Fix(source, ..) | Reading::Local(source, _) => self.history(*source).clock(),
            Reading::Place(_) => self.places.clock(),
            Reading::Heading(_) => self.headings.clock(),
            Reading::Speed(_) => self.speeds.clock(),
            Reading::YawRate(_) => self.yaw_rates.clock(),
        }
    }

    /// Notes at the end of a revolution how far each clock is behind.
    pub(super) fn note_lags(&mut self, end: Time) {
        for poses in [
            &mut self.applanix,
            &mut self.geolocation,
            &mut self.simulation,
        ] {
            poses.note_lag(end);
        }
        self.places.note_lag(end);
        self.headings.note_lag(end);
        self.speeds.note_lag(end);
        self.yaw_rates.note_lag(end);
    }

    /// How far the clock of a source is behind, seconds.
    pub(super) fn behind_s(&self, source: Source) -> f64 {
        let clock = match source {
            Source::Separate => self.places.clock(),
            _ => self.history(source).clock(),
        };
        match clock {
            Clock::Same => 0.0,
            Clock::Behind(lag) | Clock::Another(lag) => lag.seconds(),
        }
    }

    /// Compares all sources with where the odometry has the sensor at a time, if it is sure of it.
    pub(super) fn compare(&mut self, time: Time, seen: Option<Pose>) {
        for (number, source) in SOURCES.into_iter().enumerate() {
            let sensor = self
                .pose_from(source, time)
                .map(|vehicle| self.parameters.sensor(&vehicle));
            self.trusts[number].compare(time, sensor.zip(seen));
        }
    }

    /// A source that does not go as the sensor does.
    pub(super) fn distrusted(&self) -> Option<Source> {
        let mut both = SOURCES.into_iter().zip(&self.trusts);
        both.find_map(|(source, trust)| (!trust.holds()).then_some(source))
    }

    fn take(&mut self, time: Time, reading: Reading) {
        match reading {
            Reading::Fix(source, place, direction) => {
                let position_m = self.local_m(place);
                let yaw_rad = self.yaw_rad(direction);
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

    /// Where a place lies in the local frame; headings after it are those at the place.
    fn local_m(&mut self, place: Geodetic) -> [f64; 3] {
        let local = self.local.get_or_insert_with(|| LocalFrame::around(place));
        self.north_turn_rad = local.north_turn_rad(place);
        local.local_m(place)
    }

    /// Where the local frame lies, if anything was heard of the earth.
    pub(super) fn reference(&self) -> Option<Geodetic> {
        self.local.as_ref().map(LocalFrame::reference)
    }

    /// Lays the local frame around where the vehicle is, if that is far from its reference and the reference is not
    /// configured. Gives how poses are to be said anew.
    pub(super) fn recentre(&mut self, time: Time) -> Option<impl Fn(&Pose) -> Pose + use<>> {
        /// Within this the earth is flat to 8 m of height and 0.1 degrees.
        const FARTHEST_M: f64 = 10_000.0;
        let before = self.local.filter(|_| !self.parameters.fixed_reference)?;
        let (source, vehicle) = self.best(time)?;
        let [east_m, north_m, _] = vehicle.position_m;
        if source.frame() != Frame::Earth || libm::hypot(east_m, north_m) < FARTHEST_M {
            return None;
        }
        let now = LocalFrame::around(before.geodetic(vehicle.position_m));
        self.local = Some(now);
        let anew = move |pose: &Pose| {
            let place = before.geodetic(pose.position_m);
            let turn_rad = now.north_turn_rad(place) - before.north_turn_rad(place);
            Pose {
                position_m: now.local_m(place),
                yaw_rad: wrapped_rad(pose.yaw_rad + turn_rad),
            }
        };
        self.applanix.restate(anew);
        self.geolocation.restate(anew);
        let there = anew(&vehicle);
        let turn_rad = there.yaw_rad - vehicle.yaw_rad;
        self.headings
            .restate(|Yaw(yaw_rad)| Yaw(wrapped_rad(yaw_rad + turn_rad)));
        self.places.restate(|position_m| {
            let pose = Pose {
                position_m: *position_m,
                yaw_rad: 0.0,
            };
            anew(&pose).position_m
        });
        self.trusts = Default::default();
        Some(anew)
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
        wrapped_rad(direction.yaw_rad(self.heading_unit) + self.north_turn_rad)
    }

    /// The vehicle's pose from one source.
    pub(super) fn pose_from(&self, source: Source, time: Time) -> Option<Pose> {
        let limit = self.limit();
        if source != Source::Separate {
            return self.history(source).at_end(time, limit);
        }
        let position_m = self.places.at_end(time, limit)?;
        let Yaw(yaw_rad) = self.headings.at_end(time, limit)?;
        Some(Pose {
            position_m,
            yaw_rad,
        })
    }

    /// The part of a time in which a source is known, neither before its first pose nor beyond its last one.
    pub(super) fn known(&self, source: Source, time: [Time; 2]) -> Option<[Time; 2]> {
        match source {
            Source::Separate => self.headings.known(self.places.known(time)?),
            _ => self.history(source).known(time),
        }
    }

    /// Ground speed and yaw rate as they are sent.
    pub(super) fn rates(&self, time: Time) -> [Option<f64>; 2] {
        [&self.speeds, &self.yaw_rates].map(|history| history.at_end(time, self.limit()))
    }

    /// The vehicle's pose from the first source that has one and is trusted.
    pub(super) fn best(&self, time: Time) -> Option<(Source, Pose)> {
        let trusted = SOURCES.into_iter().zip(&self.trusts);
        trusted
            .filter(|(_, trust)| trust.holds())
            .find_map(|(source, _)| self.pose_from(source, time).map(|pose| (source, pose)))
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
            reference: self.reference(),
            epoch: self.epoch,
            vehicle: Some(vehicle),
            sensor: self.parameters.sensor(&vehicle),
            attitude: self.parameters.sensor(&vehicle).rigid(),
            knots,
            anchor: Anchor::IDENTITY,
        }
    }
}

#[cfg(test)]
mod tests;
