//! What a Velodyne VLP-16 sends by itself: data packets (`data`) and position packets (`position`),
//! after its user manual (63-9243, chapter 9). `device_service` makes point clouds of data packets as the
//! OpenDLV device service does, byte for byte; `captured` is how packets stand in a recording.

pub mod captured;

pub mod data;

pub mod device_service;

pub mod position;

/// UDP port of data packets.
pub const DATA_PORT: u16 = 2368;
/// UDP port of position packets.
pub const POSITION_PORT: u16 = 8308;

/// After so many microseconds a sensor's time stamps begin anew.
pub const HOUR_US: i64 = 3_600_000_000;

/// A packet as it came in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Packet<'a> {
    /// IPv4 address of the sensor.
    pub source: [u8; 4],
    /// When it came.
    pub arrival: crate::time::Time,
    /// The UDP payload.
    pub bytes: &'a [u8],
}

impl Packet<'_> {
    /// The port that a sensor sends it to.
    pub fn port(&self) -> u16 {
        match self.bytes.len() {
            position::PACKET_LEN => POSITION_PORT,
            _ => DATA_PORT,
        }
    }
}
