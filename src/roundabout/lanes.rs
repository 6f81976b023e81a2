//! Which lane a road user is on, and how fast he goes along it: a Bayes filter over the lanes that he may be on.
//!
//! Numbers without another source were set with `scripts/evaluate-roundabouts --seeds 1-8`.

use super::candidates::{Candidate, course, take_candidates};
use super::leaving::{MOUTH_M, takes};
use super::on_lane::{NEW_S, OnLane, Place};
use super::site::Site;
use crate::track::{MOST_LOST_S, Object};

/// What the filter remembers of a road user: lanes with their probabilities.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Belief {
    lanes: Vec<(Place, f64)>,
    /// What the tracker told in the mean of the last moments, if he was seen before.
    mean_told_mps: Option<f64>,
    /// How much of that he has lost by braking before it was told.
    mean_braked_mps: f64,
    /// For how long he has been seen.
    known_s: f64,
    /// Arm by which he came in, if that was seen.
    came_in_by: Option<usize>,
    /// Where he most likely was when he was measured last, moved on since.
    last: Vec<OnLane>,
    /// For how long he has not been listed.
    away_s: f64,
}

/// What is remembered of all of them, in places that are used again.
#[derive(Debug, Clone, Default)]
pub(super) struct Beliefs {
    /// Nobody's have no id.
    places: Vec<(Option<u32>, Belief)>,
}

impl Beliefs {
    /// Forgets where those are who are not listed `passed_s` later, and all of who has been away for too long to come back.
    pub(super) fn keep(&mut self, is_listed: impl Fn(u32) -> bool, passed_s: f64) {
        for (id, belief) in &mut self.places {
            let Some(known) = *id else { continue };
            if is_listed(known) {
                belief.away_s = 0.0;
                continue;
            }
            belief.away_s += passed_s;
            belief.lanes.clear();
            belief.last.clear();
            // Who gets his id back came in and drove as before.
            if belief.away_s > MOST_LOST_S {
                *id = None;
                belief.mean_told_mps = None;
                belief.known_s = 0.0;
                belief.came_in_by = None;
                belief.away_s = 0.0;
            }
        }
    }

    /// Somebody's; of a newcomer nothing is known.
    pub(super) fn of(&mut self, id: u32) -> &mut Belief {
        let position = |wanted| self.places.iter().position(|(other, _)| *other == wanted);
        let place = position(Some(id)).or_else(|| position(None));
        let place = place.unwrap_or_else(|| {
            self.places.push((None, Belief::default()));
            self.places.len() - 1
        });
        self.places[place].0 = Some(id);
        &mut self.places[place].1
    }
}

/// Lanes less probable than this are not told.
pub(super) const LEAST_PROBABILITY: f64 = 0.01;
/// Share of the belief that is forgotten at each revolution: who was surely on a lane may be on
/// another one half a second later.
const FORGOTTEN: f64 = 0.2;
/// Weight of a revolution in the mean speed: the last second of ten a second.
const MEAN_SHARE: f64 = 0.1;
impl Belief {
    /// Takes in where a road user is now, `passed_s` after the last time; gives the lanes that it may be on, the likeliest
    /// first. His speed is that of `told_late_s` ago.
    pub(super) fn update(
        &mut self,
        site: &Site,
        object: &Object,
        [passed_s, told_late_s]: [f64; 2],
        candidates: &mut Vec<Candidate>,
        found: &mut Vec<OnLane>,
    ) {
        if !object.measured && !self.last.is_empty() {
            // Who is hidden goes on along his lane, wherever straight on would lead.
            for on in &mut self.last {
                *on = on.moved_on(site, on.mean_speed_mps * passed_s);
            }
            found.clone_from(&self.last);
            return;
        }
        take_candidates(site, object, candidates);
        let (_, told_mps) = course(object);
        self.known_s += passed_s;
        let [speed_mps, mean_mps] = self.take_speed(site, told_mps, told_late_s);
        let gone_m = speed_mps * passed_s;
        let count = candidates.len();
        for candidate in candidates.iter_mut() {
            candidate.weight =
                candidate.likelihood * self.prior(site, &candidate.on, count, gone_m);
        }
        let sum: f64 = candidates.iter().map(|candidate| candidate.weight).sum();
        let likeliest = candidates
            .iter()
            .max_by(|a, b| a.weight.total_cmp(&b.weight));
        if let Some(Place::Entry(arm, _)) = likeliest.map(|candidate| candidate.on.place) {
            self.came_in_by = Some(arm);
        }
        self.lanes.clear();
        found.clear();
        for candidate in candidates.iter() {
            let probability = candidate.weight / sum;
            self.lanes.push((candidate.on.place, probability));
            if probability >= LEAST_PROBABILITY {
                // As far as it leads along the lane.
                let along = |mps: f64| {
                    if told_mps > 0.0 {
                        mps / told_mps * candidate.on.speed_mps
                    } else {
                        mps
                    }
                };
                found.push(OnLane {
                    probability,
                    known_s: self.known_s,
                    came_in_by: self.came_in_by,
                    speed_mps: along(speed_mps),
                    mean_speed_mps: along(mean_mps),
                    ..candidate.on
                });
            }
        }
        found.sort_unstable_by(|a, b| b.probability.total_cmp(&a.probability));
        self.last.clone_from(found);
    }

