//! The shell around the pipeline: a session on the network, a queue, a thread, a clock.
//!
//! `session` has the sockets, `queue` stands between them and `worker`, which owns the
//! pipeline. `health` answers the container's health check, `latency` and `fault_log` keep
//! figures and logs small. Everything is bounded.

mod fault_log;

pub mod health;

mod latency;

mod queue;

pub mod session;

mod worker;

use std::future::Future;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use bytes::Bytes;
use tokio::time::{MissedTickBehavior, interval};
use tracing::{debug, info, warn};

use crate::config::Configuration;
use crate::pipeline::Pipeline;
use crate::time::Time;
use crate::wire::Envelope;
use crate::wire::point_cloud::POINT_CLOUD_ID;
use fault_log::FaultLog;
use health::Vitals;
use queue::{Item, Job, Queue};
use session::{Arrival, Receiver, Session, SessionError};
use worker::Worker;

/// What a user says on the command line about a daemon.
#[derive(Debug, Clone)]
pub struct Options {
    /// Session.
    pub session: Session,
    /// senderStamp of what is sent.
    pub sender_stamp: u32,
    /// Everything else.
    pub configuration: Configuration,
}

/// How often Status is sent.
const STATUS_PERIOD: Duration = Duration::from_secs(1);

/// The longest pose message of any peer has 250 bytes; what is far longer is none.
const LONGEST_POSE: usize = 4096;

/// A shorter receive buffer is worth a warning.
const COMFORTABLE_BUFFER_S: f64 = 2.0;

/// Counters of the receiving side, which Status shows.
#[derive(Debug, Clone, Default)]
struct Intake {
    datagrams: u64,
    own: u64,
    damaged: u64,
    kernel_dropped: u64,
    faults: crate::tally::Tally,
}

/// Runs the daemon until `stop` is ready.
///
/// # Errors
/// [`SessionError`] when the session cannot be joined or is lost.
pub async fn run(options: Options, stop: impl Future<Output = ()>) -> Result<(), SessionError> {
    let parameters = &options.configuration.session;
    let (mut receiver, sender) = options.session.join(parameters)?;
    info!(
        "joined {} on {}, sending with TTL {}; receive buffer {} kB ({:.1} s of a VLP-16 at 10 Hz)",
        receiver.group(),
        receiver.interface(),
        parameters.ttl,
        receiver.buffer_bytes() / 1000,
        receiver.buffer_seconds(),
    );
    if receiver.buffer_seconds() < COMFORTABLE_BUFFER_S {
        warn!(
            "the kernel limits the receive buffer: raise net.core.rmem_max, or give the process \
             CAP_NET_ADMIN, or revolutions are lost when this computer is busy"
        );
    }
    let vitals = Arc::new(Vitals::default());
    let health = health::serve(options.session.cid, Arc::clone(&vitals));
    let queue = Arc::new(Queue::new(parameters.queue_revolutions));
    let intake = Arc::new(Mutex::new(Intake::default()));
    let worker = Worker {
        pipeline: Pipeline::new(&options.configuration, options.sender_stamp),
        sender,
        sender_stamp: options.sender_stamp,
        queue: Arc::clone(&queue),
        intake: Arc::clone(&intake),
        vitals,
        receive_buffer: receiver.buffer_bytes(),
    };
    let (at_work, gone) = tokio::sync::oneshot::channel::<()>();
    let worker = std::thread::spawn(move || {
        // Dropped when the thread ends, by a panic, too.
        let _at_work = at_work;
        worker.work();
    });
    let result = tokio::select! {
        result = receive(&mut receiver, &queue, &intake) => result,
        () = tick(&queue) => Ok(()),
        () = health => Ok(()),
        _ = gone => Err(SessionError::WorkerDied),
        () = stop => Ok(()),
    };
    queue.close();
    if worker.join().is_err() {
        return Err(SessionError::WorkerDied);
    }
    info!("stopped");
    result
}

/// Asks for a Status once a second.
async fn tick(queue: &Queue) {
    let mut ticks = interval(STATUS_PERIOD);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    ticks.tick().await;
    loop {
        ticks.tick().await;
        queue.push(Item::Status);
    }
}

/// Moves datagrams from the socket into the queue.
async fn receive(
    receiver: &mut Receiver,
    queue: &Queue,
    intake: &Mutex<Intake>,
) -> Result<(), SessionError> {
    let mut log = FaultLog::default();
    loop {
        let (datagram, arrival) = receiver.receive().await?;
        let mut intake = intake
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        intake.datagrams += 1;
        if arrival.kernel_dropped > intake.kernel_dropped {
            let lost = arrival.kernel_dropped - intake.kernel_dropped;
            intake.kernel_dropped = arrival.kernel_dropped;
            log.note("kernel_dropped", || {
                format!("{lost} datagrams: the receive buffer was full")
            });
        }
        if arrival.is_own {
            intake.own += 1;
            continue;
        }
        if let Some(item) = sorted(datagram, &arrival, &mut intake, &mut log) {
            drop(intake);
            queue.push(item);
        }
    }
}

/// What a datagram means for the queue, if anything.
fn sorted(
    datagram: &[u8],
    arrival: &Arrival,
    intake: &mut Intake,
    log: &mut FaultLog,
) -> Option<Item> {
    match Envelope::from_datagram(datagram) {
        Ok((envelope, rest)) => {
            if rest > 0 {
                intake.faults.count("trailing_bytes");
                log.note("trailing_bytes", || {
                    format!(
                        "{rest} bytes after the envelope from {} not read",
                        arrival.source
                    )
                });
            }
            if !Pipeline::concerns(envelope.data_type) {
                debug!(
                    "message {} from {} passed over",
                    envelope.data_type, arrival.source
                );
                return None;
            }
            let is_revolution = envelope.data_type == POINT_CLOUD_ID;
            if !is_revolution && datagram.len() > LONGEST_POSE {
                intake.damaged += 1;
                intake.faults.count("pose_too_long");
                log.note("pose_too_long", || {
                    format!("{} bytes from {}", datagram.len(), arrival.source)
                });
                return None;
            }
            Some(Item::Job(Job {
                is_revolution,
                datagram: Bytes::copy_from_slice(datagram),
                arrival: arrival.time,
            }))
        }
        Err(error) => {
            intake.damaged += 1;
            intake.faults.count(error.name());
            log.note(error.name(), || {
                format!("datagram from {}: {error}", arrival.source)
            });
            None
        }
    }
}

/// The time of the system's clock, which time stamps on the network follow.
pub fn now() -> Time {
    let since_1970 = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    Time::from_micros(since_1970.map_or(0, |passed| passed.as_micros() as i64))
}
