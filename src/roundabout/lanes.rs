//! Which lane a road user is on: a Bayes filter over the lanes, by place, heading, turn and class.
//!
//! Numbers without another source were set with `scripts/evaluate-roundabouts --seeds 1-8`.

use super::leaving::{MOUTH_M, takes};
use super::on_lane::{NEW_S, OnLane, Place};
use super::site::Site;
use crate::ego::wrapped_rad;
use crate::roadmap::{LaneKind, Polyline};
use crate::track::{Class, Object};

/// What the filter remembers of a road user: lanes with their probabilities.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Belief {
    lanes: Vec<(Place, f64)>,
    /// In the mean of the last moments, if he was seen before.
    mean_speed_mps: Option<f64>,
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
            if belief.away_s > RETURNS_S {
                *id = None;
                belief.mean_speed_mps = None;
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
/// Road users keep to the middle of a lane within this share of its width (standard deviation).
const WIDTH_SHARE: f64 = 0.25;
/// And to its direction.
const HEADING_RAD: f64 = 0.12;
/// And to its curvature.
const YAW_RATE_RADPS: f64 = 0.2;
/// Slower ones have no heading that says anything.
const MOVING_MPS: f64 = 0.7;
/// Share of road users who move as none of the lanes lead: they change lanes, or turn round.
const OTHERWISE: f64 = 0.05;
/// Who is listed again with his id after no longer than this came in and drove as before: as long as one may be lost
/// and get it back.
const RETURNS_S: f64 = 4.0;
/// Weight of a revolution in the mean speed: the last second of ten a second.
const MEAN_SHARE: f64 = 0.1;
/// Cosine of the direction against a lane within which somebody goes along it.
const LEADS: f64 = 0.3;
/// Density of road users beside all lanes, in place of a lane's by place and heading.
const ELSEWHERE: f64 = 0.02;
/// Share of those met near a roundabout on roads, bikeways and pavements.
const CLASSES: [(Class, [f64; 3]); 4] = [
    (Class::Car, [0.98, 0.01, 0.01]),
    (Class::LargeVehicle, [0.98, 0.01, 0.01]),
    (Class::Cyclist, [0.27, 0.70, 0.03]),
    (Class::Pedestrian, [0.05, 0.15, 0.80]),
];

/// Share of a class's members that use ways of a kind.
fn share(class: Class, kind: LaneKind) -> f64 {
    let index = LaneKind::ALL.iter().position(|&other| other == kind);
    let known = CLASSES.iter().find(|(other, _)| *other == class);
    let shares = known.map_or([1.0 / 3.0; 3], |(_, shares)| *shares);
    shares[index.unwrap_or(0)]
}

/// One lane as it may hold a road user.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    on: OnLane,
    likelihood: f64,
    /// Likelihood times how probable the lane was before.
    weight: f64,
}

impl Candidate {
    fn new(on: OnLane, likelihood: f64) -> Self {
        Self {
            on,
            likelihood,
            weight: 0.0,
        }
    }
}

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
        let speed_mps = (told_mps - told_late_s * self.braking_mps2(site, told_mps)).max(0.0);
        self.known_s += passed_s;
        // It takes a while before the tracker knows the speed of who is new.
        let settled = self.mean_speed_mps.filter(|_| self.known_s >= NEW_S);
        let mean_mps = settled.unwrap_or(speed_mps);
        let mean_mps = mean_mps + MEAN_SHARE * (speed_mps - mean_mps);
        self.mean_speed_mps = Some(mean_mps);
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

/// The lanes that are near, and none of them.
fn take_candidates(site: &Site, object: &Object, found: &mut Vec<Candidate>) {
    found.clear();
    let nowhere = OnLane {
        place: Place::Elsewhere,
        probability: 0.0,
        along_m: 0.0,
        offset_m: 0.0,
        speed_mps: object.speed_mps,
        mean_speed_mps: 0.0,
        known_s: 0.0,
        came_in_by: None,
    };
    found.push(Candidate::new(nowhere, ELSEWHERE));
    found.extend((0..site.rings.len()).filter_map(|ring| on_ring(site, ring, object)));
    let outermost = site.outermost_road().map(|ring| &site.rings[ring].circle);
    let round_per_m = outermost.map_or(0.0, |circle| site.side() / circle.radius_m);
    for (arm, ways) in site.arms.iter().enumerate() {
        for (lane, entry) in ways.entries.iter().enumerate() {
            let place = Place::Entry(arm, lane);
            let before_per_m = 0.0;
            found.extend(on_way(
                place,
                &entry.way,
                entry.width_m,
                before_per_m,
                object,
            ));
        }
        for (lane, exit) in ways.exits.iter().enumerate() {
            let place = Place::Exit(arm, lane);
            found.extend(on_way(place, &exit.way, exit.width_m, round_per_m, object));
        }
    }
}

/// Direction of motion: a box that goes backwards moves against its yaw.
pub(super) fn course(object: &Object) -> (f64, f64) {
    if object.speed_mps < 0.0 {
        (
            wrapped_rad(object.yaw_rad + std::f64::consts::PI),
            -object.speed_mps,
        )
    } else {
        (object.yaw_rad, object.speed_mps)
    }
}

