//! `kreisel roundabout`: elements and type of the roundabouts in a map.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use super::files::{Output, check_distinct};
use super::{Completion, roads};
use crate::ego::geodesy::{Geodetic, LocalFrame};
use crate::roadmap::{
    ArmElements, DrivenRoundabout, Elements, LaneKind, Roadmap, Roundabout, SIMPLIFIED_WITHIN_M,
    Simplified, roundabouts, scn, simplified, svg,
};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A map: OpenDaVINCI's scenario (.scn, .scnx) or OpenStreetMap (.osm).
    #[arg(value_name = "MAP")]
    map: PathBuf,
    /// Draw the roundabouts, north up.
    #[arg(long, value_name = "OUT.svg")]
    svg: Option<PathBuf>,
    /// Write the map's roads as a scenario, with its roundabouts declared.
    #[arg(long, value_name = "OUT.scn")]
    output: Option<PathBuf>,
    /// Where the map's places are counted from, instead of what the file says.
    #[arg(long, value_name = "LAT,LON", value_parser = roads::origin)]
    origin: Option<Geodetic>,
    /// Say it in JSON.
    #[arg(long)]
    json: bool,
}

/// A roundabout with all that is said of it.
struct Found {
    roundabout: Roundabout,
    elements: Elements,
    simplified: Simplified,
}

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    let outputs = [arguments.svg.as_ref(), arguments.output.as_ref()];
    check_distinct(&[Some(&arguments.map)], &outputs)?;
    let map = roads::read(&arguments.map, arguments.origin)?;
    let found: Vec<_> = roundabouts(&map)
        .into_iter()
        .map(|roundabout| Found {
            elements: Elements::of(&roundabout),
            simplified: simplified(&roundabout),
            roundabout,
        })
        .collect();
    if arguments.json {
        say!(
            "{}",
            serde_json::to_string_pretty(&Description::of(&map, &found))?
        );
    } else {
        describe(&map, &found)?;
    }
    if let Some(path) = &arguments.svg {
        let drawn: Vec<_> = found
            .iter()
            .map(|found| (found.roundabout.clone(), found.elements.clone()))
            .collect();
        let mut output = Output::create(path)?;
        output.put(svg(&map, &drawn).as_bytes())?;
        output.finish()?;
    }
    if let Some(path) = &arguments.output {
        let mut output = Output::create(path)?;
        output.put(scn::write(&declared(map, &found)).as_bytes())?;
        output.finish()?;
    }
    Ok(Completion::Done)
}

/// The map with what was found in it named.
fn declared(mut map: Roadmap, found: &[Found]) -> Roadmap {
    for found in found {
        let number = map.declared.len() as u32 + 1;
        if let Some(declared) = found.roundabout.declaration(number, &map) {
            map.declared.push(declared);
        }
    }
    map
}

fn describe(map: &Roadmap, found: &[Found]) -> Result<()> {
    let repeated = map.repeated_points();
    say!(
        "{}: {}, {}{}",
        map.name,
        counted(map.lanes.len(), "lane"),
        counted(map.point_count(), "point"),
        if repeated > 0 {
            format!(" ({repeated} repeated)")
        } else {
            String::new()
        },
    );
    if let Some(origin) = map.origin {
        let order = if origin.is_longitude_first {
            "longitude first in the file"
        } else {
            "latitude first"
        };
        say!(
            "origin {:.6}, {:.6} ({order}), x axis {:.1} degrees from east",
            origin.place.latitude_deg,
            origin.place.longitude_deg,
            origin.rotation_rad.to_degrees()
        );
    }
    if !map.skipped.is_empty() {
        let skipped: Vec<_> = map
            .skipped
            .iter()
            .map(|(name, count)| format!("{count} {name}"))
            .collect();
        say!("passed over: {}", skipped.join(", "));
    }
    if found.is_empty() {
        say!("no roundabout: none is declared or named, and no lanes close a circle");
    }
    for found in found {
        describe_one(map, found)?;
    }
    Ok(())
}

fn describe_one(map: &Roadmap, found: &Found) -> Result<()> {
    let Found {
        roundabout,
        elements,
        simplified,
    } = found;
    say!("");
    say!(
        "{}: {} roundabout ({})",
        if roundabout.name.is_empty() {
            "without a name"
        } else {
            &roundabout.name
        },
        elements.kind.name(),
        roundabout.source.name()
    );
    say!(
        "  outer diameter {:.1} m, island {:.1} m, circular path {:.1} m wide, {}, driven {}",
        elements.outer_diameter_m,
        elements.inner_diameter_m,
        elements.path_width_m,
        counted(elements.lanes, "lane"),
        if roundabout.is_clockwise {
            "clockwise"
        } else {
            "counter-clockwise"
        }
    );
    let [x, y] = roundabout.centre_m();
    let place = geodetic(map, [x, y]).map_or_else(String::new, |place| {
        format!(" ({:.6}, {:.6})", place.latitude_deg, place.longitude_deg)
    });
    say!("  centre {x:.1} m east, {y:.1} m north of the origin{place}");
    for ring in roundabout
        .rings
        .iter()
        .filter(|ring| ring.kind != LaneKind::Road)
    {
        say!(
            "  {} from {:.1} to {:.1} m off the centre",
            ring.kind.name(),
            ring.inner_m(),
            ring.outer_m()
        );
    }
    for arm in &elements.arms {
        say!("  {}", described(arm));
    }
    for contradiction in &elements.contradictions {
        say!("  against it: {contradiction}");
    }
    say!(
        "  simplified within {SIMPLIFIED_WITHIN_M} m: circles, and {} of {} points of the arms (at most {:.2} m off)",
        simplified.points - simplified.dropped,
        simplified.points,
        simplified.off_m
    );
    Ok(())
}

