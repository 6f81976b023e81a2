//! Recordings: frames end to end, without a header.

use super::{Envelope, WireError, frame};

/// Walks over the envelopes of a recording. Damage is an item of its own; after it the walk
/// goes on at the next place where a frame begins and is followed by another frame or the end.
#[derive(Debug, Clone)]
pub struct Recording<'a> {
    bytes: &'a [u8],
    offset: usize,
}

/// One stored frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry<'a> {
    /// Offset of the frame in the recording.
    pub offset: usize,
    /// The frame as it is stored.
    pub frame: &'a [u8],
    /// What it holds.
    pub envelope: Envelope<'a>,
}

/// A stretch that holds no envelope.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// What is wrong first.
    pub error: WireError,
    /// Where the damage begins.
    pub offset: usize,
    /// How many bytes were passed over.
    pub skipped: usize,
}

impl<'a> Recording<'a> {
    /// A walk over `bytes` from the beginning.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, offset: 0 }
    }

    /// Offset of the next frame.
    pub fn offset(&self) -> usize {
        self.offset
    }

    fn entry(&self, offset: usize) -> Result<(Entry<'a>, usize), WireError> {
        let (body, end) = frame::split(self.bytes, offset)?;
        let envelope = Envelope::decode(body, offset + frame::HEADER_LEN)?;
        let frame = &self.bytes[offset..end];
        Ok((
            Entry {
                offset,
                frame,
                envelope,
            },
            end,
        ))
    }

    /// Whether a frame begins at `offset` that is sound and not an accident of two bytes: no
    /// longer than a datagram, beginning with the data type as every peer writes it, and ending
    /// where the file ends or another frame begins. The cheap tests come first.
    fn resumes_at(&self, offset: usize) -> bool {
        const DATA_TYPE_KEY: u8 = 0x08;
        let Ok((body, end)) = frame::split(self.bytes, offset) else {
            return false;
        };
        body.len() <= frame::MAX_DATAGRAM_LEN
            && body.first() == Some(&DATA_TYPE_KEY)
            && (end == self.bytes.len() || self.bytes[end..].starts_with(&frame::MAGIC[..1]))
            && self.entry(offset).is_ok()
    }

    fn skip(&mut self, error: WireError) -> Damage {
        let offset = self.offset;
        // A frame that is sound outside and damaged inside is passed over as a whole.
        let sound_end = frame::split(self.bytes, offset)
            .ok()
            .map(|(_, end)| end)
            .filter(|end| *end == self.bytes.len() || self.resumes_at(*end));
        self.offset = sound_end
            .or_else(|| (offset + 1..self.bytes.len()).find(|start| self.resumes_at(*start)))
            .unwrap_or(self.bytes.len());
        Damage {
            error,
            offset,
            skipped: self.offset - offset,
        }
    }
}

impl<'a> Iterator for Recording<'a> {
    type Item = Result<Entry<'a>, Damage>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.offset >= self.bytes.len() {
            return None;
        }
        Some(match self.entry(self.offset) {
            Ok((entry, end)) => {
                self.offset = end;
                Ok(entry)
            }
            Err(error) => Err(self.skip(error)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Time;
    use crate::wire::TimeStamp;
    use crate::wire::envelope::Postmark;

    fn three_frames() -> Vec<u8> {
        let mut bytes = vec![];
        for seconds in 0..3 {
            let stamp = TimeStamp::from(Time::from_micros(seconds * 1_000_000));
            Postmark::default().put(&mut bytes, &stamp);
        }
        bytes
    }

    fn counts(bytes: &[u8]) -> (usize, usize, usize) {
        let items: Vec<_> = Recording::new(bytes).collect();
        let skipped = items.iter().filter_map(|item| item.as_ref().err());
        let good = items.iter().filter(|item| item.is_ok()).count();
        (good, items.len() - good, skipped.map(|d| d.skipped).sum())
    }

    #[test]
    fn whole_recordings_are_read_to_the_last_byte() {
        assert_eq!(counts(&three_frames()), (3, 0, 0));
        assert_eq!(counts(&[]), (0, 0, 0));
    }

    #[test]
    fn garbage_between_frames_costs_only_itself() {
        let mut bytes = three_frames();
        let second = bytes.len() / 3;
        bytes.splice(second..second, *b"\x0dgarbage");
        assert_eq!(counts(&bytes), (3, 1, 8));
    }

    #[test]
    fn bytes_that_look_like_frames_everywhere_do_not_take_for_ever() {
        let bytes = b"\x0d\xa4\x03\x00\x04".repeat(200_000);
        assert_eq!(counts(&bytes), (0, 1, bytes.len()));
    }

    #[test]
    fn a_cut_off_last_frame_is_damage() {
        let bytes = three_frames();
        let cut = &bytes[..bytes.len() - 4];
        assert_eq!(counts(cut), (2, 1, bytes.len() / 3 - 4));
    }

    #[test]
    fn a_frame_with_a_damaged_envelope_costs_only_itself() {
        let mut bytes = three_frames();
        let second = bytes.len() / 3;
        // The payload's length now reaches beyond the envelope.
        bytes[second + frame::HEADER_LEN + 3] = 0x7f;
        assert_eq!(counts(&bytes), (2, 1, second));
    }
}
