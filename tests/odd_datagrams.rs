//! Datagrams that no sound peer sends, but that arrive: cut, contradictory, from another schema, hostile.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use kreisel::time::Time;
use kreisel::wire::envelope::Postmark;
use kreisel::wire::opendlv::ObjectAnnouncement;
use kreisel::wire::{Envelope, Message, Recording, TimeStamp, WireError};

/// A frame's header: magic, and the length of what follows as it is announced.
fn header(announced: u32) -> Vec<u8> {
    let [first, second, third, _] = announced.to_le_bytes();
    vec![0x0d, 0xa4, first, second, third]
}

/// A frame around fields.
fn frame(fields: &[&[u8]]) -> Vec<u8> {
    let fields = fields.concat();
    [header(fields.len() as u32), fields].concat()
}

/// Field 1 of an envelope: data type 1130.
const DATA_TYPE: &[u8] = &[0x08, 0xd4, 0x11];

/// A sound frame: object 7, of a sender with stamp 5.
fn object_seven() -> Vec<u8> {
    let postmark = Postmark {
        sent: Time::from_micros(1_700_000_000_123_456),
        sampled: Time::from_micros(1_699_999_999_999_999),
        sender_stamp: 5,
    };
    let mut out = vec![];
    postmark.put(&mut out, &ObjectAnnouncement { object_id: 7 });
    out
}

/// A sound frame with a time in it.
fn time_stamp() -> Vec<u8> {
    let postmark = Postmark {
        sent: Time::from_micros(1_700_000_000_123_456),
        sampled: Time::from_micros(1_699_999_999_999_999),
        sender_stamp: 0,
    };
    let stamp = TimeStamp {
        seconds: 1_485_000_000,
        microseconds: 654_321,
    };
    let mut out = vec![];
    postmark.put(&mut out, &stamp);
    out
}

/// The datagrams, by names that the shared test data has for them, too.
fn odd(name: &str) -> Vec<u8> {
    match name {
        "bad_magic" => [&[0x0d, 0xa5], &object_seven()[2..]].concat(),
        "short_datagram" => object_seven()[..20].to_vec(),
        "header_only_len0" => header(0),
        "trailing_bytes" => [&object_seven()[..], &[0xde, 0xad, 0xbe, 0xef]].concat(),
        "two_envelopes_one_datagram" => [object_seven(), time_stamp()].concat(),
        "only_datatype" => frame(&[DATA_TYPE]),
        // The sender's stamp, no data, data type 1130, data type 12.
        "duplicate_datatype" => frame(&[&[0x30, 5], &[0x12, 0], DATA_TYPE, &[0x08, 24]]),
        // Field 7, a number; field 15, a byte; field 100, eight bytes.
        "unknown_fields" => frame(&[
            DATA_TYPE,
            &[0x38, 5],
            &[0x7a, 1, b'a'],
            &[0xa1, 0x06, 1, 2, 3, 4, 5, 6, 7, 8],
        ]),
        // The begin and the end of a group, then the sender's stamp.
        "group_wire_types" => frame(&[DATA_TYPE, &[0x0b], &[0x0c], &[0x30, 7]]),
        "varint_12_bytes" => frame(&[&[0x08], &[0xff; 11], &[0x01]]),
        "inner_length_beyond_envelope" => frame(&[&[0x12, 0xe8, 0x07]]),
        "inner_length_2pow40" => frame(&[&[0x12, 0x80, 0x80, 0x80, 0x80, 0x80, 0x20]]),
        _ => panic!("{name}"),
    }
}

