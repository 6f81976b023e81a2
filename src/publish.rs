//! Last step: objects become messages, and messages the frames that are sent.

mod other_sets;

mod roundabout;

use crate::ego::{Pose, Sweep};
use crate::grid::Grid;
use crate::parameter::{choices, parameters};
use crate::roundabout::Advice;
use crate::time::{Span, Time};
use crate::track::Object;
use crate::wire::envelope::Postmark;
use crate::wire::message::List;
use crate::wire::object_list::ObjectList;
use crate::wire::roundabout::Roundabout;
use crate::wire::{Message, object_list};
use other_sets::{Sight, environment_of};

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
        /// kreisel.Object 2020: each object of the list by itself as well, for tools that read plain fields alone.
        single_objects: bool = true, thesis false, "";
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
            if self.parameters.single_objects {
                list.objects
                    .0
                    .iter()
                    .for_each(|one| self.put(&postmark, one));
            }
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
        let expected = [&[2021, 2020, 2020, 1128][..], &each, &each, &[1129, 189]].concat();
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
