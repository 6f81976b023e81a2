//! Is this message one whole revolution that the array can hold? If not, why not.

use super::dialect::{DialectDetector, shown_order};
use super::sensor::{self, Sensor};
use super::{CloudParameters, Dialect, MAX_COLUMNS, Refusal, Turn};
use crate::time::{Span, Time};
use crate::wire::Envelope;
use crate::wire::point_cloud::{ByteOrder, CompactPointCloud, LAYOUT_RPLIDAR, Schema};

/// Where a revolution's distances are.
#[derive(Debug, Clone, Copy)]
pub enum Source<'a> {
    /// In a message, at equal steps of azimuth.
    Cloud(CompactPointCloud<'a>),
    /// In firings, each with an azimuth of its own.
    Turn(&'a Turn),
}

/// A revolution that was taken, with all that the next steps need.
#[derive(Debug, Clone, Copy)]
pub struct Revolution<'a> {
    /// Where its distances are.
    pub source: Source<'a>,
    /// Its sensor.
    pub sensor: &'static Sensor,
    /// How its distances are written.
    pub dialect: Dialect,
    /// How many columns there are.
    pub columns: usize,
    /// From one column to the next, seconds.
    pub column_period_s: f64,
    /// Azimuth of the first column, degrees.
    pub start_deg: f64,
    /// From one column to the next, degrees; negative when azimuths fall.
    pub step_deg: f64,
    /// End of the sweep.
    pub time: Time,
    /// Whether time went back or jumped ahead, so that nothing before is of use.
    pub time_jumped: bool,
}

/// Longest pause after which older revolutions still mean something, and longest step back in
/// time that is taken for disorder rather than for a recording that begins again.
const CONTINUITY: Span = Span::from_micros(1_000_000);

/// Messages in a row from other senders after which the one that sent the last is followed.
/// The first sender is always welcome back.
const SENDER_PATIENCE: u32 = 20;

/// Keeps what must be known from message to message. A hostile or damaged message that passes
/// for a sound one costs the sound ones after it at most one of them, unless it is the very
/// first and names another sender.
#[derive(Debug, Clone, Default)]
pub struct Intake {
    detector: DialectDetector,
    /// The first sender.
    home: Option<u32>,
    listened: Option<u32>,
    /// Messages from others since the last one that was listened to.
    others: u32,
    last_time: Option<Time>,
    /// Time of a message that was refused as out of order, if it was the last one.
    late_time: Option<Time>,
    /// Steps between columns that are known to be right, the latest first.
    usual_steps_deg: [Option<f64>; 2],
    refused_step_deg: Option<f64>,
}

