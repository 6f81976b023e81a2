//! Why a packet is of no use.

use std::net::Ipv4Addr;

use crate::wire::velodyne::data::PacketError;

/// Why a packet is not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PacketRefusal {
    /// It is no packet of a sensor.
    #[error("packet: {0}")]
    Damaged(#[from] PacketError),
    /// It comes from another sensor.
    #[error("packet of a sensor at {source_address}, while the one at {listened} is listened to")]
    OtherSensor {
        /// Who sent it.
        source_address: Ipv4Addr,
        /// Who is listened to.
        listened: Ipv4Addr,
    },
    /// It comes from a kind of sensor that the array cannot hold.
    #[error("packet of a {name} (factory byte {product:#04x}), not of a VLP-16")]
    Product {
        /// What the manufacturer calls it.
        name: &'static str,
        /// The factory byte.
        product: u8,
    },
    /// No manual knows its mode of return.
    #[error("packet with an unknown mode of return")]
    ReturnMode,
    /// A block looks where a sensor that turns cannot look.
    #[error("packet whose block {block} does not follow from the one before")]
    Azimuth {
        /// Which block, from 0.
        block: usize,
    },
    /// Neither its time nor its azimuth go on from the packets before.
    #[error("packet that does not go on from those before")]
    Jump,
    /// Its revolution is closed.
    #[error("packet of a revolution that is closed")]
    Late,
    /// It was here before.
    #[error("packet that came twice")]
    Doubled,
}

impl PacketRefusal {
    /// Whether no sensor can have sent it so.
    pub const fn is_damage(&self) -> bool {
        matches!(
            self,
            Self::Damaged(_) | Self::ReturnMode | Self::Azimuth { .. }
        )
    }

    /// A short name for counters and logs.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Damaged(PacketError::Length { .. }) => "packet_length",
            Self::Damaged(PacketError::Flag { .. }) => "packet_flag",
            Self::OtherSensor { .. } => "packet_other_sensor",
            Self::Product { .. } => "packet_product",
            Self::ReturnMode => "packet_return_mode",
            Self::Azimuth { .. } => "packet_azimuth",
            Self::Jump => "packet_jump",
            Self::Late => "packet_late",
            Self::Doubled => "packet_doubled",
        }
    }
}
