//! May one enter now? Road users on the lanes of a roundabout that a map knows, or that was found by who drives round
//! it, and the gap between them (the thesis' question; the elements are those of its section 2.2).
//!
//! A layer of its own behind the tracks: it changes no object, and where there is no roundabout it only looks at who turns.
//! It advises, and is no safety function.

mod advice;
mod approach;
mod arms;
mod bend;
mod candidates;
mod finder;
mod gap;
mod kerbs;
mod lanes;
mod leaving;
mod on_lane;
mod own;
mod sight;
mod site;
mod unseen;

use crate::ego::Pose;
use crate::ego::geodesy::Geodetic;
use crate::parameter::{Text, parameters};
use crate::roadmap::{DrivenRoundabout, Origin, Roadmap, Roundabout, roundabouts, simplified};
use crate::time::Time;
use crate::track::Object;
use candidates::Candidate;
use finder::Finder;
use gap::Users;
use lanes::Beliefs;
use site::{Placing, Site};
use unseen::Unseen;

pub use advice::{Advice, ArmAdvice, Crossing, Hindrance, State, UserOnLane};
pub use gap::Window;
pub use on_lane::{OnLane, Place};
pub use sight::Sight;

parameters! {
    /// Roundabouts: road users on their lanes, and the gap. Advice, and no safety function.
    pub struct RoundaboutParameters "roundabout" {
        /// Map of roads with the roundabout: OpenDaVINCI's scenario (.scn, .scnx) or OpenStreetMap
        /// (.osm). If empty, only found ones are told of.
        map: Text = Text::default(), "";
        /// Where the map's origin lies in a local frame that has no place on the earth, as that of a sensor
        /// without poses: to the east, or to the right of the sensor's first place.
        map_x_m: f64 = 0.0, in -100_000.0..=100_000.0, "m";
        /// The same, to the north, or ahead.
        map_y_m: f64 = 0.0, in -100_000.0..=100_000.0, "m";
        /// How far the map's x axis is turned counter-clockwise from that frame's.
        map_turn_deg: f64 = 0.0, in -180.0..=180.0, "degrees";
        /// Whether roundabouts that no map knows are found by who drives round them.
        find: bool = true, thesis false, "";
        /// How the vehicle gathers speed when it enters.
        acceleration_mps2: f64 = 3.0, in 0.3..=8.0, "m/s^2";
        /// How it brakes before the circle.
        deceleration_mps2: f64 = 4.5, in 0.5..=10.0, "m/s^2";
        /// Speed up to which it does. Who is not seen is taken to come as fast.
        speed_mps: f64 = 8.33, in 1.0..=20.0, "m/s";
        /// Time that must lie between the vehicle's leaving a conflict point and the next road user's coming.
        margin_s: f64 = 2.0, in 0.0..=10.0, "s";
        /// Length of the vehicle.
        own_length_m: f64 = 4.5, in 0.5..=25.0, "m";
        /// From the place of its pose ahead to its front.
        own_front_m: f64 = 2.3, in -5.0..=20.0, "m";
        /// Distance of the vehicle from the circle's edge within which it counts as being at the roundabout.
        reach_m: f64 = 60.0, in 5.0..=500.0, "m";
    }
}

/// So late it is told that somebody brakes: speeds of cars that brake before a roundabout are told 0.5 to 0.7 m/s too high.
const TOLD_LATE_S: f64 = 0.5;

/// What a revolution brings.
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a> {
    /// End of the sweep.
    pub time: Time,
    /// Where the local frame, in which all that follows is, lies on the earth; if it does.
    pub reference: Option<Geodetic>,
    /// Number of the local frame: places of different ones cannot be compared.
    pub epoch: u32,
    /// The vehicle, if its pose is known.
    pub vehicle: Option<Pose>,
    /// Its speed.
    pub vehicle_speed_mps: f64,
    /// Road users in the local frame.
    pub objects: &'a [Object],
    /// Where the rays went; nothing where all is seen.
    pub sight: Option<Sight<'a>>,
}

/// Watches the roundabouts of a map.
#[derive(Debug, Clone)]
pub struct Watcher {
    parameters: RoundaboutParameters,
    roundabouts: Vec<Roundabout>,
    origin: Option<Origin>,
    finder: Finder,
    /// The local frame of what was found.
    frame: Option<(Option<Geodetic>, u32)>,
    /// Where they lie in the local frame, and by which placing; behind those of the map the ones that were found.
    sites: Vec<Site>,
    placing: Option<Placing>,
    /// The one that is watched, and what is remembered of it.
    watched: Option<usize>,
    beliefs: Beliefs,
    unseen: Unseen,
    last: Option<Time>,
    /// When it began to be watched.
    since: Option<Time>,
    advice: Advice,
    /// Whether one may enter and leave by each arm, as it was said last.
    announced: Vec<[bool; 2]>,
    /// Lanes of each object, reused.
    lanes: Vec<Vec<OnLane>>,
    candidates: Vec<Candidate>,
}

impl Watcher {
    /// One that knows no roundabout.
    pub fn new(parameters: &RoundaboutParameters) -> Self {
        Self {
            parameters: parameters.clone(),
            roundabouts: vec![],
            origin: None,
            finder: Finder::default(),
            frame: None,
            sites: vec![],
            placing: None,
            watched: None,
            beliefs: Beliefs::default(),
            unseen: Unseen::default(),
            last: None,
            since: None,
            advice: Advice::default(),
            announced: vec![],
            lanes: vec![],
            candidates: vec![],
        }
    }

