//! Captures of network traffic, as `tcpdump` and Wireshark write them: their records (`pcap`,
//! `pcapng`), and the UDP packets in these (`udp`).

use crate::time::Time;
use crate::wire::point_cloud::ByteOrder;

pub mod pcap;
mod pcapng;
pub mod udp;

/// One captured frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Captured<'a> {
    /// Where its record begins in the file.
    pub offset: usize,
    /// When it was captured.
    pub time: Time,
    /// What its first header is, as the registry of link types numbers it.
    pub link: u32,
    /// Its bytes, as many as were kept.
    pub bytes: &'a [u8],
}

/// Why a capture cannot be read on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CaptureError {
    /// It does not begin as one.
    #[error("byte 0: neither pcap nor pcapng")]
    NoCapture,
    /// The file ends within a record.
    #[error("byte {offset}: the last record is cut off")]
    Cut {
        /// Where the record begins.
        offset: usize,
    },
    /// A length is impossible.
    #[error("byte {offset}: no record begins here")]
    NoRecord {
        /// Where one should begin.
        offset: usize,
    },
}

/// The frames of a capture in order; an error is the last one.
#[derive(Debug, Clone)]
pub struct Frames<'a> {
    bytes: &'a [u8],
    offset: usize,
    format: Option<Format>,
}

#[derive(Debug, Clone)]
enum Format {
    Classic(pcap::Header),
    Next(pcapng::Section),
}

/// What the next record turned out to be.
struct Record<'a> {
    length: usize,
    frame: Option<Captured<'a>>,
}

/// Whether bytes are those of a capture.
pub fn is_capture(bytes: &[u8]) -> bool {
    bytes.starts_with(&pcapng::SECTION) || pcap::Header::is_begun_by(bytes)
}

impl<'a> Frames<'a> {
    /// Those of a file's bytes.
    ///
    /// # Errors
    /// When they do not begin as a capture.
    pub fn new(bytes: &'a [u8]) -> Result<Self, CaptureError> {
        let (offset, format) = if bytes.starts_with(&pcapng::SECTION) {
            (0, Format::Next(pcapng::Section::default()))
        } else {
            let header = pcap::Header::read(bytes).ok_or(CaptureError::NoCapture)?;
            (pcap::HEADER_LEN, Format::Classic(header))
        };
        Ok(Self {
            bytes,
            offset,
            format: Some(format),
        })
    }
}

impl<'a> Iterator for Frames<'a> {
    type Item = Result<Captured<'a>, CaptureError>;

    fn next(&mut self) -> Option<Self::Item> {
        while let Some(format) = &mut self.format
            && self.offset < self.bytes.len()
        {
            let rest = &self.bytes[self.offset..];
            let record = match format {
                Format::Classic(header) => header.record(rest, self.offset),
                Format::Next(section) => section.block(rest, self.offset),
            };
            match record {
                Ok(record) => {
                    self.offset += record.length;
                    if record.frame.is_some() {
                        return record.frame.map(Ok);
                    }
                }
                Err(error) => {
                    self.format = None;
                    return Some(Err(error));
                }
            }
        }
        None
    }
}

/// Numbers of a file's byte order, at places in a record.
#[derive(Debug, Clone, Copy)]
struct Numbers<'a> {
    bytes: &'a [u8],
    order: ByteOrder,
}

impl Numbers<'_> {
    fn two(self, at: usize) -> Option<u16> {
        let two = self.bytes.get(at..)?.first_chunk()?;
        Some(self.order.join(*two))
    }

    fn four(self, at: usize) -> Option<u32> {
        let four = self.bytes.get(at..)?.first_chunk()?;
        Some(match self.order {
            ByteOrder::Big => u32::from_be_bytes(*four),
            ByteOrder::Little => u32::from_le_bytes(*four),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_capture_says_so() {
        let noise = b"no capture at all, is it";
        assert!(!is_capture(noise));
        assert_eq!(Frames::new(noise).unwrap_err(), CaptureError::NoCapture);
        assert_eq!(Frames::new(b"").unwrap_err(), CaptureError::NoCapture);
    }
}
