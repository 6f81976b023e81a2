//! Why a pose is of no use.

use crate::time::Span;

/// Why a pose is of no use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PoseRefusal {
    /// Its numbers cannot be a vehicle's.
    #[error("its numbers are no pose on the earth")]
    Implausible,
    /// It is that of a receiver that knows no place.
    #[error("a place at 0 degrees north and east is that of a receiver without a fix")]
    NoFix,
    /// Another sender is listened to.
    #[error("from sender {sender_stamp}, while sender {listened} is listened to")]
    OtherSender {
        /// Who sent it.
        sender_stamp: u32,
        /// Who is listened to.
        listened: u32,
    },
    /// Its clock is so far from that of the revolutions that it is of no use.
    #[error("stamped {:.1} s behind the revolutions: not used", .behind.seconds())]
    OtherClock {
        /// How far it is behind.
        behind: Span,
    },
}

impl PoseRefusal {
    /// A short name for counters and logs.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Implausible => "pose_implausible",
            Self::NoFix => "pose_without_fix",
            Self::OtherSender { .. } => "pose_other_sender",
            Self::OtherClock { .. } => "pose_clock",
        }
    }

    /// Whether the message is damaged, and not only unfit.
    pub const fn is_damage(&self) -> bool {
        matches!(self, Self::Implausible)
    }
}
