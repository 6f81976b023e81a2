//! Objects beside a recording's truth: what `kreisel process --truth` says at the end.
//!
//! A quick look; `scripts/evaluate` has the field's own measures.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context as _, Result, anyhow};
use serde::Deserialize;

use super::files;
use super::gap_score::GapScore;
use crate::ego::{Frame, Pose};
use crate::pipeline::{Pipeline, RevolutionReport};
use crate::roadmap::Roadmap;
use crate::roundabout::{RoundaboutParameters, Situation};
use crate::simulate::TrueObject;
use crate::time::Time;
use crate::track::{Class, Object};

#[derive(Debug, Deserialize)]
struct TrueLine {
    t: f64,
    ego: TrueEgo,
    objects: Vec<TrueUser>,
}

#[derive(Debug, Deserialize)]
struct TrueEgo {
    x: f64,
    y: f64,
    yaw: f64,
    #[serde(default)]
    v: f64,
}

/// A true road user as truth files have it.
#[derive(Debug, Deserialize)]
pub(super) struct TrueUser {
    id: u32,
    #[serde(default)]
    class: String,
    x: f64,
    y: f64,
    #[serde(default)]
    yaw: f64,
    v: f64,
    #[serde(default)]
    yaw_rate: f64,
    #[serde(default)]
    l: f64,
    #[serde(default)]
    w: f64,
    #[serde(default)]
    h: f64,
    points: usize,
}

/// A true road user counts from so many returns on.
const LEAST_POINTS: usize = 5;
/// Farther apart are two different things.
const MATCH_M: f64 = 2.0;

/// Truth, and how the objects compare so far.
#[derive(Debug)]
pub(super) struct Score {
    /// By the end of the sweep, in microseconds.
    truth: BTreeMap<i64, TrueLine>,
    /// The last id of every true road user.
    ids: BTreeMap<u32, u32>,
    revolutions: usize,
    counted: usize,
    found: usize,
    off_m: f64,
    off_mps: f64,
    false_objects: usize,
    switches: usize,
    gaps: Option<GapScore>,
}

