//! Packets of a VLP-16 to revolutions: `looks` says where each firing of a packet looked, `reference`
//! where a packet belongs, `turn` keeps the firings of a revolution, `clock` the sensor's time. This file puts them together.
//!
//! Firings are counted by the sensor's own time stamps: one takes 55.296 us, so that it is known how many are
//! missing between two packets, and whether a packet comes late or twice. What is lost stays in its place as not
//! seen.

mod clock;
mod looks;
mod reference;
mod refusal;
mod turn;

pub use clock::ClockState;
pub use refusal::PacketRefusal;
pub use turn::Turn;

use super::sensor::{self, Sensor};
use super::{ByteOrderSource, CloudParameters, Dialect, Refusal, Revolution, Source};
use crate::time::{Span, Time};
use crate::wire::point_cloud::ByteOrder;
use crate::wire::velodyne::Packet;
use crate::wire::velodyne::data::{DataPacket, ReturnMode, UNIT_M};
use crate::wire::velodyne::position::PositionPacket;
use clock::SensorClock;
use looks::Looks;
use reference::Reference;

/// A sensor that has been silent for so long gives its place to another one; after so long without a
/// revolution, those before mean nothing any more.
const SILENCE: Span = Span::from_micros(1_000_000);

/// What a packet that was taken was.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Taken {
    /// Packets that are missing before it.
    pub lost: u64,
    /// Whether it filled a gap that was left for it.
    pub is_late: bool,
    /// Whether a revolution that it closes, if it closes one, can be used.
    pub closed: Option<Result<(), Refusal>>,
}

/// Keeps what must be known from packet to packet.
#[derive(Debug, Clone, Default)]
pub struct PacketIntake {
    /// The sensor that is listened to, and when it was heard last.
    listened: Option<([u8; 4], Time)>,
    /// Stamp of the last packet of a sensor that says that it is an HDL-32E.
    unproven_us: Option<i64>,
    /// Whether it is none.
    is_early_vlp16: bool,
    mode: Option<ReturnMode>,
    /// Sensor and mode of the last packet, if they were not as before.
    other_kind: Option<(&'static str, ReturnMode)>,
    /// The newest packet.
    reference: Option<Reference>,
    /// The last packet of all, if it did not go on from the newest one.
    stray: Option<Reference>,
    /// The revolution that is being put together, and the number of its first firing.
    turn: Turn,
    first: i64,
    /// Whether it was heard from its beginning.
    is_whole: bool,
    /// The last revolution that was closed and can be used, and when its last firing was.
    closed: Turn,
    ended: (i64, Time),
    clock: SensorClock,
    last_time: Option<Time>,
}

impl PacketIntake {
    /// Takes one packet.
    ///
    /// # Errors
    /// [`PacketRefusal`] when it is of no use. What is remembered of it costs the sound ones after it nothing.
    pub fn take(
        &mut self,
        packet: &Packet<'_>,
        parameters: &CloudParameters,
    ) -> Result<Taken, PacketRefusal> {
        self.follow_source(packet)?;
        if let Some(position) = PositionPacket::read(packet.bytes) {
            self.clock.hear(&position, packet.arrival);
            return Ok(Taken::default());
        }
        let data = DataPacket::new(packet.bytes)?;
        let Some(sensor) = self.sensor_of(&data)? else {
            return Ok(Taken::default());
        };
        let mode = data.return_mode().ok_or(PacketRefusal::ReturnMode)?;
        let looks = Looks::of(&data, mode)?;
        self.follow_kind(sensor, mode)?;
        self.listened = Some((packet.source, packet.arrival));
        let reference = self.placed(Reference::of(packet, &data, &looks))?;
        let next = self.first + self.turn.len() as i64;
        if reference.number < next {
            return self.fill_in(&data, &looks, reference.number);
        }
        if self.reference.is_none() {
            self.is_whole = reference.azimuth_deg < reference.step_deg;
        }
        self.reference = Some(reference);
        let mut taken = Taken {
            lost: (reference.number - next) as u64 / looks.len() as u64,
            ..Taken::default()
        };
        self.skip(&reference, &mut taken, parameters);
        for firing in 0..looks.len() {
            self.step(
                looks.azimuth_deg(firing),
                &reference,
                &mut taken,
                parameters,
            );
            self.turn
                .fill_in(self.turn.len() - 1, &data, &looks, firing);
        }
        Ok(taken)
    }

