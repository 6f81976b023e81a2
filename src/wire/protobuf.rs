//! The scalar encoding that libcluon and OpenDaVINCI share: protobuf's wire types, with
//! signed integers in zigzag form, every field always written, in declaration order.

use super::WireError;

/// One field as it stands in the bytes, before anybody says what it means.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value<'a> {
    /// Wire type 0.
    Varint(u64),
    /// Wire type 1, little-endian.
    Fixed64([u8; 8]),
    /// Wire type 2.
    Bytes(&'a [u8]),
    /// Wire type 5, little-endian.
    Fixed32([u8; 4]),
}

/// A field with its number and the offset of its key.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field<'a> {
    /// Field number.
    pub id: u32,
    /// Where the field's key begins, counted from the base that the reader was given.
    pub offset: usize,
    /// What the field holds.
    pub value: Value<'a>,
}

/// Walks over the fields of a message. Every length is checked before it is used.
#[derive(Debug, Clone)]
pub struct Reader<'a> {
    bytes: &'a [u8],
    position: usize,
    base: usize,
    /// Keys that may still come.
    keys: usize,
}

impl<'a> Reader<'a> {
    /// A reader over `bytes`, whose errors count from `base`.
    pub fn new(bytes: &'a [u8], base: usize) -> Self {
        Self {
            bytes,
            position: 0,
            base,
            keys: usize::MAX,
        }
    }

    /// The same of a message that has no more keys than this.
    pub fn bounded(bytes: &'a [u8], base: usize, keys: usize) -> Self {
        Self {
            keys,
            ..Self::new(bytes, base)
        }
    }

    /// The offset of the next byte.
    pub fn offset(&self) -> usize {
        self.base + self.position
    }

    /// Whether every byte was read.
    pub fn is_empty(&self) -> bool {
        self.position == self.bytes.len()
    }

    /// The next field, or `None` at the end.
    ///
    /// Wire types 3, 4, 6 and 7 have no content here: their key is passed over, as both peers do.
    ///
    /// # Errors
    /// [`WireError`] with the offset when a varint or a length does not fit the bytes, or there are too many keys.
    pub fn next_field(&mut self) -> Result<Option<Field<'a>>, WireError> {
        while !self.is_empty() {
            let offset = self.offset();
            self.keys = self
                .keys
                .checked_sub(1)
                .ok_or(WireError::TooManyFields { offset })?;
            let key = self.varint()?;
            let value = match key & 7 {
                0 => Value::Varint(self.varint()?),
                1 => Value::Fixed64(self.array()?),
                2 => Value::Bytes(self.length_delimited()?),
                5 => Value::Fixed32(self.array()?),
                _ => continue,
            };
            // Keys are computed in 32 bits by the peers.
            let id = (key as u32) >> 3;
            return Ok(Some(Field { id, offset, value }));
        }
        Ok(None)
    }

    /// A base-128 varint of at most 64 bits.
    ///
    /// # Errors
    /// [`WireError::Truncated`] or [`WireError::VarintTooLong`].
    pub fn varint(&mut self) -> Result<u64, WireError> {
        let start = self.offset();
        let mut value = 0u64;
        for index in 0..10 {
            let byte = *self
                .bytes
                .get(self.position)
                .ok_or(WireError::Truncated { offset: start })?;
            self.position += 1;
            value |= u64::from(byte & 0x7f) << (7 * index);
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(WireError::VarintTooLong { offset: start })
    }

    /// A length and that many bytes.
    ///
    /// # Errors
    /// [`WireError::LengthBeyondEnd`] when the message ends before them.
    pub fn length_delimited(&mut self) -> Result<&'a [u8], WireError> {
        let offset = self.offset();
        let length = self.varint()?;
        let available = self.bytes.len() - self.position;
        let length = usize::try_from(length)
            .ok()
            .filter(|length| *length <= available)
            .ok_or(WireError::LengthBeyondEnd {
                offset,
                length,
                available,
            })?;
        let start = self.position;
        self.position += length;
        Ok(&self.bytes[start..self.position])
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], WireError> {
        let bytes = self
            .bytes
            .get(self.position..self.position + N)
            .and_then(|slice| slice.try_into().ok())
            .ok_or(WireError::Truncated {
                offset: self.offset(),
            })?;
        self.position += N;
        Ok(bytes)
    }
}

/// Appends a varint.
pub fn put_varint(out: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

/// Appends a field's key.
pub fn put_key(out: &mut Vec<u8>, id: u32, wire_type: u8) {
    put_varint(out, u64::from(id << 3 | u32::from(wire_type)));
}

/// Appends `body` with its length before it, without knowing the length beforehand.
pub fn put_length_delimited(out: &mut Vec<u8>, body: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    body(out);
    let length = out.len() - start;
    put_varint(out, length as u64);
    let prefix = out.len() - start - length;
    out[start..].rotate_right(prefix);
}

/// Zigzag at 64 bits: small magnitudes become small unsigned numbers. The narrower widths
/// of the peers give the same varint, because sign extension changes nothing.
pub const fn zigzag(value: i64) -> u64 {
    ((value << 1) ^ (value >> 63)) as u64
}

/// The inverse of [`zigzag`].
pub const fn unzigzag(value: u64) -> i64 {
    (value >> 1) as i64 ^ -((value & 1) as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zigzag_follows_the_table_of_the_protobuf_documentation() {
        for (signed, unsigned) in [(0, 0), (-1, 1), (1, 2), (-2, 3), (i64::MIN, u64::MAX)] {
            assert_eq!(zigzag(signed), unsigned);
            assert_eq!(unzigzag(unsigned), signed);
        }
    }

    #[test]
    fn a_length_beyond_the_message_names_the_offset_of_the_length() {
        let mut reader = Reader::new(&[0x12, 0xe8, 0x07], 5);
        assert_eq!(
            reader.next_field(),
            Err(WireError::LengthBeyondEnd {
                offset: 6,
                length: 1000,
                available: 0
            })
        );
    }

    #[test]
    fn a_varint_of_more_than_ten_bytes_is_refused() {
        let mut reader = Reader::new(&[0xff; 12], 0);
        assert_eq!(reader.varint(), Err(WireError::VarintTooLong { offset: 0 }));
    }

    #[test]
    fn group_keys_are_passed_over() {
        let mut reader = Reader::new(&[0x0b, 0x0c, 0x30, 0x07], 0);
        let field = reader.next_field().unwrap().unwrap();
        assert_eq!((field.id, field.value), (6, Value::Varint(7)));
        assert_eq!(reader.next_field(), Ok(None));
    }

    #[test]
    fn a_length_prefix_of_two_bytes_lands_before_its_body() {
        let mut out = vec![0xaa];
        put_length_delimited(&mut out, |out| out.extend([7; 300]));
        assert_eq!(out[..3], [0xaa, 0xac, 0x02]);
        assert_eq!(out[3..], [7; 300]);
    }
}
