//! What comes in: counted, and the sound and useful into the queue.

use tracing::trace;

use super::fault_log::FaultLog;
use super::listener::{Arrival, Datagram};
use super::queue::Queue;
use crate::pipeline::Pipeline;
use crate::tally::Tally;
use crate::wire::Envelope;
use crate::wire::point_cloud::POINT_CLOUD_ID;

/// The longest pose message of any peer has 250 bytes; what is far longer is none.
const LONGEST_POSE: usize = 4096;

/// Counters of the receiving side, which Status shows.
#[derive(Debug, Default)]
pub(super) struct Intake {
    pub(super) datagrams: u64,
    pub(super) own: u64,
    pub(super) damaged: u64,
    pub(super) kernel_dropped: u64,
    pub(super) faults: Tally,
    log: FaultLog,
    /// Whether revolutions come from a sensor's own packets, and point clouds are none of ours.
    has_sensor: bool,
}

impl Intake {
    pub(super) fn new(has_sensor: bool) -> Self {
        Self {
            has_sensor,
            ..Self::default()
        }
    }

    /// Counts a datagram and queues it if it means anything to the pipeline.
    pub(super) fn hear(&mut self, datagram: &mut Datagram, arrival: &Arrival, queue: &mut Queue) {
        self.datagrams += 1;
        if arrival.kernel_dropped > self.kernel_dropped {
            let lost = arrival.kernel_dropped - self.kernel_dropped;
            self.kernel_dropped = arrival.kernel_dropped;
            self.log.note("kernel_dropped", || {
                format!("{lost} datagrams: the receive buffer was full")
            });
        }
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
        if !Pipeline::concerns(envelope.data_type) {
            trace!("message {} from {source} passed over", envelope.data_type);
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

    fn refuse(&mut self, name: &'static str, text: impl FnOnce() -> String) {
        self.damaged += 1;
        self.faults.count(name);
        self.log.note(name, text);
    }
}
