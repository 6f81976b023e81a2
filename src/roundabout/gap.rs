//! The gap: when road users are where the own way crosses theirs, and when the vehicle is.
//!
//! Numbers without another source were set with `scripts/evaluate-roundabouts --seeds 1-8`.

use super::RoundaboutParameters;
use super::approach::Approach;
use super::on_lane::OnLane;
use super::site::{Conflict, Site};
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
    /// From now, seconds: as early as it may come; as is likely, where a gap has been announced.
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
/// Time that a road user must have been gone before the vehicle comes.
pub(super) const BEHIND_S: f64 = 0.3;

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
    /// Whether a gap there has been announced.
    pub(super) is_announced: bool,
}

/// What a gap must leave beyond the margin to be announced, where road users are seen and not known: what is hardly long
/// enough is so by mistake as often as not (`scripts/evaluate-roundabouts --seeds 1-80`).
const CAUTION_S: f64 = 0.2;
/// The same behind the last one, who is near and seen well: with 0.05, and 0.15 before, 15 instead of 2 of 3,500 exits are
/// announced by mistake (the same, seeds 301-343 and 501-540).
const CAUTION_BEHIND_S: f64 = 0.1;
/// What it may lack of it later: who has been told to go has begun to. With 0.4 one announcement of 20 lasts until half a
/// second of the margin is gone, with 0.1 one of 100 (the same, seeds 1-20).
pub(super) const LACKS_S: f64 = 0.1;

impl Asked<'_> {
    /// What must be left beyond what a gap must leave: before the next road user, and behind the last one.
    pub(super) fn cautions_s(&self) -> [f64; 2] {
        match (self.is_seen, self.is_announced) {
            (true, false) => [CAUTION_S, CAUTION_BEHIND_S],
            (true, true) => [-LACKS_S; 2],
            (false, _) => [0.0; 2],
        }
    }

    /// Whether a gap is kept as long as nothing speaks against it, instead of closed by what may be.
    pub(super) fn keeps(&self) -> bool {
        self.is_seen && self.is_announced
    }
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
