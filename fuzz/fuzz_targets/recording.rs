//! Any bytes as a recording: entries and damage follow each other without gap or overlap to the end.
#![no_main]

use kreisel::wire::Recording;
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
});
