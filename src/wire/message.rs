//! Messages as tables: one line a field, from which encoding, decoding and the description
//! that is compared with `proto/kreisel.odvd` all follow.

use super::WireError;
use super::protobuf::{Reader, Value, put_key, put_length_delimited, put_varint, unzigzag, zigzag};

/// A message with a number of its own.
pub trait Message: Default {
    /// The envelope's `dataType`.
    const ID: i32;
    /// Full name in the message specification.
    const NAME: &'static str;
    /// The fields in the order in which they are written.
    const FIELDS: &'static [FieldDescription];

    /// Appends the payload. Every field is written, zeros included.
    fn encode(&self, out: &mut Vec<u8>);

    /// Reads a payload whose first byte has the offset `base`. Missing fields keep their
    /// default, unknown ones and those of another wire type are passed over, the last of
    /// several wins.
    ///
    /// # Errors
    /// [`WireError`] with the offset of the first byte that does not fit.
    fn decode(payload: &[u8], base: usize) -> Result<Self, WireError>;
}

/// One field as the message specification writes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FieldDescription {
    /// Field number.
    pub id: u32,
    /// Name in the specification's camel case.
    pub name: &'static str,
    /// Type in the specification.
    pub kind: &'static str,
}

/// A type that a field may have.
pub trait FieldValue {
    /// Its name in the message specification.
    const KIND: &'static str;

    /// Appends key and value.
    fn put(&self, out: &mut Vec<u8>, id: u32);

    /// Takes the value over if it has the right wire type. `end` is the offset after it.
    ///
    /// # Errors
    /// [`WireError`] where the value has an inner structure that does not fit.
    fn merge(&mut self, value: Value<'_>, end: usize) -> Result<(), WireError>;
}

macro_rules! varint_field {
    ($($type:ty, $kind:literal, $encode:expr, $decode:expr;)*) => {$(
        impl FieldValue for $type {
            const KIND: &'static str = $kind;

            fn put(&self, out: &mut Vec<u8>, id: u32) {
                put_key(out, id, 0);
                put_varint(out, $encode(*self));
            }

            fn merge(&mut self, value: Value<'_>, _end: usize) -> Result<(), WireError> {
                if let Value::Varint(raw) = value {
                    *self = $decode(raw);
                }
                Ok(())
            }
        }
    )*};
}

varint_field! {
    bool, "bool", u64::from, |raw| raw != 0;
    u8, "uint8", u64::from, |raw| raw as u8;
    u32, "uint32", u64::from, |raw| raw as u32;
    u64, "uint64", |value| value, |raw| raw;
    i16, "int16", |value: i16| zigzag(value.into()), |raw| unzigzag(raw) as i16;
    i32, "int32", |value: i32| zigzag(value.into()), |raw| unzigzag(raw) as i32;
}

macro_rules! fixed_field {
    ($($type:ty, $kind:literal, $variant:ident, $wire_type:literal;)*) => {$(
        impl FieldValue for $type {
            const KIND: &'static str = $kind;

            fn put(&self, out: &mut Vec<u8>, id: u32) {
                put_key(out, id, $wire_type);
                out.extend_from_slice(&self.to_le_bytes());
            }

            fn merge(&mut self, value: Value<'_>, _end: usize) -> Result<(), WireError> {
                if let Value::$variant(raw) = value {
                    *self = <$type>::from_le_bytes(raw);
                }
                Ok(())
            }
        }
    )*};
}

fixed_field! {
    f32, "float", Fixed32, 5;
    f64, "double", Fixed64, 1;
}

impl FieldValue for String {
    const KIND: &'static str = "string";

    fn put(&self, out: &mut Vec<u8>, id: u32) {
        put_key(out, id, 2);
        put_length_delimited(out, |out| out.extend_from_slice(self.as_bytes()));
    }

    /// Bytes that are not UTF-8 are replaced: peers put Latin-1 here, too.
    fn merge(&mut self, value: Value<'_>, _end: usize) -> Result<(), WireError> {
        if let Value::Bytes(bytes) = value {
            *self = String::from_utf8_lossy(bytes).into_owned();
        }
        Ok(())
    }
}

/// Bytes with a meaning of their own.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Bytes(pub Vec<u8>);

impl FieldValue for Bytes {
    const KIND: &'static str = "bytes";

    fn put(&self, out: &mut Vec<u8>, id: u32) {
        put_key(out, id, 2);
        put_length_delimited(out, |out| out.extend_from_slice(&self.0));
    }

    fn merge(&mut self, value: Value<'_>, _end: usize) -> Result<(), WireError> {
        if let Value::Bytes(bytes) = value {
            self.0.clear();
            self.0.extend_from_slice(bytes);
        }
        Ok(())
    }
}

/// OpenDaVINCI's `list<...>` of messages or strings: one length-delimited field with the
/// elements end to end, each with its own length and no tag. To libcluon and protobuf, which
/// have no such type, it is a `bytes` field.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct List<T>(pub Vec<T>);

/// What a [`List`] may hold.
pub trait Element: Sized {
    /// Appends the element without a length.
    fn put_element(&self, out: &mut Vec<u8>);

    /// Reads an element whose first byte has the offset `base`.
    ///
    /// # Errors
    /// [`WireError`] with the offset of the first byte that does not fit.
    fn take_element(bytes: &[u8], base: usize) -> Result<Self, WireError>;
}

impl Element for String {
    fn put_element(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(self.as_bytes());
    }

    fn take_element(bytes: &[u8], _base: usize) -> Result<Self, WireError> {
        Ok(String::from_utf8_lossy(bytes).into_owned())
    }
}

impl<M: Message> Element for M {
    fn put_element(&self, out: &mut Vec<u8>) {
        self.encode(out);
    }

