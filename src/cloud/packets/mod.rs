//! Packets of a VLP-16 to revolutions: `looks` says where each firing of a packet looked, `turn` keeps
//! the firings of a revolution, `clock` the sensor's time. This file puts them together.
//!
//! Firings are counted by the sensor's own time stamps: one takes 55.296 us, so that it is known how many are
//! missing between two packets, and whether a packet comes late or twice. What is lost stays in its place as not
//! seen.

mod clock;

mod looks;

mod refusal;

mod turn;

pub use clock::ClockState;
pub use refusal::PacketRefusal;
pub use turn::Turn;

use super::sensor::{self, Sensor, VLP16};
use super::{ByteOrderSource, CloudParameters, Dialect, Refusal, Revolution, Source};
use crate::time::{Span, Time};
use crate::wire::point_cloud::ByteOrder;
use crate::wire::velodyne::data::{DataPacket, ReturnMode, UNIT_M};
use crate::wire::velodyne::position::PositionPacket;
use crate::wire::velodyne::{HOUR_US, Packet};
use clock::SensorClock;
use looks::Looks;

/// A sensor that has been silent for so long gives its place to another one; after so long without a
/// revolution, those before mean nothing any more.
const SILENCE: Span = Span::from_micros(1_000_000);
/// Longest stretch of lost packets after which a revolution goes on, in microseconds.
const LONGEST_GAP_US: i64 = 250_000;
/// How much time stamps, which are whole microseconds, may differ from whole firings.
const STAMP_TOLERANCE_US: f64 = 10.0;
/// How much the azimuth of a packet may differ from where the rotation leads, and how much more for each degree that
/// it turned. Motors keep their rate within 0.3 %.
const AZIMUTH_TOLERANCE_DEG: f64 = 1.0;
const AZIMUTH_TOLERANCE: f64 = 0.01;
const FIRING_PERIOD_US: f64 = 1e6 * VLP16.column_period_s;

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

/// When the firings of a packet were, and where it looked.
#[derive(Debug, Clone, Copy)]
struct Reference {
    /// Number of its first firing since the first of all.
    number: i64,
    /// When that was, by the sensor's clock.
    time_us: u32,
    /// When the packet came.
    arrival: Time,
    firings: usize,
    azimuth_deg: f64,
    step_deg: f64,
}

impl Reference {
    fn of(packet: &Packet<'_>, data: &DataPacket<'_>, looks: &Looks) -> Self {
        Self {
            number: 0,
            time_us: data.time_us(),
            arrival: packet.arrival,
            firings: looks.len(),
            azimuth_deg: looks.azimuth_deg(0),
            step_deg: looks.step_deg(),
        }
    }

    /// How many firings after it another packet begins, if that one goes on from it.
    fn ahead(&self, other: &Self) -> Option<i64> {
        const HALF_US: i64 = HOUR_US / 2;
        let passed_us = i64::from(other.time_us) - i64::from(self.time_us);
        let passed_us = (passed_us + HALF_US).rem_euclid(HOUR_US) - HALF_US;
        let firings = libm::round(passed_us as f64 / FIRING_PERIOD_US);
        let off_us = libm::fabs(passed_us as f64 - firings * FIRING_PERIOD_US);
        let turned_deg = firings * self.step_deg;
        let off_deg = other.azimuth_deg - self.azimuth_deg - turned_deg;
        let off_deg = (off_deg + 180.0).rem_euclid(360.0) - 180.0;
        let tolerance_deg = AZIMUTH_TOLERANCE_DEG + AZIMUTH_TOLERANCE * libm::fabs(turned_deg);
        let goes_on = passed_us.abs() <= LONGEST_GAP_US
            && off_us <= STAMP_TOLERANCE_US
            && libm::fabs(off_deg) <= tolerance_deg;
        goes_on.then_some(firings as i64)
    }

