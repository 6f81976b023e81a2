//! Bytes that real peers wrote decode to the values that they wrote, and are written back
//! byte for byte: the golden envelopes of libcluon and OpenDaVINCI, envelopes from before 2017, and
//! recordings of real device services.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use kreisel::cloud::shown_order;
use kreisel::wire::envelope::Postmark;
use kreisel::wire::environment::{Direction, Environment, PerceivedObject};
use kreisel::wire::message::List;
use kreisel::wire::opendlv::{
    ObjectAngularBlob, ObjectAnnouncement, ObjectDirection, ObjectDistance, ObjectFrameEnd,
    ObjectFrameStart, ObjectPosition, ObjectType,
};
use kreisel::wire::point_cloud::{
    ByteOrder, CompactPointCloud, DistanceEncoding, IntensityPlacement, POINT_CLOUD_ID, Schema,
};
use kreisel::wire::pose::{
    AngularVelocityReading, ApplanixGroup1, GeodeticHeadingReading, GeodeticWgs84Reading,
    Geolocation, GroundSpeedReading, SimulationFrame,
};
use kreisel::wire::protobuf::{Reader, Value, unzigzag};
use kreisel::wire::{Envelope, Message, Recording, TimeStamp, known_name};
use serde_json::Value as Json;
use std::fmt::Debug;

