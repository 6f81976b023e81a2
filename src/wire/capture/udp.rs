//! UDP packets over IPv4, which sensors send, in captured frames (RFC 768, RFC 791).

use super::Captured;

/// Link types (the Tcpdump group's registry).
const ETHERNET: u32 = 1;
const RAW: u32 = 101;
const LINUX_COOKED: u32 = 113;
const IPV4: u32 = 228;
const LINUX_COOKED_2: u32 = 276;

/// Tags of virtual networks, four bytes each, which may stand before the type (IEEE 802.1Q).
const TAGS: [u16; 3] = [0x8100, 0x88a8, 0x9100];
const TYPE_IPV4: u16 = 0x0800;
const PROTOCOL_UDP: u8 = 17;
const UDP_HEADER_LEN: usize = 8;
const IPV4_HEADER_LEN: usize = 20;

/// A packet in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UdpPacket<'a> {
    /// Address that it came from.
    pub source: [u8; 4],
    /// What it holds.
    pub payload: &'a [u8],
    /// Whether its headers say that it is longer.
    pub is_cut: bool,
}

/// A frame that ends within its headers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the frame ends within its headers")]
pub struct CutFrame;

/// The packet in a frame, if it is one; one in fragments is none.
///
/// # Errors
/// When the frame ends within a header.
pub fn packet<'a>(frame: &Captured<'a>) -> Result<Option<UdpPacket<'a>>, CutFrame> {
    let bytes = frame.bytes;
    let two = |at: usize| {
        bytes
            .get(at..)?
            .first_chunk()
            .copied()
            .map(u16::from_be_bytes)
    };
    let (kind, ip_at) = match frame.link {
        ETHERNET => {
            let mut at = 12;
            while two(at).is_some_and(|kind| TAGS.contains(&kind)) {
                at += 4;
            }
            (two(at), at + 2)
        }
        LINUX_COOKED => (two(14), 16),
        LINUX_COOKED_2 => (two(0), 20),
        RAW | IPV4 => (Some(TYPE_IPV4), 0),
        _ => return Ok(None),
    };
    if kind.ok_or(CutFrame)? != TYPE_IPV4 {
        return Ok(None);
    }
    ipv4(bytes.get(ip_at..).ok_or(CutFrame)?)
}

fn ipv4(bytes: &[u8]) -> Result<Option<UdpPacket<'_>>, CutFrame> {
    let header = bytes.first_chunk::<IPV4_HEADER_LEN>().ok_or(CutFrame)?;
    let header_len = 4 * usize::from(header[0] & 0xf);
    let is_fragment = u16::from_be_bytes([header[6], header[7]]) & 0x3fff != 0;
    if header[0] >> 4 != 4 || header[9] != PROTOCOL_UDP || is_fragment {
        return Ok(None);
    }
    if header_len < IPV4_HEADER_LEN {
        return Err(CutFrame);
    }
    let stated = usize::from(u16::from_be_bytes([header[2], header[3]]));
    // Behind it a frame may be filled up.
    let held = &bytes[..stated.min(bytes.len())];
    let udp = held.get(header_len..).ok_or(CutFrame)?;
    let udp_header = udp.first_chunk::<UDP_HEADER_LEN>().ok_or(CutFrame)?;
    let udp_len = usize::from(u16::from_be_bytes([udp_header[4], udp_header[5]]));
    Ok(Some(UdpPacket {
        source: [header[12], header[13], header[14], header[15]],
        payload: &udp[UDP_HEADER_LEN..udp_len.clamp(UDP_HEADER_LEN, udp.len())],
        is_cut: stated > bytes.len() || udp_len > udp.len() || udp_len < UDP_HEADER_LEN,
    }))
}