    /// When a firing was: microseconds past the hour by the sensor's clock, and by that of the arrivals. A packet
    /// is sent when its last firing is over.
    fn time_of(&self, number: i64) -> (i64, Time) {
        let after_us = libm::round((number - self.number) as f64 * FIRING_PERIOD_US) as i64;
        let whole_us = libm::round(self.firings as f64 * FIRING_PERIOD_US) as i64;
        (
            i64::from(self.time_us) + after_us,
            self.arrival + Span::from_micros(after_us - whole_us),
        )
    }
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
pub(crate) mod tests {
    use super::*;
    use crate::cloud::{MAX_COLUMNS, MAX_LAYERS, OwnVehicle, Scan};
    use crate::parameter::Profile;
    use crate::wire::velodyne::data::{BLOCKS, LASERS, PACKET_LEN, PacketWriter, Return};

    const EPOCH: Time = Time::from_micros(1_700_000_000_000_000);

    /// A sensor in a round room of 10 m, and in front of it a pane at 4 m that lets half of each pulse through.
    struct TestSensor {
        rate_hz: f64,
        mode: ReturnMode,
        product: u8,
    }

    const SENSOR: TestSensor = TestSensor {
        rate_hz: 10.0,
        mode: ReturnMode::Strongest,
        product: sensor::VLP16_PRODUCT,
    };

    impl TestSensor {
        fn firings(&self) -> usize {
            if self.mode == ReturnMode::Dual {
                12
            } else {
                24
            }
        }

        /// A packet by its number; the first one begins 3 degrees before the end of the circle.
        fn packet(&self, number: usize) -> [u8; PACKET_LEN] {
            let mut writer = PacketWriter::new(self.mode, self.product);
            let blocks = 24 / self.firings();
            for block in 0..BLOCKS {
                let firing = number * self.firings() + block / blocks * 2;
                let azimuth_deg =
                    357.0 + 360.0 * self.rate_hz * VLP16.column_period_s * firing as f64;
                let azimuth_deg = azimuth_deg.rem_euclid(360.0);
                writer.set_azimuth(block, (100.0 * azimuth_deg) as u16);
                for channel in 0..2 * LASERS {
                    let is_pane = (10.0..20.0).contains(&azimuth_deg) && block % blocks == 1;
                    let found = Return {
                        distance: if is_pane { 2000 } else { 5000 },
                        reflectivity: channel as u8,
                    };
                    writer.set(block, channel / LASERS, channel % LASERS, found);
                }
            }
            let time_us = (number * self.firings()) as f64 * FIRING_PERIOD_US;
            writer.set_time_us((3_599_900_000 + time_us.round() as i64).rem_euclid(HOUR_US) as u32);
            *writer.bytes()
        }
    }

    struct Listener {
        intake: PacketIntake,
        parameters: CloudParameters,
        scan: Scan,
        /// Columns, those that were not heard, whether time jumped; or why it was refused.
        closed: Vec<Result<(usize, usize, bool), &'static str>>,
        lost: u64,
        late: u32,
    }

    impl Listener {
        fn new() -> Self {
            Self {
                intake: PacketIntake::default(),
                parameters: CloudParameters::profile(Profile::Default),
                scan: Scan::default(),
                closed: vec![],
                lost: 0,
                late: 0,
            }
        }

        fn hear(&mut self, sensor: &TestSensor, number: usize) -> Result<(), &'static str> {
            let bytes = sensor.packet(number);
            let micros = (number + 1) as f64 * sensor.firings() as f64 * FIRING_PERIOD_US;
            self.hear_bytes(&bytes, 7, micros)
        }