/// The content of a file of test data; `None` where the data is absent.
fn bytes(name: &str) -> Option<Vec<u8>> {
    let path = common::data(name)?;
    Some(std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
}

/// A JSON file of the test data; `None` where the data is absent.
fn json(name: &str) -> Option<Json> {
    Some(serde_json::from_slice(&bytes(name)?).unwrap())
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn unhex(text: &str) -> Vec<u8> {
    let digits = text.as_bytes().chunks(2);
    digits
        .map(|two| u8::from_str_radix(std::str::from_utf8(two).unwrap(), 16).unwrap())
        .collect()
}

fn time_stamp(pair: &Json) -> TimeStamp {
    let part = |index: usize| i32::try_from(pair[index].as_i64().unwrap()).unwrap();
    TimeStamp {
        seconds: part(0),
        microseconds: part(1),
    }
}

/// An entry of golden.json with the bytes of its files.
struct Golden {
    name: String,
    entry: Json,
    frame: Vec<u8>,
    payload: Vec<u8>,
}

impl Golden {
    fn read(entry: Json) -> Self {
        let stated = |key: &str| unhex(entry[key].as_str().unwrap());
        let (frame, payload) = (stated("hex"), stated("payload_hex"));
        for (key, stated) in [("file", &frame), ("payload_file", &payload)] {
            if let Some(file) = entry[key].as_str() {
                assert_eq!(&bytes(file).unwrap(), stated, "{file}");
            }
        }
        Self {
            name: entry["name"].as_str().unwrap().into(),
            frame,
            payload,
            entry,
        }
    }

    /// Those of the package, which scripts/golden makes, and those of the shared data where it is there.
    fn all() -> Vec<Self> {
        let own = serde_json::from_str(include_str!("golden/golden.json")).unwrap();
        let lists = [Some(own), json("golden.json")].into_iter().flatten();
        lists
            .flat_map(|list| match list {
                Json::Array(entries) => entries,
                other => panic!("no list: {other}"),
            })
            .map(Self::read)
            .collect()
    }

    /// How many of all there must be, of so many in the package and so many in the shared data.
    fn expected(own: usize, shared: usize) -> usize {
        own + json("golden.json").map_or(0, |_| shared)
    }

    fn fields(&self) -> &[Json] {
        self.entry["fields"].as_array().unwrap()
    }

    fn envelope(&self) -> Envelope<'_> {
        let (envelope, rest) = Envelope::from_datagram(&self.frame).unwrap();
        assert_eq!(rest, 0, "{}", self.name);
        envelope
    }

    fn is_received(&self) -> bool {
        self.envelope().received != TimeStamp::default()
    }

    fn postmark(&self) -> Postmark {
        let envelope = self.envelope();
        Postmark {
            sent: envelope.sent.time(),
            sampled: envelope.sample_time_stamp.time(),
            sender_stamp: envelope.sender_stamp,
        }
    }
}

#[test]
fn every_golden_frame_decodes_to_the_stated_envelope() {
    let all = Golden::all();
    assert_eq!(all.len(), Golden::expected(83, 50));
    for golden in &all {
        let (envelope, stated) = (golden.envelope(), &golden.entry["envelope"]);
        let expected = Envelope {
            data_type: stated["dataType"].as_i64().unwrap() as i32,
            payload: &golden.payload,
            payload_offset: envelope.payload_offset,
            sent: time_stamp(&stated["sent"]),
            received: time_stamp(&stated["received"]),
            sample_time_stamp: time_stamp(&stated["sampleTimeStamp"]),
            sender_stamp: u32::try_from(stated["senderStamp"].as_u64().unwrap()).unwrap(),
        };
        assert_eq!(envelope, expected, "{}", golden.name);
        assert_eq!(golden.entry["message_id"], expected.data_type);
        assert_eq!(golden.entry["hex"], hex(&golden.frame), "{}", golden.name);
        assert!(golden.frame[envelope.payload_offset..].starts_with(&golden.payload));
    }
}

#[test]
fn every_golden_payload_holds_the_stated_fields_and_no_others() {
    for golden in &Golden::all() {
        let payload = golden.envelope().payload;
        check_message(payload, golden.fields(), &golden.name);
    }
}

#[test]
fn every_golden_frame_is_written_again_around_its_payload() {
    let (all, mut written) = (Golden::all(), 0);
    for golden in all.iter().filter(|golden| !golden.is_received()) {
        let mut out = vec![];
        let data_type = golden.envelope().data_type;
        golden
            .postmark()
            .put_payload(&mut out, data_type, |out| out.extend(&golden.payload));
        assert_eq!(hex(&out), hex(&golden.frame), "{}", golden.name);
        written += 1;
    }
    assert_eq!(written, Golden::expected(83, 49));
}

/// Checks fields in their order, each by its stated type.
fn check_message(payload: &[u8], fields: &[Json], at: &str) {
    let mut reader = Reader::new(payload, 0);
    for stated in fields {
        let at = format!("{at}.{}", stated["name"]);
        let field = reader.next_field().unwrap().expect(&at);
        assert_eq!(stated["id"], field.id, "{at}");
        assert_eq!(stated["wire_type"], wire_type(field.value), "{at}");
        let kind = stated["type"].as_str().unwrap();
        check_value(field.value, kind, &stated["value"], &at);
    }
    assert_eq!(reader.next_field(), Ok(None), "{at}");
}

fn wire_type(value: Value<'_>) -> u8 {
    match value {
        Value::Varint(_) => 0,
        Value::Fixed64(_) => 1,
        Value::Bytes(_) => 2,
        Value::Fixed32(_) => 5,
    }
}

fn check_value(value: Value<'_>, kind: &str, stated: &Json, at: &str) {
    match value {
        Value::Varint(raw) => check_varint(raw, kind, stated, at),
        Value::Fixed32(raw) => {
            let stated = stated.as_f64().unwrap() as f32;
            assert_eq!((kind, raw), ("float", stated.to_le_bytes()), "{at}");
        }
        Value::Fixed64(raw) => {
            let stated = stated.as_f64().unwrap();
            assert_eq!((kind, raw), ("double", stated.to_le_bytes()), "{at}");
        }
        Value::Bytes(raw) => check_bytes(raw, kind, stated, at),
    }
}

fn check_varint(raw: u64, kind: &str, stated: &Json, at: &str) {
    match kind {
        "bool" => assert_eq!(stated.as_bool(), Some(raw == 1), "{at} {raw}"),
        "char" => {
            assert_eq!(stated["varint"].as_u64(), Some(raw), "{at}");
            assert_eq!(
                stated["char_code"].as_u64(),
                Some(u64::from(raw as u8)),
                "{at}"
            );
        }
        "uint8" | "uint16" | "uint32" | "uint64" => {
            assert!(fits(raw, &kind[4..]), "{at} {raw}");
            assert_eq!(stated.as_u64(), Some(raw), "{at}");
        }
        "int8" | "int16" | "int32" | "int64" => {
            assert!(fits(raw, &kind[3..]), "{at} {raw}");
            assert_eq!(stated.as_i64(), Some(unzigzag(raw)), "{at}");
        }
        "enum" => check_varint(raw, "int32", stated, at),
        other => panic!("{at}: a varint for {other}"),
    }
}

/// Whether a varint has no bits above its type's width.
fn fits(raw: u64, width: &str) -> bool {
    raw.checked_shr(width.parse().unwrap()).unwrap_or(0) == 0
}

fn check_bytes(raw: &[u8], kind: &str, stated: &Json, at: &str) {
    if let Some(element) = kind
        .strip_prefix("list<")
        .and_then(|rest| rest.strip_suffix('>'))
    {
        return check_list(raw, element, stated.as_array().unwrap(), at);
    }
    if let Some((element, length)) = kind.strip_suffix(']').and_then(|kind| kind.split_once('[')) {
        let stated = stated.as_array().unwrap();
        assert_eq!(stated.len().to_string(), length, "{at}");
        return check_packed(raw, element, stated, at);
    }
    match kind {
        "string" => assert_eq!(stated.as_str().unwrap().as_bytes(), raw, "{at}"),
        "bytes" => assert_eq!(stated["hex"], hex(raw), "{at}"),
        "map<string,string>" => check_map(raw, stated.as_array().unwrap(), at),
        _ => check_message(raw, stated.as_array().unwrap(), at),
    }
}

fn is_scalar(kind: &str) -> bool {
    let scalars = ["bool", "char", "enum", "float", "double"];
    let (integer, width) = kind.split_at(kind.find(char::is_numeric).unwrap_or(0));
    scalars.contains(&kind)
        || matches!((integer, width), ("int" | "uint", "8" | "16" | "32" | "64"))
}

/// Numbers end to end; strings and messages each with its length before it.
fn check_list(raw: &[u8], element: &str, stated: &[Json], at: &str) {
    if is_scalar(element) {
        return check_packed(raw, element, stated, at);
    }
    let mut reader = Reader::new(raw, 0);
    for stated in stated {
        let body = reader.length_delimited().unwrap();
        check_bytes(body, element, stated, at);
    }
    assert!(reader.is_empty(), "{at}");
}

fn check_packed(raw: &[u8], element: &str, stated: &[Json], at: &str) {
    if element == "float" {
        let (fours, rest) = raw.as_chunks::<4>();
        assert_eq!((fours.len(), rest.len()), (stated.len(), 0), "{at}");
        for (four, stated) in fours.iter().zip(stated) {
            check_value(Value::Fixed32(*four), element, stated, at);
        }
        return;
    }
    let mut reader = Reader::new(raw, 0);
    for stated in stated {
        check_varint(reader.varint().unwrap(), element, stated, at);
    }
    assert!(reader.is_empty(), "{at}");
}

/// A map is a list of messages with key and value.
fn check_map(raw: &[u8], stated: &[Json], at: &str) {
    let mut reader = Reader::new(raw, 0);
    for stated in stated {
        let mut pair = Reader::new(reader.length_delimited().unwrap(), 0);
        for (id, key) in [(1, "key"), (2, "value")] {
            let field = pair.next_field().unwrap().unwrap();
            assert_eq!(field.id, id, "{at}");
            check_value(field.value, "string", &stated[key], at);
        }
        assert!(pair.is_empty(), "{at}");
    }
    assert!(reader.is_empty(), "{at}");
}

#[test]
fn every_golden_message_with_a_type_decodes_to_the_stated_values_and_back_to_its_bytes() {
    let all = Golden::all();
    let typed = all.iter().filter(|golden| check_typed(golden)).count();
    assert_eq!(typed, Golden::expected(78, 38));
}

/// Whether the crate has a type for the message, which is then checked.
fn check_typed(golden: &Golden) -> bool {
    match golden.envelope().data_type {
        POINT_CLOUD_ID => check_cloud(golden),
        TimeStamp::ID => check_both_ways::<TimeStamp>(golden),
        ApplanixGroup1::ID => check_decoding::<ApplanixGroup1>(golden),
        GeodeticWgs84Reading::ID => check_both_ways::<GeodeticWgs84Reading>(golden),
        GeodeticHeadingReading::ID => check_both_ways::<GeodeticHeadingReading>(golden),
        GroundSpeedReading::ID => check_both_ways::<GroundSpeedReading>(golden),
        AngularVelocityReading::ID => check_both_ways::<AngularVelocityReading>(golden),
        Geolocation::ID => check_both_ways::<Geolocation>(golden),
        SimulationFrame::ID => check_both_ways::<SimulationFrame>(golden),
        ObjectFrameStart::ID => check_both_ways::<ObjectFrameStart>(golden),
        ObjectFrameEnd::ID => check_both_ways::<ObjectFrameEnd>(golden),
        ObjectAnnouncement::ID => check_both_ways::<ObjectAnnouncement>(golden),
        ObjectType::ID => check_both_ways::<ObjectType>(golden),
        ObjectDirection::ID => check_both_ways::<ObjectDirection>(golden),
        ObjectDistance::ID => check_both_ways::<ObjectDistance>(golden),
        ObjectAngularBlob::ID => check_both_ways::<ObjectAngularBlob>(golden),
        ObjectPosition::ID => check_both_ways::<ObjectPosition>(golden),
        PerceivedObject::ID => check_both_ways::<PerceivedObject>(golden),
        Environment::ID => check_both_ways::<Environment>(golden),
        untyped => {
            assert_eq!(known_name(untyped), None, "{}", golden.name);
            return false;
        }
    }
    true
}

fn check_decoding<M: Message + FromFields + PartialEq + Debug>(golden: &Golden) {
    let expected = M::from_fields(golden.fields());
    assert_eq!(golden.entry["message_name"], M::NAME, "{}", golden.name);
    assert_eq!(
        M::decode(&golden.payload, 0),
        Ok(expected),
        "{}",
        golden.name
    );
}

fn check_both_ways<M: Message + FromFields + PartialEq + Debug>(golden: &Golden) {
    check_decoding::<M>(golden);
    let message = M::from_fields(golden.fields());
    let mut payload = vec![];
    message.encode(&mut payload);
    assert_eq!(hex(&payload), hex(&golden.payload), "{}", golden.name);
    if !golden.is_received() {
        let mut frame = vec![];
        golden.postmark().put(&mut frame, &message);
        assert_eq!(hex(&frame), hex(&golden.frame), "{}", golden.name);
    }
}

fn check_cloud(golden: &Golden) {
    let distances = blob(golden.fields(), "distances");
    let azimuth_angles = match golden.fields().last().unwrap()["type"].as_str() {
        Some("bytes") => blob(golden.fields(), "azimuthAngles"),
        _ => vec![],
    };
    let expected = CompactPointCloud {
        start_azimuth_deg: get(golden.fields(), "startAzimuth"),
        end_azimuth_deg: get(golden.fields(), "endAzimuth"),
        layers: get(golden.fields(), "entriesPerAzimuth"),
        distances: &distances,
        intensity_bits: get(golden.fields(), "numberOfBitsForIntensity"),
        schema: stated_schema(golden.fields(), &azimuth_angles),
    };
    let decoded = CompactPointCloud::decode(&golden.payload, 0);
    assert_eq!(decoded, Ok(expected), "{}", golden.name);
    let mut payload = vec![];
    expected.encode(&mut payload);
    assert_eq!(hex(&payload), hex(&golden.payload), "{}", golden.name);
}

/// The schema by the names that golden.json gives fields 6 and 7.
fn stated_schema<'a>(fields: &[Json], azimuth_angles: &'a [u8]) -> Schema<'a> {
    let names: Vec<_> = fields
        .iter()
        .filter_map(|field| field["name"].as_str())
        .collect();
    match names[5..] {
        ["intensityPlacement", "distanceEncoding"] => Schema::OpenDaVinci {
            placement: match get::<i32>(fields, "intensityPlacement") {
                0 => IntensityPlacement::Higher,
                1 => IntensityPlacement::Lower,
                other => panic!("placement {other}"),
            },
            encoding: match get::<i32>(fields, "distanceEncoding") {
                0 => DistanceEncoding::Centimetre,
                1 => DistanceEncoding::TwoMillimetres,
                other => panic!("encoding {other}"),
            },
        },
        ["typeOfVerticalAngularLayout", "azimuthAngles"] => Schema::OpenDlv {
            vertical_layout: get(fields, "typeOfVerticalAngularLayout"),
            azimuth_angles,
        },
        _ => panic!("{names:?}"),
    }
}

