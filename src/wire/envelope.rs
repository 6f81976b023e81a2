//! The envelope around every message: what it is, when it was sampled, who sent it.
//!
//! libcluon calls it `cluon.data.Envelope`, OpenDaVINCI `MessageContainer`; the bytes are the
//! same. Both write all six fields, older peers write fewer, so any subset is accepted.

use super::frame;
use super::message::{FieldValue, Message};
use super::protobuf::{Reader, Value, put_key, put_length_delimited, put_varint, zigzag};
use super::{WireError, protobuf};
use crate::time::Time;

super::message! {
    /// Seconds and microseconds since 1970 UTC, each signed, as they travel.
    #[derive(Copy, Eq)]
    pub struct TimeStamp = 12 "cluon.data.TimeStamp" {
        /// Whole seconds.
        1 => seconds: i32,
        /// Microseconds after them.
        2 => microseconds: i32,
    }
}

impl TimeStamp {
    /// The time that this stamp names.
    pub fn time(self) -> Time {
        Time::from_micros(i64::from(self.seconds) * 1_000_000 + i64::from(self.microseconds))
    }
}

impl From<Time> for TimeStamp {
    /// Times outside the 32-bit seconds of the wire (1901 to 2038) are clamped to its ends.
    fn from(time: Time) -> Self {
        let seconds = time.micros().div_euclid(1_000_000);
        Self {
            seconds: seconds.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32,
            microseconds: time.micros().rem_euclid(1_000_000) as i32,
        }
    }
}

/// An envelope whose message is still bytes, borrowed from the datagram or file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Envelope<'a> {
    /// Which message `payload` holds; 0 when the sender did not say.
    pub data_type: i32,
    /// The message's bytes.
    pub payload: &'a [u8],
    /// Offset of `payload` in the datagram or file, for error messages.
    pub payload_offset: usize,
    /// When it was handed to the network.
    pub sent: TimeStamp,
    /// When it was received; written by receivers, of no use to anybody else.
    pub received: TimeStamp,
    /// When the data was true.
    pub sample_time_stamp: TimeStamp,
    /// Which instance of a service sent it.
    pub sender_stamp: u32,
}

/// Fields that an envelope may have: six, some that a later schema adds, and repetitions. It bounds what looking for the
/// next sound frame in a damaged recording costs, where every second byte may seem to begin one.
const MOST_FIELDS: usize = 32;
/// Bytes that a time in an envelope may have: 22, and some that a later schema adds.
const MOST_TIME_BYTES: usize = 64;

impl<'a> Envelope<'a> {
    /// Decodes the body of a frame that begins at `base`.
    ///
    /// # Errors
    /// [`WireError`] with the offset of the first byte that does not fit.
    pub fn decode(body: &'a [u8], base: usize) -> Result<Self, WireError> {
        let mut envelope = Self::default();
        let mut reader = Reader::bounded(body, base, MOST_FIELDS);
        while let Some(field) = reader.next_field()? {
            let end = reader.offset();
            let is_long_time = match (field.id, field.value) {
                (3..=5, Value::Bytes(bytes)) => bytes.len() > MOST_TIME_BYTES,
                _ => false,
            };
            if is_long_time {
                return Err(WireError::TooManyFields { offset: end });
            }
            match (field.id, field.value) {
                (1, Value::Varint(raw)) => envelope.data_type = protobuf::unzigzag(raw) as i32,
                (2, Value::Bytes(bytes)) => {
                    envelope.payload = bytes;
                    envelope.payload_offset = end - bytes.len();
                }
                (3, value) => envelope.sent.merge(value, end)?,
                (4, value) => envelope.received.merge(value, end)?,
                (5, value) => envelope.sample_time_stamp.merge(value, end)?,
                (6, Value::Varint(raw)) => envelope.sender_stamp = raw as u32,
                _ => {}
            }
        }
        Ok(envelope)
    }

