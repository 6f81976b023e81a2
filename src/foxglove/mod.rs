//! What Kreisel sees, for Foxglove, Lichtblick and all that reads MCAP.
//!
//! | topic | schema | |
//! |-|-|-|
//! | `/points` | `foxglove.PointCloud` | returns, moved to the end of the sweep; `kind` says what they are |
//! | `/objects` | `foxglove.SceneUpdate` | boxes with class, id, speed and confidence |
//! | `/map` | `foxglove.Grid` | the static world around the vehicle, once a second |
//! | `/tf` | `foxglove.FrameTransforms` | where `vehicle` is in `local` |
//! | `/log` | `foxglove.Log` | how the service is, when that changes |
//! | `/status` | JSON | counters and latency, for plots |
//!
//! `points`, `objects` and `map` make the messages; a [`Stage`] sends them to whoever listens: a [`Server`], or a file.

mod map;

mod objects;

mod points;

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;

use foxglove::messages::{
    FrameTransform, FrameTransforms, Grid, Log, PointCloud, Quaternion, SceneUpdate, Timestamp,
    Vector3, log::Level,
};
use foxglove::{Channel, Context, FoxgloveError, RawChannel, WebSocketServerHandle};

use crate::daemon::Onlooker;
use crate::pipeline::{Pipeline, RevolutionReport};
use crate::time::{Span, Time};
use crate::view::{Around, Labels};
use crate::wire::status::Status;

/// The frame that never jumps, but for what a pose source corrects: east, north, up.
const LOCAL: &str = "local";
/// x ahead, y to the left, z up, at the sensor.
const VEHICLE: &str = "vehicle";
/// How often the map is sent.
const MAP_PERIOD: Span = Span::from_micros(1_000_000);

/// Where a server is found unless it is told otherwise: Foxglove looks there.
pub const DEFAULT_ADDRESS: &str = "127.0.0.1:8765";

/// All topics.
#[derive(Debug)]
pub struct Stage {
    context: Arc<Context>,
    points: Channel<PointCloud>,
    objects: Channel<SceneUpdate>,
    map: Channel<Grid>,
    frames: Channel<FrameTransforms>,
    log: Channel<Log>,
    status: Arc<RawChannel>,
    labels: Labels,
    map_sent: Option<Time>,
    health: String,
}

/// A server of all topics.
#[derive(Debug)]
pub struct Server {
    stage: Stage,
    address: SocketAddr,
    _handle: WebSocketServerHandle,
}

impl Server {
    /// Serves a stage; port 0 is any.
    ///
    /// # Errors
    /// When the address cannot be had.
    pub fn start(address: SocketAddr) -> Result<Self, FoxgloveError> {
        let stage = Stage::new()?;
        let server = stage.context.websocket_server().name("Kreisel");
        let server = server.bind(address.ip().to_string(), address.port());
        let handle = server.start_blocking()?;
        Ok(Self {
            address: SocketAddr::new(address.ip(), handle.port()),
            stage,
            _handle: handle,
        })
    }

    /// Where it is.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Onlooker for Server {
    fn show(&mut self, pipeline: &Pipeline, report: &RevolutionReport) {
        self.stage.show(pipeline, report);
    }

    fn tell(&mut self, status: &Status, now: Time) {
        self.stage.tell(status, now);
    }
}

impl Stage {
    /// A stage that nobody listens to.
    ///
    /// # Errors
    /// Never, as long as no two topics are alike.
    pub fn new() -> Result<Self, FoxgloveError> {
        let context = Context::new();
        let status = context.channel_builder("/status").message_encoding("json");
        Ok(Self {
            points: context.channel_builder("/points").build(),
            objects: context.channel_builder("/objects").build(),
            map: context.channel_builder("/map").build(),
            frames: context.channel_builder("/tf").build(),
            log: context.channel_builder("/log").build(),
            status: status.build_raw()?,
            context,
            labels: Labels::default(),
            map_sent: None,
            health: String::new(),
        })
    }

    /// For sinks.
    pub fn context(&self) -> &Arc<Context> {
        &self.context
    }