/// The value of a field in golden.json.
fn stated<'a>(fields: &'a [Json], name: &str) -> &'a Json {
    let field = fields.iter().find(|field| field["name"] == name);
    &field.unwrap_or_else(|| panic!("no {name}"))["value"]
}

fn get<T: FromStated>(fields: &[Json], name: &str) -> T {
    T::from_stated(stated(fields, name))
}

fn blob(fields: &[Json], name: &str) -> Vec<u8> {
    unhex(stated(fields, name)["hex"].as_str().unwrap())
}

/// A field's type, made from a value in golden.json.
trait FromStated {
    fn from_stated(stated: &Json) -> Self;
}

macro_rules! from_stated {
    ($($type:ty, $stated:ident => $value:expr;)*) => {$(
        impl FromStated for $type {
            fn from_stated($stated: &Json) -> Self {
                $value
            }
        }
    )*};
}

from_stated! {
    f32, stated => stated.as_f64().unwrap() as f32;
    f64, stated => stated.as_f64().unwrap();
    u8, stated => u8::try_from(stated.as_u64().unwrap()).unwrap();
    u32, stated => u32::try_from(stated.as_u64().unwrap()).unwrap();
    i16, stated => i16::try_from(stated.as_i64().unwrap()).unwrap();
    i32, stated => i32::try_from(stated.as_i64().unwrap()).unwrap();
    String, stated => stated.as_str().unwrap().into();
}

