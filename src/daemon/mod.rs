//! The shell around the pipeline: a session on the network, a queue, a clock, one thread.
//!
//! `session` has the sockets of a session, `sensor` those of a sensor, both on a `listener`; `intake` sorts what comes,
//! `queue` stands between it and `worker`, which owns the pipeline. `route` and `kernel` notice what goes wrong before a
//! datagram reaches a socket, `health` says how all is, `telling` and `fault_log` write the log, `supervisor` is who
//! started the daemon, `latency` keeps figures. Everything is bounded.
//!
//! One thread does it all: while the pipeline works, the kernel's buffer takes what comes, and
//! before the next revolution all of that goes into the queue. So nothing is locked, a
//! revolution stays where the kernel has written it, and its answer waits for no other thread
//! to be woken.

mod fault_log;

pub mod health;

mod intake;

mod kernel;

mod latency;

pub mod listener;

mod queue;

mod route;

pub mod sensor;

pub mod session;

mod supervisor;

mod telling;

mod worker;

use std::convert::Infallible;
use std::future::{Future, pending, ready};
use std::time::Duration;

use tokio::time::{MissedTickBehavior, interval};
use tracing::{info, warn};

use crate::config::{Configuration, SessionParameters};
use crate::pipeline::{Pipeline, RevolutionReport};
use crate::roadmap::Roadmap;
use crate::time::Time;
use crate::view::Feed;
use crate::wire::status::Status;
use health::Vitals;
use intake::Intake;
use kernel::KernelCounts;
use listener::Datagram;
use queue::Queue;
use route::Route;
use sensor::{SensorError, SensorPort, SensorPorts};
use session::{Receiver, Session, SessionError};
use worker::{Output, Worker};

/// Somebody who is shown every revolution and every Status, and whom the daemon does not wait for.
pub trait Onlooker: std::fmt::Debug {
    /// A revolution was answered, and the map is up to date.
    fn show(&mut self, pipeline: &Pipeline, report: &RevolutionReport);

    /// How the daemon is.
    fn tell(&mut self, status: &Status, now: Time);
}

/// What a user says on the command line about a daemon.
#[derive(Debug)]
pub struct Options {
    /// Session, if there is one.
    pub session: Option<Session>,
    /// Where a sensor's own packets come in, if they do.
    pub sensor: Option<SensorPort>,
    /// Whether point clouds are made of them for the session.
    pub publish_cloud: bool,
    /// senderStamp of what is sent.
    pub sender_stamp: u32,
    /// Roads with roundabouts to watch.
    pub roads: Option<Roadmap>,
    /// Everything else.
    pub configuration: Configuration,
    /// Where pictures go, if anybody may look.
    pub view: Option<Feed>,
    /// Who else looks on.
    pub onlooker: Option<Box<dyn Onlooker>>,
}