    /// Sends the pipeline's last revolution. What nobody has subscribed to is not made.
    pub fn show(&mut self, pipeline: &Pipeline, report: &RevolutionReport) {
        let around = Around::of(pipeline, report.ground.plane.height_m());
        let time = report.time;
        if self.frames.has_sinks() {
            let transform = FrameTransform {
                timestamp: Some(stamp(time)),
                parent_frame_id: LOCAL.into(),
                child_frame_id: VEHICLE.into(),
                translation: Some(vector(around.sensor.position_m)),
                rotation: Some(turned(around.sensor.yaw_rad)),
            };
            let transforms = vec![transform];
            let message = FrameTransforms { transforms };
            self.frames.log_with_time(&message, stamp(time));
        }
        if self.points.has_sinks() {
            self.labels.label(&around, pipeline);
            let message = points::message(&around, &self.labels, time);
            self.points.log_with_time(&message, stamp(time));
        }
        if self.objects.has_sinks() {
            let message = objects::message(pipeline.objects(), &around, time);
            self.objects.log_with_time(&message, stamp(time));
        }
        let is_due = self
            .map_sent
            .is_none_or(|sent| time - sent >= MAP_PERIOD || time < sent);
        if self.map.has_sinks() && is_due {
            self.map_sent = Some(time);
            let message = map::message(pipeline.grid(), &around, time);
            self.map.log_with_time(&message, stamp(time));
        }
    }

    /// Sends how the service is.
    pub fn tell(&mut self, status: &Status, time: Time) {
        if self.status.has_sinks() {
            let json = serde_json::json!({
                "healthy": status.healthy,
                "revolutionsPublished": status.revolutions_published,
                "revolutionsRefused": status.revolutions_refused,
                "revolutionsMissed": status.revolutions_missed,
                "revolutionsQueueDropped": status.revolutions_queue_dropped,
                "datagramsReceived": status.datagrams_received,
                "datagramsKernelDropped": status.datagrams_kernel_dropped,
                "fragmentedLost": status.fragmented_lost,
                "packetsReceived": status.packets_received,
                "packetsLost": status.packets_lost,
                "posesReceived": status.poses_received,
                "latencyMedian": status.latency_median,
                "latencyP99": status.latency_p99,
                "latencyMax": status.latency_max,
                "rotationRate": status.rotation_rate,
                "groundHeight": status.ground_height,
                "groundTilt": status.ground_tilt,
                "odometryDeviation": status.odometry_deviation,
                "poseDisagreement": status.pose_disagreement,
                "faults": faults(&status.faults),
            });
            self.status
                .log_with_meta(json.to_string().as_bytes(), at(time));
        }
        if status.health != self.health {
            self.health.clone_from(&status.health);
            let level = if status.healthy {
                Level::Info
            } else {
                Level::Warning
            };
            self.say(level, &status.health, time);
        }
    }

    /// Logs that something was of no use.
    pub fn warn(&self, message: &str, time: Time) {
        self.say(Level::Warning, message, time);
    }

    fn say(&self, level: Level, message: &str, time: Time) {
        let log = Log {
            timestamp: Some(stamp(time)),
            level: level.into(),
            message: message.into(),
            name: "kreisel".into(),
            ..Log::default()
        };
        self.log.log_with_time(&log, stamp(time));
    }
}

/// Counts by name.
fn faults(text: &str) -> BTreeMap<&str, u64> {
    let faults = text.split_whitespace().filter_map(|fault| {
        let (name, count) = fault.split_once('=')?;
        Some((name, count.parse().ok()?))
    });
    faults.collect()
}

fn at(time: Time) -> foxglove::PartialMetadata {
    foxglove::PartialMetadata::with_log_time(stamp(time))
}

/// Times before 1970 and after 2106 are none that a message can hold.
fn stamp(time: Time) -> Timestamp {
    let micros = time.micros().max(0);
    let seconds = u32::try_from(micros / 1_000_000).unwrap_or(u32::MAX);
    Timestamp::new_checked(seconds, 1000 * (micros % 1_000_000) as u32).unwrap_or(Timestamp::MAX)
}

fn vector([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x, y, z }
}

/// A turn about the upright axis.
fn turned(yaw_rad: f64) -> Quaternion {
    let (z, w) = libm::sincos(0.5 * yaw_rad);
    Quaternion {
        x: 0.0,
        y: 0.0,
        z,
        w,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_kept_to_the_microsecond_and_impossible_ones_are_bounded() {
        let of = |micros| {
            let stamp = stamp(Time::from_micros(micros));
            (stamp.sec(), stamp.nsec())
        };
        assert_eq!(of(1_700_000_000_123_456), (1_700_000_000, 123_456_000));
        assert_eq!(of(-1), (0, 0));
        assert_eq!(of(i64::MAX).0, u32::MAX);
    }

    #[test]
    fn faults_are_counted_by_name() {
        let found = faults("time_order=3 odd length=x twin=1");
        assert_eq!(found, BTreeMap::from([("time_order", 3), ("twin", 1)]));
    }
}