impl Intake {
    /// Decides on one message.
    ///
    /// # Errors
    /// [`Refusal`] when it is not a whole revolution that the array can hold.
    pub fn accept<'a>(
        &mut self,
        envelope: &Envelope<'_>,
        cloud: CompactPointCloud<'a>,
        parameters: &CloudParameters,
    ) -> Result<Revolution<'a>, Refusal> {
        let sensor = check_shape(&cloud)?;
        let unknown = Refusal::UnknownEncoding {
            intensity_bits: cloud.intensity_bits,
        };
        if cloud.distance_mask() == 0 {
            return Err(unknown);
        }
        self.check_sender(envelope.sender_stamp, parameters)?;
        let (start_deg, step_deg) = self.check_azimuths(&cloud, sensor, parameters)?;
        let (time, time_jumped) = self.check_time(envelope, &cloud, sensor)?;
        let dialect = self.detector.dialect(&cloud, parameters).ok_or(unknown)?;
        self.last_time = Some(time);
        self.home.get_or_insert(envelope.sender_stamp);
        self.listened.get_or_insert(envelope.sender_stamp);
        Ok(Revolution {
            source: Source::Cloud(cloud),
            sensor,
            dialect,
            columns: cloud.columns(),
            column_period_s: sensor.column_period_s,
            start_deg,
            step_deg,
            time,
            time_jumped,
        })
    }

    fn check_sender(
        &mut self,
        sender_stamp: u32,
        parameters: &CloudParameters,
    ) -> Result<(), Refusal> {
        let configured = u32::try_from(parameters.sender_stamp).ok();
        let listened = configured.or(self.listened).unwrap_or(sender_stamp);
        self.others += 1;
        let is_home = configured.is_none() && self.home == Some(sender_stamp);
        let patience_ends = configured.is_none() && self.others > SENDER_PATIENCE;
        if sender_stamp != listened && !is_home && !patience_ends {
            return Err(Refusal::OtherSender {
                sender_stamp,
                listened,
            });
        }
        self.others = 0;
        self.listened = self.listened.map(|_| sender_stamp);
        Ok(())
    }

    /// First azimuth and step. First and last column are given, those between are linear.
    fn check_azimuths(
        &mut self,
        cloud: &CompactPointCloud<'_>,
        sensor: &Sensor,
        parameters: &CloudParameters,
    ) -> Result<(f64, f64), Refusal> {
        let columns = cloud.columns();
        let (start_deg, signed_span_deg) = span_deg(cloud)?;
        let span_deg = signed_span_deg.abs();
        let step_deg = span_deg / (columns.max(2) - 1) as f64;
        let least_deg = parameters.least_span_deg * sensor.field_deg / 360.0;
        if span_deg + step_deg < least_deg {
            return Err(Refusal::PartialRevolution { columns, span_deg });
        }
        self.check_step(step_deg, cloud, parameters)?;
        Ok((start_deg, signed_span_deg / (columns.max(2) - 1) as f64))
    }

    /// A step that differs from the usual one means wrong azimuths. Two that differ in the
    /// same way mean another rate of rotation.
    fn check_step(
        &mut self,
        step_deg: f64,
        cloud: &CompactPointCloud<'_>,
        parameters: &CloudParameters,
    ) -> Result<(), Refusal> {
        let close = |to: f64| (step_deg / to - 1.0).abs() <= parameters.step_tolerance;
        let [latest_deg, before_deg] = self.usual_steps_deg;
        let fits = match latest_deg {
            Some(latest_deg) => close(latest_deg) || before_deg.is_some_and(close),
            None => cloud.start_azimuth_deg != 0.0 || is_whole_turn(cloud, step_deg),
        };
        if fits || self.refused_step_deg.is_some_and(close) {
            if !latest_deg.is_some_and(close) {
                self.usual_steps_deg[1] = latest_deg;
            }
            (self.usual_steps_deg[0], self.refused_step_deg) = (Some(step_deg), None);
            return Ok(());
        }
        self.refused_step_deg = Some(step_deg);
        Err(match latest_deg {
            Some(usual_deg) if cloud.start_azimuth_deg != 0.0 => Refusal::UnevenStep {
                step_deg,
                usual_deg,
            },
            _ => Refusal::FirstAzimuth {
                columns: cloud.columns(),
                span_deg: step_deg * (cloud.columns().max(2) - 1) as f64,
            },
        })
    }

    /// The end of the sweep. A sender without a clock gets the time that the columns took. Two
    /// messages in a row that are older than the last one mean that the last one was wrong.
    fn check_time(
        &mut self,
        envelope: &Envelope<'_>,
        cloud: &CompactPointCloud<'_>,
        sensor: &Sensor,
    ) -> Result<(Time, bool), Refusal> {
        let time = envelope.time();
        let Some(last) = self.last_time else {
            return Ok((time, false));
        };
        if time.is_zero() {
            let sweep_s = cloud.columns() as f64 * sensor.column_period_s;
            return Ok((last + Span::from_seconds(sweep_s), false));
        }
        let passed = time - last;
        let in_disorder = passed.micros() <= 0 && passed.micros() > -CONTINUITY.micros();
        let late_time = std::mem::replace(&mut self.late_time, in_disorder.then_some(time));
        if in_disorder && late_time.is_none_or(|late| time <= late) {
            return Err(Refusal::OutOfOrder {
                late_s: -passed.seconds(),
            });
        }
        Ok((time, passed.micros() < 0 || passed > CONTINUITY))
    }
}