fn gauss(off: f64, deviation: f64) -> f64 {
    libm::exp(-0.5 * (off / deviation) * (off / deviation))
}

/// How well the motion fits a lane that leads somewhere with a curvature.
fn motion_fit(object: &Object, heading_rad: f64, curvature_per_m: f64) -> f64 {
    let (course_rad, speed_mps) = course(object);
    if speed_mps < MOVING_MPS {
        return 1.0;
    }
    let heading_deviation_rad = libm::hypot(HEADING_RAD, object.yaw_deviation_rad);
    let off_rad = wrapped_rad(course_rad - heading_rad);
    let off_radps = object.yaw_rate_radps - speed_mps * curvature_per_m;
    let fits =
        gauss(off_rad, heading_deviation_rad) * gauss(off_radps, YAW_RATE_RADPS + 0.05 * speed_mps);
    (1.0 - OTHERWISE) * fits + OTHERWISE
}

fn place_fit(object: &Object, offset_m: f64, width_m: f64) -> f64 {
    let [x, y] = object.position_deviation_m;
    let deviation_m = libm::hypot(WIDTH_SHARE * width_m, x.max(y));
    gauss(offset_m, deviation_m)
}

fn on_ring(site: &Site, index: usize, object: &Object) -> Option<Candidate> {
    let ring = &site.rings[index];
    let at_m = [object.centre_m[0], object.centre_m[1]];
    let offset_m = ring.circle.off_m(at_m);
    if offset_m.abs() > 2.0 * ring.width_m {
        return None;
    }
    let angle_rad = ring.circle.angle_rad(at_m);
    let tangent_rad = site.tangent_rad(angle_rad);
    let side = site.side();
    let along = motion_fit(object, tangent_rad, side / ring.circle.radius_m);
    let back_rad = wrapped_rad(tangent_rad + std::f64::consts::PI);
    // On foot one goes both ways.
    let (fit, is_along) = if ring.kind == LaneKind::Pavement {
        let against = motion_fit(object, back_rad, -side / ring.circle.radius_m);
        (along.max(against), along >= against)
    } else {
        (along, true)
    };
    let (course_rad, speed_mps) = course(object);
    let heading_rad = if is_along { tangent_rad } else { back_rad };
    let leads = libm::cos(course_rad - heading_rad);
    // Who changes lanes goes round as fast as he goes, and who comes in will.
    let is_inward = libm::cos(course_rad - angle_rad) < 0.0;
    let goes_round = leads > if is_inward { 0.0 } else { LEADS };
    let leads_mps = match ring.kind {
        LaneKind::Road if goes_round => speed_mps,
        // Nobody drives round against all others.
        LaneKind::Road => (speed_mps * leads).max(0.0),
        LaneKind::Bikeway | LaneKind::Pavement => speed_mps * leads,
    };
    let on = OnLane {
        place: Place::Ring(index),
        probability: 0.0,
        along_m: ring.circle.radius_m * angle_rad,
        offset_m,
        speed_mps: if is_along { leads_mps } else { -leads_mps },
        mean_speed_mps: 0.0,
        known_s: 0.0,
        came_in_by: None,
    };
    let likelihood =
        place_fit(object, offset_m, ring.width_m) * fit * share(object.class, ring.kind);
    Some(Candidate::new(on, likelihood))
}

/// `before_per_m` is the curvature of what leads to the way: nobody turns the wheel at once, and a turn rate is told late.
fn on_way(
    place: Place,
    way: &Polyline,
    width_m: f64,
    before_per_m: f64,
    object: &Object,
) -> Option<Candidate> {
    const TURNS_M: f64 = 4.0;
    let [x, y, _] = object.centre_m;
    let reach_m = 2.0 * width_m;
    let station = way
        .comes_within([x, y], reach_m)
        .then(|| way.nearest([x, y]))??;
    // Before the beginning or behind the end it is another lane's.
    if station.distance_m > reach_m || station.distance_m > station.offset_m.abs() + 1.0 {
        return None;
    }
    let turned = (station.along_m / TURNS_M).clamp(0.0, 1.0);
    let curvature_per_m =
        before_per_m + turned * (way.curvature_per_m(station.along_m) - before_per_m);
    let (course_rad, speed_mps) = course(object);
    let fit = motion_fit(object, station.heading_rad, curvature_per_m);
    // Nobody goes out on a way in, and of who has only just come into view the direction is not known well.
    let leads = match place {
        Place::Entry(..) => 1.0,
        _ => libm::cos(course_rad - station.heading_rad),
    };
    let on = OnLane {
        place,
        probability: 0.0,
        along_m: station.along_m,
        offset_m: station.offset_m,
        speed_mps: speed_mps * leads,
        mean_speed_mps: 0.0,
        known_s: 0.0,
        came_in_by: None,
    };
    let likelihood =
        place_fit(object, station.offset_m, width_m) * fit * share(object.class, LaneKind::Road);
    Some(Candidate::new(on, likelihood))
}