    /// Speed now, and in the mean of the last moments, of somebody whose speed of `told_late_s` ago is told.
    fn take_speed(&mut self, site: &Site, told_mps: f64, told_late_s: f64) -> [f64; 2] {
        // It takes a while before the tracker knows the speed of who is new.
        let settled = self.mean_told_mps.filter(|_| self.known_s >= NEW_S);
        let share = settled.map_or(1.0, |_| MEAN_SHARE);
        let mean_told_mps = settled.unwrap_or(told_mps);
        let mean_told_mps = mean_told_mps + share * (told_mps - mean_told_mps);
        self.mean_told_mps = Some(mean_told_mps);
        // Who goes faster than in the mean does not brake. Without this 2 instead of none of 2,940 gaps at the own arm are not
        // there (`scripts/evaluate-roundabouts --seeds 1-70`, 301-343, 401-425 and 501-540).
        let braked_mps = if told_mps > mean_told_mps {
            self.mean_braked_mps = 0.0;
            0.0
        } else {
            told_late_s * self.braking_mps2(site, told_mps)
        };
        self.mean_braked_mps += share * (braked_mps - self.mean_braked_mps);
        [told_mps - braked_mps, mean_told_mps - self.mean_braked_mps].map(|mps| mps.max(0.0))
    }

    /// How hard somebody brakes who comes along a way in.
    fn braking_mps2(&self, site: &Site, speed_mps: f64) -> f64 {
        let last = self.last.first();
        last.map_or(0.0, |on| site.bend_before(on).braking_mps2(speed_mps))
    }

    /// How probable a lane is before it is known where somebody is now.
    fn prior(&self, site: &Site, on: &OnLane, lanes: usize, gone_m: f64) -> f64 {
        let fresh = 1.0 / lanes as f64;
        // Nobody knows where somebody was who was never seen.
        if self.lanes.is_empty() {
            return fresh;
        }
        let known = self.lanes.iter().find(|(other, _)| *other == on.place);
        let kept = known.map_or(0.0, |(_, probability)| *probability);
        let stayed = (1.0 - FORGOTTEN) * kept + FORGOTTEN * fresh;
        let arm = match on.place {
            Place::Exit(arm, _) if on.along_m < MOUTH_M => arm,
            _ => return stayed,
        };
        let rings = self
            .lanes
            .iter()
            .filter(|(place, _)| matches!(place, Place::Ring(_)));
        let round: f64 = rings.map(|(_, probability)| probability).sum();
        // Who leaves does so somewhere along the mouth.
        stayed + takes(site, arm, self.came_in_by) * round * (gone_m / MOUTH_M).clamp(0.0, 1.0)
    }
}