/// Puts an Ethernet frame that broadcasts a UDP packet, from and to the same port.
///
/// # Errors
/// When the packet is too long for one frame.
pub fn put_broadcast(
    out: &mut Vec<u8>,
    station: [u8; 6],
    source: [u8; 4],
    port: u16,
    payload: &[u8],
) -> Result<(), std::num::TryFromIntError> {
    const BROADCAST: [u8; 4] = [255; 4];
    const TIME_TO_LIVE: u8 = 255;
    const DO_NOT_FRAGMENT: u16 = 0x4000;
    let udp_len = u16::try_from(UDP_HEADER_LEN + payload.len())?;
    let ip_len = u16::try_from(IPV4_HEADER_LEN + UDP_HEADER_LEN + payload.len())?;
    out.extend([0xff; 6]);
    out.extend(station);
    out.extend(TYPE_IPV4.to_be_bytes());

    let mut header = [0; IPV4_HEADER_LEN];
    header[0] = 4 << 4 | (IPV4_HEADER_LEN / 4) as u8;
    header[2..4].copy_from_slice(&ip_len.to_be_bytes());
    header[6..8].copy_from_slice(&DO_NOT_FRAGMENT.to_be_bytes());
    header[8] = TIME_TO_LIVE;
    header[9] = PROTOCOL_UDP;
    header[12..16].copy_from_slice(&source);
    header[16..20].copy_from_slice(&BROADCAST);
    let ip_sum = checksum(sum(&header));
    header[10..12].copy_from_slice(&ip_sum.to_be_bytes());
    out.extend(header);

    let begin = [port, port, udp_len].map(u16::to_be_bytes);
    let begin = begin.as_flattened();
    let addressed = sum(&header[12..]) + u64::from(PROTOCOL_UDP) + u64::from(udp_len);
    // Zero would say that there is none.
    let udp_sum = match checksum(addressed + sum(begin) + sum(payload)) {
        0 => u16::MAX,
        other => other,
    };
    out.extend(begin);
    out.extend(udp_sum.to_be_bytes());
    out.extend(payload);
    Ok(())
}

/// The sum of 16-bit words, the last one filled up with zero.
fn sum(bytes: &[u8]) -> u64 {
    let word = |two: &[u8]| [two[0], two.get(1).copied().unwrap_or(0)];
    let words = bytes.chunks(2).map(word).map(u16::from_be_bytes);
    words.map(u64::from).sum()
}

/// The complement of a sum with its carries added (RFC 1071).
fn checksum(mut sum: u64) -> u16 {
    while sum > u64::from(u16::MAX) {
        sum = (sum >> 16) + (sum & u64::from(u16::MAX));
    }
    !(sum as u16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Time;

    const SOURCE: [u8; 4] = [192, 168, 1, 201];

    fn ethernet() -> Vec<u8> {
        let mut frame = vec![];
        put_broadcast(&mut frame, [2; 6], SOURCE, 2368, b"of a sensor").unwrap();
        frame
    }

    fn read(link: u32, bytes: &[u8]) -> Result<Option<UdpPacket<'_>>, CutFrame> {
        packet(&Captured {
            offset: 0,
            time: Time::ZERO,
            link,
            bytes,
        })
    }

    #[test]
    fn a_packet_is_found_behind_every_link_header_and_before_what_fills_up() {
        let frame = ethernet();
        let (link_header, ip) = frame.split_at(14);
        let tagged = [&link_header[..12], &[0x81, 0, 0, 5], &link_header[12..], ip].concat();
        let cooked = [&[0; 14][..], &TYPE_IPV4.to_be_bytes(), ip].concat();
        let cooked_2 = [&TYPE_IPV4.to_be_bytes()[..], &[0; 18], ip].concat();
        let filled = [&frame[..], &[0; 9]].concat();
        let expected = UdpPacket {
            source: SOURCE,
            payload: b"of a sensor",
            is_cut: false,
        };
        for (link, bytes) in [
            (ETHERNET, &frame[..]),
            (ETHERNET, &tagged),
            (ETHERNET, &filled),
            (LINUX_COOKED, &cooked),
            (LINUX_COOKED_2, &cooked_2),
            (RAW, ip),
            (IPV4, ip),
        ] {
            assert_eq!(read(link, bytes), Ok(Some(expected)), "link type {link}");
        }
        assert_eq!(read(147, &frame), Ok(None));
    }

    #[test]
    fn a_frame_that_ends_early_is_cut() {
        let frame = ethernet();
        for length in 0..frame.len() {
            let found = read(ETHERNET, &frame[..length]);
            let is_cut = |packet: Option<UdpPacket<'_>>| packet.is_some_and(|packet| packet.is_cut);
            assert!(found.map_or(true, is_cut), "{length} bytes");
        }
    }

    #[test]
    fn fragments_and_other_protocols_are_no_packets() {
        for (at, byte) in [(13, 6), (20, 0x20), (21, 1), (23, 6)] {
            let mut frame = ethernet();
            frame[at] = byte;
            assert_eq!(read(ETHERNET, &frame), Ok(None), "byte {at}");
        }
    }

    #[test]
    fn check_sums_cancel_out() {
        let frame = ethernet();
        let (ip, udp) = frame[14..].split_at(IPV4_HEADER_LEN);
        assert_eq!(checksum(sum(ip)), 0);
        let addressed = sum(&ip[12..]) + u64::from(PROTOCOL_UDP) + udp.len() as u64;
        assert_eq!(checksum(addressed + sum(udp)), 0);
    }
}
