use std::f64::consts::{FRAC_PI_2, TAU};

use super::read;
use crate::roadmap::{Elements, roundabouts, svg};

const OSM: &str = r#"<?xml version="1.0"?>
<osm version="0.6">
 <node id="1" lat="57.00010" lon="12.0"/>
 <node id="2" lat="57.00007" lon="11.99987"/>
 <node id="3" lat="57.0" lon="11.999815"/>
 <node id="4" lat="56.99993" lon="11.99987"/>
 <node id="5" lat="56.9999" lon="12.0"/>
 <node id="6" lat="56.99993" lon="12.00013"/>
 <node id="7" lat="57.0" lon="12.000185"/>
 <node id="8" lat="57.00007" lon="12.00013"/>
 <node id="9" lat="56.9990" lon="12.0"><tag k="highway" v="mini_roundabout"/></node>
 <way id="11"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="4"/><nd ref="5"/>
  <tag k="highway" v="residential"/><tag k="junction" v="roundabout"/><tag k="name" v="R&amp;B"/></way>
 <way id="12"><nd ref="5"/><nd ref="6"/><nd ref="7"/><nd ref="8"/><nd ref="1"/>
  <tag k="highway" v="residential"/><tag k="junction" v="roundabout"/></way>
 <way id="13"><nd ref="5"/><nd ref="9"/><tag k="highway" v="residential"/><tag k="width" v="7 m"/></way>
 <way id="14"><nd ref="1"/><nd ref="9"/><tag k="building" v="yes"/></way>
</osm>"#;

/// In two ways, as circles with bus stops or names often are.
#[test]
fn a_roundabout_of_several_ways_is_one() {
    let map = read(OSM, None).unwrap();
    let found = roundabouts(&map);
    assert_eq!(found.len(), 1, "{found:?}");
    let elements = Elements::of(&found[0]);
    assert!(
        (elements.outer_diameter_m - 25.8).abs() < 0.3,
        "{elements:?}"
    );
    assert!(!found[0].is_clockwise);
    assert_eq!(elements.arms.len(), 1);
    assert_eq!(elements.arms[0].entry_width_m, Some(3.5));
    assert_eq!(elements.arms[0].exit_width_m, Some(3.5));
    assert!((elements.arms[0].bearing_rad + FRAC_PI_2).abs() < 0.1);
    assert_eq!(map.skipped.len(), 2, "{:?}", map.skipped);
    let drawn = svg(&map, &[(found[0].clone(), elements)]);
    roxmltree::Document::parse(&drawn).unwrap();
    assert!(drawn.contains("R&amp;B"), "{drawn}");
}

#[test]
fn what_is_no_map_is_refused_with_its_place() {
    for (text, expected) in [
        (
            "<osm><node id='1' lat='95' lon='0'/></osm>",
            "line 1, column 6: a node without id",
        ),
        ("<osm>\n<way></osm>", "line 2, column 6: no XML"),
        ("<gpx/>", "line 1, column 1: no OpenStreetMap"),
    ] {
        let error = read(text, None).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error}");
    }
}

/// Extracts are cut through roads.
#[test]
fn roads_that_leave_the_extract_are_counted() {
    let text = "<osm><way id='1'><nd ref='7'/><tag k='highway' v='road'/></way></osm>";
    let map = read(text, None).unwrap();
    assert_eq!(map.skipped["road outside of the extract"], 1);
}

/// An extract with a circle of 24 nodes, driven clockwise where traffic drives on the left, parted into ways, and four
/// two-way roads of two pieces each.
fn town(pieces: usize, side: f64) -> String {
    const NODES: usize = 24;
    let node = |id: usize, radius_m: f64, angle_rad: f64| {
        let (sine, cosine) = angle_rad.sin_cos();
        let (lat, lon) = (
            radius_m * sine / 111_320.0,
            side * radius_m * cosine / 111_320.0,
        );
        format!("<node id='{id}' lat='{lat:.9}' lon='{lon:.9}'/>")
    };
    let turn = |share: f64| TAU * share;
    let mut text = String::from("<osm>");
    for id in 0..NODES {
        text += &node(id, 13.0, turn(id as f64 / NODES as f64));
    }
    for arm in 0..4 {
        text += &node(100 + arm, 30.0, turn(arm as f64 / 4.0));
        text += &node(200 + arm, 90.0, turn(arm as f64 / 4.0));
    }
    let mut ids = 0..;
    let mut way = |nodes: &[usize], tags: &str| {
        let id = ids.next().unwrap();
        let nodes: String = nodes.iter().map(|id| format!("<nd ref='{id}'/>")).collect();
        text += &format!("<way id='{id}'>{nodes}<tag k='highway' v='residential'/>{tags}</way>");
    };
    let each = NODES / pieces;
    for piece in 0..pieces {
        let nodes: Vec<_> = (piece * each..=(piece + 1) * each)
            .map(|id| id % NODES)
            .collect();
        way(&nodes, "<tag k='junction' v='roundabout'/>");
    }
    for arm in 0..4 {
        way(&[arm * NODES / 4, 100 + arm], "");
        way(&[100 + arm, 200 + arm], "");
    }
    text + "</osm>"
}

#[test]
fn a_town_is_the_same_however_its_ways_are_parted() {
    for pieces in [1, 2, 4, 8, 12] {
        for side in [1.0, -1.0] {
            let found = roundabouts(&read(&town(pieces, side), None).unwrap());
            assert_eq!(found.len(), 1, "{pieces} {side}");
            assert_eq!(found[0].is_clockwise, side < 0.0);
            assert_eq!(found[0].arms.len(), 4, "{pieces} {side}");
            for arm in &found[0].arms {
                assert_eq!(
                    (arm.entries.len(), arm.exits.len()),
                    (1, 1),
                    "{pieces} {side}"
                );
                // Followed beyond the first piece.
                assert!(arm.entries[0].way.length_m() > 55.0);
                assert!(arm.exits[0].way.length_m() > 55.0);
            }
            let elements = Elements::of(&found[0]);
            assert!(
                (elements.outer_diameter_m - 29.5).abs() < 0.2,
                "{elements:?}"
            );
        }
    }
}

#[test]
fn loops_that_nobody_drives_round_are_no_roundabouts() {
    for (from, to) in [
        ("<tag k='junction' v='roundabout'/>", ""),
        ("residential", "footway"),
    ] {
        let map = read(&town(1, 1.0).replace(from, to), None).unwrap();
        assert_eq!(roundabouts(&map), [], "{to}");
    }
}
