//! Jobs into answers: the pipeline, what its answers are sent with, and what is said of it.

use std::time::Instant;

use tracing::{debug, info, trace};

use super::fault_log::FaultLog;
use super::health::Vitals;
use super::intake::Intake;
use super::latency::Latency;
use super::now;
use super::queue::{Job, Queue};
use super::session::Sender;
use crate::cloud::Dialect;
use crate::ego::EgoReport;
use crate::ground::Origin;
use crate::odometry::Quality;
use crate::pipeline::{Outcome, Pipeline, RevolutionReport, Step};
use crate::tally::Tally;
use crate::view::Feed;
use crate::wire::Envelope;
use crate::wire::envelope::Postmark;

/// Every so many Status messages the log says what the latency is.
const LOGGED: u64 = 60;

/// Owns the pipeline.
pub(super) struct Worker<'a> {
    pipeline: Pipeline,
    sender: Sender,
    sender_stamp: u32,
    receive_buffer: usize,
    vitals: &'a Vitals,
    start: Instant,
    latency: Latency,
    statuses: u64,
    dialect: Option<Dialect>,
    ego: Option<EgoReport>,
    dropped_revolutions: u64,
    log: FaultLog,
    frame: Vec<u8>,
    view: Option<Feed>,
}

impl<'a> Worker<'a> {
    /// A worker that sends with `sender_stamp`, of a session with so many bytes of receive
    /// buffer, and shows what it does in a view, if there is one.
    pub(super) fn new(
        pipeline: Pipeline,
        sender: Sender,
        sender_stamp: u32,
        receive_buffer: usize,
        vitals: &'a Vitals,
        view: Option<Feed>,
    ) -> Self {
        Self {
            pipeline,
            sender,
            sender_stamp,
            receive_buffer,
            vitals,
            start: Instant::now(),
            latency: Latency::default(),
            statuses: 0,
            dialect: None,
            ego: None,
            dropped_revolutions: 0,
            log: FaultLog::default(),
            frame: vec![],
            view,
        }
    }

    /// Handles a message, and sends what answers it.
    pub(super) fn answer(&mut self, job: &Job) {
        let begin = Instant::now();
        // The intake has decoded it once already.
        let Ok((envelope, _)) = Envelope::from_datagram(job.datagram.bytes()) else {
            return;
        };
        if let Some(view) = &mut self.view {
            view.begin();
        }
        let note = |step| {
            if let Some(view) = &mut self.view {
                view.note(step);
            }
        };
        match self.pipeline.handle_watched(&envelope, note) {
            Ok(Outcome::Revolution(report)) => {
                let processing_s = begin.elapsed().as_secs_f32();
                let frames = self.pipeline.publish_objects(now(), processing_s);
                send(&self.sender, frames, &mut self.log, &mut self.view);
                self.latency.record(now() - job.arrival);
                self.vitals.answered();
                self.pipeline.update_map();
                let frames = self.pipeline.publish_map(now());
                send(&self.sender, frames, &mut self.log, &mut self.view);
                if let Some(view) = &mut self.view {
                    view.note(Step::Map);
                    view.show(&self.pipeline, &report, None);
                }
                self.tell(&report);
            }
            Ok(_) => {}
            Err(fault) => self.log.note(fault.name(), || fault.to_string()),
        }
    }

    /// Notes what could not be answered.
    pub(super) fn note_drops(&mut self, intake: &Intake, queue: &Queue) {
        let revolutions = queue.dropped_revolutions;
        if revolutions > self.dropped_revolutions {
            self.dropped_revolutions = revolutions;
            self.log.note("queue_dropped", || {
                format!("{revolutions} revolutions so far: the pipeline is behind")
            });
        }
        self.vitals
            .dropped(revolutions + queue.dropped_others + intake.kernel_dropped);
    }

