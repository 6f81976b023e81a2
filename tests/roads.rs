//! `kreisel roundabout` as a user runs it.
#![cfg(feature = "shell")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn kreisel(map: &Path, options: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kreisel"));
    command.arg("roundabout").arg(map).args(options);
    command.output().unwrap()
}

fn described(map: &Path, options: &[&str]) -> Value {
    let output = kreisel(map, &[options, &["--json"]].concat());
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{text}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A map of the shared data.
fn shared(name: &str) -> Option<std::path::PathBuf> {
    Some(common::data("../roundabout")?.join(name))
}

fn near(value: &Value, expected: f64, within: f64) -> bool {
    value
        .as_f64()
        .is_some_and(|value| (value - expected).abs() <= within)
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn the_proving_grounds_roundabouts_are_found_in_the_scenario() {
    for name in ["astazero.scn", "astazero-rewritten.scn"] {
        let Some(map) = shared(name) else { return };
        let found = described(&map, &[]);
        assert_eq!(
            (found["lanes"].as_u64(), found["points"].as_u64()),
            (Some(25), Some(1741))
        );
        let [north, west] = &found["roundabouts"].as_array().unwrap()[..] else {
            panic!("{found}");
        };
        assert_eq!(
            (&north["name"], &west["name"]),
            (&"RoundAboutNorth".into(), &"RoundAboutWest".into())
        );
        assert_eq!(west["arms"].as_array().unwrap().len(), 1, "{west}");
        assert!(near(&west["outer_diameter"], 24.3, 0.3), "{west}");
        assert!(!west["warnings"].as_array().unwrap().is_empty());
    }
}

/// Two maps of one place, drawn by different hands.
#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn openstreetmap_has_the_western_roundabout_at_the_same_place() {
    let (Some(scenario), Some(map)) = (shared("astazero.scn"), shared("astazero.osm")) else {
        return;
    };
    let west = &described(&scenario, &[])["roundabouts"][1];
    let origin = &["--origin", "57.772840,12.769964"];
    let found = described(&map, origin);
    let rings = found["roundabouts"].as_array().unwrap();
    assert_eq!(rings.len(), 3, "{found}");
    let centre = |one: &Value| [0, 1].map(|axis| one["centre"][axis].as_f64().unwrap());
    let [x, y] = centre(west);
    let nearest = rings.iter().map(|one| {
        let [u, v] = centre(one);
        (u - x).hypot(v - y)
    });
    assert!(nearest.fold(f64::INFINITY, f64::min) < 2.0, "{found}");
    let is_right_handed = |one: &Value| one["clockwise"] == Value::Bool(false);
    assert!(rings.iter().all(is_right_handed));
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn an_archive_is_read_and_its_bends_are_no_roundabouts() {
    let Some(map) = shared("track.scnx") else {
        return;
    };
    let found = described(&map, &[]);
    assert_eq!(found["lanes"], 44);
    assert_eq!(found["skipped"]["POLYGON"], 12);
    assert!(near(&found["origin"][0], 29.445996, 1e-9), "{found}");
    assert_eq!(found["roundabouts"], Value::Array(vec![]));
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn what_is_written_again_is_read_as_the_same_roads() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["astazero.scn", "track.scnx", "astazero.osm"] {
        let Some(map) = shared(name) else { return };
        let (copy, drawing) = (
            folder.path().join("copy.scn"),
            folder.path().join("all.svg"),
        );
        let first = described(
            &map,
            &[
                "--output",
                copy.to_str().unwrap(),
                "--svg",
                drawing.to_str().unwrap(),
            ],
        );
        let second = described(&copy, &[]);
        for key in ["lanes", "points", "repeated_points"] {
            assert_eq!(first[key], second[key], "{name}: {key}");
        }
        let rings = |found: &Value| found["roundabouts"].as_array().unwrap().clone();
        for (one, other) in rings(&first).iter().zip(&rings(&second)) {
            assert_eq!(other["source"], "declared");
            for key in ["outer_diameter", "inner_diameter"] {
                assert!(
                    near(&one[key], other[key].as_f64().unwrap(), 0.01),
                    "{name}: {one} {other}"
                );
            }
            assert_eq!(
                one["arms"].as_array().unwrap().len(),
                other["arms"].as_array().unwrap().len()
            );
        }
        assert_eq!(rings(&first).len(), rings(&second).len());
        assert!(
            std::fs::read_to_string(&drawing)
                .unwrap()
                .ends_with("</svg>\n")
        );
    }
}

fn archive_of(name: &str, content: &[u8]) -> Vec<u8> {
    let mut archive = rawzip::ZipArchiveWriter::new(vec![]);
    let (mut entry, config) = archive.new_file(name).start().unwrap();
    let mut writer = config.wrap(&mut entry);
    writer.write_all(content).unwrap();
    let (_, sizes) = writer.finish().unwrap();
    entry.finish(sizes).unwrap();
    archive.finish().unwrap()
}

#[test]
fn what_is_no_map_is_one_line_with_file_and_place() {
    let folder = tempfile::tempdir().unwrap();
    let archive = archive_of("readme.txt", b"none");
    let mut damaged = archive_of("scenario.scn", b"SCENARIO");
    let content = damaged.windows(8).position(|bytes| bytes == b"SCENARIO");
    damaged[content.unwrap()] ^= 1;
    for (name, bytes, expected) in [
        (
            "empty.scn",
            b"".to_vec(),
            "line 1, column 1: the file ends, SCENARIO is missing",
        ),
        (
            "noise.scn",
            vec![0xff; 300],
            "line 1, column 1: no scenario",
        ),
        (
            "page.osm",
            b"<html></html>".to_vec(),
            "line 1, column 1: no OpenStreetMap",
        ),
        (
            "cut.scnx",
            archive[..archive.len() / 2].to_vec(),
            "a damaged archive",
        ),
        (
            "other.scnx",
            archive.clone(),
            "an archive without scenario.scn",
        ),
        ("damaged.scnx", damaged, "scenario.scn in the archive: "),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let output = kreisel(&path, &[]);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert_eq!(text.lines().count(), 1, "{text}");
        assert!(text.contains(&format!("{name}: {expected}")), "{text}");
    }
}