    /// The first sensor that is heard is listened to, until it is silent.
    fn follow_source(&mut self, packet: &Packet<'_>) -> Result<(), PacketRefusal> {
        let Some((listened, heard)) = self
            .listened
            .filter(|(listened, _)| *listened != packet.source)
        else {
            return Ok(());
        };
        if packet.arrival - heard <= SILENCE {
            return Err(PacketRefusal::OtherSensor {
                source_address: packet.source.into(),
                listened: listened.into(),
            });
        }
        self.begin_anew(self.turn.sensor);
        self.clock = SensorClock::default();
        (self.listened, self.mode, self.other_kind) = (None, None, None);
        (self.unproven_us, self.is_early_vlp16) = (None, false);
        Ok(())
    }

    /// By the factory byte. Early VLP-16 say that they are an HDL-32E; but that one sends a packet every 553 us,
    /// and they send one every 1327. With the first one it is not known yet.
    fn sensor_of(
        &mut self,
        data: &DataPacket<'_>,
    ) -> Result<Option<&'static Sensor>, PacketRefusal> {
        const HDL32E: u8 = 0x21;
        const PACKET_US: std::ops::RangeInclusive<i64> = 1326..=1329;
        let product = data.product();
        if product == HDL32E && !self.is_early_vlp16 {
            let now_us = i64::from(data.time_us());
            let Some(before_us) = self.unproven_us.replace(now_us) else {
                return Ok(None);
            };
            self.is_early_vlp16 = PACKET_US.contains(&(now_us - before_us));
        }
        let sensor = match product {
            HDL32E if self.is_early_vlp16 => Some(&sensor::VLP16),
            _ => sensor::of_product(product),
        };
        sensor.map(Some).ok_or(PacketRefusal::Product {
            name: sensor::product_name(product),
            product,
        })
    }

    /// Another kind of packet is believed when two of it come in a row.
    fn follow_kind(
        &mut self,
        sensor: &'static Sensor,
        mode: ReturnMode,
    ) -> Result<(), PacketRefusal> {
        let before = self.other_kind.take();
        if self.mode == Some(mode) && self.turn.sensor == sensor {
            return Ok(());
        }
        if self.mode.is_some() && before != Some((sensor.name, mode)) {
            self.other_kind = Some((sensor.name, mode));
            return Err(PacketRefusal::Jump);
        }
        self.mode = Some(mode);
        self.begin_anew(sensor);
        Ok(())
    }

    fn begin_anew(&mut self, sensor: &'static Sensor) {
        self.turn.clear();
        self.turn.sensor = sensor;
        (self.reference, self.stray) = (None, None);
        (self.first, self.is_whole) = (0, false);
    }

    /// Counts where a packet belongs. One that does not go on from the newest is refused; two that do not,
    /// but go on from each other, begin anew.
    fn placed(&mut self, mut packet: Reference) -> Result<Reference, PacketRefusal> {
        let Some(newest) = self.reference else {
            return Ok(packet);
        };
        let stray = self.stray.take();
        if let Some(ahead) = newest.ahead(&packet) {
            packet.number = newest.number + ahead;
            return Ok(packet);
        }
        if stray.is_some_and(|stray| stray.ahead(&packet).is_some_and(|ahead| ahead > 0)) {
            self.begin_anew(self.turn.sensor);
            return Ok(packet);
        }
        self.stray = Some(packet);
        Err(PacketRefusal::Jump)
    }