/// Why a daemon cannot run.
#[derive(Debug, thiserror::Error)]
pub enum DaemonError {
    /// For its session.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// For its sensor.
    #[error(transparent)]
    Sensor(#[from] SensorError),
}

/// How often the network is looked at, and in how many times of that Status is sent, once a second.
const WATCH_PERIOD: Duration = Duration::from_millis(250);
const WATCHES_PER_STATUS: u32 = 4;

/// A shorter receive buffer is worth a warning.
const COMFORTABLE_BUFFER_S: f64 = 2.0;

/// Datagrams that are taken in before the next one is answered, however many more there are.
const MOST_AT_ONCE: usize = 256;

/// The same of packets that say the time.
const MOST_POSITIONS_AT_ONCE: usize = 16;

/// Runs the daemon until `stop` is ready.
///
/// # Errors
/// [`DaemonError`] when the session cannot be joined or the sensor not be heard, or when they are lost.
pub async fn run(options: Options, stop: impl Future<Output = ()>) -> Result<(), DaemonError> {
    let parameters = &options.configuration.session;
    let route = options
        .session
        .as_ref()
        .and_then(|session| Route::to(session).ok());
    let joined = options
        .session
        .map(|session| session.join(parameters))
        .transpose()?;
    let (receiver, sender) = joined.unzip();
    if let Some(receiver) = &receiver {
        tell_joined(receiver, parameters.ttl);
    }
    let buffer_mb = parameters.receive_buffer_mb;
    let sensor = options
        .sensor
        .map(|sensor| sensor.open(buffer_mb))
        .transpose()?;
    if let Some(at) = options.sensor {
        info!("listening for packets of a VLP-16 on UDP port {}", at.port);
    }
    let buffer_bytes = receiver.as_ref().map(Receiver::buffer_bytes);
    let buffer_bytes = buffer_bytes.or(sensor.as_ref().map(SensorPorts::buffer_bytes));
    let vitals = Vitals::new(parameters.most_missed_share);
    let output = Output {
        sender,
        sender_stamp: options.sender_stamp,
        view: options.view,
        onlooker: options.onlooker,
        not_sent: 0,
        sent_bytes: 0,
    };
    let mut pipeline = Pipeline::new(&options.configuration, options.sender_stamp);
    if let Some(roads) = &options.roads {
        let count = pipeline.take_map(roads);
        info!(
            "watching the nearest of {count} roundabouts of the map {:?}",
            roads.name
        );
    }
    let worker = Worker::new(
        pipeline,
        output,
        options.publish_cloud,
        buffer_bytes.unwrap_or_default(),
        &vitals,
    );
    let mut service = Service {
        receiver,
        sensor,
        intake: Intake::new(
            options.sender_stamp,
            &parameters.sources.0,
            options.sensor.is_some(),
        ),
        queue: Queue::new(parameters.queue_revolutions),
        worker,
        session: options.session,
        parameters: parameters.clone(),
        route,
        kernel: KernelCounts::read(),
        vitals: &vitals,
    };
    supervisor::ready();
    let cid = options.session.map_or(0, |session| session.cid);
    let result = tokio::select! {
        result = service.serve() => result.map(|never| match never {}),
        () = health::serve(cid, &vitals) => Ok(()),
        () = stop => Ok(()),
    };
    supervisor::stopping();
    service.worker.log_latency();
    info!("stopped");
    result
}

fn tell_joined(receiver: &Receiver, ttl: usize) {
    info!(
        "joined {} on {}, sending with TTL {ttl}; receive buffer {} kB ({:.1} s of a VLP-16 at 10 Hz)",
        receiver.group(),
        receiver.interface(),
        receiver.buffer_bytes() / 1000,
        receiver.buffer_seconds(),
    );
    if receiver.buffer_seconds() < COMFORTABLE_BUFFER_S {
        warn!(
            "the kernel limits the receive buffer: raise net.core.rmem_max, or give the process \
             CAP_NET_ADMIN, or revolutions are lost when this computer is busy"
        );
    }
}

/// All that the one thread works with.
struct Service<'a> {
    receiver: Option<Receiver>,
    sensor: Option<SensorPorts>,
    intake: Intake,
    queue: Queue,
    worker: Worker<'a>,
    session: Option<Session>,
    parameters: SessionParameters,
    /// How the session was joined.
    route: Option<Route>,
    kernel: KernelCounts,
    vitals: &'a Vitals,
}

