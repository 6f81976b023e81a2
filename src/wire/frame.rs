//! The frame around every envelope: `0D A4`, a 24-bit little-endian length, the envelope.
//! The same bytes travel in a datagram and stand in a recording.

use super::WireError;

/// The two bytes that begin a frame.
pub const MAGIC: [u8; 2] = [0x0d, 0xa4];

/// Magic and length.
pub const HEADER_LEN: usize = 5;

/// The largest UDP payload over IPv4, header included; peers drop what is longer.
pub const MAX_DATAGRAM_LEN: usize = 65_507;

/// The largest body that the 24-bit length can announce.
pub const MAX_BODY_LEN: usize = (1 << 24) - 1;

/// Splits the frame that begins at `offset` of `bytes` into its body and the offset after it.
///
/// # Errors
/// [`WireError::BadMagic`] or [`WireError::FrameTruncated`].
pub fn split(bytes: &[u8], offset: usize) -> Result<(&[u8], usize), WireError> {
    let rest = &bytes[offset..];
    let known = rest.len().min(MAGIC.len());
    if rest[..known] != MAGIC[..known] {
        return Err(WireError::BadMagic { offset });
    }
    if rest.len() < HEADER_LEN {
        return Err(WireError::FrameTruncated {
            offset,
            announced: HEADER_LEN,
            available: rest.len(),
        });
    }
    let announced = u32::from_le_bytes([rest[2], rest[3], rest[4], 0]) as usize;
    let body = &rest[HEADER_LEN..];
    if announced > body.len() {
        return Err(WireError::FrameTruncated {
            offset,
            announced,
            available: body.len(),
        });
    }
    Ok((&body[..announced], offset + HEADER_LEN + announced))
}

/// Appends a frame around what `body` writes. A body past [`MAX_BODY_LEN`] cannot be framed;
/// callers keep to [`MAX_DATAGRAM_LEN`], far below.
pub fn put(out: &mut Vec<u8>, body: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    out.extend_from_slice(&[MAGIC[0], MAGIC[1], 0, 0, 0]);
    body(out);
    let length = out.len() - start - HEADER_LEN;
    debug_assert!(length <= MAX_BODY_LEN);
    out[start + 2..start + HEADER_LEN].copy_from_slice(&(length as u32).to_le_bytes()[..3]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_split_where_it_was_put() {
        let mut out = vec![];
        put(&mut out, |out| out.extend([1, 2, 3]));
        put(&mut out, |_| {});
        let (body, next) = split(&out, 0).unwrap();
        assert_eq!((body, next), (&[1, 2, 3][..], 8));
        assert_eq!(split(&out, next), Ok((&[][..], out.len())));
    }

    #[test]
    fn a_frame_longer_than_its_bytes_says_so() {
        assert_eq!(
            split(&[0x0d, 0xa4, 0x27, 0, 0, 1, 2], 0),
            Err(WireError::FrameTruncated {
                offset: 0,
                announced: 39,
                available: 2
            })
        );
        assert!(matches!(
            split(&[0x0d], 0),
            Err(WireError::FrameTruncated { .. })
        ));
    }

    #[test]
    fn anything_else_is_no_frame() {
        assert_eq!(
            split(&[0x0d, 0xa5], 0),
            Err(WireError::BadMagic { offset: 0 })
        );
        assert_eq!(
            split(&[7, 0, 0, 0, 0, 0], 0),
            Err(WireError::BadMagic { offset: 0 })
        );
    }
}