    /// Sends a Status.
    pub(super) fn send_status(&mut self, intake: &Intake, queue: &Queue) {
        let mut status = self.pipeline.status();
        let mut faults = self.pipeline.counts().faults.clone();
        faults.add(&intake.faults);
        faults.count_many("queue_dropped_poses", queue.dropped_others);
        let latency = self.latency.percentiles();
        status.uptime = self.start.elapsed().as_secs_f64();
        // Those that waited in vain were received, too.
        status.revolutions_received += queue.dropped_revolutions;
        status.revolutions_queue_dropped = queue.dropped_revolutions;
        status.datagrams_received = intake.datagrams;
        status.datagrams_own = intake.own;
        status.datagrams_kernel_dropped = intake.kernel_dropped;
        status.datagrams_damaged += intake.damaged;
        status.faults = faults.to_string();
        status.latency_median = latency.median_s;
        status.latency_p99 = latency.p99_s;
        status.latency_p999 = latency.p999_s;
        status.latency_max = latency.max_s;
        status.receive_buffer = self.receive_buffer as u32;
        status.healthy = self.vitals.verdict().is_ok();
        if let Some(view) = &mut self.view {
            view.tell(&status);
        }
        let sent = now();
        let postmark = Postmark {
            sent,
            sampled: sent,
            sender_stamp: self.sender_stamp,
        };
        self.frame.clear();
        postmark.put(&mut self.frame, &status);
        send(
            &self.sender,
            [&self.frame[..]],
            &mut self.log,
            &mut self.view,
        );
        trace!("{status:?}");
        debug!("{}", summary(&self.pipeline, latency.median_s));
        self.statuses += 1;
        if self.statuses.is_multiple_of(LOGGED) {
            self.log_latency();
        }
    }

    /// Says how long answers took.
    pub(super) fn log_latency(&self) {
        let (revolutions, latency) = (self.latency.revolutions(), self.latency.percentiles());
        info!("{revolutions} revolutions answered; from arrival to answer {latency}");
    }

    /// Says what changed.
    fn tell(&mut self, report: &RevolutionReport) {
        let Dialect {
            byte_order,
            byte_order_source,
            unit_m,
            intensity_bits,
            ..
        } = report.dialect;
        if self.dialect.replace(report.dialect) != Some(report.dialect) {
            info!(
                "{}: {} columns at {:.1} Hz, distances {} ({}), unit {} mm, {intensity_bits} bits of intensity",
                report.sensor,
                report.columns,
                report.rotation_hz,
                byte_order.name(),
                byte_order_source.name(),
                1000.0 * unit_m,
            );
        }
        if report.time_jumped {
            self.log.note("time_jump", || {
                format!("to {:.3} s: tracks begin anew", report.time.seconds())
            });
        }
        if let Some(last) = self.ego.replace(report.ego) {
            if last.source != report.ego.source {
                info!("poses: {}", report.ego.source);
            }
            if last.jumps != report.ego.jumps {
                let source = report.ego.source;
                self.log.note("pose_jump", || {
                    format!("{source} jumped: the local frame is tied to the odometry anew")
                });
            }
            if last.restarts != report.ego.restarts {
                self.log.note("odometry_restart", || {
                    "what is seen did not fit for too long: a new map begins".into()
                });
            }
        }
        match report.ego.odometry.quality {
            Quality::Off | Quality::Begun | Quality::Following => {}
            Quality::Degenerate => self.log.note("odometry_degenerate", || {
                format!(
                    "what is seen tells the place to {:.1} m only: prediction and poses ({}) tell the rest",
                    report.ego.odometry.deviation_m, report.ego.source
                )
            }),
            Quality::Lost => self.log.note("odometry_lost", || {
                "what is seen does not fit what was seen before".into()
            }),
        }
        match report.ground.origin {
            Origin::Found => {}
            Origin::Held => self.log.note("ground_held", || {
                "no plausible ground plane: the last one is kept".into()
            }),
            Origin::Fallback => self.log.note("ground_fallback", || {
                format!(
                    "no plausible ground plane yet: taken {} m below the sensor",
                    report.ground.plane.height_m()
                )
            }),
        }
        trace!(
            "revolution {}: {} returns, ground {:.2} m below, {} clusters, {} objects",
            report.number,
            report.returns,
            report.ground.plane.height_m(),
            report.clusters,
            report.objects,
        );
    }
}

/// What is around, in one line.
fn summary(pipeline: &Pipeline, latency_s: f32) -> String {
    let mut classes = Tally::default();
    for object in pipeline.objects() {
        classes.count(object.class.name());
    }
    let revolutions = pipeline.status().revolutions_published;
    let objects = pipeline.objects().len();
    format!(
        "{revolutions} revolutions, {objects} objects now: {classes}; latency {:.1} ms",
        1000.0 * latency_s
    )
}

/// Sends frames, and shows them; what cannot be sent is told.
fn send<'a>(
    sender: &Sender,
    frames: impl IntoIterator<Item = &'a [u8]>,
    log: &mut FaultLog,
    view: &mut Option<Feed>,
) {
    for frame in frames {
        if let Some(view) = view {
            view.put(frame);
        }
        if let Err(error) = sender.send(frame) {
            log.note("send", || error.to_string());
        }
    }
}
