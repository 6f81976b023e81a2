//! Any text as a map: none panics or takes long, and what is read is read again from what it writes.
#![no_main]

use kreisel::roadmap::{Elements, Roadmap, osm, roundabouts, scn, simplified, svg};
use libfuzzer_sys::fuzz_target;

fn measured(map: &Roadmap) {
    let found = roundabouts(map);
    let found: Vec<_> = found
        .into_iter()
        .map(|one| (simplified(&one).roundabout, Elements::of(&one)))
        .collect();
    assert!(svg(map, &found).starts_with("<svg"));
}

fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes);
    if let Ok(map) = scn::read(&text) {
        measured(&map);
        let again = scn::read(&scn::write(&map)).expect("own text");
        assert_eq!(map.point_count(), again.point_count());
        assert_eq!(map.declared.len(), again.declared.len());
    }
    if let Ok(map) = osm::read(&text, None) {
        measured(&map);
    }
});