impl<T: FromStated> FromStated for List<T> {
    fn from_stated(stated: &Json) -> Self {
        List(
            stated
                .as_array()
                .unwrap()
                .iter()
                .map(T::from_stated)
                .collect(),
        )
    }
}

/// A message, made from its fields in golden.json.
trait FromFields {
    fn from_fields(fields: &[Json]) -> Self;
}

macro_rules! from_fields {
    ($($type:ident { $($field:ident = $name:literal),* $(,)? })*) => {$(
        impl FromFields for $type {
            fn from_fields(fields: &[Json]) -> Self {
                Self { $($field: get(fields, $name)),* }
            }
        }

        impl FromStated for $type {
            fn from_stated(stated: &Json) -> Self {
                Self::from_fields(stated.as_array().unwrap())
            }
        }
    )*};
}

from_fields! {
    TimeStamp { seconds = "seconds", microseconds = "microseconds" }
    GeodeticWgs84Reading { latitude = "latitude", longitude = "longitude" }
    GeodeticHeadingReading { north_heading = "northHeading" }
    GroundSpeedReading { ground_speed = "groundSpeed" }
    AngularVelocityReading {
        angular_velocity_x = "angularVelocityX",
        angular_velocity_y = "angularVelocityY",
        angular_velocity_z = "angularVelocityZ",
    }
    Geolocation {
        latitude = "latitude",
        longitude = "longitude",
        altitude = "altitude",
        heading = "heading",
    }
    SimulationFrame { x = "x", y = "y", z = "z", roll = "roll", pitch = "pitch", yaw = "yaw" }
    ApplanixGroup1 {
        lat = "lat",
        lon = "lon",
        alt = "alt",
        vel_north = "vel_north",
        vel_east = "vel_east",
        vel_down = "vel_down",
        roll = "roll",
        pitch = "pitch",
        heading = "heading",
        wander = "wander",
        track = "track",
        speed = "speed",
        arate_lon = "arate_lon",
        arate_trans = "arate_trans",
        arate_down = "arate_down",
        accel_lon = "accel_lon",
        accel_trans = "accel_trans",
        accel_down = "accel_down",
    }
    ObjectFrameStart { object_frame_id = "objectFrameId" }
    ObjectFrameEnd { object_frame_id = "objectFrameId" }
    ObjectAnnouncement { object_id = "objectId" }
    ObjectType { object_id = "objectId", kind = "type" }
    ObjectDirection {
        object_id = "objectId",
        azimuth_angle = "azimuthAngle",
        zenith_angle = "zenithAngle",
    }
    ObjectDistance { object_id = "objectId", distance = "distance" }
    ObjectAngularBlob { object_id = "objectId", width = "width", height = "height" }
    Direction { azimuth = "azimuth", zenith = "zenith" }
    PerceivedObject {
        identified = "identified",
        kind = "type",
        type_confidence = "typeConfidence",
        direction = "direction",
        direction_confidence = "directionConfidence",
        direction_rate = "directionRate",
        direction_rate_confidence = "directionRateConfidence",
        distance = "distance",
        distance_confidence = "distanceConfidence",
        angular_size = "angularSize",
        angular_size_confidence = "angularSizeConfidence",
        angular_size_rate = "angularSizeRate",
        angular_size_rate_confidence = "angularSizeRateConfidence",
        confidence = "confidence",
        sources = "sources",
        properties = "properties",
        object_id = "objectId",
    }
    ObjectPosition { object_id = "objectId", x = "x", y = "y", z = "z" }
    Environment { valid_until = "validUntil", objects = "objects" }
}

