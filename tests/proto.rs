//! `proto/` says what the code does: the message tables, field by field, and our bytes decoded
//! by an independent protobuf implementation from `proto/kreisel.proto`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use kreisel::wire::environment::Environment;
use kreisel::wire::grid_tile::{GridTile, encode_cells};
use kreisel::wire::message::List;
use kreisel::wire::object_list::{Object, ObjectList};
use kreisel::wire::opendlv::{
    ObjectAngularBlob, ObjectAnnouncement, ObjectDirection, ObjectDistance, ObjectFrameEnd,
    ObjectFrameStart, ObjectPosition, ObjectType,
};
use kreisel::wire::roundabout::{
    ConflictWindow, LaneUser, Roundabout, RoundaboutArm, RoundaboutRing,
};
use kreisel::wire::status::Status;
use kreisel::wire::{FieldDescription, Message};
use prost_reflect::{DescriptorPool, DynamicMessage, Value};

/// A message of an .odvd: name, id, fields as (number, name, type).
type Described = (String, i32, Vec<(u32, String, String)>);

fn odvd_messages() -> Vec<Described> {
    messages_of(include_str!("../proto/kreisel.odvd"))
}

fn messages_of(text: &str) -> Vec<Described> {
    let mut messages: Vec<Described> = vec![];
    let number = |line: &str| -> String {
        let from = line.find("id = ").unwrap() + 5;
        line[from..]
            .chars()
            .take_while(char::is_ascii_digit)
            .collect()
    };
    for line in text.lines().map(str::trim) {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["message", name, ..] => {
                messages.push((name.into(), number(line).parse().unwrap(), vec![]));
            }
            [kind, name, "[id", ..] if !line.starts_with("//") => {
                let field = (number(line).parse().unwrap(), name.into(), kind.into());
                messages.last_mut().unwrap().2.push(field);
            }
            _ => {}
        }
    }
    messages
}

fn table<M: Message>() -> Described {
    let field = |field: &FieldDescription| (field.id, field.name.into(), field.kind.into());
    (M::NAME.into(), M::ID, M::FIELDS.iter().map(field).collect())
}

#[test]
fn the_odvd_lists_every_field_of_every_message_that_is_published() {
    let expected = [
        table::<Object>(),
        table::<ObjectList>(),
        table::<GridTile>(),
        table::<Status>(),
        table::<RoundaboutArm>(),
        table::<ConflictWindow>(),
        table::<LaneUser>(),
        table::<RoundaboutRing>(),
        table::<Roundabout>(),
    ];
    assert_eq!(odvd_messages(), expected);
}

#[test]
fn the_odvd_of_the_opendlv_set_lists_every_field_of_every_message_of_it_that_is_published() {
    let expected = [
        table::<ObjectFrameStart>(),
        table::<ObjectFrameEnd>(),
        table::<ObjectAnnouncement>(),
        table::<ObjectType>(),
        table::<ObjectDirection>(),
        table::<ObjectDistance>(),
        table::<ObjectAngularBlob>(),
        table::<ObjectPosition>(),
        table::<Environment>(),
    ];
    // The set's own names are not ours, and what is a message within one is bytes to its tools.
    let places = |messages: Vec<Described>| -> Vec<_> {
        let without_names = |(name, id, fields): Described| {
            let kinds = fields.into_iter().map(|(number, _, kind)| {
                let is_message = kind.contains('.');
                (number, if is_message { "bytes".into() } else { kind })
            });
            (name, id, kinds.collect::<Vec<_>>())
        };
        messages.into_iter().map(without_names).collect()
    };
    let found = messages_of(include_str!("../proto/opendlv.odvd"));
    assert_eq!(places(found), places(expected.into()));
}

fn pool() -> DescriptorPool {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/proto");
    let descriptors = protox::compile(["kreisel.proto"], [folder]).unwrap();
    DescriptorPool::from_file_descriptor_set(descriptors).unwrap()
}