        fn hear_bytes(&mut self, bytes: &[u8], host: u8, micros: f64) -> Result<(), &'static str> {
            let packet = Packet {
                source: [192, 168, 1, host],
                arrival: EPOCH + Span::from_micros(micros as i64),
                bytes,
            };
            let taken = self.intake.take(&packet, &self.parameters);
            let taken = taken.map_err(|refusal| refusal.name())?;
            self.lost += taken.lost;
            self.late += u32::from(taken.is_late);
            match taken.closed {
                Some(Ok(())) => {
                    let revolution = self.intake.revolution(&self.parameters);
                    self.scan
                        .fill(&revolution, &OwnVehicle::default(), &self.parameters);
                    let unseen = (0..revolution.columns)
                        .filter(|column| self.scan.range_m()[column * MAX_LAYERS] < 0.0)
                        .count();
                    let found = (revolution.columns, unseen, revolution.time_jumped);
                    self.closed.push(Ok(found));
                }
                Some(Err(refusal)) => self.closed.push(Err(refusal.name())),
                None => {}
            }
            Ok(())
        }
    }

    #[test]
    fn revolutions_are_whole_and_end_where_the_circle_does() {
        let mut listener = Listener::new();
        for number in 0..240 {
            listener.hear(&SENSOR, number).unwrap();
        }
        assert_eq!(listener.closed.len(), 3);
        for closed in &listener.closed {
            assert!(matches!(closed, Ok((1808..=1809, 0, false))), "{closed:?}");
        }
        let scan = &listener.scan;
        assert!((scan.rotation_hz() - 10.0).abs() < 0.02);
        assert!(
            scan.range_m()
                .iter()
                .all(|range_m| (range_m - 10.0).abs() < 1e-3)
        );
        assert_eq!((scan.reflectivity()[0], scan.reflectivity()[15]), (0, 15));
        assert!(!scan.has_two_returns());
        // The top layer's laser fires last, when the sensor has turned on.
        let azimuth_deg = |layer| {
            let [x, y, _] = scan.point_m(scan.index(900, layer)).map(f64::from);
            libm::atan2(x, y).to_degrees()
        };
        assert!((azimuth_deg(15) - azimuth_deg(0) - 3.6 * 15.0 * 2.304e-3).abs() < 1e-4);
        let between = listener.intake.revolution(&listener.parameters).time - EPOCH;
        let ended_s = (3.0 / 360.0 + 3.0) / 10.0;
        assert!((between.seconds() - ended_s).abs() < 2e-4, "{between:?}");
    }

    #[test]
    fn every_rate_of_rotation_fits_the_array() {
        for (rate_hz, columns) in [
            (5.0, 1808),
            (7.0, 1291),
            (9.0, 1004),
            (9.5, 1903),
            (20.0, 904),
        ] {
            let sensor = TestSensor { rate_hz, ..SENSOR };
            let mut listener = Listener::new();
            for number in 0..500 {
                listener.hear(&sensor, number).unwrap();
            }
            let closed = listener.closed.last().unwrap();
            let Ok((found, 0, false)) = *closed else {
                panic!("{closed:?}");
            };
            assert!(
                found.abs_diff(columns) <= 1 && found <= MAX_COLUMNS,
                "{rate_hz}: {found}"
            );
            assert!((listener.scan.rotation_hz() - rate_hz).abs() < 0.02);
            assert!((listener.scan.duration_s() * rate_hz - 1.0).abs() < 2e-3);
        }
    }

    #[test]
    fn lost_packets_leave_a_gap_that_was_not_seen() {
        let mut listener = Listener::new();
        for number in (0..260).filter(|number| ![100, 101, 160].contains(number)) {
            listener.hear(&SENSOR, number).unwrap();
        }
        let unseen: Vec<_> = listener
            .closed
            .iter()
            .map(|closed| closed.unwrap().1)
            .collect();
        assert_eq!((unseen, listener.lost), (vec![0, 48, 24], 3));
        let scan = &listener.scan;
        for column in 1..scan.columns() {
            let step_rad = scan.azimuth_rad(column) - scan.azimuth_rad(column - 1);
            assert!((step_rad / scan.step_rad() - 1.0).abs() < 0.06, "{column}");
        }
    }

    #[test]
    fn a_revolution_with_too_many_gaps_is_refused_and_the_next_one_is_not() {
        let mut listener = Listener::new();
        for number in (0..260).filter(|number| !(100..110).contains(number)) {
            listener.hear(&SENSOR, number).unwrap();
        }
        assert!(listener.closed[0].is_ok() && listener.closed[2].is_ok());
        assert_eq!(listener.closed[1], Err("lost_packets"));
    }

    #[test]
    fn gaps_over_the_end_of_a_revolution_cost_no_other_one() {
        let mut listener = Listener::new();
        for number in (0..400).filter(|number| !(149..155).contains(number)) {
            listener.hear(&SENSOR, number).unwrap();
        }
        assert_eq!(listener.closed.len(), 5);
        assert!(
            listener.closed.iter().all(Result::is_ok),
            "{:?}",
            listener.closed
        );
    }

    #[test]
    fn late_packets_find_their_place_and_double_ones_are_told() {
        let mut listener = Listener::new();
        for number in 0..100 {
            listener.hear(&SENSOR, number).unwrap();
        }
        for number in [103, 101, 100, 102] {
            listener.hear(&SENSOR, number).unwrap();
        }
        assert_eq!(listener.hear(&SENSOR, 101), Err("packet_doubled"));
        assert_eq!(listener.hear(&SENSOR, 50), Err("packet_late"));
        for number in 104..160 {
            listener.hear(&SENSOR, number).unwrap();
        }
        assert!(matches!(listener.closed[1], Ok((_, 0, false))));
        assert_eq!(listener.late, 3);
    }

    #[test]
    fn a_sensor_that_begins_anew_is_followed_and_a_stray_packet_is_not() {
        let mut listener = Listener::new();
        for number in 0..100 {
            listener.hear(&SENSOR, number).unwrap();
            if number % 10 == 5 {
                let stray = TestSensor {
                    rate_hz: 13.0,
                    ..SENSOR
                }
                .packet(7000 * number);
                let heard = listener.hear_bytes(&stray, 7, 1327.0 * number as f64);
                assert_eq!(heard, Err("packet_jump"));
            }
        }
        let sound = listener.closed.len();
        let refused = (2000..2200)
            .filter(|number| listener.hear(&SENSOR, *number).is_err())
            .count();
        assert_eq!((sound, refused, listener.closed.len()), (1, 1, 3));
        assert_eq!(
            listener.closed[1].map(|(_, unseen, jumped)| (unseen, jumped)),
            Ok((0, true))
        );
    }

    fn behind_a_pane() -> Listener {
        let sensor = TestSensor {
            mode: ReturnMode::Dual,
            ..SENSOR
        };
        let mut listener = Listener::new();
        for number in 0..350 {
            listener.hear(&sensor, number).unwrap();
        }
        listener
    }

    /// A revolution in a round room of 10 m, with a pane at 4 m from 10 to 20 degrees, of pulses with two returns.
    pub(crate) fn scan_through_a_pane() -> Scan {
        behind_a_pane().scan
    }

    #[test]
    fn the_nearer_of_two_returns_is_the_point_and_the_farther_the_reach() {
        let listener = behind_a_pane();
        assert!(matches!(listener.closed[1], Ok((1808..=1809, 0, false))));
        let scan = &listener.scan;
        let at = |azimuth_deg: f64| {
            let point = scan.index(scan.column_at(azimuth_deg.to_radians()), 3);
            (scan.range_m()[point], scan.reached_m()[point])
        };
        assert!(scan.has_two_returns());
        assert_eq!((at(15.0), at(30.0)), ((4.0, 10.0), (10.0, 10.0)));
    }

    #[test]
    fn sensors_are_told_apart_by_address_until_one_is_silent() {
        let mut listener = Listener::new();
        let packet = SENSOR.packet(0);
        listener.hear_bytes(&packet, 1, 0.0).unwrap();
        let heard = listener.hear_bytes(&packet, 2, 900_000.0);
        assert_eq!(heard, Err("packet_other_sensor"));
        listener.hear_bytes(&packet, 2, 1_100_000.0).unwrap();
    }

    #[test]
    fn other_products_are_refused_by_name_and_early_firmware_is_not() {
        let name = |product: u8| {
            let bytes = TestSensor { product, ..SENSOR }.packet(0);
            let packet = Packet {
                source: [10, 0, 0, 1],
                arrival: EPOCH,
                bytes: &bytes,
            };
            let mut listener = Listener::new();
            let taken = listener.intake.take(&packet, &listener.parameters);
            taken.map_or_else(|refusal| refusal.to_string(), |_| "taken".into())
        };
        assert!(name(0x28).contains("VLP-32C"));
        assert!(name(0x77).contains("unknown sensor"));
        assert_eq!(name(0x24), "taken");
        let early = TestSensor {
            product: 0x21,
            ..SENSOR
        };
        let mut listener = Listener::new();
        for number in 0..160 {
            listener.hear(&early, number).unwrap();
        }
        assert_eq!(listener.closed.len(), 1);
        listener = Listener::new();
        listener.hear(&early, 0).unwrap();
        assert_eq!(listener.hear(&early, 2), Err("packet_product"));
    }
}
