//! Step one and last: bytes to messages and messages to bytes.
//!
//! A datagram holds one frame (`frame`), a frame one envelope (`envelope`), an envelope the
//! bytes of one message (`message` and the modules after it). A recording (`recording`) is
//! frames end to end. What was captured of a sensor's network is read by `capture`. Degrees,
//! centimetres, zigzag and big-endian end in this folder.

pub mod protobuf;

pub mod frame;

pub mod envelope;

pub mod recording;

pub mod message;

pub mod point_cloud;

pub mod velodyne;

pub mod capture;

pub mod pose;

pub mod object_list;

pub mod grid_tile;

// Roundabouts and the gap.
pub mod roundabout;

pub mod status;

pub mod opendlv;

pub mod environment;

pub use envelope::{Envelope, TimeStamp};
pub(crate) use message::message;
pub use message::{FieldDescription, Message};
pub use recording::Recording;

/// The full name of a message that this crate reads or writes.
pub fn known_name(data_type: i32) -> Option<&'static str> {
    macro_rules! names {
        ($($message:ty),* $(,)?) => {
            match data_type {
                point_cloud::POINT_CLOUD_ID => Some("opendlv.proxy.PointCloudReading"),
                $( <$message>::ID => Some(<$message>::NAME), )*
                _ => None,
            }
        };
    }
    names!(
        TimeStamp,
        pose::ApplanixGroup1,
        pose::GeodeticWgs84Reading,
        pose::GeodeticHeadingReading,
        pose::GroundSpeedReading,
        pose::AngularVelocityReading,
        pose::Geolocation,
        pose::SimulationFrame,
        object_list::Object,
        object_list::ObjectList,
        grid_tile::GridTile,
        status::Status,
        roundabout::RoundaboutArm,
        roundabout::ConflictWindow,
        roundabout::LaneUser,
        roundabout::RoundaboutRing,
        roundabout::Roundabout,
        velodyne::captured::SensorPackets,
        opendlv::ObjectFrameStart,
        opendlv::ObjectFrameEnd,
        opendlv::ObjectAnnouncement,
        opendlv::ObjectType,
        opendlv::ObjectDirection,
        opendlv::ObjectDistance,
        opendlv::ObjectAngularBlob,
        opendlv::ObjectPosition,
        environment::Direction,
        environment::PerceivedObject,
        environment::Environment,
    )
}

/// What can be wrong with bytes from the network or a file. Offsets count from the first
/// byte of the datagram or file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// A frame does not begin with `0D A4`.
    #[error("byte {offset}: no frame begins here (expected 0d a4)")]
    BadMagic {
        /// Where the frame should begin.
        offset: usize,
    },
    /// The frame's length field points past the end of the datagram or file.
    #[error("byte {offset}: the frame announces {announced} bytes, {available} are there")]
    FrameTruncated {
        /// Where the frame begins.
        offset: usize,
        /// Bytes that its header announces.
        announced: usize,
        /// Bytes that follow the header.
        available: usize,
    },
    /// The bytes end inside a number.
    #[error("byte {offset}: the message ends inside a number")]
    Truncated {
        /// Where the number begins.
        offset: usize,
    },
    /// A varint has more than ten bytes.
    #[error("byte {offset}: a varint of more than ten bytes")]
    VarintTooLong {
        /// Where the varint begins.
        offset: usize,
    },
    /// An envelope, or a time in one, has more fields than any peer's.
    #[error("byte {offset}: more fields than an envelope can have")]
    TooManyFields {
        /// Where the first one too many begins.
        offset: usize,
    },
    /// A field's length points past the end of its message.
    #[error("byte {offset}: a field announces {length} bytes, {available} are there")]
    LengthBeyondEnd {
        /// Where the length stands.
        offset: usize,
        /// The announced length.
        length: u64,
        /// What the message still holds.
        available: usize,
    },
}

impl WireError {
    /// A short name for counters and logs.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::BadMagic { .. } => "bad_magic",
            Self::FrameTruncated { .. } => "frame_truncated",
            Self::Truncated { .. } => "number_truncated",
            Self::VarintTooLong { .. } => "varint_too_long",
            Self::TooManyFields { .. } => "too_many_fields",
            Self::LengthBeyondEnd { .. } => "length_beyond_end",
        }
    }

    /// The offset of the first byte that is wrong.
    pub const fn offset(&self) -> usize {
        match self {
            Self::BadMagic { offset }
            | Self::FrameTruncated { offset, .. }
            | Self::Truncated { offset }
            | Self::VarintTooLong { offset }
            | Self::TooManyFields { offset }
            | Self::LengthBeyondEnd { offset, .. } => *offset,
        }
    }
}
