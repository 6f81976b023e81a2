//! The gap: when road users are where the own way crosses theirs, and whether it fits between.
//!
//! Numbers without another source were set with `scripts/evaluate-roundabouts --seeds 1-8`.

use std::f64::consts::TAU;

use super::RoundaboutParameters;
use super::bend::Bend;
use super::leaving::{MOUTH_M, still_there};
use super::on_lane::{NEW_S, OnLane, Place};
use super::site::{Conflict, Site};
use super::unseen::fastest_mps;
use crate::roadmap::LaneKind;
use crate::track::Object;

/// When a road user is at a conflict point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Whose.
    pub object_id: u32,
    /// At which arm.
    pub arm: usize,
    /// Whether it is on the arm's way out, and not on its way in.
    pub at_exit: bool,
    /// Which conflict point of that way, in the order in which they are met.
    pub conflict: usize,
    /// Of the way that is crossed.
    pub kind: LaneKind,
    /// From now, seconds: as early as it may come.
    pub begin_s: f64,
    /// From now: as late as it may be gone.
    pub end_s: f64,
    /// From now: when its front most likely comes.
    pub expected_s: f64,
    /// Probability that it comes at all.
    pub probability: f64,
    /// Way that is left to the conflict point.
    pub way_m: f64,
}

/// The own vehicle on its way in or out, and its speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OwnMotion {
    /// Place of its front along the way; negative before its beginning.
    pub(super) front_m: f64,
    pub(super) speed_mps: f64,
}

/// A road user with the lanes that it may be on.
#[derive(Clone, Copy)]
pub(super) struct User<'a> {
    pub(super) object: &'a Object,
    pub(super) lanes: &'a [OnLane],
}

/// All of them.
#[derive(Clone, Copy)]
pub(super) struct Users<'a> {
    pub(super) objects: &'a [Object],
    /// Of each object, and perhaps more.
    pub(super) lanes: &'a [Vec<OnLane>],
}

impl<'a> Users<'a> {
    pub(super) fn iter(self) -> impl Iterator<Item = User<'a>> {
        let users = self.objects.iter().zip(self.lanes);
        users.map(|(object, lanes)| User { object, lanes })
    }
}

/// Windows farther off than this are not told.
pub(super) const HORIZON_S: f64 = 15.0;
/// Who comes with less than this probability is not waited for: of those who are known, and of those who are seen, as
/// what is seen of somebody who leaves is never quite right.
const LEAST_PROBABILITY: f64 = 0.03;
const LEAST_SEEN_PROBABILITY: f64 = 0.01;
/// Slower road users do not come: they wait.
const WAITS_MPS: f64 = 0.7;
/// Who goes along a pavement with less than this share of his speed goes across it.
const ALONG_SHARE: f64 = 0.7;
/// Time that a road user must have been gone before the vehicle comes.
pub(super) const BEHIND_S: f64 = 0.3;
/// Standard deviations that a window is widened by at either end.
const DEVIATIONS: f64 = 0.4;
/// The same of somebody who is hidden.
const DEVIATIONS_HIDDEN: f64 = 1.0;
/// And how much faster a newcomer may be than he seems.
const DEVIATIONS_NEW: f64 = 2.0;
/// Slower ones on the circle may gather speed, and so fast.
const SLOW_MPS: f64 = 2.0;
const STARTS_MPS2: f64 = 3.0;
/// Drivers go round so many times as fast as most, or as slowly.
pub(super) const VARIES: f64 = 1.15;
/// More does not count: whose place is not known at all is rather not there.
const MOST_BLUR_M: f64 = 2.0;

impl OwnMotion {
    /// When the front has gone so far, by the stated acceleration up to the stated speed.
    pub(super) fn time_s(&self, way_m: f64, parameters: &RoundaboutParameters) -> f64 {
        let way_m = way_m.max(0.0);
        let (a, top) = (parameters.acceleration_mps2, parameters.speed_mps);
        let from = self.speed_mps.max(0.0);
        // Who is faster already goes on as he does.
        let top = top.max(from);
        let rise_m = (top * top - from * from) / (2.0 * a);
        if way_m <= rise_m {
            (libm::sqrt(from * from + 2.0 * a * way_m) - from) / a
        } else {
            (top - from) / a + (way_m - rise_m) / top
        }
    }

    /// From when to when the vehicle is at a conflict point of its way in.
    pub(super) fn window_s(
        &self,
        conflict: &Conflict,
        parameters: &RoundaboutParameters,
    ) -> [f64; 2] {
        let [begin_m, end_m] = conflict.zone_m;
        let reach_m = begin_m - self.front_m;
        // Where the way ends on the circle the vehicle does not cross it: it is gone from the
        // point when its rear is past it.
        let clear_m = end_m + parameters.own_length_m - self.front_m;
        [reach_m, clear_m].map(|way_m| self.time_s(way_m, parameters))
    }
}

