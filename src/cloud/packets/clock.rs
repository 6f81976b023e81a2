//! The time of a sensor's packets: its own where a GPS receiver keeps it, else that of their arrival.

use crate::cloud::PacketTime;
use crate::time::{Span, Time};
use crate::wire::velodyne::HOUR_US;
use crate::wire::velodyne::position::PositionPacket;

/// How old what a receiver said may be when the sensor passes it on: a sentence a second, and a second to be sent.
const OLDEST_SENTENCE: Span = Span::from_micros(3_000_000);
/// For so long a clock is believed to go on after the last word of its receiver.
const TRUST: Span = Span::from_micros(5_000_000);
/// A clock that is farther from the computer's than this is of no use beside it: what is played was recorded
/// once, or the receiver counts weeks wrong.
const FARTHEST: Span = Span::from_micros(10_000_000);

/// Whose time revolutions have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ClockState {
    /// That of the packets' arrival: no receiver keeps the sensor's.
    #[default]
    Free,
    /// The sensor's, which follows a GPS receiver.
    Synchronised,
    /// That of the arrival, though a receiver keeps the sensor's: both are too far apart.
    Apart,
    /// That of the arrival, because it is configured.
    Configured,
}

impl ClockState {
    /// How logs and Status name it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Synchronised => "synchronised",
            Self::Apart => "apart",
            Self::Configured => "configured",
        }
    }
}

/// What is known of a sensor's clock.
#[derive(Debug, Clone, Default)]
pub(super) struct SensorClock {
    /// A moment: microseconds past the hour, the whole time, and when it was heard of.
    kept: Option<(i64, Time, Time)>,
    state: ClockState,
    /// How far it is ahead of the arrival's.
    ahead: Span,
}

impl SensorClock {
    /// Hears what a position packet says.
    pub(super) fn hear(&mut self, position: &PositionPacket, arrival: Time) {
        let Some(utc) = position.utc.filter(|_| position.is_locked) else {
            return;
        };
        let stamp_us = i64::from(position.time_us);
        let time = nearest(stamp_us, utc);
        let age = time - utc;
        if age.micros().abs() <= OLDEST_SENTENCE.micros() {
            self.kept = Some((stamp_us, time, arrival));
        }
    }

    /// The time of a moment that lies so many microseconds past the hour, and seemed to be at `arrival`.
    pub(super) fn time(&mut self, stamp_us: i64, arrival: Time, wanted: PacketTime) -> Time {
        let kept = self.kept.filter(|(_, _, heard)| arrival - *heard <= TRUST);
        let time = kept.map(|(kept_us, kept, _)| {
            const HALF_US: i64 = HOUR_US / 2;
            let passed_us = (stamp_us - kept_us + HALF_US).rem_euclid(HOUR_US) - HALF_US;
            kept + Span::from_micros(passed_us)
        });
        self.ahead = time.map_or(Span::default(), |time| time - arrival);
        let (state, time) = match time {
            _ if wanted == PacketTime::Arrival => (ClockState::Configured, arrival),
            None => (ClockState::Free, arrival),
            Some(time) if (time - arrival).micros().abs() > FARTHEST.micros() => {
                (ClockState::Apart, arrival)
            }
            Some(time) => (ClockState::Synchronised, time),
        };
        self.state = state;
        time
    }

    pub(super) fn ahead(&self) -> Span {
        self.ahead
    }

    pub(super) fn state(&self) -> ClockState {
        self.state
    }
}

/// The time nearest to another one that lies so many microseconds past an hour.
fn nearest(stamp_us: i64, to: Time) -> Time {
    let hours = (to.micros() - stamp_us + HOUR_US / 2).div_euclid(HOUR_US);
    Time::from_micros(hours * HOUR_US + stamp_us)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOUR: Time = Time::from_micros(1_699_999_200_000_000);

    fn after(seconds: f64) -> Time {
        HOUR + Span::from_seconds(seconds)
    }

    fn position(stamp_s: f64, utc_s: f64) -> PositionPacket {
        PositionPacket {
            time_us: (1e6 * stamp_s) as u32,
            is_locked: true,
            utc: Some(after(utc_s)),
        }
    }

    #[test]
    fn a_kept_clock_is_taken_over_the_turn_of_the_hour() {
        let mut clock = SensorClock::default();
        clock.hear(&position(3599.9, 3599.0), after(3598.5));
        let time = clock.time(400_000, after(3599.1), PacketTime::Sensor);
        assert_eq!(
            (time, clock.state()),
            (after(3600.4), ClockState::Synchronised)
        );
        let time = clock.time(3_599_800_000, after(3598.4), PacketTime::Sensor);
        assert_eq!(time, after(3599.8));
        // The sentence is of the hour before.
        clock.hear(&position(0.3, 3599.0), after(3600.2));
        assert_eq!(
            clock.time(500_000, after(3600.4), PacketTime::Sensor),
            after(3600.5)
        );
    }

    #[test]
    fn the_arrival_counts_where_the_clock_is_not_kept() {
        let mut clock = SensorClock::default();
        let arrival = after(20.0);
        let state_of = |clock: &mut SensorClock, wanted| {
            let time = clock.time(21_000_000, arrival, wanted);
            (time, clock.state())
        };
        let free = (arrival, ClockState::Free);
        assert_eq!(state_of(&mut clock, PacketTime::Sensor), free);
        let unlocked = PositionPacket {
            is_locked: false,
            ..position(20.0, 20.0)
        };
        clock.hear(&unlocked, arrival);
        clock.hear(&position(20.0, 26.0), arrival);
        assert_eq!(state_of(&mut clock, PacketTime::Sensor), free);
        clock.hear(&position(20.0, 20.0), after(14.0));
        assert_eq!(state_of(&mut clock, PacketTime::Sensor), free);
        clock.hear(&position(20.0, 20.0), arrival);
        let kept = (after(21.0), ClockState::Synchronised);
        assert_eq!(state_of(&mut clock, PacketTime::Sensor), kept);
        let configured = (arrival, ClockState::Configured);
        assert_eq!(state_of(&mut clock, PacketTime::Arrival), configured);
        clock.hear(&position(20.0, 7220.0), arrival);
        assert_eq!(
            state_of(&mut clock, PacketTime::Sensor),
            (arrival, ClockState::Apart)
        );
    }
}
