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
mod tests;