fn check_object_seven(envelope: &Envelope<'_>) {
    assert_eq!((envelope.data_type, envelope.sender_stamp), (1130, 5));
    let object = ObjectAnnouncement::decode(envelope.payload, envelope.payload_offset);
    assert_eq!(object, Ok(ObjectAnnouncement { object_id: 7 }));
    assert_eq!(envelope.time().micros(), 1_699_999_999_999_999);
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn the_odd_datagrams_are_those_that_libcluon_was_tried_with() {
    let Some(list) = common::data("edge.json") else {
        return;
    };
    let cases: serde_json::Value = serde_json::from_slice(&std::fs::read(list).unwrap()).unwrap();
    let cases = cases.as_array().unwrap();
    assert_eq!(cases.len(), 12);
    for case in cases {
        let own = odd(case["name"].as_str().unwrap());
        let hex: String = own.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(case["hex"], hex, "{}", case["name"]);
    }
}

#[test]
fn a_datagram_without_the_magic_is_refused() {
    let error = Envelope::from_datagram(&odd("bad_magic")).unwrap_err();
    assert_eq!(error, WireError::BadMagic { offset: 0 });
}

#[test]
fn a_datagram_shorter_than_its_length_field_is_refused() {
    let error = Envelope::from_datagram(&odd("short_datagram")).unwrap_err();
    let expected = WireError::FrameTruncated {
        offset: 0,
        announced: 39,
        available: 15,
    };
    assert_eq!(error, expected);
}

#[test]
fn a_header_with_length_zero_is_an_envelope_of_data_type_zero() {
    assert_eq!(
        Envelope::from_datagram(&odd("header_only_len0")),
        Ok((Envelope::default(), 0))
    );
}

#[test]
fn bytes_after_the_first_envelope_are_counted_and_not_read() {
    for (name, rest_len) in [("trailing_bytes", 4), ("two_envelopes_one_datagram", 51)] {
        let datagram = odd(name);
        let (envelope, rest) = Envelope::from_datagram(&datagram).unwrap();
        check_object_seven(&envelope);
        assert_eq!(rest, rest_len, "{name}");
    }
}

#[test]
fn two_envelopes_of_a_datagram_are_two_entries_of_a_recording() {
    let datagram = odd("two_envelopes_one_datagram");
    let entries: Vec<_> = Recording::new(&datagram).map(Result::unwrap).collect();
    let [first, second] = &entries[..] else {
        panic!("{entries:?}")
    };
    check_object_seven(&first.envelope);
    let stamp = TimeStamp::decode(second.envelope.payload, 0).unwrap();
    assert_eq!(second.envelope.data_type, TimeStamp::ID);
    assert_eq!(stamp.time().micros(), 1_485_000_000_654_321);
}

#[test]
fn an_envelope_with_nothing_but_a_data_type_is_accepted() {
    let expected = Envelope {
        data_type: 1130,
        ..Envelope::default()
    };
    assert_eq!(
        Envelope::from_datagram(&odd("only_datatype")),
        Ok((expected, 0))
    );
}

#[test]
fn the_last_of_two_data_types_wins_in_any_order_of_fields() {
    let datagram = odd("duplicate_datatype");
    let (envelope, rest) = Envelope::from_datagram(&datagram).unwrap();
    assert_eq!((envelope.data_type, envelope.sender_stamp), (12, 5));
    assert_eq!((envelope.payload, rest), (&[][..], 0));
}

#[test]
fn unknown_fields_and_keys_without_content_are_passed_over() {
    for (name, sender_stamp) in [("unknown_fields", 0), ("group_wire_types", 7)] {
        let expected = Envelope {
            data_type: 1130,
            sender_stamp,
            ..Envelope::default()
        };
        assert_eq!(
            Envelope::from_datagram(&odd(name)),
            Ok((expected, 0)),
            "{name}"
        );
    }
}

#[test]
fn a_varint_of_twelve_bytes_is_refused() {
    let error = Envelope::from_datagram(&odd("varint_12_bytes")).unwrap_err();
    assert_eq!(error, WireError::VarintTooLong { offset: 6 });
}

#[test]
fn an_inner_length_past_the_envelope_is_refused_whatever_its_size() {
    let cases = [
        ("inner_length_beyond_envelope", 1000),
        ("inner_length_2pow40", 1 << 40),
    ];
    for (name, length) in cases {
        let expected = WireError::LengthBeyondEnd {
            offset: 6,
            length,
            available: 0,
        };
        assert_eq!(Envelope::from_datagram(&odd(name)), Err(expected), "{name}");
    }
}
