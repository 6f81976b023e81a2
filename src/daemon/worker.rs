//! Jobs into answers: the pipeline, and what its answers are sent with.

use std::time::Instant;

use tracing::{debug, info, trace};

use super::fault_log::FaultLog;
use super::health::{Health, Vitals};
use super::intake::Intake;
use super::latency::Latency;
use super::listener::{Arrival, Datagram};
use super::queue::{Job, Queue};
use super::sensor::SensorCounts;
use super::session::Sender;
use super::supervisor;
use super::telling::Teller;
use super::{Onlooker, now};
use crate::cloud::PacketRefusal;
use crate::pipeline::{Fault, Outcome, Pipeline, RevolutionReport, Step};
use crate::tally::Tally;
use crate::time::Time;
use crate::view::Feed;
use crate::wire::Envelope;
use crate::wire::envelope::Postmark;
use crate::wire::point_cloud::POINT_CLOUD_ID;
use crate::wire::velodyne::Packet;
use crate::wire::velodyne::data::PACKET_LEN;
use crate::wire::velodyne::device_service::SweepAssembler;

/// Every so many Status messages the log says what the latency is.
const LOGGED: u64 = 60;

/// Owns the pipeline.
pub(super) struct Worker<'a> {
    pipeline: Pipeline,
    output: Output,
    /// Makes point clouds of packets, if they are to be published.
    assembler: Option<SweepAssembler>,
    /// When the packet came that closed a revolution which is not answered yet.
    due: Option<Time>,
    receive_buffer: usize,
    vitals: &'a Vitals,
    start: Instant,
    latency: Latency,
    statuses: u64,
    teller: Teller,
    /// Revolutions of packets that were dropped because the next one was there.
    replaced: u64,
    dropped_revolutions: u64,
    fragmented_lost: u64,
    /// Frames that were not sent at the last Status.
    told_not_sent: u64,
    log: FaultLog,
    frame: Vec<u8>,
}

/// Where answers go.
pub(super) struct Output {
    /// The session, if there is one.
    pub(super) sender: Option<Sender>,
    pub(super) sender_stamp: u32,
    /// The view, if there is one.
    pub(super) view: Option<Feed>,
    pub(super) onlooker: Option<Box<dyn Onlooker>>,
    /// Frames that could not be sent.
    pub(super) not_sent: u64,
    /// Bytes of those that were.
    pub(super) sent_bytes: u64,
}

impl Output {
    /// Sends frames, and shows them; what cannot be sent is told.
    fn send<'a>(&mut self, frames: impl IntoIterator<Item = &'a [u8]>, log: &mut FaultLog) {
        for frame in frames {
            if let Some(view) = &mut self.view {
                view.put(frame);
            }
            match self.sender.as_ref().map(|sender| sender.send(frame)) {
                None => {}
                Some(Ok(())) => self.sent_bytes += frame.len() as u64,
                Some(Err(error)) => {
                    self.not_sent += 1;
                    log.note("send", || error.to_string());
                }
            }
        }
    }

    /// Says that work on a revolution begins.
    fn begin(&mut self) {
        if let Some(view) = &mut self.view {
            view.begin();
        }
    }

    /// Says that a step is done.
    fn note(&mut self, step: Step) {
        if let Some(view) = &mut self.view {
            view.note(step);
        }
    }
}

impl<'a> Worker<'a> {
    /// A worker with so many bytes of receive buffer.
    pub(super) fn new(
        pipeline: Pipeline,
        output: Output,
        publish_cloud: bool,
        receive_buffer: usize,
        vitals: &'a Vitals,
    ) -> Self {
        Self {
            pipeline,
            output,
            assembler: publish_cloud.then(SweepAssembler::default),
            due: None,
            receive_buffer,
            vitals,
            start: Instant::now(),
            latency: Latency::default(),
            statuses: 0,
            teller: Teller::default(),
            replaced: 0,
            dropped_revolutions: 0,
            fragmented_lost: 0,
            told_not_sent: 0,
            log: FaultLog::default(),
            frame: vec![],
        }
    }

    /// Handles a message, and sends what answers it.
    pub(super) fn answer(&mut self, job: &Job) {
        let begin = Instant::now();
        // The intake has decoded it once already.
        let Ok((envelope, _)) = Envelope::from_datagram(job.datagram.bytes()) else {
            return;
        };
        self.output.begin();
        let output = &mut self.output;
        match self
            .pipeline
            .handle_watched(&envelope, |step| output.note(step))
        {
            Ok(Outcome::Revolution(report)) => self.publish(&report, job.arrival, begin),
            Ok(_) => {}
            Err(fault) => self.log.note(fault.name(), || fault.to_string()),
        }
    }

    /// Takes a packet of a sensor.
    pub(super) fn take_packet(&mut self, datagram: &Datagram, arrival: &Arrival) {
        let packet = Packet {
            source: arrival.source.ip().octets(),
            arrival: arrival.time,
            bytes: datagram.bytes(),
        };
        let taken = self.pipeline.take_packet(&packet);
        let is_foreign = matches!(taken, Err(Fault::Packet(PacketRefusal::OtherSensor { .. })));
        if !is_foreign && packet.bytes.len() == PACKET_LEN {
            self.publish_cloud(&packet);
        }
        match taken {
            Ok(true) => {
                let before = self.due.replace(arrival.time);
                self.replaced += u64::from(before.is_some());
            }
            Ok(false) => {}
            Err(fault) => self.log.note(fault.name(), || fault.to_string()),
        }
    }

