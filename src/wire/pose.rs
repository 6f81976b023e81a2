//! Messages that say where the vehicle is, as the services on the network send them.

super::message! {
    /// Applanix position group 1. The schema changed three times, fields 2 to 19 never did:
    /// only they are read. The thesis' simulator fills 2, 3, 8 and 10 alone, with metres in
    /// the place of degrees and a roll of 1234 as the mark of that.
    pub struct ApplanixGroup1 = 533 "opendlv.core.sensors.applanix.Grp1Data" {
        /// Latitude in degrees.
        2 => lat: f64,
        /// Longitude in degrees.
        3 => lon: f64,
        /// Altitude in metres.
        4 => alt: f64,
        /// Velocity to the north in m/s.
        5 => vel_north: f32,
        /// Velocity to the east in m/s.
        6 => vel_east: f32,
        /// Velocity downward in m/s.
        7 => vel_down: f32,
        /// Roll in degrees.
        8 => roll: f64,
        /// Pitch in degrees.
        9 => pitch: f64,
        /// Heading in degrees, clockwise from north.
        10 => heading: f64,
        /// Wander angle in degrees.
        11 => wander: f64,
        /// Course over ground in degrees.
        12 => track: f32,
        /// Speed over ground in m/s.
        13 => speed: f32,
        /// Angular rate about the longitudinal axis in degrees/s.
        14 => arate_lon: f32,
        /// Angular rate about the transverse axis in degrees/s.
        15 => arate_trans: f32,
        /// Angular rate about the down axis in degrees/s.
        16 => arate_down: f32,
        /// Longitudinal acceleration in m/s².
        17 => accel_lon: f32,
        /// Transverse acceleration in m/s².
        18 => accel_trans: f32,
        /// Downward acceleration in m/s².
        19 => accel_down: f32,
    }
}

super::message! {
    /// Position on the WGS84 ellipsoid; the longitude is field 3.
    pub struct GeodeticWgs84Reading = 19 "opendlv.proxy.GeodeticWgs84Reading" {
        /// Degrees.
        1 => latitude: f64,
        /// Degrees.
        3 => longitude: f64,
    }
}

super::message! {
    /// Heading clockwise from north: degrees from some services, radians from others.
    pub struct GeodeticHeadingReading = 1051 "opendlv.proxy.GeodeticHeadingReading" {
        /// Degrees in [0, 360) or radians in [-pi, pi], by service.
        1 => north_heading: f32,
    }
}

super::message! {
    /// Speed over ground; a signed sum of components from at least one service.
    pub struct GroundSpeedReading = 1046 "opendlv.proxy.GroundSpeedReading" {
        /// m/s.
        1 => ground_speed: f32,
    }
}

super::message! {
    /// Angular rates of the vehicle.
    pub struct AngularVelocityReading = 1031 "opendlv.proxy.AngularVelocityReading" {
        /// Roll rate in rad/s.
        1 => angular_velocity_x: f32,
        /// Pitch rate in rad/s.
        2 => angular_velocity_y: f32,
        /// Yaw rate in rad/s.
        3 => angular_velocity_z: f32,
    }
}

super::message! {
    /// A fused position with heading.
    pub struct Geolocation = 1116 "opendlv.logic.sensation.Geolocation" {
        /// Degrees.
        1 => latitude: f64,
        /// Degrees.
        2 => longitude: f64,
        /// Metres.
        3 => altitude: f32,
        /// Heading; unit by service.
        4 => heading: f32,
    }
}

super::message! {
    /// A pose in a simulation's own frame.
    pub struct SimulationFrame = 1001 "opendlv.sim.Frame" {
        /// Metres.
        1 => x: f32,
        /// Metres.
        2 => y: f32,
        /// Metres.
        3 => z: f32,
        /// Radians.
        4 => roll: f32,
        /// Radians.
        5 => pitch: f32,
        /// Radians.
        6 => yaw: f32,
    }
}