    fn take_element(bytes: &[u8], base: usize) -> Result<Self, WireError> {
        M::decode(bytes, base)
    }
}

impl<T: Element> FieldValue for List<T> {
    const KIND: &'static str = "bytes";

    fn put(&self, out: &mut Vec<u8>, id: u32) {
        put_key(out, id, 2);
        put_length_delimited(out, |out| {
            for element in &self.0 {
                put_length_delimited(out, |out| element.put_element(out));
            }
        });
    }

    fn merge(&mut self, value: Value<'_>, end: usize) -> Result<(), WireError> {
        let Value::Bytes(bytes) = value else {
            return Ok(());
        };
        self.0.clear();
        let mut reader = Reader::new(bytes, end - bytes.len());
        while !reader.is_empty() {
            let element = reader.length_delimited()?;
            let base = reader.offset() - element.len();
            self.0.push(T::take_element(element, base)?);
        }
        Ok(())
    }
}

/// A message as a field of another one.
impl<M: Message> FieldValue for M {
    const KIND: &'static str = M::NAME;

    fn put(&self, out: &mut Vec<u8>, id: u32) {
        put_key(out, id, 2);
        put_length_delimited(out, |out| self.encode(out));
    }

    fn merge(&mut self, value: Value<'_>, end: usize) -> Result<(), WireError> {
        if let Value::Bytes(bytes) = value {
            *self = M::decode(bytes, end - bytes.len())?;
        }
        Ok(())
    }
}

/// Writes a snake-case name as the specification's camel case, at compile time.
pub const fn camel_case<const N: usize>(snake: &str) -> ([u8; N], usize) {
    let snake = snake.as_bytes();
    let (mut out, mut length, mut index) = ([0; N], 0, 0);
    while index < snake.len() {
        let mut byte = snake[index];
        if byte == b'_' {
            index += 1;
            byte = snake[index].to_ascii_uppercase();
        }
        out[length] = byte;
        length += 1;
        index += 1;
    }
    (out, length)
}

/// Declares a message: `id => name: type` a line, in the order of writing.
macro_rules! message {
    (
        $(#[$meta:meta])*
        pub struct $name:ident = $message_id:literal $full_name:literal {
            $( $(#[$field_meta:meta])* $id:literal => $field:ident: $type:ty, )*
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, PartialEq, Default)]
        pub struct $name {
            $( $(#[$field_meta])* pub $field: $type, )*
        }

        impl $crate::wire::message::Message for $name {
            const ID: i32 = $message_id;
            const NAME: &'static str = $full_name;
            const FIELDS: &'static [$crate::wire::message::FieldDescription] = &[$(
                $crate::wire::message::FieldDescription {
                    id: $id,
                    name: {
                        const SNAKE: &str = stringify!($field);
                        const CAMEL: ([u8; SNAKE.len()], usize) =
                            $crate::wire::message::camel_case(SNAKE);
                        match std::str::from_utf8(CAMEL.0.split_at(CAMEL.1).0) {
                            Ok(name) => name,
                            Err(_) => SNAKE,
                        }
                    },
                    kind: <$type as $crate::wire::message::FieldValue>::KIND,
                },
            )*];

            fn encode(&self, out: &mut Vec<u8>) {
                $( $crate::wire::message::FieldValue::put(&self.$field, out, $id); )*
            }

            fn decode(payload: &[u8], base: usize) -> Result<Self, $crate::wire::WireError> {
                let mut message = Self::default();
                let mut reader = $crate::wire::protobuf::Reader::new(payload, base);
                while let Some(field) = reader.next_field()? {
                    let end = reader.offset();
                    match field.id {
                        $( $id => $crate::wire::message::FieldValue::merge(
                            &mut message.$field, field.value, end,
                        )?, )*
                        _ => {}
                    }
                }
                Ok(message)
            }
        }
    };
}
pub(crate) use message;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::TimeStamp;

    message! {
        /// A message of every shape.
        #[expect(unreachable_pub)]
        pub struct Sample = 9999 "test.Sample" {
            /// First.
            1 => plain_number: u32,
            /// Second.
            7 => list_of_names: List<String>,
            /// Third.
            3 => stamp: TimeStamp,
        }
    }

    #[test]
    fn fields_are_written_in_declaration_order_and_read_back() {
        let sample = Sample {
            plain_number: 300,
            list_of_names: List(vec!["a".into(), String::new(), "bcd".into()]),
            stamp: TimeStamp {
                seconds: -1,
                microseconds: 2,
            },
        };
        let mut out = vec![];
        sample.encode(&mut out);
        assert_eq!(out[..3], [0x08, 0xac, 0x02]);
        assert_eq!(out[3..12], *b"\x3a\x07\x01a\x00\x03bcd");
        assert_eq!(Sample::decode(&out, 0), Ok(sample));
    }

    #[test]
    fn names_follow_the_specification() {
        let names: Vec<_> = Sample::FIELDS.iter().map(|field| field.name).collect();
        assert_eq!(names, ["plainNumber", "listOfNames", "stamp"]);
        assert_eq!(Sample::FIELDS[2].kind, "cluon.data.TimeStamp");
    }

    #[test]
    fn a_list_element_that_is_too_long_names_its_byte() {
        let error = Sample::decode(&[0x3a, 2, 9, b'a'], 100).unwrap_err();
        assert_eq!(error.offset(), 102);
    }

    #[test]
    fn a_field_of_another_wire_type_is_passed_over() {
        let sample = Sample::decode(&[0x0d, 1, 2, 3, 4, 0x18, 1], 0).unwrap();
        assert_eq!(sample, Sample::default());
    }
}