    /// Decodes the first frame of a datagram, as libcluon does: what follows it is not read.
    /// The second value is how many bytes follow.
    ///
    /// # Errors
    /// [`WireError`] with the offset of the first byte that does not fit.
    pub fn from_datagram(datagram: &'a [u8]) -> Result<(Self, usize), WireError> {
        let (body, end) = frame::split(datagram, 0)?;
        let envelope = Self::decode(body, frame::HEADER_LEN)?;
        Ok((envelope, datagram.len() - end))
    }

    /// When the data was true: `sampleTimeStamp`, or `sent` where a peer left it out.
    pub fn time(&self) -> Time {
        let sampled = self.sample_time_stamp.time();
        if sampled.is_zero() {
            self.sent.time()
        } else {
            sampled
        }
    }
}

/// What an envelope says beside its message, for sending.
#[derive(Debug, Clone, Copy, Default)]
pub struct Postmark {
    /// When it is handed to the network.
    pub sent: Time,
    /// When the data was true.
    pub sampled: Time,
    /// Which instance sends.
    pub sender_stamp: u32,
}

impl Postmark {
    /// Appends a whole frame with `message` in its envelope.
    pub fn put<M: Message>(&self, out: &mut Vec<u8>, message: &M) {
        self.put_payload(out, M::ID, |out| message.encode(out));
    }

    /// Appends a whole frame whose payload is written by `payload`.
    pub fn put_payload(
        &self,
        out: &mut Vec<u8>,
        data_type: i32,
        payload: impl FnOnce(&mut Vec<u8>),
    ) {
        frame::put(out, |out| {
            put_key(out, 1, 0);
            put_varint(out, zigzag(i64::from(data_type)));
            put_key(out, 2, 2);
            put_length_delimited(out, payload);
            TimeStamp::from(self.sent).put(out, 3);
            TimeStamp::default().put(out, 4);
            TimeStamp::from(self.sampled).put(out, 5);
            self.sender_stamp.put(out, 6);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documented_frame_of_a_time_stamp_is_written_byte_for_byte() {
        let expected = [
            "0da42e00000818120a0880b59a880b10e2ef4f1a0a0880c49fd50c1080890f",
            "2204080010002a0a08fec39fd50c10fe887a3000",
        ]
        .concat();
        let message = TimeStamp {
            seconds: 1_485_000_000,
            microseconds: 654_321,
        };
        let mut out = vec![];
        Postmark {
            sent: Time::from_micros(1_700_000_000_123_456),
            sampled: Time::from_micros(1_699_999_999_999_999),
            sender_stamp: 0,
        }
        .put(&mut out, &message);
        let hex: String = out.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(hex, expected);
    }

    #[test]
    fn an_envelope_of_endless_fields_is_refused() {
        let decode = |fields: usize| {
            let body = [0x30, 7].repeat(fields);
            Envelope::decode(&body, 0).map(|envelope| envelope.sender_stamp)
        };
        assert_eq!(decode(MOST_FIELDS), Ok(7));
        let refused = Err(WireError::TooManyFields { offset: 64 });
        assert_eq!(decode(MOST_FIELDS + 1), refused);
        let empty = Envelope::decode(&[0x0f; 40], 0);
        assert_eq!(empty, Err(WireError::TooManyFields { offset: 32 }));
        let long_time = [&[0x1a, 66][..], &[0x08, 7].repeat(33)].concat();
        assert!(Envelope::decode(&long_time, 0).is_err());
    }

    #[test]
    fn a_missing_sample_time_falls_back_to_the_sending_time() {
        let sent = TimeStamp {
            seconds: 5,
            microseconds: 7,
        };
        let envelope = Envelope {
            sent,
            ..Envelope::default()
        };
        assert_eq!(envelope.time().micros(), 5_000_007);
    }

    #[test]
    fn times_before_1970_keep_their_microseconds_positive() {
        let stamp = TimeStamp::from(Time::from_micros(-1));
        assert_eq!((stamp.seconds, stamp.microseconds), (-1, 999_999));
        assert_eq!(stamp.time().micros(), -1);
    }
}
