//! How a road user comes to where the own way crosses his, and when he is there.
//!
//! Numbers without another source were set with `scripts/evaluate-roundabouts --seeds 1-8`.

use std::f64::consts::TAU;

use super::bend::Bend;
use super::gap::{Asked, HORIZON_S, Window};
use super::leaving::{MOUTH_M, still_there};
use super::on_lane::{NEW_S, NEW_SLOW_S, OnLane, Place};
use super::site::{Conflict, Site};
use super::unseen::fastest_mps;
use crate::roadmap::LaneKind;
use crate::track::{Class, Object};

/// Slower road users do not come: they wait.
const WAITS_MPS: f64 = 0.7;
/// Who goes along a pavement with less than this share of his speed goes across it.
const ALONG_SHARE: f64 = 0.7;
/// Standard deviations by which somebody on the road may come earlier than is likely, and by which anybody may be gone
/// later (`scripts/evaluate-roundabouts --seeds 301-343`).
const DEVIATIONS: f64 = 0.4;
const DEVIATIONS_BEHIND: f64 = 0.7;
/// By which somebody who is hidden may come earlier.
const DEVIATIONS_HIDDEN: f64 = 1.0;
/// Beside the road the tracker's deviation says nothing of it. So one of 100 comes 0.28 s earlier than told on bikeways, 0.1 of
/// it beyond the caution, as on the road, where it is 0.30 s (what `scripts/evaluate-roundabouts --seeds 1-20` says of windows).
/// With none 3 instead of 1 of 1,450 gaps at the own arm are not there (seeds 301-343 and 501-540).
const EARLIER_S: f64 = 0.1;
/// And how much faster a newcomer may be than he seems.
const DEVIATIONS_NEW: f64 = 2.0;
/// Slower ones on the circle may gather speed, and so fast.
const SLOW_MPS: f64 = 2.0;
const STARTS_MPS2: f64 = 3.0;
/// Drivers go round so many times as fast as most, or as slowly.
pub(super) const VARIES: f64 = 1.15;
/// Of a cyclist who comes end on less is seen: a bicycle is 1.8 m long (AASHTO Guide for the Development of Bicycle
/// Facilities, 2012), some are shorter. By what is seen alone 54 instead of 3 of 3,470 exits are announced by mistake (seeds
/// 301-343 and 501-540).
const BICYCLE_M: f64 = 1.7;
/// More does not count: whose place is not known at all is rather not there.
const MOST_BLUR_M: f64 = 2.0;

/// How far it is for the middle of somebody on a lane to a conflict point, negative behind it, and
/// how probably the way leads there.
fn way_to(
    site: &Site,
    arm: usize,
    conflict: &Conflict,
    on: &OnLane,
    either_way: bool,
) -> Option<(f64, f64)> {
    // Behind the point by less than this is behind it, and not almost all the way round.
    let behind = |way_m: f64, radius_m: f64| {
        const BEHIND_M: f64 = 12.0;
        const BEHIND_SHARE: f64 = 0.2;
        let round_m = TAU * radius_m;
        if way_m > round_m - BEHIND_M.min(BEHIND_SHARE * round_m) {
            way_m - round_m
        } else {
            way_m
        }
    };
    match on.place {
        Place::Ring(index) => {
            let own = &site.rings[index];
            if own.kind != conflict.kind {
                return None;
            }
            let angle_rad = on.along_m / own.circle.radius_m;
            let round_rad = if on.speed_mps < 0.0 {
                site.round_rad(conflict.angle_rad, angle_rad)
            } else {
                site.round_rad(angle_rad, conflict.angle_rad)
            };
            let radius_m = own.circle.radius_m;
            let way_m = if either_way {
                radius_m * round_rad.min(TAU - round_rad)
            } else {
                behind(radius_m * round_rad, radius_m)
            };
            let stays = if own.kind == LaneKind::Road && way_m > 0.0 {
                // Who leaves from an inner lane is still on it where the mouth of the exit begins.
                let is_inner = site.outermost_road() != Some(index);
                let late_rad = if is_inner { MOUTH_M / radius_m } else { 0.0 };
                let past_rad = angle_rad - site.side() * late_rad;
                still_there(site, past_rad, round_rad + late_rad, on.came_in_by)
            } else {
                1.0
            };
            Some((way_m, stays))
        }
        Place::Entry(other, lane) if conflict.kind == LaneKind::Road && other != arm => {
            let entry = &site.arms[other].entries[lane];
            let round_rad = site.round_rad(entry.mouth_rad, conflict.angle_rad);
            let stays = still_there(site, entry.mouth_rad, round_rad, Some(other));
            let radius_m = site.rings[conflict.ring].circle.radius_m;
            let way_m = entry.way.length_m() - on.along_m + radius_m * round_rad;
            Some((way_m, stays))
        }
        _ => None,
    }
}

