//! The OpenDLV standard messages for objects: one message a property, joined by object id,
//! between a frame's start and end.

super::message! {
    /// Begins the objects of one revolution.
    pub struct ObjectFrameStart = 1128 "opendlv.logic.perception.ObjectFrameStart" {
        /// The same in start and end.
        1 => object_frame_id: u32,
    }
}

super::message! {
    /// Ends the objects of one revolution; viewers draw on it.
    pub struct ObjectFrameEnd = 1129 "opendlv.logic.perception.ObjectFrameEnd" {
        /// The same in start and end.
        1 => object_frame_id: u32,
    }
}

super::message! {
    /// Announces an object.
    pub struct ObjectAnnouncement = 1130 "opendlv.logic.perception.Object" {
        /// Identity.
        1 => object_id: u32,
    }
}

super::message! {
    /// What it is.
    pub struct ObjectType = 1131 "opendlv.logic.perception.ObjectType" {
        /// Identity.
        1 => object_id: u32,
        /// Class code of the producer.
        2 => kind: u32,
    }
}

super::message! {
    /// Where it is seen from the vehicle.
    pub struct ObjectDirection = 1133 "opendlv.logic.perception.ObjectDirection" {
        /// Identity.
        1 => object_id: u32,
        /// Positive to the left of forward.
        2 => azimuth_angle: f32,
        /// Above the horizon.
        3 => zenith_angle: f32,
    }
}

super::message! {
    /// How far it is.
    pub struct ObjectDistance = 1134 "opendlv.logic.perception.ObjectDistance" {
        /// Identity.
        1 => object_id: u32,
        /// Metres.
        2 => distance: f32,
    }
}

super::message! {
    /// How large it appears.
    pub struct ObjectAngularBlob = 1135 "opendlv.logic.perception.ObjectAngularBlob" {
        /// Identity.
        1 => object_id: u32,
        /// Angular width.
        2 => width: f32,
        /// Angular height.
        3 => height: f32,
    }
}

super::message! {
    /// Where it is in metres. The message set of v0.9.10 numbers y and z both 3, which no
    /// parser can mean; z is 4 here, as in the sets after it.
    pub struct ObjectPosition = 1136 "opendlv.logic.perception.ObjectPosition" {
        /// Identity.
        1 => object_id: u32,
        /// Metres.
        2 => x: f32,
        /// Metres.
        3 => y: f32,
        /// Metres.
        4 => z: f32,
    }
}
