//! The thread that owns the pipeline.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use tracing::{debug, info};

use super::fault_log::FaultLog;
use super::health::Vitals;
use super::latency::Latency;
use super::queue::{Item, Job, Queue};
use super::session::Sender;
use super::{Intake, now};
use crate::cloud::Dialect;
use crate::ground::Origin;
use crate::pipeline::{Outcome, Pipeline, RevolutionReport};
use crate::wire::Envelope;
use crate::wire::envelope::Postmark;

pub(super) struct Worker {
    pub(super) pipeline: Pipeline,
    pub(super) sender: Sender,
    pub(super) sender_stamp: u32,
    pub(super) queue: Arc<Queue>,
    pub(super) intake: Arc<Mutex<Intake>>,
    pub(super) vitals: Arc<Vitals>,
    pub(super) receive_buffer: usize,
}

/// What the worker remembers between items.
struct Diary {
    start: Instant,
    log: FaultLog,
    latency: Latency,
    dialect: Option<Dialect>,
    dropped_revolutions: u64,
    frame: Vec<u8>,
}

impl Worker {
    /// Works until the queue is closed.
    pub(super) fn work(mut self) {
        let mut diary = Diary {
            start: Instant::now(),
            log: FaultLog::default(),
            latency: Latency::default(),
            dialect: None,
            dropped_revolutions: 0,
            frame: vec![],
        };
        while let Some(item) = self.queue.pop() {
            match item {
                Item::Job(job) => self.answer(&job, &mut diary),
                Item::Status => self.send_status(&mut diary),
            }
        }
    }

    fn answer(&mut self, job: &Job, diary: &mut Diary) {
        let begin = Instant::now();
        // The receiving side has decoded it once already.
        let Ok((envelope, _)) = Envelope::from_datagram(&job.datagram) else {
            return;
        };
        match self.pipeline.handle(&envelope) {
            Ok(Outcome::Revolution(report)) => {
                for frame in self.pipeline.publish(now(), begin.elapsed().as_secs_f32()) {
                    if let Err(error) = self.sender.send(frame) {
                        diary.log.note("send", || error.to_string());
                    }
                }
                diary.latency.record(now() - job.arrival);
                self.vitals.answered();
                diary.tell(&report);
            }
            Ok(_) => {}
            Err(fault) => diary.log.note(fault.name(), || fault.to_string()),
        }
        self.note_drops(diary);
    }

    fn note_drops(&self, diary: &mut Diary) {
        let (revolutions, others) = self.queue.dropped();
        if revolutions > diary.dropped_revolutions {
            diary.dropped_revolutions = revolutions;
            diary.log.note("queue_dropped", || {
                format!("{revolutions} revolutions so far: the pipeline is behind")
            });
        }
        let intake = self.intake.lock().unwrap_or_else(PoisonError::into_inner);
        self.vitals
            .dropped(revolutions + others + intake.kernel_dropped);
    }

    fn send_status(&mut self, diary: &mut Diary) {
        self.note_drops(diary);
        let mut status = self.pipeline.status();
        let intake = self
            .intake
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone();
        let mut faults = self.pipeline.counts().faults.clone();
        faults.add(&intake.faults);
        let (dropped_revolutions, dropped_others) = self.queue.dropped();
        faults.count_many("queue_dropped_poses", dropped_others);
        let latency = diary.latency.percentiles();
        status.uptime = diary.start.elapsed().as_secs_f64();
        // Those that waited in vain were received, too.
        status.revolutions_received += dropped_revolutions;
        status.revolutions_queue_dropped = dropped_revolutions;
        status.datagrams_received = intake.datagrams;
        status.datagrams_own = intake.own;
        status.datagrams_kernel_dropped = intake.kernel_dropped;
        status.datagrams_damaged += intake.damaged;
        status.faults = faults.to_string();
        status.latency_median = latency.median_s;
        status.latency_p99 = latency.p99_s;
        status.latency_max = latency.max_s;
        status.receive_buffer = self.receive_buffer as u32;
        status.healthy = self.vitals.verdict().is_ok();
        let sent = now();
        let postmark = Postmark {
            sent,
            sampled: sent,
            sender_stamp: self.sender_stamp,
        };
        diary.frame.clear();
        postmark.put(&mut diary.frame, &status);
        if let Err(error) = self.sender.send(&diary.frame) {
            diary.log.note("send", || error.to_string());
        }
        debug!("{status:?}");
    }
}

impl Diary {
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
        debug!(
            "revolution {}: {} returns, ground {:.2} m below, {} clusters, {} objects",
            report.number,
            report.returns,
            report.ground.plane.height_m(),
            report.clusters,
            report.objects,
        );
    }
}