/// Everything that one message alone shows.
fn check_shape(cloud: &CompactPointCloud<'_>) -> Result<&'static Sensor, Refusal> {
    let layers = cloud.layers;
    if let Schema::OpenDlv {
        vertical_layout: LAYOUT_RPLIDAR,
        ..
    } = cloud.schema
    {
        return Err(Refusal::RpLidar);
    }
    if layers == 0 {
        return Err(Refusal::ZeroLayers);
    }
    let sensor = sensor::identify(cloud).ok_or(Refusal::UnknownSensor { layers })?;
    if ![&sensor::VLP16, &sensor::IBEO_LUX_8L].contains(&sensor) {
        return Err(Refusal::TooManyLayers {
            sensor: sensor.name,
            layers,
        });
    }
    let bytes = cloud.distances.len();
    if bytes == 0 {
        return Err(Refusal::NoDistances);
    }
    if !bytes.is_multiple_of(2 * usize::from(layers)) {
        return Err(Refusal::BrokenColumns { bytes, layers });
    }
    if cloud.columns() > MAX_COLUMNS {
        return Err(Refusal::TooManyColumns {
            columns: cloud.columns(),
        });
    }
    Ok(sensor)
}

/// First azimuth and signed span. An end below the start is a sweep over 0 while both are on
/// the circle; with negative azimuths (an early version of the thesis' simulation) it is a
/// sensor that turns the other way.
fn span_deg(cloud: &CompactPointCloud<'_>) -> Result<(f64, f64), Refusal> {
    let (start, end) = (cloud.start_azimuth_deg, cloud.end_azimuth_deg);
    let possible = -720.0..=720.0;
    let span_deg = f64::from(end) - f64::from(start);
    let wraps = span_deg < 0.0 && end >= 0.0;
    let span_deg = if wraps { span_deg + 360.0 } else { span_deg };
    // The device service ends a revolution up to one packet (4.8 degrees at 20 Hz) late.
    if !possible.contains(&start) || !possible.contains(&end) || span_deg.abs() > 365.0 {
        return Err(Refusal::ImpossibleAzimuth {
            start_deg: start,
            end_deg: end,
        });
    }
    Ok((f64::from(start), span_deg))
}

/// Whether a first message that claims to begin exactly at 0, as a device's first message
/// does wherever it began, is a whole turn all the same: its columns are as many as at a usual
/// rate of rotation, which the motor keeps within 0.3 %, or its ends fit together.
fn is_whole_turn(cloud: &CompactPointCloud<'_>, step_deg: f64) -> bool {
    const USUAL_RATES_HZ: [f64; 3] = [5.0, 10.0, 20.0];
    const RATE_TOLERANCE: f64 = 0.006;
    const SMOOTH_SEAM: f64 = 3.0;
    let rate_hz = step_deg / (360.0 * sensor::VLP16.column_period_s);
    let usual = |usual_hz: &f64| (rate_hz / usual_hz - 1.0).abs() < RATE_TOLERANCE;
    let order = shown_order(cloud).unwrap_or(ByteOrder::Big);
    let seam = cloud.seam_roughness(order);
    USUAL_RATES_HZ.iter().any(usual) || seam.is_some_and(|roughness| roughness < SMOOTH_SEAM)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::Profile;
    use crate::wire::TimeStamp;

    struct Sender {
        intake: Intake,
        parameters: CloudParameters,
        micros: i64,
    }

    impl Sender {
        fn new() -> Self {
            Self {
                intake: Intake::default(),
                parameters: CloudParameters::profile(Profile::Default),
                micros: 1_700_000_000_000_000,
            }
        }

        fn send(&mut self, start: f32, end: f32, columns: usize) -> Result<f64, Refusal> {
            self.micros += 100_000;
            self.send_at(self.micros, start, end, columns)
        }

        fn send_at(
            &mut self,
            micros: i64,
            start: f32,
            end: f32,
            columns: usize,
        ) -> Result<f64, Refusal> {
            // Every column is farther than the one before: a piece of a turn by its looks.
            let distances: Vec<u8> = (0..columns as u16)
                .flat_map(|column| std::iter::repeat_n(1000 + column, 16))
                .flat_map(u16::to_be_bytes)
                .collect();
            let cloud = CompactPointCloud {
                start_azimuth_deg: start,
                end_azimuth_deg: end,
                layers: 16,
                distances: &distances,
                ..CompactPointCloud::default()
            };
            let envelope = Envelope {
                sample_time_stamp: TimeStamp::from(Time::from_micros(micros)),
                ..Envelope::default()
            };
            let taken = self.intake.accept(&envelope, cloud, &self.parameters);
            taken.map(|revolution| revolution.step_deg)
        }
    }

    fn refused(result: Result<f64, Refusal>) -> &'static str {
        result.map_or_else(|refusal| refusal.name(), |_| "accepted")
    }

    #[test]
    fn a_first_message_whose_azimuth_lies_is_refused_and_the_next_ones_are_not() {
        let mut sender = Sender::new();
        assert_eq!(refused(sender.send(0.0, 359.895, 656)), "first_azimuth");
        assert_eq!(refused(sender.send(0.09, 359.925, 1810)), "accepted");
        assert_eq!(refused(sender.send(0.12, 359.95, 1811)), "accepted");
        assert_eq!(refused(sender.send(0.0, 359.895, 900)), "first_azimuth");
        assert_eq!(refused(sender.send(0.15, 359.93, 1812)), "accepted");
    }

    #[test]
    fn synthetic_revolutions_from_zero_are_taken_from_the_first_on() {
        for columns in [904, 1800, 1803] {
            assert_eq!(refused(Sender::new().send(0.0, 360.0, columns)), "accepted");
        }
    }

    #[test]
    fn an_unusual_step_is_taken_when_it_comes_twice() {
        let mut sender = Sender::new();
        assert_eq!(refused(sender.send(0.0, 359.0, 360)), "first_azimuth");
        assert_eq!(refused(sender.send(0.0, 359.0, 360)), "accepted");
    }

    #[test]
    fn lost_packets_and_split_revolutions_are_refused() {
        let mut sender = Sender::new();
        assert_eq!(refused(sender.send(0.1, 359.9, 1808)), "accepted");
        assert_eq!(refused(sender.send(0.1, 359.9, 1784)), "uneven_step");
        assert_eq!(refused(sender.send(0.1, 359.9, 1808)), "accepted");
        assert_eq!(refused(sender.send(0.0, 189.6, 1875)), "partial_revolution");
        assert_eq!(
            refused(sender.send(187.4, 359.9, 1702)),
            "partial_revolution"
        );
    }

    #[test]
    fn a_sweep_over_zero_and_a_falling_one_keep_their_direction() {
        let step = 359.8 / 1799.0;
        let over_zero = Sender::new().send(200.0, 199.8, 1800).unwrap();
        assert!((over_zero - step).abs() < 1e-6);
        let falling = Sender::new().send(215.0, -144.8, 1800).unwrap();
        assert!((falling + step).abs() < 1e-6);
    }

    #[test]
    fn impossible_azimuths_are_refused() {
        for (start, end) in [
            (f32::NAN, 1.0),
            (0.0, f32::INFINITY),
            (0.0, 1e9),
            (-10.0, 360.0),
        ] {
            assert_eq!(
                refused(Sender::new().send(start, end, 1800)),
                "impossible_azimuth"
            );
        }
    }

    #[test]
    fn disorder_is_refused_and_a_restart_is_not() {
        let mut sender = Sender::new();
        let now = sender.micros;
        assert_eq!(refused(sender.send_at(now, 0.1, 359.9, 1800)), "accepted");
        assert_eq!(
            refused(sender.send_at(now, 0.1, 359.9, 1800)),
            "out_of_order"
        );
        assert_eq!(
            refused(sender.send_at(now - 200_000, 0.1, 359.9, 1800)),
            "out_of_order"
        );
        assert_eq!(
            refused(sender.send_at(now - 8_000_000, 0.1, 359.9, 1800)),
            "accepted"
        );
        assert_eq!(
            refused(sender.send_at(now - 7_900_000, 0.1, 359.9, 1800)),
            "accepted"
        );
    }

    #[test]
    fn more_columns_than_the_array_has_are_refused() {
        assert_eq!(refused(Sender::new().send(0.1, 359.9, 2000)), "accepted");
        assert_eq!(
            refused(Sender::new().send(0.1, 359.9, 2001)),
            "too_many_columns"
        );
    }

    #[test]
    fn shapes_that_the_array_cannot_hold_are_refused_by_name() {
        let shape = |layers, distances, intensity_bits| {
            let cloud = CompactPointCloud {
                end_azimuth_deg: 359.8,
                layers,
                distances,
                intensity_bits,
                ..CompactPointCloud::default()
            };
            let parameters = CloudParameters::profile(Profile::Default);
            let result = Intake::default().accept(&Envelope::default(), cloud, &parameters);
            result.map_or_else(|refusal| refusal.name(), |_| "accepted")
        };
        assert_eq!(shape(0, &[1; 32], 0), "zero_layers");
        assert_eq!(shape(16, &[], 0), "no_distances");
        assert_eq!(shape(16, &[1; 33], 0), "broken_columns");
        assert_eq!(shape(12, &[1; 24], 0), "too_many_layers");
        assert_eq!(shape(13, &[1; 26], 0), "unknown_sensor");
        assert_eq!(shape(16, &[1; 64], 16), "unknown_encoding");
    }

    #[test]
    fn the_first_sender_is_listened_to_and_another_one_while_it_is_silent() {
        let mut sender = Sender::new();
        let distances = [1; 32 * 1800];
        let mut send = |stamp: u32, micros: i64| {
            let cloud = CompactPointCloud {
                end_azimuth_deg: 359.8,
                layers: 16,
                distances: &distances,
                ..CompactPointCloud::default()
            };
            let envelope = Envelope {
                sender_stamp: stamp,
                sample_time_stamp: TimeStamp::from(Time::from_micros(micros)),
                ..Envelope::default()
            };
            sender
                .intake
                .accept(&envelope, cloud, &sender.parameters)
                .is_ok()
        };
        assert!(send(3, 1_000_000));
        assert!(!send(4, 1_050_000));
        assert!(send(3, 1_100_000));
        let taken = (0..30).filter(|n| send(4, 1_200_000 + n * 100_000)).count();
        assert_eq!(taken, 10);
        assert!(send(3, 4_200_000));
        assert!(!send(4, 4_300_000));
    }

    #[test]
    fn of_two_other_senders_one_is_followed_when_the_first_is_silent() {
        let mut sender = Sender::new();
        let distances = [1; 32 * 1800];
        let mut send = |stamp: u32, tenths: i64| {
            let cloud = CompactPointCloud {
                end_azimuth_deg: 359.8,
                layers: 16,
                distances: &distances,
                ..CompactPointCloud::default()
            };
            let envelope = Envelope {
                sender_stamp: stamp,
                sample_time_stamp: TimeStamp::from(Time::from_micros(100_000 * tenths)),
                ..Envelope::default()
            };
            let taken = sender.intake.accept(&envelope, cloud, &sender.parameters);
            taken.is_ok()
        };
        assert!(send(3, 1));
        let taken = (0..60).filter(|n| send(4 + (n % 2) as u32, 2 + n)).count();
        assert_eq!(taken, 20);
    }

    #[test]
    fn one_message_from_the_near_future_costs_one_revolution() {
        let mut sender = Sender::new();
        let now = sender.micros;
        let mut send = |millis: i64| refused(sender.send_at(now + 1000 * millis, 0.1, 359.9, 1800));
        assert_eq!(send(0), "accepted");
        assert_eq!(send(800), "accepted");
        assert_eq!(send(100), "out_of_order");
        assert_eq!(send(200), "accepted");
        assert_eq!(send(300), "accepted");
    }

    #[test]
    fn a_rate_that_two_odd_messages_agree_on_does_not_displace_the_right_one() {
        let mut sender = Sender::new();
        assert_eq!(refused(sender.send(0.1, 359.9, 1808)), "accepted");
        assert_eq!(refused(sender.send(0.1, 352.0, 1808)), "uneven_step");
        assert_eq!(refused(sender.send(0.1, 352.5, 1808)), "accepted");
        assert_eq!(refused(sender.send(0.1, 359.9, 1808)), "accepted");
    }
}