    /// Puts a packet that comes late into the gap that was left for it.
    fn fill_in(
        &mut self,
        data: &DataPacket<'_>,
        looks: &Looks,
        number: i64,
    ) -> Result<Taken, PacketRefusal> {
        let Ok(place) = usize::try_from(number - self.first) else {
            return Err(PacketRefusal::Late);
        };
        let mut is_late = false;
        for firing in 0..looks.len() {
            is_late |= self.turn.fill_in(place + firing, data, looks, firing);
        }
        if !is_late {
            return Err(PacketRefusal::Doubled);
        }
        Ok(Taken {
            is_late,
            ..Taken::default()
        })
    }

    /// Leaves room for the firings before a packet that were not heard of.
    fn skip(&mut self, packet: &Reference, taken: &mut Taken, parameters: &CloudParameters) {
        let missing = packet.number - self.first - self.turn.len() as i64;
        let Some(last_deg) = self.turn.last_deg().filter(|_| missing > 0) else {
            return;
        };
        let steps = missing as f64 + 1.0;
        let advance_deg = (packet.azimuth_deg - last_deg).rem_euclid(360.0);
        let turns = libm::round((steps * packet.step_deg - advance_deg) / 360.0);
        let step_deg = (advance_deg + 360.0 * turns.max(0.0)) / steps;
        for firing in 1..=missing {
            let azimuth_deg = (last_deg + step_deg * firing as f64).rem_euclid(360.0);
            self.step(azimuth_deg, packet, taken, parameters);
        }
    }

    /// Goes on to an azimuth, and closes the revolution if it lies behind.
    fn step(
        &mut self,
        azimuth_deg: f64,
        packet: &Reference,
        taken: &mut Taken,
        parameters: &CloudParameters,
    ) {
        if self
            .turn
            .last_deg()
            .is_some_and(|last_deg| azimuth_deg < last_deg)
        {
            let next = self.first + self.turn.len() as i64;
            let closed = self.turn.check(parameters);
            if self.is_whole {
                // A sound one is not lost because the same gap holds the next one.
                if closed.is_ok() {
                    std::mem::swap(&mut self.turn, &mut self.closed);
                    self.turn.sensor = self.closed.sensor;
                    self.ended = packet.time_of(next - 1);
                }
                taken.closed = taken.closed.filter(Result::is_ok).or(Some(closed));
            }
            self.turn.clear();
            (self.first, self.is_whole) = (next, true);
        }
        self.turn.push(azimuth_deg);
    }

    /// The last revolution that was closed.
    pub fn revolution(&mut self, parameters: &CloudParameters) -> Revolution<'_> {
        let (ended_us, ended) = self.ended;
        let time = self.clock.time(ended_us, ended, parameters.packet_time);
        let passed = self.last_time.replace(time).map(|last| time - last);
        let time_jumped = passed.is_some_and(|passed| passed.micros() <= 0 || passed > SILENCE);
        self.closed.finish();
        Revolution {
            sensor: self.closed.sensor,
            dialect: Dialect {
                byte_order: ByteOrder::Little,
                byte_order_source: ByteOrderSource::Defined,
                distance_mask: u16::MAX,
                unit_m: UNIT_M,
                intensity_bits: 8,
            },
            columns: self.closed.len(),
            start_deg: self.closed.start_deg(),
            step_deg: self.closed.step_deg(),
            column_period_s: self.closed.column_period_s(),
            source: Source::Turn(&self.closed),
            time,
            time_jumped,
        }
    }

    /// Whose time the last revolution has.
    pub fn clock(&self) -> ClockState {
        self.clock.state()
    }

    /// How far the sensor's clock, if it is kept, is ahead of that of the arrivals.
    pub fn clock_ahead(&self) -> Span {
        self.clock.ahead()
    }

    /// How many firings are one column, in the last revolution.
    pub fn firings_per_column(&self) -> usize {
        self.closed.merged()
    }

    /// Which returns the sensor sends, if it was heard.
    pub fn mode(&self) -> Option<ReturnMode> {
        self.mode
    }
}

#[cfg(test)]
pub(crate) mod tests;