#[test]
fn the_proto_has_the_same_fields_in_the_same_places() {
    let pool = pool();
    for (name, _, fields) in odvd_messages() {
        let message = pool.get_message_by_name(&name).unwrap();
        let mut found: Vec<_> = message
            .fields()
            .map(|field| {
                (
                    field.number(),
                    field.name().to_string(),
                    // Protobuf has a name of its own for zigzag.
                    format!("{:?}", field.kind())
                        .to_lowercase()
                        .replace("sint", "int"),
                )
            })
            .collect();
        found.sort_by_key(|(number, ..)| *number);
        assert_eq!(found, fields, "{name}");
    }
}

fn object(object_id: u32) -> Object {
    Object {
        object_id,
        classification: 1,
        existence: 0.75,
        measured: true,
        x: -12.5,
        yaw: 3.0,
        number_of_points: 300,
        ..Object::default()
    }
}

#[test]
fn protobuf_decodes_the_bytes_of_an_object_list() {
    let list = ObjectList {
        revolution: 9,
        count: 2,
        objects: List(vec![object(7), object(0)]),
        ..ObjectList::default()
    };
    let mut bytes = vec![];
    list.encode(&mut bytes);
    let pool = pool();
    let decode = |name: &str, bytes: &[u8]| {
        DynamicMessage::decode(pool.get_message_by_name(name).unwrap(), bytes).unwrap()
    };
    let decoded = decode("kreisel.ObjectList", &bytes);
    let field = |message: &DynamicMessage, name: &str| {
        message.get_field_by_name(name).unwrap().into_owned()
    };
    assert_eq!(field(&decoded, "revolution"), Value::U32(9));
    assert_eq!(decoded.unknown_fields().count(), 0);

    let objects = field(&decoded, "objects");
    let mut rest: &[u8] = objects.as_bytes().unwrap();
    let mut ids = vec![];
    while let [length, tail @ ..] = rest {
        // Objects here are shorter than 128 bytes, so that their length is one byte.
        let (body, next) = tail.split_at(usize::from(*length));
        let decoded = decode("kreisel.Object", body);
        assert_eq!(field(&decoded, "x"), Value::F64(-12.5));
        assert_eq!(field(&decoded, "numberOfPoints"), Value::U32(300));
        ids.push(field(&decoded, "objectId").as_u32().unwrap());
        rest = next;
    }
    assert_eq!(ids, [7, 0]);
}

#[test]
fn protobuf_decodes_the_bytes_of_a_status() {
    let status = Status {
        uptime: 1.5,
        faults: "bad_magic=2".into(),
        revolutions_received: u64::MAX,
        healthy: true,
        ..Status::default()
    };
    let mut bytes = vec![];
    status.encode(&mut bytes);
    let descriptor = pool().get_message_by_name("kreisel.Status").unwrap();
    let decoded = DynamicMessage::decode(descriptor, bytes.as_slice()).unwrap();
    let field = |name: &str| decoded.get_field_by_name(name).unwrap().into_owned();
    assert_eq!(field("faults"), Value::String("bad_magic=2".into()));
    assert_eq!(field("revolutionsReceived"), Value::U64(u64::MAX));
    assert_eq!(field("healthy"), Value::Bool(true));
}

#[test]
fn protobuf_decodes_the_bytes_of_a_tile() {
    let mut cells = vec![];
    let levels: Vec<i16> = (0..16).map(|n| n % 5 - 2).collect();
    encode_cells(&levels, 4, &mut cells);
    let tile = GridTile {
        tile_x: -3,
        cell_size: 0.1,
        ..GridTile::default()
    };
    let tile = tile.with_cells(cells.clone());
    let mut bytes = vec![];
    tile.encode(&mut bytes);
    let descriptor = pool().get_message_by_name("kreisel.GridTile").unwrap();
    let decoded = DynamicMessage::decode(descriptor, bytes.as_slice()).unwrap();
    let field = |name: &str| decoded.get_field_by_name(name).unwrap().into_owned();
    assert_eq!(field("tileX"), Value::I32(-3));
    assert_eq!(field("cellSize"), Value::F64(0.1));
    assert_eq!(field("cells"), Value::Bytes(cells.into()));
}
