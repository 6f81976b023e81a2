//! Last step: objects become messages, and messages the frames that are sent.

mod roundabout;

use crate::ego::{Pose, Sweep};
use crate::grid::Grid;
use crate::parameter::{choices, parameters};
use crate::roundabout::Advice;
use crate::time::{Span, Time};
use crate::track::Object;
use crate::wire::envelope::Postmark;
use crate::wire::environment::{Direction, Environment, PerceivedObject};
use crate::wire::message::List;
use crate::wire::object_list::ObjectList;
use crate::wire::roundabout::Roundabout;
use crate::wire::{Message, TimeStamp, object_list, opendlv};

choices! {
    /// Unit of angles in OpenDLV's object messages.
    pub enum AngleUnit {
        /// As the existing subscribers read them.
        Degrees = "degrees",
        /// As the message set says.
        Radians = "radians",
    }
}

parameters! {
    /// What is sent for each revolution.
    pub struct PublishParameters "publish" {
        /// kreisel.ObjectList 2021.
        object_list: bool = true, "";
        /// Objects in a list. Of more, the nearest are kept, and the list says how many were
        /// left out; 400 fill one datagram.
        most_objects: usize = 256, in 1..=400, "objects";
        /// OpenDLV's object messages 1128 to 1136, several for each object.
        opendlv: bool = false, "";
        /// Unit of ObjectDirection and ObjectAngularBlob. The message set says SI, existing
        /// subscribers read degrees.
        opendlv_angles: AngleUnit = AngleUnit::Degrees, "";
        /// OpenDaVINCI's opendlv.perception.Environment 189.
        environment: bool = false, "";
        /// How long an Environment is valid after its revolution.
        environment_validity_s: f64 = 0.2, in 0.0..=10.0, "s";
    }
}

/// Makes frames and keeps them until the next revolution.
#[derive(Debug, Clone)]
pub struct Publisher {
    parameters: PublishParameters,
    sender_stamp: u32,
    bytes: Vec<u8>,
    ends: Vec<usize>,
    /// The objects that are sent, and their list.
    kept: Vec<Object>,
    list: ObjectList,
    /// What is said of a roundabout beside it.
    roundabout: Roundabout,
}

/// What a revolution's messages say beside its objects.
#[derive(Debug, Clone, Copy)]
pub struct Heading<'a> {
    /// Number of the revolution.
    pub revolution: u32,
    /// End of its sweep.
    pub time: Time,
    /// When its messages are handed to the network.
    pub sent: Time,
    /// From the envelope in to the list out.
    pub processing_s: f32,
    /// Where the sensor and its vehicle were.
    pub sweep: &'a Sweep,
}

impl Publisher {
    /// A publisher for an instance of the service.
    pub fn new(parameters: &PublishParameters, sender_stamp: u32) -> Self {
        Self {
            parameters: parameters.clone(),
            sender_stamp,
            bytes: vec![],
            ends: vec![],
            kept: vec![],
            list: ObjectList::default(),
            roundabout: Roundabout::default(),
        }
    }