    /// Takes a map's roundabouts; gives how many there are.
    pub fn take_map(&mut self, map: &Roadmap) -> usize {
        let found = roundabouts(map);
        self.roundabouts = found.iter().map(|one| simplified(one).roundabout).collect();
        self.origin = map.origin;
        self.placing = None;
        self.forget();
        self.roundabouts.len()
    }

    /// Forgets who was where, and what was found.
    pub fn reset(&mut self) {
        self.forget();
        self.forget_found();
    }

    fn forget_found(&mut self) {
        self.finder = Finder::default();
        self.placing = None;
    }

    /// Roundabouts that were found, where they lie in the local frame.
    pub fn found(&self) -> &[DrivenRoundabout] {
        self.finder.found()
    }

    fn forget(&mut self) {
        self.watched = None;
        self.forget_users();
    }

    fn forget_users(&mut self) {
        self.advice.own_arm = None;
        self.announced.clear();
        self.beliefs = Beliefs::default();
        self.unseen = Unseen::default();
        self.last = None;
        self.since = None;
    }

    /// What is to be said of the nearest roundabout; nothing if none is near.
    pub fn advice(&self) -> Option<&Advice> {
        self.watched.map(|_| &self.advice)
    }

    /// Takes in a revolution.
    pub fn watch(&mut self, situation: &Situation<'_>) {
        let frame = (situation.reference, situation.epoch);
        if self.frame != Some(frame) {
            // What was found lies elsewhere now.
            self.frame = Some(frame);
            self.forget_found();
        }
        self.place(situation);
        let is_mapped = |watched| watched < self.roundabouts.len();
        if self.parameters.find && !self.watched.is_some_and(is_mapped) {
            self.find(situation);
        }
        let Some(index) = self.nearest(situation) else {
            self.forget();
            return;
        };
        if self.watched != Some(index) {
            self.forget();
            self.watched = Some(index);
        }
        let site = &self.sites[index];
        let passed_s = self
            .last
            .map_or(0.0, |last| (situation.time - last).seconds());
        self.last = Some(situation.time);
        self.since.get_or_insert(situation.time);
        if let Some(sight) = &situation.sight {
            let road_mps = self.parameters.speed_mps;
            self.unseen
                .update(site, sight, situation.objects, passed_s, road_mps);
        }
        let objects = situation.objects;
        let count = self.lanes.len().max(objects.len());
        self.lanes.resize_with(count, Vec::new);
        // Ids are the tracker's.
        let is_listed = |id| objects.iter().any(|object| object.id == id);
        self.beliefs.keep(is_listed, passed_s);
        // Who is known is known without delay.
        let told_late_s = situation.sight.map_or(0.0, |_| TOLD_LATE_S);
        for (object, lanes) in objects.iter().zip(&mut self.lanes) {
            let belief = self.beliefs.of(object.id);
            let times_s = [passed_s, told_late_s];
            belief.update(site, object, times_s, &mut self.candidates, lanes);
        }
        let users = Users {
            objects,
            lanes: &self.lanes,
        };
        self.unseen.note_listed(site, users);
        self.advise(index, situation);
    }

    /// Those who drive round what the map lacks.
    fn find(&mut self, situation: &Situation<'_>) {
        if !self.finder.take(situation) {
            return;
        }
        let lanes = |watcher: &Self| {
            let watched = watcher.watched.and_then(|index| watcher.sites.get(index));
            watched.map(Site::lanes)
        };
        let before = lanes(self);
        self.placing = None;
        self.place(situation);
        // What was remembered of lanes is of others.
        if lanes(self) != before {
            self.forget_users();
        }
    }

    /// The sites, where the local frame lies now.
    fn place(&mut self, situation: &Situation<'_>) {
        let placing = Placing {
            reference: situation.reference,
            origin: self.origin,
            shift_m: [self.parameters.map_x_m, self.parameters.map_y_m],
            turn_rad: self.parameters.map_turn_deg.to_radians(),
        };
        if self.placing != Some(placing) {
            self.placing = Some(placing);
            let placed = self
                .roundabouts
                .iter()
                .map(|one| Site::placed(one, &placing));
            self.sites = placed.collect();
            let known = self.sites.len();
            for found in self.finder.found() {
                let site = Site::found(found);
                let is_known = |known: &Site| {
                    let [x, y] = [0, 1].map(|axis| known.centre_m[axis] - site.centre_m[axis]);
                    libm::hypot(x, y) < known.outer_m
                };
                if !self.sites[..known].iter().any(is_known) {
                    self.sites.push(site);
                }
            }
        }
    }

    fn nearest(&self, situation: &Situation<'_>) -> Option<usize> {
        let [x, y] = situation
            .vehicle
            .map_or([0.0; 2], |pose| [pose.position_m[0], pose.position_m[1]]);
        let away_m =
            |site: &Site| libm::hypot(site.centre_m[0] - x, site.centre_m[1] - y) - site.outer_m;
        let sites = self.sites.iter().enumerate();
        let nearest = sites.min_by(|(_, a), (_, b)| away_m(a).total_cmp(&away_m(b)));
        nearest
            .filter(|(_, site)| away_m(site) < self.parameters.reach_m)
            .map(|(index, _)| index)
    }
}

#[cfg(test)]
mod tests;
