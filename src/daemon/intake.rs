//! What comes in: counted, and the sound and useful into the queue.

use std::net::Ipv4Addr;
use std::time::{Duration, Instant};

use tracing::trace;

use super::fault_log::FaultLog;
use super::kernel::Drops;
use super::listener::{Arrival, Datagram};
use super::queue::Queue;
use crate::pipeline::{OWN_IDS, Pipeline};
use crate::tally::Tally;
use crate::wire::Envelope;
use crate::wire::point_cloud::POINT_CLOUD_ID;

/// The longest pose message of any peer has 250 bytes; what is far longer is none.
const LONGEST_POSE: usize = 4096;

/// Counters of the receiving side, which Status shows.
#[derive(Debug, Default)]
pub(super) struct Intake {
    pub(super) datagrams: u64,
    /// Bytes of them.
    pub(super) bytes: u64,
    pub(super) own: u64,
    pub(super) damaged: u64,
    pub(super) drops: Drops,
    pub(super) faults: Tally,
    log: FaultLog,
    /// senderStamp of what this daemon sends.
    sender_stamp: u32,
    /// Hosts that are listened to; any if there are none.
    sources: Vec<Ipv4Addr>,
    /// Of each message and senderStamp the host that is listened to, and when it was heard last.
    listened: Vec<Listened>,
    /// Whether revolutions come from a sensor's own packets, and point clouds are none of ours.
    has_sensor: bool,
}

/// Whose messages of a number and senderStamp are taken.
#[derive(Debug, Clone, Copy)]
struct Listened {
    message: (i32, u32),
    host: Ipv4Addr,
    heard: Instant,
}

/// Messages and senderStamps that are kept apart; a session has some ten.
const MOST_LISTENED: usize = 64;

impl Intake {
    pub(super) fn new(sender_stamp: u32, sources: &[Ipv4Addr], has_sensor: bool) -> Self {
        Self {
            sender_stamp,
            sources: sources.to_vec(),
            has_sensor,
            ..Self::default()
        }
    }

    /// Counts a datagram and queues it if it means anything to the pipeline.
    pub(super) fn hear(&mut self, datagram: &mut Datagram, arrival: &Arrival, queue: &mut Queue) {
        self.datagrams += 1;
        self.bytes += datagram.bytes().len() as u64;
        self.drops.note(arrival, "datagrams", &mut self.log);
        if arrival.is_own {
            self.own += 1;
            return;
        }
        let source = arrival.source;
        let (envelope, rest) = match Envelope::from_datagram(datagram.bytes()) {
            Ok(sound) => sound,
            Err(error) => {
                return self.refuse(error.name(), || format!("datagram from {source}: {error}"));
            }
        };
        if rest > 0 {
            self.faults.count("trailing_bytes");
            self.log.note("trailing_bytes", || {
                format!("{rest} bytes after the envelope from {source} not read")
            });
        }
        let is_twin =
            OWN_IDS.contains(&envelope.data_type) && envelope.sender_stamp == self.sender_stamp;
        if is_twin {
            self.faults.count("twin");
            let id = self.sender_stamp;
            self.log.note("twin", || {
                format!("{source} sends what this service sends, with the same id {id}: give one of them another --id")
            });
        } else if !Pipeline::concerns(envelope.data_type) {
            trace!("message {} from {source} passed over", envelope.data_type);
        } else if !self.listens_to((envelope.data_type, envelope.sender_stamp), *source.ip()) {
            self.faults.count("other_source");
            let data_type = envelope.data_type;
            self.log.note("other_source", || {
                format!("message {data_type} from {source}, while another host is listened to")
            });
        } else if envelope.data_type == POINT_CLOUD_ID && self.has_sensor {
            self.faults.count("cloud_beside_sensor");
            self.log.note("cloud_beside_sensor", || {
                format!(
                    "point clouds from {source} are passed over: the sensor's own packets are used"
                )
            });
        } else if envelope.data_type == POINT_CLOUD_ID {
            queue.push_revolution(datagram, arrival.time);
        } else if datagram.bytes().len() > LONGEST_POSE {
            let length = datagram.bytes().len();
            self.refuse("pose_too_long", || format!("{length} bytes from {source}"));
        } else {
            queue.push_other(datagram, arrival.time);
        }
    }

    /// Whether a host's messages of a number and senderStamp are taken: those of the hosts that are configured, else
    /// those of the first one that is heard, until it is silent.
    fn listens_to(&mut self, message: (i32, u32), host: Ipv4Addr) -> bool {
        const SILENCE: Duration = Duration::from_secs(1);
        if !self.sources.is_empty() {
            return self.sources.contains(&host);
        }
        let now = Listened {
            message,
            host,
            heard: Instant::now(),
        };
        let known = self
            .listened
            .iter_mut()
            .find(|known| known.message == message);
        let Some(known) = known else {
            if self.listened.len() == MOST_LISTENED {
                self.listened.sort_unstable_by_key(|known| known.heard);
                self.listened.remove(0);
            }
            self.listened.push(now);
            return true;
        };
        if known.host != host && known.heard.elapsed() < SILENCE {
            return false;
        }
        let before = std::mem::replace(known, now).host;
        if before != host {
            let (data_type, sender_stamp) = message;
            self.log.note("source_changed", || {
                format!("message {data_type} of sender {sender_stamp} comes from {host} now, and no more from {before}")
            });
        }
        true
    }

    fn refuse(&mut self, name: &'static str, text: impl FnOnce() -> String) {
        self.damaged += 1;
        self.faults.count(name);
        self.log.note(name, text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Ipv4Addr = Ipv4Addr::new(10, 0, 0, 1);
    const B: Ipv4Addr = Ipv4Addr::new(10, 0, 0, 2);

    #[test]
    fn of_each_sender_one_host_is_listened_to() {
        let mut intake = Intake::new(0, &[], false);
        assert!(intake.listens_to((49, 0), A));
        assert!(!intake.listens_to((49, 0), B));
        // Another sensor may be at another host, and poses as well.
        assert!(intake.listens_to((49, 1), B) && intake.listens_to((533, 0), B));
        assert!(intake.listens_to((49, 0), A));
        for sender_stamp in 0..1000 {
            intake.listens_to((49, sender_stamp), B);
        }
        assert!(intake.listened.len() <= MOST_LISTENED);
    }

    #[test]
    fn hosts_that_are_configured_are_the_only_ones() {
        let mut intake = Intake::new(0, &[B], false);
        assert!(!intake.listens_to((49, 0), A));
        assert!(intake.listens_to((49, 0), B));
    }
}
