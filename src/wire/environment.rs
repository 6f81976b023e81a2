//! OpenDaVINCI's own object message, for programs from before OpenDLV.

use super::TimeStamp;
use super::message::List;

super::message! {
    /// A direction in radians.
    pub struct Direction = 152 "opendlv.model.Direction" {
        /// Positive to the left of forward.
        1 => azimuth: f32,
        /// Above the horizon.
        2 => zenith: f32,
    }
}

super::message! {
    /// One object as `opendlv.core` describes it.
    pub struct PerceivedObject = 181 "opendlv.perception.Object" {
        /// When it was first seen.
        1 => identified: TimeStamp,
        /// Class in words.
        2 => kind: String,
        /// 0 to 1.
        3 => type_confidence: f32,
        /// Where it is seen from the vehicle.
        4 => direction: Direction,
        /// 0 to 1.
        5 => direction_confidence: f32,
        /// rad/s.
        6 => direction_rate: Direction,
        /// 0 to 1.
        7 => direction_rate_confidence: f32,
        /// Metres.
        8 => distance: f32,
        /// 0 to 1.
        9 => distance_confidence: f32,
        /// Radians.
        10 => angular_size: f32,
        /// 0 to 1.
        11 => angular_size_confidence: f32,
        /// rad/s.
        12 => angular_size_rate: f32,
        /// 0 to 1.
        13 => angular_size_rate_confidence: f32,
        /// Confidence of existence, 0 to 1.
        14 => confidence: f32,
        /// Sensors that see it.
        15 => sources: List<String>,
        /// Free words.
        16 => properties: List<String>,
        /// Identity, cut to 16 bits by the schema.
        17 => object_id: i16,
    }
}

super::message! {
    /// All objects around the vehicle.
    pub struct Environment = 189 "opendlv.perception.Environment" {
        /// When the list is out of date.
        1 => valid_until: TimeStamp,
        /// The objects in OpenDaVINCI's list encoding.
        2 => objects: List<PerceivedObject>,
    }
}
