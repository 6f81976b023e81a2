//! Objects and truth as lines of JSON.

use anyhow::Result;
use serde::Serialize;

use crate::pipeline::RevolutionReport;
use crate::simulate::Truth;
use crate::track::Object;

#[derive(Serialize)]
struct ObjectsLine<'a> {
    t: f64,
    revolution: u32,
    ego: Option<EgoEntry>,
    objects: Vec<ObjectEntry<'a>>,
}

#[derive(Serialize)]
struct EgoEntry {
    x: f64,
    y: f64,
    yaw: f64,
}

#[derive(Serialize)]
struct ObjectEntry<'a> {
    id: u32,
    class: &'a str,
    x: f64,
    y: f64,
    z: f64,
    yaw: f64,
    v: f64,
    yaw_rate: f64,
    l: f64,
    w: f64,
    h: f64,
    confidence: f64,
    measured: bool,
    points: usize,
    speed_deviation: f64,
}

#[derive(Serialize)]
struct TruthLine<'a> {
    t: f64,
    ego: TruthEgo,
    objects: Vec<TruthEntry<'a>>,
}

#[derive(Serialize)]
struct TruthEgo {
    x: f64,
    y: f64,
    z: f64,
    yaw: f64,
    v: f64,
}

#[derive(Serialize)]
struct TruthEntry<'a> {
    id: u32,
    class: &'a str,
    x: f64,
    y: f64,
    yaw: f64,
    v: f64,
    yaw_rate: f64,
    l: f64,
    w: f64,
    h: f64,
    points: usize,
    visible: bool,
}

/// A revolution's objects.
pub(super) fn line(report: &RevolutionReport, objects: &[Object]) -> Result<Vec<u8>> {
    let entry = |object: &Object| ObjectEntry {
        id: object.id,
        class: object.class.name(),
        x: object.centre_m[0],
        y: object.centre_m[1],
        z: object.centre_m[2],
        yaw: object.yaw_rad,
        v: object.speed_mps,
        yaw_rate: object.yaw_rate_radps,
        l: object.length_m,
        w: object.width_m,
        h: object.height_m,
        confidence: object.existence,
        measured: object.measured,
        points: object.points,
        speed_deviation: object.speed_deviation_mps,
    };
    with_newline(&ObjectsLine {
        t: report.time.seconds(),
        revolution: report.number,
        ego: report.vehicle.map(|pose| EgoEntry {
            x: pose.position_m[0],
            y: pose.position_m[1],
            yaw: pose.yaw_rad,
        }),
        objects: objects.iter().map(entry).collect(),
    })
}

/// A revolution's truth.
pub(super) fn truth_line(truth: &Truth) -> Result<Vec<u8>> {
    let entries = truth.objects.iter().map(|object| TruthEntry {
        id: object.id,
        class: object.class.name(),
        x: object.centre_m[0],
        y: object.centre_m[1],
        yaw: object.yaw_rad,
        v: object.speed_mps,
        yaw_rate: object.yaw_rate_radps,
        l: object.size_m[0],
        w: object.size_m[1],
        h: object.size_m[2],
        points: object.points,
        visible: object.points > 0,
    });
    with_newline(&TruthLine {
        t: truth.time.seconds(),
        ego: TruthEgo {
            x: truth.sensor_m[0],
            y: truth.sensor_m[1],
            z: truth.sensor_m[2],
            yaw: truth.sensor_yaw_rad,
            v: truth.sensor_speed_mps,
        },
        objects: entries.collect(),
    })
}

fn with_newline(line: &impl Serialize) -> Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec(line)?;
    bytes.push(b'\n');
    Ok(bytes)
}
