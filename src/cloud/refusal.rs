//! Why a message that is sound on the wire is of no use to the array.

use super::MAX_COLUMNS;

/// Why a sound message is not processed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// From another sensor than the one that is listened to.
    #[error("from sender {sender_stamp}, while sender {listened} is listened to")]
    OtherSender {
        /// Who sent it.
        sender_stamp: u32,
        /// Who is listened to.
        listened: u32,
    },
    /// No layers at all, as the first versions of one device service sent.
    #[error("zero layers")]
    ZeroLayers,
    /// No distances.
    #[error("no distances")]
    NoDistances,
    /// The distances are not whole columns.
    #[error("{bytes} bytes of distances are no whole columns of {layers} layers")]
    BrokenColumns {
        /// Length of the distances.
        bytes: usize,
        /// Layers in a column.
        layers: u8,
    },
    /// More columns than the array has.
    #[error("{columns} columns, the array holds {MAX_COLUMNS}")]
    TooManyColumns {
        /// Columns in the message.
        columns: usize,
    },
    /// One of the three messages of a sensor with 32 layers.
    #[error("{layers} of the 32 layers of a {sensor}, the array holds 16")]
    TooManyLayers {
        /// Name of the sensor.
        sensor: &'static str,
        /// Layers in the message.
        layers: u8,
    },
    /// A number of layers that no table has.
    #[error("no sensor with {layers} layers is known")]
    UnknownSensor {
        /// Layers in the message.
        layers: u8,
    },
    /// A planar scanner with a format of its own.
    #[error("an RPLidar, which has one layer and floats for distances")]
    RpLidar,
    /// Intensity takes all bits, or the schema has a newer encoding.
    #[error("an encoding of distances that is not known ({intensity_bits} bits of intensity)")]
    UnknownEncoding {
        /// Bits of intensity that the message announces.
        intensity_bits: u8,
    },
    /// Not a number, infinite, or far outside a circle.
    #[error("azimuths from {start_deg} to {end_deg} degrees")]
    ImpossibleAzimuth {
        /// First column.
        start_deg: f32,
        /// Last column.
        end_deg: f32,
    },
    /// The first message after a device starts claims to begin at 0 wherever it began.
    #[error("first message of a device: {columns} columns cannot span {span_deg:.1} degrees")]
    FirstAzimuth {
        /// Columns in the message.
        columns: usize,
        /// What they claim to span.
        span_deg: f64,
    },
    /// The sensor turns at 5 Hz and the device cuts the revolution in two, or a step back in
    /// azimuth ended the message.
    #[error("{columns} columns span {span_deg:.1} degrees, no whole revolution")]
    PartialRevolution {
        /// Columns in the message.
        columns: usize,
        /// What they span.
        span_deg: f64,
    },
    /// Packets were lost on the way to the device.
    #[error("{step_deg:.4} degrees a column after {usual_deg:.4}: packets were lost")]
    UnevenStep {
        /// Step between columns.
        step_deg: f64,
        /// Step in the revolutions before.
        usual_deg: f64,
    },
    /// More packets were lost than may be.
    #[error("{missing} of {columns} columns are missing: packets were lost")]
    LostPackets {
        /// Columns that are missing.
        missing: usize,
        /// Columns with them.
        columns: usize,
    },
    /// Older than the revolution before, or the same again.
    #[error("{late_s:.3} s older than the revolution before")]
    OutOfOrder {
        /// How much older.
        late_s: f64,
    },
}

impl Refusal {
    /// A short name for counters and logs.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::OtherSender { .. } => "other_sender",
            Self::ZeroLayers => "zero_layers",
            Self::NoDistances => "no_distances",
            Self::BrokenColumns { .. } => "broken_columns",
            Self::TooManyColumns { .. } => "too_many_columns",
            Self::TooManyLayers { .. } => "too_many_layers",
            Self::UnknownSensor { .. } => "unknown_sensor",
            Self::RpLidar => "rplidar",
            Self::UnknownEncoding { .. } => "unknown_encoding",
            Self::ImpossibleAzimuth { .. } => "impossible_azimuth",
            Self::FirstAzimuth { .. } => "first_azimuth",
            Self::PartialRevolution { .. } => "partial_revolution",
            Self::UnevenStep { .. } => "uneven_step",
            Self::LostPackets { .. } => "lost_packets",
            Self::OutOfOrder { .. } => "out_of_order",
        }
    }
}
