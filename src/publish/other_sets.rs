//! Objects in the messages of OpenDLV's and OpenDaVINCI's own sets.

use super::{AngleUnit, Heading, Publisher};
use crate::ego::Pose;
use crate::time::Time;
use crate::track::Object;
use crate::wire::envelope::Postmark;
use crate::wire::environment::{Direction, Environment, PerceivedObject};
use crate::wire::message::List;
use crate::wire::{TimeStamp, opendlv};

impl Publisher {
    pub(super) fn put_opendlv(
        &mut self,
        postmark: &Postmark,
        heading: &Heading<'_>,
        objects: &[Object],
    ) {
        let object_frame_id = heading.revolution;
        self.put(postmark, &opendlv::ObjectFrameStart { object_frame_id });
        let unit = match self.parameters.opendlv_angles {
            AngleUnit::Degrees => 1f64.to_degrees(),
            AngleUnit::Radians => 1.0,
        };
        for object in objects {
            let (object_id, sight) = (object.id, Sight::of(object, &heading.sweep.local_sensor()));
            let [x, y, z] = sight.position_m.map(|metres| metres as f32);
            self.put(postmark, &opendlv::ObjectAnnouncement { object_id });
            self.put(
                postmark,
                &opendlv::ObjectType {
                    object_id,
                    kind: object.class.number(),
                },
            );
            self.put(
                postmark,
                &opendlv::ObjectDirection {
                    object_id,
                    azimuth_angle: (sight.azimuth_rad * unit) as f32,
                    zenith_angle: (sight.zenith_rad * unit) as f32,
                },
            );
            let distance = sight.distance_m as f32;
            self.put(
                postmark,
                &opendlv::ObjectDistance {
                    object_id,
                    distance,
                },
            );
            self.put(
                postmark,
                &opendlv::ObjectAngularBlob {
                    object_id,
                    width: (sight.width_rad * unit) as f32,
                    height: (sight.height_rad * unit) as f32,
                },
            );
            self.put(postmark, &opendlv::ObjectPosition { object_id, x, y, z });
        }
        self.put(postmark, &opendlv::ObjectFrameEnd { object_frame_id });
    }
}

pub(super) fn environment_of(valid_until: Time, objects: &[Object], sensor: &Pose) -> Environment {
    let message = |object: &Object| {
        let sight = Sight::of(object, sensor);
        PerceivedObject {
            identified: TimeStamp::from(object.first_seen),
            kind: object.class.name().into(),
            direction: Direction {
                azimuth: sight.azimuth_rad as f32,
                zenith: sight.zenith_rad as f32,
            },
            direction_confidence: object.existence as f32,
            distance: sight.distance_m as f32,
            distance_confidence: object.existence as f32,
            angular_size: sight.width_rad as f32,
            angular_size_confidence: object.existence as f32,
            confidence: object.existence as f32,
            sources: List(vec!["lidar".into()]),
            object_id: object.id as i16,
            ..PerceivedObject::default()
        }
    };
    Environment {
        valid_until: TimeStamp::from(valid_until),
        objects: List(objects.iter().map(message).collect()),
    }
}

/// An object as seen from the sensor, which looks along y.
pub(super) struct Sight {
    /// In the sensor frame.
    pub(super) position_m: [f64; 3],
    pub(super) azimuth_rad: f64,
    pub(super) zenith_rad: f64,
    pub(super) distance_m: f64,
    pub(super) width_rad: f64,
    pub(super) height_rad: f64,
}

impl Sight {
    pub(super) fn of(object: &Object, sensor: &Pose) -> Self {
        let [east_m, north_m, up_m] = object.centre_m;
        let [x, y] = sensor.placement().sensor_m([east_m, north_m]);
        let z = up_m - sensor.position_m[2];
        let horizontal_m = libm::hypot(x, y);
        let distance_m = libm::hypot(horizontal_m, z);
        // How wide the box appears: its shadow across the line of sight.
        let [sensor_x, sensor_y, _] = sensor.position_m;
        let turn_rad = object.yaw_rad - libm::atan2(north_m - sensor_y, east_m - sensor_x);
        let across_m = object.length_m * libm::fabs(libm::sin(turn_rad))
            + object.width_m * libm::fabs(libm::cos(turn_rad));
        let seen_under = |size_m: f64| 2.0 * libm::atan2(0.5 * size_m, distance_m.max(0.1));
        Self {
            position_m: [x, y, z],
            azimuth_rad: libm::atan2(-x, y),
            zenith_rad: libm::atan2(z, horizontal_m),
            distance_m,
            width_rad: seen_under(across_m),
            height_rad: seen_under(object.height_m),
        }
    }
}