/// How somebody comes to a conflict point.
pub(super) struct Approach {
    /// Left for his middle; negative behind the point.
    way_m: f64,
    /// Along it: now, and in the mean of the last moments.
    speeds_mps: [f64; 2],
    /// How far the conflict reaches along it, to either side.
    zone_m: f64,
    /// Whether he comes on the road, and not beside it.
    is_on_road: bool,
    /// Whether he is seen, and not known.
    is_seen: bool,
    /// As fast as anybody comes there, and on the way in.
    fastest_mps: f64,
    road_mps: f64,
    /// Whether he is on the circle already.
    on_circle: bool,
    /// What he slows down for.
    bend: Bend,
    /// For how long he has been seen since he is listed.
    known_s: f64,
    /// For how long that must be before it is known how fast he is.
    new_s: f64,
    /// Whether he takes a gap back that has been announced only if that is likely.
    is_likely: bool,
    /// That he comes so.
    probability: f64,
}

impl Approach {
    /// Of somebody who may be on a lane, if it leads there.
    pub(super) fn of(
        asked: &Asked<'_>,
        conflict: &Conflict,
        object: &Object,
        on: &OnLane,
    ) -> Option<Self> {
        // Who crosses a pavement may go either way along it.
        let speed_mps = object.speed_mps.abs();
        let is_across =
            conflict.kind == LaneKind::Pavement && on.speed_mps.abs() < ALONG_SHARE * speed_mps;
        let (way_m, probability) = way_to(asked.site, asked.arm, conflict, on, is_across)?;
        let is_on_road = conflict.kind == LaneKind::Road;
        Some(Self {
            way_m,
            speeds_mps: if is_across {
                [speed_mps; 2]
            } else {
                [on.speed_mps.abs(), on.mean_speed_mps.abs()]
            },
            zone_m: asked.width_m / 2.0,
            is_on_road,
            is_seen: asked.is_seen,
            fastest_mps: fastest_mps(&asked.site.rings[conflict.ring], asked.road_mps),
            road_mps: asked.road_mps,
            on_circle: matches!(on.place, Place::Ring(_)) && is_on_road,
            bend: asked.site.bend_before(on),
            known_s: on.known_s,
            new_s: if is_on_road { NEW_S } else { NEW_SLOW_S },
            is_likely: asked.keeps(),
            probability: probability * on.probability,
        })
    }

    /// When he is at the point.
    pub(super) fn window(&self, object: &Object) -> Option<Window> {
        let [now_mps, mean_mps] = self.speeds_mps;
        let length_m = match object.class {
            Class::Cyclist => object.length_m.max(BICYCLE_M),
            _ => object.length_m,
        };
        let front_m = self.way_m - object.length_m / 2.0 - self.zone_m;
        let rear_m = self.way_m + length_m / 2.0 + self.zone_m;
        let faster_mps = now_mps.max(mean_mps);
        let stands =
            faster_mps + 2.0 * object.speed_deviation_mps < WAITS_MPS && self.known_s >= NEW_S;
        let is_there = front_m <= 0.0 && rear_m >= 0.0;
        let [begin_s, end_s] = if stands && self.on_circle && self.way_m > 0.0 {
            [self.begin_s(object, front_m), HORIZON_S]
        } else if stands {
            // Who stands where the ways cross is in the way as long as he stands.
            is_there.then_some([0.0, HORIZON_S])?
        } else {
            let slower_mps = now_mps.min(mean_mps);
            let end_s = self.time_s(object, rear_m, slower_mps, 1.0 / VARIES, DEVIATIONS_BEHIND);
            [self.begin_s(object, front_m), end_s]
        };
        let front_of_him_m = self.way_m - object.length_m / 2.0;
        let expected_s = self.time_s(object, front_of_him_m, now_mps, 1.0, 0.0);
        (end_s > 0.0).then_some(Window {
            object_id: object.id,
            arm: 0,
            at_exit: false,
            conflict: 0,
            kind: LaneKind::Road,
            begin_s,
            end_s,
            expected_s: expected_s.max(0.0),
            probability: self.probability,
            way_m: self.way_m,
        })
    }