    /// Sends the point clouds that a packet closes, as the device service does.
    fn publish_cloud(&mut self, packet: &Packet<'_>) {
        let Some(assembler) = &mut self.assembler else {
            return;
        };
        // What is no packet was told of already.
        for sweep in assembler.take(packet.bytes).unwrap_or_default() {
            let postmark = Postmark {
                sent: now(),
                sampled: packet.arrival,
                sender_stamp: self.output.sender_stamp,
            };
            self.frame.clear();
            postmark.put_payload(&mut self.frame, POINT_CLOUD_ID, |out| {
                sweep.cloud().encode(out)
            });
            self.output.send([&self.frame[..]], &mut self.log);
        }
    }

    /// Whether a revolution of packets waits for its answer.
    pub(super) fn is_due(&self) -> bool {
        self.due.is_some()
    }

    /// Answers the revolution that packets have closed, if there is one.
    pub(super) fn answer_packets(&mut self) {
        let Some(arrival) = self.due.take() else {
            return;
        };
        let begin = Instant::now();
        self.output.begin();
        let output = &mut self.output;
        let report = self.pipeline.perceive_packets(|step| output.note(step));
        self.publish(&report, arrival, begin);
    }

    /// Sends what answers a revolution.
    fn publish(&mut self, report: &RevolutionReport, arrival: Time, begin: Instant) {
        let processing_s = begin.elapsed().as_secs_f32();
        let frames = self.pipeline.publish_objects(now(), processing_s);
        self.output.send(frames, &mut self.log);
        let latency = now() - arrival;
        self.latency.record(latency);
        if let Some(view) = &mut self.output.view {
            view.answered(latency);
        }
        self.vitals.answered(report.missed);
        self.pipeline.update_map();
        let frames = self.pipeline.publish_map(now());
        self.output.send(frames, &mut self.log);
        if let Some(view) = &mut self.output.view {
            view.note(Step::Map);
            view.show(&self.pipeline, report, None);
        }
        if let Some(onlooker) = &mut self.output.onlooker {
            onlooker.show(&self.pipeline, report);
        }
        self.teller
            .tell(report, self.pipeline.packets(), &mut self.log);
    }

    /// Sends into a session that was joined anew.
    pub(super) fn set_sender(&mut self, sender: Sender) {
        self.output.sender = Some(sender);
    }

    /// Notes fragmented datagrams that were lost.
    pub(super) fn note_fragments(&mut self, lost: u64) {
        self.fragmented_lost += lost;
        if lost > 0 {
            self.log.note("fragmented_lost", || {
                format!(
                    "{lost} fragmented datagrams of this host could not be put together: revolutions are lost on the \
                     network; sysctl net.ipv4.ipfrag_time=1 net.ipv4.ipfrag_high_thresh=67108864 helps where fragments \
                     clog the kernel"
                )
            });
        }
    }

    /// Notes what could not be answered.
    pub(super) fn note_drops(
        &mut self,
        intake: &Intake,
        queue: &Queue,
        sensor: Option<&SensorCounts>,
    ) {
        let revolutions = queue.dropped_revolutions + self.replaced;
        if revolutions > self.dropped_revolutions {
            self.dropped_revolutions = revolutions;
            self.log.note("queue_dropped", || {
                format!("{revolutions} revolutions so far: the pipeline is behind")
            });
        }
        let kernel_dropped = intake.drops.total() + sensor.map_or(0, |sensor| sensor.drops.total());
        self.vitals
            .dropped(revolutions + queue.dropped_others + kernel_dropped);
    }

    /// Sends a Status.
    pub(super) fn send_status(
        &mut self,
        intake: &Intake,
        queue: &Queue,
        sensor: Option<&SensorCounts>,
    ) {
        let mut status = self.pipeline.status();
        let mut faults = self.pipeline.counts().faults.clone();
        faults.add(&intake.faults);
        if let Some(sensor) = sensor {
            faults.add(&sensor.faults);
            status.datagrams_received += sensor.datagrams;
            status.datagrams_kernel_dropped += sensor.drops.total();
        }
        faults.count_many("queue_dropped_poses", queue.dropped_others);
        let latency = self.latency.percentiles();
        status.uptime = self.start.elapsed().as_secs_f64();
        // Those that waited in vain were received, too.
        status.revolutions_received += queue.dropped_revolutions;
        status.revolutions_queue_dropped = queue.dropped_revolutions + self.replaced;
        status.datagrams_received += intake.datagrams;
        status.datagrams_own = intake.own;
        status.datagrams_kernel_dropped += intake.drops.total();
        status.datagrams_damaged += intake.damaged;
        status.faults = faults.to_string();
        status.latency_median = latency.median_s;
        status.latency_p99 = latency.p99_s;
        status.latency_p999 = latency.p999_s;
        status.latency_max = latency.max_s;
        status.receive_buffer = self.receive_buffer as u32;
        let not_sent = self.output.not_sent;
        if not_sent > self.told_not_sent {
            self.told_not_sent = not_sent;
            self.vitals
                .trouble(format!("{not_sent} frames could not be sent"));
        }
        status.frames_not_sent = not_sent;
        status.fragmented_lost = self.fragmented_lost;
        let health = self.vitals.verdict();
        status.healthy = health == Health::Well;
        status.health = health.to_string();
        supervisor::well(&health);
        self.teller.tell_health(health);
        if let Some(view) = &mut self.output.view {
            let received_bytes = intake.bytes + sensor.map_or(0, |sensor| sensor.bytes);
            view.note_traffic(received_bytes, self.output.sent_bytes);
            view.tell(&status);
        }
        let sent = now();
        if let Some(onlooker) = &mut self.output.onlooker {
            onlooker.tell(&status, sent);
        }
        let postmark = Postmark {
            sent,
            sampled: sent,
            sender_stamp: self.output.sender_stamp,
        };
        self.frame.clear();
        postmark.put(&mut self.frame, &status);
        self.output.send([&self.frame[..]], &mut self.log);
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
