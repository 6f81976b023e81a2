//! Why an envelope was of no use, and how often.

use crate::cloud::{PacketRefusal, Refusal};
use crate::ego::PoseRefusal;
use crate::tally::Tally;
use crate::wire::WireError;

/// Why an envelope was of no use.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// Its bytes do not fit its message.
    #[error("message {data_type}: {error}")]
    Damaged {
        /// The envelope's data type.
        data_type: i32,
        /// What is wrong.
        error: WireError,
    },
    /// A point cloud that is no whole revolution, or that the array cannot hold.
    #[error("point cloud refused: {0}")]
    Refused(#[from] Refusal),
    /// A pose that is of no use.
    #[error("message {data_type}: {refusal}")]
    Pose {
        /// The envelope's data type.
        data_type: i32,
        /// Why not.
        refusal: PoseRefusal,
    },
    /// A packet of a sensor that is of no use.
    #[error(transparent)]
    Packet(#[from] PacketRefusal),
}

impl Fault {
    /// A short name for counters and logs.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Damaged { error, .. } => error.name(),
            Self::Refused(refusal) => refusal.name(),
            Self::Pose { refusal, .. } => refusal.name(),
            Self::Packet(refusal) => refusal.name(),
        }
    }
}

/// What was counted since the beginning.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Counts {
    /// Packets of a sensor handed in.
    pub packets: u64,
    /// Packets that never came.
    pub packets_lost: u64,
    /// Packets that came late and were put in their place.
    pub packets_late: u64,
    /// Point clouds handed in, and revolutions that packets closed.
    pub revolutions: u64,
    /// Point clouds refused.
    pub refused: u64,
    /// Messages whose bytes do not fit.
    pub damaged: u64,
    /// Poses read.
    pub poses: u64,
    /// Sound poses that are of no use: of other senders, other clocks, or without a fix.
    pub poses_refused: u64,
    /// Returns that hung in the air.
    pub airborne: u64,
    /// Revolutions that had some.
    pub airborne_revolutions: u64,
    /// Revolutions that were not answered between two that were.
    pub missed: u64,
    /// Revolutions that kept the last good plane.
    pub ground_held: u64,
    /// Revolutions at the configured height.
    pub ground_fallback: u64,
    /// Leaps in time.
    pub time_jumps: u64,
    /// All faults by name.
    pub faults: Tally,
}
