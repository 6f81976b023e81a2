//! Which lanes a road user may be on, and how well each of them fits, by place, heading, turn and class.
//!
//! Numbers without another source were set with `scripts/evaluate-roundabouts --seeds 1-8`.

use super::on_lane::{OnLane, Place};
use super::site::Site;
use crate::ego::wrapped_rad;
use crate::roadmap::{LaneKind, Polyline};
use crate::track::{Class, Object};

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
    pub(super) on: OnLane,
    pub(super) likelihood: f64,
    /// Likelihood times how probable the lane was before.
    pub(super) weight: f64,
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

/// The lanes that are near, and none of them.
pub(super) fn take_candidates(site: &Site, object: &Object, found: &mut Vec<Candidate>) {
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
