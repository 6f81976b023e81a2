//! The shell around the pipeline: a session on the network, a queue, a clock, one thread.
//!
//! `session` has the sockets, `intake` sorts what comes, `queue` stands between it and
//! `worker`, which owns the pipeline. `health` answers the container's health check, `latency`
//! and `fault_log` keep figures and logs small. Everything is bounded.
//!
//! One thread does it all: while the pipeline works, the kernel's buffer takes what comes, and
//! before the next revolution all of that goes into the queue. So nothing is locked, a
//! revolution stays where the kernel has written it, and its answer waits for no other thread
//! to be woken.

mod fault_log;

pub mod health;

mod intake;

mod latency;

mod queue;

pub mod session;

mod worker;

use std::convert::Infallible;
use std::future::{Future, ready};
use std::time::Duration;

use tokio::time::{MissedTickBehavior, interval};
use tracing::{info, warn};

use crate::config::Configuration;
use crate::pipeline::Pipeline;
use crate::time::Time;
use crate::view::Feed;
use health::Vitals;
use intake::Intake;
use queue::Queue;
use session::{Datagram, Receiver, Session, SessionError};
use worker::Worker;

/// What a user says on the command line about a daemon.
#[derive(Debug)]
pub struct Options {
    /// Session.
    pub session: Session,
    /// senderStamp of what is sent.
    pub sender_stamp: u32,
    /// Everything else.
    pub configuration: Configuration,
    /// Where pictures go, if anybody may look.
    pub view: Option<Feed>,
}

/// How often Status is sent.
const STATUS_PERIOD: Duration = Duration::from_secs(1);

/// A shorter receive buffer is worth a warning.
const COMFORTABLE_BUFFER_S: f64 = 2.0;

/// Datagrams that are taken in before the next one is answered, however many more there are.
const MOST_AT_ONCE: usize = 256;

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
    let vitals = Vitals::default();
    let mut worker = Worker::new(
        Pipeline::new(&options.configuration, options.sender_stamp),
        sender,
        options.sender_stamp,
        receiver.buffer_bytes(),
        &vitals,
        options.view,
    );
    let queue = Queue::new(parameters.queue_revolutions);
    let result = tokio::select! {
        result = serve(&mut receiver, queue, &mut worker) => result.map(|never| match never {}),
        () = health::serve(options.session.cid, &vitals) => Ok(()),
        () = stop => Ok(()),
    };
    worker.log_latency();
    info!("stopped");
    result
}

/// Takes in what comes and answers it, and sends a Status now and then.
async fn serve(
    receiver: &mut Receiver,
    mut queue: Queue,
    worker: &mut Worker<'_>,
) -> Result<Infallible, SessionError> {
    let mut intake = Intake::default();
    let mut datagram = Datagram::default();
    let mut ticks = interval(STATUS_PERIOD);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    ticks.tick().await;
    loop {
        tokio::select! {
            biased;
            _ = ticks.tick() => worker.send_status(&intake, &queue),
            () = ready(()), if !queue.is_empty() => {}
            arrival = receiver.receive(&mut datagram) => {
                intake.hear(&mut datagram, &arrival?, &mut queue);
            }
        }
        for _ in 0..MOST_AT_ONCE {
            let Some(arrival) = receiver.receive_waiting(&mut datagram)? else {
                break;
            };
            intake.hear(&mut datagram, &arrival, &mut queue);
        }
        if let Some(job) = queue.pop() {
            worker.answer(&job);
            queue.recycle(job);
        }
        worker.note_drops(&intake, &queue);
        // Health checks and signals have their turn even when there is always more to do.
        tokio::task::yield_now().await;
    }
}

/// The time of the system's clock, which time stamps on the network follow.
pub fn now() -> Time {
    let since_1970 = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    Time::from_micros(since_1970.map_or(0, |passed| passed.as_micros() as i64))
}
