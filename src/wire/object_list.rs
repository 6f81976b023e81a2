//! What Kreisel answers a revolution with: `kreisel.ObjectList` and the objects in it.

use super::message::List;

super::message! {
    /// One road user, valid at the revolution's time.
    pub struct Object = 2020 "kreisel.Object" {
        /// Identity, kept as long as the object is followed; never given twice in a run.
        1 => object_id: u32,
        /// 0 unclassified, 1 car, 2 cyclist, 3 pedestrian, 4 large vehicle.
        2 => classification: u32,
        /// Probability of that class, 0 to 1.
        3 => class_probability: f32,
        /// Probability that the object exists, 0 to 1.
        4 => existence: f32,
        /// Whether this revolution measured it, or it is predicted.
        5 => measured: bool,
        /// Centre in the local frame, metres.
        6 => x: f64,
        /// Centre in the local frame, metres.
        7 => y: f64,
        /// Centre in the local frame, metres.
        8 => z: f64,
        /// Counter-clockwise from east, radians in (-pi, pi].
        9 => yaw: f32,
        /// Speed along yaw, m/s.
        10 => speed: f32,
        /// rad/s.
        11 => yaw_rate: f32,
        /// m/s².
        12 => acceleration: f32,
        /// Along yaw, metres.
        13 => length: f32,
        /// Across yaw, metres.
        14 => width: f32,
        /// Metres.
        15 => height: f32,
        /// Standard deviation, metres.
        16 => x_deviation: f32,
        /// Standard deviation, metres.
        17 => y_deviation: f32,
        /// Standard deviation, radians.
        18 => yaw_deviation: f32,
        /// Standard deviation, m/s.
        19 => speed_deviation: f32,
        /// Seconds since it was first seen.
        20 => age: f32,
        /// Seconds since it was last measured.
        21 => time_since_measurement: f32,
        /// Returns on it in this revolution; of what is near and shows many, about as many.
        22 => number_of_points: u32,
    }
}

super::message! {
    /// All objects of one revolution; sent for every revolution, also when empty.
    pub struct ObjectList = 2021 "kreisel.ObjectList" {
        /// Counts the revolutions that were answered, from 0.
        1 => revolution: u32,
        /// 0: the odometry frame, that of the sensor at the start, x right, y forward; 1: east, north, up
        /// around a WGS84 reference; 2: a simulation's own frame.
        2 => frame: u32,
        /// Whether the vehicle's pose is known, from odometry or from messages.
        3 => ego_known: bool,
        /// Pose of the vehicle in the frame of the objects, metres.
        4 => ego_x: f64,
        /// Metres.
        5 => ego_y: f64,
        /// Metres.
        6 => ego_z: f64,
        /// Radians.
        7 => ego_yaw: f32,
        /// How many objects follow.
        8 => count: u32,
        /// Objects that were left out because the list has a greatest length.
        9 => omitted: u32,
        /// From the envelope in to this list out, seconds.
        10 => processing_time: f32,
        /// The objects, each with its length before it.
        11 => objects: List<Object>,
        /// Where frame 1 lies, degrees north; 0 in another frame. It lies around another place when the vehicle is 10 km
        /// away, unless it is configured; ids go on.
        12 => reference_latitude: f64,
        /// Degrees east.
        13 => reference_longitude: f64,
    }
}
