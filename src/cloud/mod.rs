//! Step two: one point cloud message into the static array of points.
//!
//! `dialect` finds what the message does not say (byte order) and what it says in two ways
//! (intensity, unit). `intake` decides whether the message is one whole revolution that the
//! array can hold, `refusal` says why not. `scan` is the array, `passes` fills it, `airborne` leaves out what hangs in the air, `own_vehicle` masks part of it.
//! `sensor` has the elevation tables. `packets` puts revolutions together from what a sensor itself sends.

mod airborne;

mod dialect;

mod intake;

mod own_vehicle;

pub mod packets;

mod passes;

mod refusal;

mod scan;

#[cfg(test)]
pub(crate) use packets::tests::scan_through_a_pane;
#[cfg(test)]
pub(crate) use scan::tests;

pub mod sensor;

pub use dialect::{ByteOrderSource, Dialect, shown_order};
pub use intake::{Intake, Revolution, Source};
pub use own_vehicle::{Extent, OwnVehicle};
pub use packets::{ClockState, PacketIntake, PacketRefusal, Turn};
pub use refusal::Refusal;
pub use scan::{Azimuths, CAPACITY, MAX_COLUMNS, MAX_LAYERS, Scan};

use crate::parameter::{choices, parameters};

choices! {
    /// How the order of the two bytes of a distance is decided.
    pub enum ByteOrderSetting {
        /// From the data.
        Auto = "auto",
        /// Network order.
        Big = "big",
        /// Host order of old recordings.
        Little = "little",
    }
}

choices! {
    /// How the unit of a distance is decided.
    pub enum UnitSetting {
        /// As the message says; centimetres where it says nothing.
        Auto = "auto",
        /// 0.01 m.
        Centimetre = "1cm",
        /// 0.002 m: opendlv-device-lidar-vlp16 v0.0.2 to v0.0.5.
        TwoMillimetres = "2mm",
        /// 0.02 m.
        TwoCentimetres = "2cm",
    }
}

choices! {
    /// Whose time the revolutions of a sensor's own packets have.
    pub enum PacketTime {
        /// The sensor's, where a GPS receiver keeps it; else that of the arrival.
        Sensor = "sensor",
        /// That of the arrival.
        Arrival = "arrival",
    }
}

parameters! {
    /// The point cloud: how messages are read and which returns are kept.
    pub struct CloudParameters "cloud" {
        /// Order of the two bytes of a distance. No message says it; auto compares how smooth
        /// the surfaces are in either order and says in log and Status what it found.
        byte_order: ByteOrderSetting = ByteOrderSetting::Auto, "";
        /// Unit of a distance. auto follows the message; where its schema has no unit it is 1cm.
        distance_unit: UnitSetting = UnitSetting::Auto, "";
        /// Which sender of a session with several sensors is listened to; -1 takes the first
        /// one that is heard.
        sender_stamp: i64 = -1, in -1.0 ..= 4294967295.0, "senderStamp";
        /// Returns nearer than this are dropped: the vehicle's own roof and the sensor's mount.
        minimum_range_m: f64 = 1.0, in 0.0..=10.0, "m";
        /// Returns farther than this are dropped.
        maximum_range_m: f64 = 130.0, in 1.0..=655.35, "m";
        /// Whether what is seen of the own vehicle is learned and dropped: what is of one piece with what is
        /// within 1.3 m of the sensor, and keeps its place there for a second.
        own_vehicle: bool = true, thesis false, "";
        /// Whether returns within 15 m with nothing beside them are dropped where they are many: snow, rain, spray, dust.
        airborne: bool = true, thesis false, "";
        /// Box around the own vehicle, instead of what is learned of it, in the sensor frame (x right, y forward, z up), within
        /// which returns are dropped: lowest x. The box is empty where low is not below high.
        vehicle_x_low_m: f64 = 0.0, in -10.0..=10.0, "m";
        /// Highest x of the own vehicle's box.
        vehicle_x_high_m: f64 = 0.0, in -10.0..=10.0, "m";
        /// Lowest y of the own vehicle's box.
        vehicle_y_low_m: f64 = 0.0, in -20.0..=20.0, "m";
        /// Highest y of the own vehicle's box.
        vehicle_y_high_m: f64 = 0.0, in -20.0..=20.0, "m";
        /// Lowest z of the own vehicle's box.
        vehicle_z_low_m: f64 = -5.0, in -5.0..=5.0, "m";
        /// Highest z of the own vehicle's box.
        vehicle_z_high_m: f64 = 1.0, in -5.0..=5.0, "m";
        /// How much the step between columns may differ from the revolutions before. Packets
        /// lost between sensor and device widen it, and azimuths between first and last column
        /// are then wrong: one packet of 75 widens it by 0.013.
        step_tolerance: f64 = 0.01, in 0.001..=0.5, "";
        /// Part of the circle that a message must cover to be a revolution; of a sensor that
        /// sees less than the circle, the same share of its field.
        least_span_deg: f64 = 350.0, in 1.0..=359.0, "degrees";
        /// Of a sensor's own packets: whose time its revolutions have. sensor takes the sensor's where a GPS receiver
        /// keeps it and it is within 10 s of this computer's; poses must then have the same time.
        packet_time: PacketTime = PacketTime::Sensor, "";
        /// Of a sensor's own packets: share of a revolution that may be lost. What is lost counts as not seen.
        most_lost_share: f64 = 0.1, in 0.0..=0.9, "";
    }
}