/// Whose windows are asked about, and when.
pub(super) struct Asked<'a> {
    pub(super) site: &'a Site,
    /// Number of the arm.
    pub(super) arm: usize,
    /// Whether it is about its way out, and not about its way in.
    pub(super) at_exit: bool,
    /// Of that way.
    pub(super) conflicts: &'a [Conflict],
    /// Of that way.
    pub(super) width_m: f64,
    /// Where along it the front of a vehicle is that stands before all of them.
    pub(super) stop_m: f64,
    /// As fast as anybody comes on the road.
    pub(super) road_mps: f64,
    /// Whether the road users are seen, and not known.
    pub(super) is_seen: bool,
    /// What must be left beyond what a gap must leave, before the next road user and behind the last one.
    pub(super) caution_s: f64,
}

/// The windows of a road user at the conflict points of a way.
pub(super) fn windows(asked: &Asked<'_>, user: &User<'_>, found: &mut Vec<Window>) {
    for (number, conflict) in asked.conflicts.iter().enumerate() {
        let mut best: Option<Window> = None;
        for on in user.lanes {
            let approach = Approach::of(asked, conflict, user.object, on);
            let Some(window) = approach.and_then(|approach| approach.window(user.object)) else {
                continue;
            };
            best = Some(match best {
                // Lanes that lead to the same point: as early as by any, as probable as by all.
                Some(known) => Window {
                    begin_s: known.begin_s.min(window.begin_s),
                    end_s: known.end_s.max(window.end_s),
                    probability: known.probability + window.probability,
                    ..known
                },
                None => window,
            });
        }
        let least = if asked.is_seen {
            LEAST_SEEN_PROBABILITY
        } else {
            LEAST_PROBABILITY
        };
        let counts = |window: &Window| window.probability >= least && window.begin_s < HORIZON_S;
        found.extend(best.filter(counts).map(|window| Window {
            arm: asked.arm,
            at_exit: asked.at_exit,
            conflict: number,
            kind: conflict.kind,
            ..window
        }));
    }
}

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
struct Approach {
    /// Left for his middle; negative behind the point.
    way_m: f64,
    /// Along it: now, and in the mean of the last moments.
    speeds_mps: [f64; 2],
    /// How far the conflict reaches along it, to either side.
    zone_m: f64,
    /// As fast as anybody comes there, and on the way in.
    fastest_mps: f64,
    road_mps: f64,
    /// Whether he is on the circle already.
    on_circle: bool,
    /// What he slows down for.
    bend: Bend,
    /// For how long he has been seen since he is listed.
    known_s: f64,
    /// That he comes so.
    probability: f64,
}

impl Approach {
    /// Of somebody who may be on a lane, if it leads there.
    fn of(asked: &Asked<'_>, conflict: &Conflict, object: &Object, on: &OnLane) -> Option<Self> {
        // Who crosses a pavement may go either way along it.
        let speed_mps = object.speed_mps.abs();
        let is_across =
            conflict.kind == LaneKind::Pavement && on.speed_mps.abs() < ALONG_SHARE * speed_mps;
        let (way_m, probability) = way_to(asked.site, asked.arm, conflict, on, is_across)?;
        Some(Self {
            way_m,
            speeds_mps: if is_across {
                [speed_mps; 2]
            } else {
                [on.speed_mps.abs(), on.mean_speed_mps.abs()]
            },
            zone_m: asked.width_m / 2.0,
            fastest_mps: fastest_mps(&asked.site.rings[conflict.ring], asked.road_mps),
            road_mps: asked.road_mps,
            on_circle: matches!(on.place, Place::Ring(_)) && conflict.kind == LaneKind::Road,
            bend: asked.site.bend_before(on),
            known_s: on.known_s,
            probability: probability * on.probability,
        })
    }

    /// When he is at the point.
    fn window(&self, object: &Object) -> Option<Window> {
        let [now_mps, mean_mps] = self.speeds_mps;
        let half_m = object.length_m / 2.0 + self.zone_m;
        let (front_m, rear_m) = (self.way_m - half_m, self.way_m + half_m);
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
            let end_s = self.time_s(object, rear_m, slower_mps, 1.0 / VARIES, DEVIATIONS);
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
    /// now.
    fn begin_s(&self, object: &Object, front_m: f64) -> f64 {
        let [_, mean_mps] = self.speeds_mps;
        let deviations = if object.measured {
            DEVIATIONS
        } else {
            DEVIATIONS_HIDDEN
        };
        let mut begin_s = self.time_s(object, front_m, mean_mps, VARIES, -deviations);
        begin_s = begin_s.max(0.0);
        let left_m = front_m.max(0.0);
        // Who stands on the circle may go on.
        if self.on_circle && mean_mps < SLOW_MPS {
            begin_s = begin_s.min(libm::sqrt(2.0 * left_m / STARTS_MPS2));
        }
        // It is not known yet how fast he is, or that he moves at all.
        if self.known_s < NEW_S {
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