    /// As early as he may come, if he goes on as in the mean of the last moments, which is known better than his speed
    /// now. A gap that has been announced is not taken back for what may be and is not likely.
    fn begin_s(&self, object: &Object, front_m: f64) -> f64 {
        let [_, mean_mps] = self.speeds_mps;
        let (deviations, earlier_s) = match (self.is_likely, object.measured) {
            (true, _) => (0.0, 0.0),
            (false, true) if self.is_on_road => (DEVIATIONS, 0.0),
            (false, true) if self.is_seen => (0.0, EARLIER_S),
            (false, true) => (0.0, 0.0),
            (false, false) => (DEVIATIONS_HIDDEN, 0.0),
        };
        let mut begin_s = self.time_s(object, front_m, mean_mps, VARIES, -deviations);
        begin_s -= earlier_s;
        begin_s = begin_s.max(0.0);
        let left_m = front_m.max(0.0);
        // Who stands on the circle may go on.
        if self.on_circle && mean_mps < SLOW_MPS {
            begin_s = begin_s.min(libm::sqrt(2.0 * left_m / STARTS_MPS2));
        }
        // It is not known yet how fast he is, or that he moves at all.
        if self.known_s < self.new_s && !self.is_likely {
            begin_s = begin_s.min(if mean_mps < WAITS_MPS {
                self.soonest_s(left_m, 0.0)
            } else {
                // Along a way in nobody comes faster than others do, unless he is seen to.
                let is_on_circle = self.bend.left_m <= 0.0;
                let most_mps = if is_on_circle {
                    f64::INFINITY
                } else {
                    self.road_mps
                };
                let faster_mps = mean_mps + DEVIATIONS_NEW * object.speed_deviation_mps;
                let faster_mps = faster_mps.min(most_mps.max(mean_mps));
                self.bend(VARIES).time_s(left_m, faster_mps)
            });
        }
        // However little is known of his speed.
        begin_s.max(self.soonest_s(left_m, mean_mps))
    }

    /// How long a way takes anybody, or him if he is seen to be faster.
    fn soonest_s(&self, way_m: f64, mean_mps: f64) -> f64 {
        let bend = Bend {
            speed_mps: self.fastest_mps.max(mean_mps),
            ..self.bend
        };
        bend.soonest_s(way_m, self.road_mps.max(mean_mps))
    }

    /// When he has gone so far, so many deviations later: it is not known where he is, and not how fast. He goes round
    /// `varies` times as fast as most do.
    fn time_s(
        &self,
        object: &Object,
        way_m: f64,
        speed_mps: f64,
        varies: f64,
        deviations: f64,
    ) -> f64 {
        let [x, y] = object.position_deviation_m;
        let moving_mps = speed_mps.max(WAITS_MPS);
        let wander_m = way_m.max(0.0) / moving_mps * object.speed_deviation_mps;
        let blur_m = libm::hypot(x.max(y).min(MOST_BLUR_M), wander_m);
        self.bend(varies)
            .time_s(way_m + deviations * blur_m, moving_mps)
    }

    /// The bend before him, if he drives through it so many times as fast as most do.
    fn bend(&self, varies: f64) -> Bend {
        Bend {
            speed_mps: varies * self.bend.speed_mps,
            ..self.bend
        }
    }
}