impl Score {
    /// Reads truth as `kreisel simulate --truth` writes it.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let content = String::from_utf8(files::read(path)?).map_err(|error| {
            let byte = error.utf8_error().valid_up_to();
            anyhow!("{}: byte {byte} is not UTF-8 text", path.display())
        })?;
        let mut truth = BTreeMap::new();
        let mut offset = 0;
        for text in content.split_inclusive('\n') {
            let line: TrueLine = serde_json::from_str(text).with_context(|| {
                format!("{}: no truth in the line at byte {offset}", path.display())
            })?;
            offset += text.len();
            truth.insert((1e6 * line.t) as i64, line);
        }
        Ok(Self {
            truth,
            ids: BTreeMap::new(),
            revolutions: 0,
            counted: 0,
            found: 0,
            off_m: 0.0,
            off_mps: 0.0,
            false_objects: 0,
            switches: 0,
            gaps: None,
        })
    }

    /// Compares what is said of a map's roundabouts, too.
    pub(super) fn watch_gaps(&mut self, parameters: &RoundaboutParameters, roads: &Roadmap) {
        self.gaps = Some(GapScore::new(parameters, roads));
    }

    /// Compares a revolution's objects, the closest pairs first. Revolutions without truth do
    /// not count.
    pub(super) fn take(&mut self, report: &RevolutionReport, pipeline: &Pipeline) {
        let objects = pipeline.objects();
        /// Truth and revolution mean the same time if they differ by less, in microseconds.
        const SAME_TIME: i64 = 5_000;
        let time = report.time.micros();
        let mut near = self
            .truth
            .range(time.saturating_sub(SAME_TIME)..=time.saturating_add(SAME_TIME));
        let Some((_, line)) = near.next() else {
            return;
        };
        self.revolutions += 1;
        self.counted += line.objects.iter().filter(|user| is_counted(user)).count();
        let places: Vec<[f64; 2]> = objects
            .iter()
            .map(|object| place_m(object, report, &line.ego))
            .collect();
        let mut pairs: Vec<(f64, usize, usize)> = vec![];
        for (user, truth) in line.objects.iter().enumerate() {
            for (object, [x, y]) in places.iter().enumerate() {
                let distance_m = libm::hypot(x - truth.x, y - truth.y);
                if distance_m < MATCH_M {
                    pairs.push((distance_m, user, object));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut is_taken = vec![false; objects.len()];
        let mut is_found = vec![false; line.objects.len()];
        for (distance_m, user, object) in pairs {
            if is_taken[object] || is_found[user] {
                continue;
            }
            (is_taken[object], is_found[user]) = (true, true);
            let truth = &line.objects[user];
            if is_counted(truth) {
                self.found += 1;
                self.off_m += distance_m;
                self.off_mps += (objects[object].speed_mps - truth.v).abs();
                let before = self.ids.insert(truth.id, objects[object].id);
                self.switches += usize::from(before.is_some_and(|id| id != objects[object].id));
            }
        }
        self.false_objects += is_taken.iter().filter(|taken| !**taken).count();
        if let (Some(gaps), Some(advice)) = (&mut self.gaps, pipeline.advice()) {
            let users: Vec<Object> = line
                .objects
                .iter()
                .map(|user| user.object(report.time))
                .collect();
            let vehicle = Pose {
                position_m: [line.ego.x, line.ego.y, 0.0],
                yaw_rad: line.ego.yaw,
            };
            let situation = Situation {
                time: report.time,
                reference: pipeline.sweep().reference,
                epoch: pipeline.sweep().epoch,
                vehicle: Some(vehicle),
                vehicle_speed_mps: line.ego.v,
                objects: &users,
                sight: None,
            };
            gaps.take(advice, objects, &situation);
        }
    }

    /// The same of gaps, if there are any.
    pub(super) fn gap_summary(&self) -> Option<String> {
        self.gaps.as_ref().map(GapScore::summary)
    }

    /// One line for people.
    pub(super) fn summary(&self) -> String {
        let share = |sum: f64, count: usize| sum / count.max(1) as f64;
        format!(
            "truth of {} revolutions: {} sightings of road users with {LEAST_POINTS} returns or \
             more, {:.1} % found within {MATCH_M} m, off by {:.2} m and {:.2} m/s in the mean; \
             {:.2} false objects a revolution; {} changes of an id",
            self.revolutions,
            self.counted,
            100.0 * share(self.found as f64, self.counted),
            share(self.off_m, self.found),
            share(self.off_mps, self.found),
            share(self.false_objects as f64, self.revolutions),
            self.switches,
        )
    }
}

impl From<&TrueObject> for TrueUser {
    fn from(user: &TrueObject) -> Self {
        let [x, y] = user.centre_m;
        let [l, w, h] = user.size_m;
        Self {
            id: user.id,
            class: user.class.name().to_owned(),
            x,
            y,
            yaw: user.yaw_rad,
            v: user.speed_mps,
            yaw_rate: user.yaw_rate_radps,
            l,
            w,
            h,
            points: user.points,
        }
    }
}

impl TrueUser {
    /// As an object that is surely known, and always was.
    pub(super) fn object(&self, time: Time) -> Object {
        Object {
            id: self.id,
            class: match self.class.as_str() {
                "car" => Class::Car,
                "truck" => Class::LargeVehicle,
                "cyclist" => Class::Cyclist,
                "pedestrian" => Class::Pedestrian,
                _ => Class::Unclassified,
            },
            class_probability: 1.0,
            measured: true,
            centre_m: [self.x, self.y, 0.0],
            yaw_rad: self.yaw,
            speed_mps: self.v,
            yaw_rate_radps: self.yaw_rate,
            length_m: self.l,
            width_m: self.w,
            height_m: self.h,
            position_deviation_m: [0.0; 2],
            yaw_deviation_rad: 0.0,
            speed_deviation_mps: 0.0,
            existence: 1.0,
            first_seen: Time::ZERO,
            seen_since: Time::ZERO,
            last_measured: time,
            points: self.points,
        }
    }
}

fn is_counted(user: &TrueUser) -> bool {
    user.points >= LEAST_POINTS
}

/// Where an object stands in the frame of the truth.
fn place_m(object: &Object, report: &RevolutionReport, ego: &TrueEgo) -> [f64; 2] {
    let place_m = [object.centre_m[0], object.centre_m[1]];
    if report.frame != Frame::Odometry {
        return place_m;
    }
    // The frames began elsewhere: seen from the vehicle they are one.
    let truly = Pose {
        position_m: [ego.x, ego.y, 0.0],
        yaw_rad: ego.yaw,
    };
    let vehicle = report.vehicle.unwrap_or(Pose::SENSOR);
    let from_vehicle_m = vehicle.placement().sensor_m(place_m);
    truly.placement().local_m(from_vehicle_m)
}