/// The distance in centimetres that legacy.json gives a cell.
fn legacy_cell_cm(column: usize, layer: usize) -> u16 {
    if (column + layer).is_multiple_of(7) {
        return 0;
    }
    u16::try_from(1000 + column + 100 * layer).unwrap()
}

fn check_legacy_cloud(envelope: &Envelope<'_>, columns: usize) {
    assert_eq!(envelope.data_type, POINT_CLOUD_ID);
    let cloud = CompactPointCloud::decode(envelope.payload, envelope.payload_offset).unwrap();
    assert_eq!(
        (cloud.layers, cloud.columns(), cloud.schema),
        (16, columns, Schema::Bare)
    );
    assert_eq!(
        (cloud.intensity_bits, cloud.distances.len()),
        (0, columns * 32)
    );
    let order = shown_order(&cloud).unwrap();
    assert_eq!(order, ByteOrder::Little);
    let (cells, _) = cloud.distances.as_chunks::<2>();
    for (index, cell) in cells.iter().enumerate() {
        assert_eq!(
            order.join(*cell),
            legacy_cell_cm(index / 16, index % 16),
            "cell {index}"
        );
    }
}

/// The thesis' simulation sends no receiving time, no sampling time and no sender.
fn check_dvnode(envelope: &Envelope<'_>) {
    let left_out = (
        envelope.received,
        envelope.sample_time_stamp,
        envelope.sender_stamp,
    );
    assert_eq!(left_out, (TimeStamp::default(), TimeStamp::default(), 0));
    assert_eq!(envelope.time(), envelope.sent.time());
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn the_point_cloud_of_the_thesis_simulation_is_read_in_little_endian() {
    let Some(frame) = bytes("legacy/dvnode_cpc_49_le.bin") else {
        return;
    };
    let (envelope, rest) = Envelope::from_datagram(&frame).unwrap();
    check_dvnode(&envelope);
    check_legacy_cloud(&envelope, 1803);
    let cloud = CompactPointCloud::decode(envelope.payload, 0).unwrap();
    assert_eq!(
        (cloud.start_azimuth_deg, cloud.end_azimuth_deg, rest),
        (0.0, 360.0, 0)
    );
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn the_point_cloud_of_opendavinci_before_2017_is_read_in_little_endian() {
    const YEAR_2016: std::ops::Range<i32> = 1_451_606_400..1_483_228_800;
    let Some(frame) = bytes("legacy/od4_2016_cpc_49_le.bin") else {
        return;
    };
    let (envelope, rest) = Envelope::from_datagram(&frame).unwrap();
    check_legacy_cloud(&envelope, 100);
    assert!(YEAR_2016.contains(&envelope.sample_time_stamp.seconds));
    assert_eq!((envelope.sender_stamp, rest), (0, 0));
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn the_pose_of_the_thesis_simulation_has_its_four_values_and_no_others() {
    let Some(frame) = bytes("legacy/dvnode_grp1data_533.bin") else {
        return;
    };
    let (envelope, rest) = Envelope::from_datagram(&frame).unwrap();
    check_dvnode(&envelope);
    let expected = ApplanixGroup1 {
        lat: 12.5,
        lon: -3.25,
        roll: 1234.0,
        heading: -87.5,
        ..ApplanixGroup1::default()
    };
    assert_eq!((envelope.data_type, rest), (ApplanixGroup1::ID, 0));
    assert_eq!(ApplanixGroup1::decode(envelope.payload, 0), Ok(expected));
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn the_session_of_the_thesis_simulation_holds_both_of_its_messages() {
    let Some(session) = bytes("legacy/dvnode_session.rec") else {
        return;
    };
    let frames: Vec<_> = Recording::new(&session)
        .map(|entry| entry.unwrap().frame)
        .collect();
    let files = ["dvnode_cpc_49_le.bin", "dvnode_grp1data_533.bin"];
    let mut expected = files.map(|name| bytes(&format!("legacy/{name}")).unwrap());
    expected.sort();
    let mut found: Vec<_> = frames.iter().map(|frame| frame.to_vec()).collect();
    found.sort();
    assert_eq!(found, expected);
}

const TEST_RECORDING: &str = "legacy/OpenDaVINCITestData-recording.rec";

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn the_test_recording_of_opendavinci_has_five_envelopes_without_times() {
    let Some(recording) = bytes(TEST_RECORDING) else {
        return;
    };
    let entries: Vec<_> = Recording::new(&recording).map(Result::unwrap).collect();
    let ids: Vec<_> = entries
        .iter()
        .map(|entry| entry.envelope.data_type)
        .collect();
    assert_eq!(ids, [1005, 1005, 1002, 1006, 1007]);
    for entry in &entries {
        check_dvnode(&entry.envelope);
        assert!(entry.envelope.time().is_zero());
    }
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn the_test_recording_of_opendavinci_holds_its_scalars_and_lists() {
    let Some(recording) = bytes(TEST_RECORDING) else {
        return;
    };
    let stated: Json = serde_json::from_str(TEST_MESSAGES).unwrap();
    for entry in Recording::new(&recording).map(Result::unwrap) {
        let fields = stated[entry.envelope.data_type.to_string()]
            .as_array()
            .unwrap();
        let mut reader = Reader::new(entry.envelope.payload, 0);
        for field in fields {
            let found = reader.next_field().unwrap().unwrap();
            assert_eq!(field[0], found.id);
            check_value(
                found.value,
                field[1].as_str().unwrap(),
                &field[2],
                TEST_RECORDING,
            );
        }
        assert!(reader.is_empty());
    }
}

/// Number, type and value of the fields of OpenDaVINCI's test messages, by message.
const TEST_MESSAGES: &str = r#"{
    "1002": [[1, "uint8", 60], [2, "int8", -60]],
    "1005": [
        [1, "uint8", 3], [2, "int8", -3], [3, "uint16", 103], [4, "int16", -103],
        [5, "uint32", 10003], [6, "int32", -10003], [7, "uint64", 54321], [8, "int64", -54321],
        [9, "float", -5.4321], [10, "double", -50.4321],
        [11, "string", "Hello OpenDaVINCI World!"],
        [12, "TestMessage1", [
            {"id": 1, "name": "field", "type": "uint32", "wire_type": 0, "value": 150}
        ]]
    ],
    "1006": [[4, "list<uint32>", [3, 270, 86942]]],
    "1007": [[1, "float[3]", [-12.345, -34.567, 47.891]]]
}"#;

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn every_listed_recording_holds_the_listed_revolutions() {
    let Some(listed) = json("revolutions.json") else {
        return;
    };
    for (name, recording) in listed.as_object().unwrap() {
        let bytes = bytes(name).unwrap();
        let entries: Vec<_> = Recording::new(&bytes).map(Result::unwrap).collect();
        let listed = recording["envelopes"].as_array().unwrap();
        assert_eq!(entries.len(), listed.len(), "{name}");
        for (entry, listed) in entries.iter().zip(listed) {
            assert_eq!(listed["envelope_bytes"], entry.frame.len(), "{name}");
            check_listed_envelope(&entry.envelope, listed);
            check_listed_cloud(&entry.envelope, listed);
        }
    }
}

fn check_listed_envelope(envelope: &Envelope<'_>, listed: &Json) {
    assert_eq!(envelope.data_type, POINT_CLOUD_ID);
    assert_eq!(envelope.sent, time_stamp(&listed["sent"]));
    assert_eq!(envelope.received, time_stamp(&listed["received"]));
    assert_eq!(envelope.sample_time_stamp, time_stamp(&listed["sample"]));
    assert_eq!(listed["senderStamp"], envelope.sender_stamp);
}

fn check_listed_cloud(envelope: &Envelope<'_>, listed: &Json) {
    let cloud = CompactPointCloud::decode(envelope.payload, envelope.payload_offset).unwrap();
    assert_eq!(
        f32::from_stated(&listed["startAzimuth"]),
        cloud.start_azimuth_deg
    );
    assert_eq!(
        f32::from_stated(&listed["endAzimuth"]),
        cloud.end_azimuth_deg
    );
    assert_eq!(listed["entriesPerAzimuth"], cloud.layers);
    assert_eq!(listed["columns"], cloud.columns());
    assert_eq!(listed["numberOfBitsForIntensity"], cloud.intensity_bits);
    assert_eq!(
        cloud.distances.len(),
        cloud.columns() * usize::from(cloud.layers) * 2
    );
    let expected = match listed["typeOfVerticalAngularLayout"].as_u64() {
        None => Schema::Bare,
        Some(layout) => Schema::OpenDlv {
            vertical_layout: layout as u8,
            azimuth_angles: &[],
        },
    };
    assert_eq!(cloud.schema, expected);
    assert_eq!(
        shown_order(&cloud).unwrap_or(ByteOrder::Big),
        ByteOrder::Big
    );
}
