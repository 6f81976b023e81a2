//! Any bytes as a recording: entries and damage follow each other without gap or overlap to the end. As a capture: its frames
//! follow each other, and packets lie within them.
#![no_main]

use kreisel::wire::Recording;
use kreisel::wire::capture::{Frames, udp};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut end = 0;
    for item in Recording::new(bytes) {
        let (offset, length) = match &item {
            Ok(entry) => (entry.offset, entry.frame.len()),
            Err(damage) => (damage.offset, damage.skipped),
        };
        assert_eq!(offset, end);
        assert!(length > 0);
        end = offset + length;
    }
    assert_eq!(end, bytes.len());

    let mut end = 0;
    for frame in Frames::new(bytes).into_iter().flatten().flatten() {
        assert!(frame.offset >= end);
        end = frame.offset + frame.bytes.len();
        assert!(end <= bytes.len());
        if let Ok(Some(packet)) = udp::packet(&frame) {
            assert!(packet.payload.len() < frame.bytes.len());
        }
    }
});