fn described(arm: &ArmElements) -> String {
    let way = |name: &str, width_m: Option<f64>, radius_m: Option<f64>| {
        let width_m = width_m?;
        let corner = radius_m.map_or_else(String::new, |radius_m| {
            format!(", corner radius {radius_m:.1} m")
        });
        Some(format!("{name} {width_m:.1} m{corner}"))
    };
    let parts = [
        way("entry", arm.entry_width_m, arm.entry_radius_m),
        way("exit", arm.exit_width_m, arm.exit_radius_m),
        arm.divider_m.map(|metres| format!("divider {metres:.1} m")),
    ];
    let parts: Vec<_> = parts.into_iter().flatten().collect();
    let bearing_deg = compass_deg(arm.bearing_rad);
    format!(
        "arm at {bearing_deg:.0} degrees from north: {}",
        parts.join("; ")
    )
}

/// A roundabout that no map knows, in a line; its place on the earth if that of the local frame is known.
pub(super) fn described_found(found: &DrivenRoundabout, reference: Option<Geodetic>) -> String {
    let roundabout = &found.roundabout;
    let [x, y] = roundabout.centre_m();
    let place = reference.map_or_else(
        || format!("{x:.1} m, {y:.1} m"),
        |reference| {
            let place = LocalFrame::around(reference).geodetic([x, y, 0.0]);
            format!("{:.7}, {:.7}", place.latitude_deg, place.longitude_deg)
        },
    );
    let rings = roundabout.rings.iter().map(|ring| {
        let kind = ring.kind.name();
        format!("{kind} {:.1} to {:.1} m", ring.inner_m(), ring.outer_m())
    });
    format!(
        "roundabout found by who drives round it: centre {place}; {}; {}; confidence {:.2}",
        rings.collect::<Vec<_>>().join(", "),
        counted(roundabout.arms.len(), "arm"),
        found.confidence,
    )
}

fn geodetic(map: &Roadmap, [x, y]: [f64; 2]) -> Option<Geodetic> {
    let origin = map.origin?;
    let (sine, cosine) = libm::sincos(origin.rotation_rad);
    let turned = [x * cosine - y * sine, x * sine + y * cosine, 0.0];
    Some(LocalFrame::around(origin.place).geodetic(turned))
}

fn compass_deg(bearing_rad: f64) -> f64 {
    (90.0 - bearing_rad.to_degrees()).rem_euclid(360.0)
}

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

#[derive(Serialize)]
struct Description<'a> {
    name: &'a str,
    lanes: usize,
    points: usize,
    repeated_points: usize,
    origin: Option<[f64; 2]>,
    skipped: &'a std::collections::BTreeMap<String, usize>,
    roundabouts: Vec<RoundaboutDescription<'a>>,
}

#[derive(Serialize)]
struct RoundaboutDescription<'a> {
    name: &'a str,
    source: &'static str,
    #[serde(rename = "type")]
    kind: &'static str,
    clockwise: bool,
    centre: [f64; 2],
    centre_wgs84: Option<[f64; 2]>,
    outer_diameter: f64,
    inner_diameter: f64,
    path_width: f64,
    lanes: usize,
    rings: Vec<RingDescription>,
    arms: Vec<ArmDescription>,
    warnings: Vec<String>,
    simplified_points: usize,
    dropped_points: usize,
    simplified_off: f64,
}

#[derive(Serialize)]
struct RingDescription {
    kind: &'static str,
    inner: f64,
    outer: f64,
}

#[derive(Serialize)]
struct ArmDescription {
    bearing_from_north_deg: f64,
    entry_width: Option<f64>,
    exit_width: Option<f64>,
    entry_radius: Option<f64>,
    exit_radius: Option<f64>,
    divider: Option<f64>,
}

impl<'a> Description<'a> {
    fn of(map: &'a Roadmap, found: &'a [Found]) -> Self {
        let degrees = |place: Geodetic| [place.latitude_deg, place.longitude_deg];
        let one = |found: &'a Found| {
            let (roundabout, elements) = (&found.roundabout, &found.elements);
            RoundaboutDescription {
                name: &roundabout.name,
                source: roundabout.source.name(),
                kind: elements.kind.name(),
                clockwise: roundabout.is_clockwise,
                centre: roundabout.centre_m(),
                centre_wgs84: geodetic(map, roundabout.centre_m()).map(degrees),
                outer_diameter: elements.outer_diameter_m,
                inner_diameter: elements.inner_diameter_m,
                path_width: elements.path_width_m,
                lanes: elements.lanes,
                rings: roundabout
                    .rings
                    .iter()
                    .map(|ring| RingDescription {
                        kind: ring.kind.name(),
                        inner: ring.inner_m(),
                        outer: ring.outer_m(),
                    })
                    .collect(),
                arms: elements
                    .arms
                    .iter()
                    .map(|arm| ArmDescription {
                        bearing_from_north_deg: compass_deg(arm.bearing_rad),
                        entry_width: arm.entry_width_m,
                        exit_width: arm.exit_width_m,
                        entry_radius: arm.entry_radius_m,
                        exit_radius: arm.exit_radius_m,
                        divider: arm.divider_m,
                    })
                    .collect(),
                warnings: elements
                    .contradictions
                    .iter()
                    .map(ToString::to_string)
                    .collect(),
                simplified_points: found.simplified.points - found.simplified.dropped,
                dropped_points: found.simplified.dropped,
                simplified_off: found.simplified.off_m,
            }
        };
        Self {
            name: &map.name,
            lanes: map.lanes.len(),
            points: map.point_count(),
            repeated_points: map.repeated_points(),
            origin: map.origin.map(|origin| degrees(origin.place)),
            skipped: &map.skipped,
            roundabouts: found.iter().map(one).collect(),
        }
    }
}
