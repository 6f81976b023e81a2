//! Any text as a configuration: what is taken is printed and taken again.
#![no_main]

use kreisel::config::text::{parse, print};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Ok(configuration) = parse(text) {
        assert_eq!(parse(&print(&configuration)), Ok(configuration));
    }
});
