use super::reference::FIRING_PERIOD_US;
use super::*;
use crate::cloud::sensor::VLP16;
use crate::cloud::{MAX_COLUMNS, MAX_LAYERS, OwnVehicle, Scan};
use crate::parameter::Profile;
use crate::wire::velodyne::HOUR_US;
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
            let azimuth_deg = 357.0 + 360.0 * self.rate_hz * VLP16.column_period_s * firing as f64;
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