    /// The frames that were made last, in the order in which they are to be sent.
    pub fn frames(&self) -> impl Iterator<Item = &[u8]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts
            .zip(&self.ends)
            .map(|(start, end)| &self.bytes[start..*end])
    }

    /// Makes the frames of a revolution's objects.
    pub fn publish_objects(&mut self, heading: &Heading<'_>, objects: &[Object]) {
        self.bytes.clear();
        self.ends.clear();
        let mut kept = std::mem::take(&mut self.kept);
        keep_nearest(
            objects,
            self.parameters.most_objects,
            &heading.sweep.local_sensor(),
            &mut kept,
        );
        let postmark = Postmark {
            sent: heading.sent,
            sampled: heading.time,
            sender_stamp: self.sender_stamp,
        };
        if self.parameters.object_list {
            let mut list = std::mem::take(&mut self.list);
            fill_list(&mut list, heading, &kept, objects.len() - kept.len());
            self.put(&postmark, &list);
            self.list = list;
        }
        if self.parameters.opendlv {
            self.put_opendlv(&postmark, heading, &kept);
        }
        if self.parameters.environment {
            let validity = Span::from_seconds(self.parameters.environment_validity_s);
            self.put(
                &postmark,
                &environment_of(
                    heading.time + validity,
                    &kept,
                    &heading.sweep.local_sensor(),
                ),
            );
        }
        self.kept = kept;
    }

    /// Adds what is said of a roundabout to the frames of the same revolution.
    pub fn add_roundabout(&mut self, heading: &Heading<'_>, advice: &Advice) {
        let postmark = Postmark {
            sent: heading.sent,
            sampled: heading.time,
            sender_stamp: self.sender_stamp,
        };
        let mut message = std::mem::take(&mut self.roundabout);
        roundabout::fill(&mut message, heading.revolution, advice);
        self.put(&postmark, &message);
        self.roundabout = message;
    }

    /// Makes the frames of what is to be sent of the map after the revolution of a time.
    pub fn publish_map(&mut self, time: Time, sent: Time, sweep: &Sweep, grid: &mut Grid) {
        self.bytes.clear();
        self.ends.clear();
        let postmark = Postmark {
            sent,
            sampled: time,
            sender_stamp: self.sender_stamp,
        };
        grid.publish(time, sweep, |tile| self.put(&postmark, tile));
    }

    fn put<M: Message>(&mut self, postmark: &Postmark, message: &M) {
        postmark.put(&mut self.bytes, message);
        self.ends.push(self.bytes.len());
    }

    fn put_opendlv(&mut self, postmark: &Postmark, heading: &Heading<'_>, objects: &[Object]) {
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

/// Keeps the objects that a list has room for, in their order.
fn keep_nearest(objects: &[Object], most: usize, sensor: &Pose, kept: &mut Vec<Object>) {
    kept.clear();
    kept.extend_from_slice(objects);
    if kept.len() > most {
        let distance = |object: &Object| Sight::of(object, sensor).distance_m;
        kept.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        kept.truncate(most);
        kept.sort_by_key(|object| object.id);
    }
}

fn fill_list(list: &mut ObjectList, heading: &Heading<'_>, objects: &[Object], omitted: usize) {
    let message = |object: &Object| object_list::Object {
        object_id: object.id,
        classification: object.class.number(),
        class_probability: object.class_probability as f32,
        existence: object.existence as f32,
        measured: object.measured,
        x: object.centre_m[0],
        y: object.centre_m[1],
        z: object.centre_m[2],
        yaw: object.yaw_rad as f32,
        speed: object.speed_mps as f32,
        yaw_rate: object.yaw_rate_radps as f32,
        acceleration: 0.0,
        length: object.length_m as f32,
        width: object.width_m as f32,
        height: object.height_m as f32,
        x_deviation: object.position_deviation_m[0] as f32,
        y_deviation: object.position_deviation_m[1] as f32,
        yaw_deviation: object.yaw_deviation_rad as f32,
        speed_deviation: object.speed_deviation_mps as f32,
        age: (heading.time - object.first_seen).seconds() as f32,
        time_since_measurement: (heading.time - object.last_measured).seconds() as f32,
        number_of_points: object.points as u32,
    };
    let vehicle = heading.sweep.vehicle;
    let [ego_x, ego_y, ego_z] = vehicle.map_or([0.0; 3], |pose| pose.position_m);
    let mut messages = std::mem::take(&mut list.objects.0);
    messages.clear();
    messages.extend(objects.iter().map(message));
    let reference = heading.sweep.reference;
    *list = ObjectList {
        revolution: heading.revolution,
        frame: heading.sweep.frame.number(),
        ego_known: vehicle.is_some(),
        ego_x,
        ego_y,
        ego_z,
        ego_yaw: vehicle.map_or(0.0, |pose| pose.yaw_rad) as f32,
        count: objects.len() as u32,
        omitted: omitted as u32,
        processing_time: heading.processing_s,
        objects: List(messages),
        reference_latitude: reference.map_or(0.0, |place| place.latitude_deg),
        reference_longitude: reference.map_or(0.0, |place| place.longitude_deg),
    };
}

fn environment_of(valid_until: Time, objects: &[Object], sensor: &Pose) -> Environment {
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
struct Sight {
    /// In the sensor frame.
    position_m: [f64; 3],
    azimuth_rad: f64,
    zenith_rad: f64,
    distance_m: f64,
    width_rad: f64,
    height_rad: f64,
}

impl Sight {
    fn of(object: &Object, sensor: &Pose) -> Self {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::Profile;
    use crate::track::Class;
    use crate::wire::Envelope;
    use crate::wire::frame::MAX_DATAGRAM_LEN;

    fn object(id: u32, x: f64, y: f64) -> Object {
        Object {
            id,
            class: Class::Cyclist,
            class_probability: 0.9,
            measured: true,
            yaw_rate_radps: 0.1,
            last_measured: Time::from_micros(1),
            centre_m: [x, y, -1.0],
            yaw_rad: 1.0,
            speed_mps: 3.0,
            length_m: 4.0,
            width_m: 2.0,
            height_m: 1.5,
            position_deviation_m: [0.1; 2],
            yaw_deviation_rad: 0.1,
            speed_deviation_mps: 0.1,
            existence: 0.5,
            first_seen: Time::from_micros(1),
            seen_since: Time::from_micros(1),
            points: 70_000,
        }
    }

    const STILL: &Sweep = &Sweep::still(0);

    fn heading() -> Heading<'static> {
        Heading {
            sweep: STILL,
            revolution: 7,
            time: Time::from_micros(1_700_000_000_000_000),
            sent: Time::from_micros(1_700_000_000_010_000),
            processing_s: 0.002,
        }
    }

    fn publish(edit: impl Fn(&mut PublishParameters), objects: &[Object]) -> Publisher {
        let mut parameters = PublishParameters::profile(Profile::Default);
        edit(&mut parameters);
        let mut publisher = Publisher::new(&parameters, 42);
        publisher.publish_objects(&heading(), objects);
        publisher
    }

    fn ids(publisher: &Publisher) -> Vec<i32> {
        let data_type = |frame| Envelope::from_datagram(frame).unwrap().0.data_type;
        publisher.frames().map(data_type).collect()
    }

    #[test]
    fn an_empty_revolution_is_an_empty_list() {
        let publisher = publish(|_| {}, &[]);
        let frames: Vec<_> = publisher.frames().collect();
        let (envelope, _) = Envelope::from_datagram(frames[0]).unwrap();
        let list = ObjectList::decode(envelope.payload, 0).unwrap();
        assert_eq!((frames.len(), list.count, list.revolution), (1, 0, 7));
        assert_eq!(
            (envelope.sender_stamp, envelope.time()),
            (42, heading().time)
        );
    }

    #[test]
    fn opendlv_messages_stand_between_frame_start_and_end() {
        let all = |parameters: &mut PublishParameters| {
            (parameters.opendlv, parameters.environment) = (true, true);
        };
        let objects = [object(1, 1.0, 2.0), object(2, 3.0, 4.0)];
        let each = [1130, 1131, 1133, 1134, 1135, 1136];
        let expected = [&[2021, 1128][..], &each, &each, &[1129, 189]].concat();
        assert_eq!(ids(&publish(all, &objects)), expected);
    }

    #[test]
    fn an_object_to_the_left_has_a_positive_azimuth() {
        let sight = Sight::of(&object(1, -5.0, 5.0), &Pose::SENSOR);
        assert!((sight.azimuth_rad.to_degrees() - 45.0).abs() < 1e-9);
        assert!(sight.zenith_rad < 0.0);
    }

    #[test]
    fn the_longest_list_fits_a_datagram_and_says_what_it_left_out() {
        let objects: Vec<_> = (0..1000)
            .map(|id| object(u32::MAX - 1000 + id, f64::from(id), 1.0))
            .collect();
        let publisher = publish(|parameters| parameters.most_objects = 400, &objects);
        let frame = publisher.frames().next().unwrap();
        let (envelope, _) = Envelope::from_datagram(frame).unwrap();
        let list = ObjectList::decode(envelope.payload, 0).unwrap();
        assert!(frame.len() <= MAX_DATAGRAM_LEN, "{}", frame.len());
        assert_eq!((list.count, list.omitted), (400, 600));
        assert_eq!(list.objects.0[399].x, 399.0);
    }
}