impl Service<'_> {
    /// Takes in what comes and answers it, and sends a Status now and then.
    async fn serve(&mut self) -> Result<Infallible, DaemonError> {
        let mut datagram = Datagram::default();
        let mut packet = Datagram::default();
        let mut watches = 0;
        let mut ticks = interval(WATCH_PERIOD);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        ticks.tick().await;
        loop {
            let mut is_due = false;
            let from_session = async {
                match &mut self.receiver {
                    Some(receiver) => receiver.receive(&mut datagram).await,
                    None => pending().await,
                }
            };
            tokio::select! {
                biased;
                _ = ticks.tick() => is_due = true,
                () = ready(()), if !self.queue.is_empty() => {}
                arrival = from_session => {
                    self.intake.hear(&mut datagram, &arrival?, &mut self.queue);
                }
                arrival = next_packet(&mut self.sensor, &mut packet) => {
                    self.worker.take_packet(&packet, &arrival?);
                }
            }
            self.take_waiting(&mut datagram, &mut packet)?;
            self.answer();
            let counts = self.sensor.as_ref().map(|sensor| &sensor.counts);
            self.worker.note_drops(&self.intake, &self.queue, counts);
            if is_due {
                supervisor::alive();
                self.watch_network();
                watches += 1;
            }
            if watches == WATCHES_PER_STATUS {
                watches = 0;
                self.watch_kernel();
                let counts = self.sensor.as_ref().map(|sensor| &sensor.counts);
                self.worker.send_status(&self.intake, &self.queue, counts);
            }
            // Health checks and signals have their turn even when there is always more to do.
            tokio::task::yield_now().await;
        }
    }

    /// Joins the session anew where the route to it is another one than it was: an interface came, went, was made anew or
    /// has another address.
    fn watch_network(&mut self) {
        let Some(session) = &self.session else { return };
        let problem = match Route::to(session) {
            Ok(route) if self.route == Some(route) => None,
            Ok(route) => match session.join(&self.parameters) {
                Ok((receiver, sender)) => {
                    match self.route {
                        Some(before) => {
                            warn!("joined the session anew over {route}: it was {before}")
                        }
                        None => warn!("joined the session anew over {route}"),
                    }
                    tell_joined(&receiver, self.parameters.ttl);
                    self.receiver = Some(receiver);
                    self.worker.set_sender(sender);
                    self.route = Some(route);
                    None
                }
                Err(error) => Some(error.to_string()),
            },
            Err(error) => Some(error.to_string()),
        };
        if let Some(problem) = &problem
            && self.route.take().is_some()
        {
            warn!("cut off from the session: {problem}");
        }
        self.vitals.cut_off(problem);
    }

    /// Says what the kernel lost before it reached a socket.
    fn watch_kernel(&mut self) {
        let now = KernelCounts::read();
        let lost = now.since(&self.kernel).fragmented_lost;
        self.kernel = now;
        self.worker.note_fragments(lost);
    }

    /// Takes in what has come meanwhile.
    fn take_waiting(
        &mut self,
        datagram: &mut Datagram,
        packet: &mut Datagram,
    ) -> Result<(), DaemonError> {
        if let Some(receiver) = &mut self.receiver {
            for _ in 0..MOST_AT_ONCE {
                let Some(arrival) = receiver.receive_waiting(datagram)? else {
                    break;
                };
                self.intake.hear(datagram, &arrival, &mut self.queue);
            }
        }
        if let Some(sensor) = &mut self.sensor {
            for _ in 0..MOST_POSITIONS_AT_ONCE {
                let Some(arrival) = sensor.position_waiting(packet) else {
                    break;
                };
                self.worker.take_packet(packet, &arrival);
            }
            for _ in 0..MOST_AT_ONCE {
                let Some(arrival) = sensor.receive_waiting(packet)? else {
                    break;
                };
                self.worker.take_packet(packet, &arrival);
            }
        }
        Ok(())
    }

    /// Answers the next message; or, if a revolution of packets is due, all that came before it, and it.
    fn answer(&mut self) {
        for _ in 0..MOST_AT_ONCE {
            let Some(job) = self.queue.pop() else { break };
            self.worker.answer(&job);
            self.queue.recycle(job);
            if !self.worker.is_due() {
                break;
            }
        }
        self.worker.answer_packets();
    }
}

/// Waits for a packet of a sensor; for ever if there is none.
async fn next_packet(
    sensor: &mut Option<SensorPorts>,
    packet: &mut Datagram,
) -> Result<listener::Arrival, SensorError> {
    match sensor {
        Some(sensor) => sensor.receive(packet).await,
        None => pending().await,
    }
}

/// The time of the system's clock, which time stamps on the network follow.
pub fn now() -> Time {
    let since_1970 = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    Time::from_micros(since_1970.map_or(0, |passed| passed.as_micros() as i64))
}
