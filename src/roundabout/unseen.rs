//! Where somebody may be who is not seen.
//!
//! Numbers without another source were set with `scripts/evaluate-roundabouts --seeds 1-8`.

use std::f64::consts::TAU;

use super::approach::VARIES;
use super::bend::{Bend, fastest_round_mps, round_mps};
use super::gap::{User, Users};
use super::sight::Sight;
use super::site::{Conflict, Entry, Site};
use crate::roadmap::{LaneKind, Ring};
use crate::track::Object;

/// Who is listed within this of a place is who is there.
const LISTED_M: f64 = 3.5;
/// What is on a lane is within this share of its width: beside it kerbs, signs and bushes begin.
const ON_LANE: f64 = 0.8;
/// Nobody on a cycle path or on foot comes faster out of where nothing is seen.
const CYCLIST_MPS: f64 = 6.0;
const WALKER_MPS: f64 = 2.0;

/// Places on a lane, as far apart as this.
const APART_M: f64 = 2.0;
/// Who comes along a way in was at one of so many places a moment ago, from his own on back. If all that is seen there is
/// believed to come along it, cyclists and walkers far away who cross it and are not listed yet are taken for cars, and
/// those who come late wait 100 instead of 81 s (the entries that [`LOOKS`] were tried on); if nothing is that is on a bikeway
/// or a pavement, 68 instead of 45 gaps of 6,900 at any arm are announced that are not there (the same, `--seeds 301-343`,
/// 401-425 and 501-540).
const BEHIND: usize = 3;
/// Ways in are looked at so far back: as far as one comes in the time that it takes to enter, and in the margin.
const BACK_M: f64 = 50.0;

/// Somebody was somewhere until as many looks as this say that nobody is: far away not every revolution meets him. With
/// five, 72 instead of 81 gaps of 11,000 at any arm are announced that are not there, but as many at the own arm and at exits, 1
/// and 5 (`scripts/evaluate-roundabouts --seeds 1-70`, 301-343, 401-425 and 501-540 together), and those who come late wait 159
/// instead of 125 s (`kreisel drive`: `roundabout-entry` with seeds 301, 307, 422, 519, 601, 613, 627, `two-lane-entry` with 408,
/// 507, 528, 607, 614, 630, 633, 636, `mini-entry` with 627). With one, 26 instead of 21 gaps of 1,650 at any arm, and 5 instead of
/// 1 of 1,330 at exits (`--seeds 1-30 --scenarios roundabout-traffic,two-lane-roundabout`).
const LOOKS: u8 = 3;
/// The same of who was listed and is not any more; a look of rays that would have met even a low car counts as several. 35 m
/// away one ray meets its sill, which may be a bump of the road, and the next one passes above it. With [`LOOKS`] 59
/// instead of 55 gaps of 8,400 at any arm are announced that are not there, one of them instead of none at the own arm
/// (`--seeds 301-343`, 401-425, 501-540 and 601-625); those who come late wait as long.
const LOST_LOOKS: u8 = 15;
const MEETING_LOOKS: u8 = 5;

/// Where on the rings and the ways in somebody may be who is not listed: what is hidden now and was not seen to be
/// free before, what was reached from there meanwhile, where a road user was who is not listed any more, and where
/// something is on a ring that is not listed.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Unseen {
    rings: Vec<Stretch>,
    /// Of all ways in, arm by arm.
    ways: Vec<Stretch>,
    /// Who was listed last: id, place, and how far around it is his.
    listed: Vec<(u32, [f64; 2], f64)>,
    /// Who was listed then and is not now.
    missing: Vec<([f64; 2], f64)>,
}

/// Of one lane.
#[derive(Debug, Clone, Default, PartialEq)]
struct Stretch {
    /// Of a ring from east on, in the direction of driving; of a way in from the circle back: how many looks are to come
    /// before nobody can be there.
    may_hold: Vec<u8>,
    /// How far they may have gone since the last step.
    gone_m: f64,
}

impl Unseen {
    /// Takes in what is seen `passed_s` later.
    pub(super) fn update(
        &mut self,
        site: &Site,
        sight: &Sight<'_>,
        objects: &[Object],
        passed_s: f64,
        road_mps: f64,
    ) {
        self.note_missing(objects);
        let look = Look {
            sight,
            objects,
            missing: &self.missing,
        };
        self.rings.resize_with(site.rings.len(), Stretch::default);
        self.ways
            .resize_with(entries(site).count(), Stretch::default);
        for ((_, entry), stretch) in entries(site).zip(&mut self.ways) {
            let way = &entry.way;
            let length_m = way.length_m();
            stretch.fit((length_m.min(BACK_M) / APART_M) as usize);
            for _ in 0..stretch.steps(passed_s, road_mps) {
                stretch.come_in();
            }
            stretch.take(&look, |place| way.at(length_m - APART_M * place as f64).0);
        }
        for (index, (ring, stretch)) in site.rings.iter().zip(&mut self.rings).enumerate() {
            let count = libm::ceil(TAU * ring.circle.radius_m / APART_M).clamp(8.0, 400.0) as usize;
            stretch.fit(count);
            for _ in 0..stretch.steps(passed_s, fastest_mps(ring, road_mps)) {
                stretch.go_round(ring.kind == LaneKind::Pavement);
            }
            if site.outermost_road() == Some(index) {
                for ((_, entry), before) in entries(site).zip(&self.ways) {
                    let mouth = place_at(site, entry.mouth_rad, count);
                    let comes = before.may_hold.first().copied().unwrap_or(0);
                    stretch.may_hold[mouth] = stretch.may_hold[mouth].max(comes);
                }
            }
            stretch.take(&look, |place| ring.circle.at(angle_rad(site, place, count)));
        }
        for at_m in sight.things_m() {
            let mut crosses = false;
            for (ring, stretch) in site.rings.iter().zip(&mut self.rings) {
                let is_on = ring.circle.off_m(at_m).abs() < ON_LANE * ring.width_m / 2.0;
                if is_on && !is_listed(objects, at_m) {
                    let place = place_at(site, site.angle_rad(at_m), stretch.may_hold.len());
                    stretch.may_hold[place] = stretch.may_hold[place].max(LOOKS);
                    crosses |= ring.kind != LaneKind::Road;
                }
            }
            for ((_, entry), stretch) in entries(site).zip(&mut self.ways) {
                stretch.note_thing(entry, at_m, crosses, objects);
            }
        }
    }

    /// Who has gone from the list since the last revolution.
    fn note_missing(&mut self, objects: &[Object]) {
        let is_missing = |id: u32| objects.iter().all(|object| object.id != id);
        let missing = self.listed.iter().filter(|(id, ..)| is_missing(*id));
        self.missing.clear();
        self.missing
            .extend(missing.map(|&(_, at_m, reach_m)| (at_m, reach_m)));
    }

    /// Remembers who is listed, and where on the lanes.
    pub(super) fn note_listed(&mut self, site: &Site, users: Users<'_>) {
        self.listed.clear();
        self.listed
            .extend(users.iter().map(|User { object, lanes }| {
                let [x, y, _] = object.centre_m;
                let on_lane_m = lanes.first().and_then(|on| on.place_m(site));
                (object.id, on_lane_m.unwrap_or([x, y]), reach_m(object))
            }));
    }

    /// How long it takes from the nearest place where somebody may be who is not listed to a conflict point of an arm, if
    /// there is one; and the share of the rings where nobody is.
    pub(super) fn before(
        &self,
        site: &Site,
        arm: usize,
        conflict: &Conflict,
        road_mps: f64,
    ) -> (f64, f64) {
        let mut soonest_s = f64::INFINITY;
        let mut least_share: f64 = 1.0;
        // Who comes round an inner lane counts, too.
        let rings = site.rings.iter().zip(&self.rings);
        for (ring, stretch) in rings.filter(|(ring, _)| ring.kind == conflict.kind) {
            let count = stretch.may_hold.len();
            let hidden = (0..count).filter(|&place| stretch.may_hold[place] > 0);
            let way_m = |place: usize| {
                let round_rad = site.round_rad(angle_rad(site, place, count), conflict.angle_rad);
                let back_rad = if ring.kind == LaneKind::Pavement {
                    TAU - round_rad
                } else {
                    TAU
                };
                ring.circle.radius_m * round_rad.min(back_rad)
            };
            let nearest_m = hidden.clone().map(way_m).fold(f64::INFINITY, f64::min);
            soonest_s = soonest_s.min(nearest_m / fastest_mps(ring, road_mps));
            least_share = least_share.min(1.0 - hidden.count() as f64 / count.max(1) as f64);
        }
        if conflict.kind == LaneKind::Road {
            let others = entries(site).zip(&self.ways);
            for ((_, entry), stretch) in others.filter(|((other, _), _)| *other != arm) {
                let Some(nearest) = stretch.may_hold.iter().position(|&looks| looks > 0) else {
                    continue;
                };
                let back_m = APART_M * nearest as f64;
                let round_rad = site.round_rad(entry.mouth_rad, conflict.angle_rad);
                let ring = &site.rings[conflict.ring];
                let bend = Bend {
                    left_m: back_m - (entry.way.length_m() - entry.bend_m),
                    // As of anybody who is seen there.
                    speed_mps: road_mps.min(VARIES * round_mps(ring.circle.radius_m)),
                };
                let way_m = back_m + ring.circle.radius_m * round_rad;
                soonest_s = soonest_s.min(bend.soonest_s(way_m, road_mps));
            }
        }
        (soonest_s, least_share)
    }
}

/// All ways in with the numbers of their arms, arm by arm.
fn entries(site: &Site) -> impl Iterator<Item = (usize, &Entry)> {
    let arms = site.arms.iter().enumerate();
    arms.flat_map(|(number, arm)| arm.entries.iter().map(move |entry| (number, entry)))
}

/// How far around his middle a place is a road user's: half of his length and a metre.
fn reach_m(object: &Object) -> f64 {
    object.length_m / 2.0 + 1.0
}

fn is_listed(objects: &[Object], at_m: [f64; 2]) -> bool {
    objects.iter().any(|object| {
        let [x, y, _] = object.centre_m;
        is_within([x, y], at_m, LISTED_M.max(reach_m(object)))
    })
}

fn is_within([x, y]: [f64; 2], [u, v]: [f64; 2], reach_m: f64) -> bool {
    (u - x) * (u - x) + (v - y) * (v - y) < reach_m * reach_m
}

impl Stretch {
    /// Of another number of places nothing is known.
    fn fit(&mut self, count: usize) {
        if self.may_hold.len() != count {
            self.may_hold.clear();
            self.may_hold.resize(count, 1);
        }
    }

    /// How many places further those may be who were hidden.
    fn steps(&mut self, passed_s: f64, fastest_mps: f64) -> usize {
        self.gone_m += passed_s.clamp(0.0, 10.0) * fastest_mps;
        let steps = libm::floor(self.gone_m / APART_M);
        self.gone_m -= steps * APART_M;
        steps as usize
    }

    /// One place nearer to the circle.
    fn come_in(&mut self) {
        for place in 1..self.may_hold.len() {
            self.may_hold[place - 1] = self.may_hold[place - 1].max(self.may_hold[place]);
        }
    }

    /// One place further round; on foot one goes both ways.
    fn go_round(&mut self, both_ways: bool) {
        let (Some(&first), Some(&last)) = (self.may_hold.first(), self.may_hold.last()) else {
            return;
        };
        let count = self.may_hold.len();
        for place in (1..count).rev() {
            self.may_hold[place] = self.may_hold[place].max(self.may_hold[place - 1]);
        }
        self.may_hold[0] = first.max(last);
        if both_ways {
            // What came forward came from here: nobody goes two places back.
            for place in 0..count - 1 {
                self.may_hold[place] = self.may_hold[place].max(self.may_hold[place + 1]);
            }
            self.may_hold[count - 1] = self.may_hold[count - 1].max(first);
        }
    }

    /// Somebody may be where something is on a way in that is not listed. What `crosses` it, on a bikeway or a pavement, is
    /// nobody who comes along it, if nobody was there and behind.
    fn note_thing(&mut self, entry: &Entry, at_m: [f64; 2], crosses: bool, objects: &[Object]) {
        let half_m = ON_LANE * entry.width_m / 2.0;
        let way = &entry.way;
        let station = way.comes_within(at_m, half_m).then(|| way.nearest(at_m));
        let Some(station) = station.flatten() else {
            return;
        };
        let back = ((way.length_m() - station.along_m) / APART_M) as usize;
        let mut behind = self.may_hold.iter().skip(back).take(BEHIND);
        if crosses && behind.all(|&looks| looks == 0) {
            return;
        }
        if let Some(may_hold) = self.may_hold.get_mut(back)
            && station.distance_m < half_m
            && !is_listed(objects, at_m)
        {
            *may_hold = (*may_hold).max(LOOKS);
        }
    }

    /// Takes in what is seen of its places.
    fn take(&mut self, look: &Look<'_>, place_m: impl Fn(usize) -> [f64; 2]) {
        for (place, may_hold) in self.may_hold.iter_mut().enumerate() {
            let at_m = place_m(place);
            let is_listed = is_listed(look.objects, at_m);
            // Where nobody was nobody is, be it seen or not.
            if *may_hold > 0 && look.sight.reaches(at_m) {
                let looks = if *may_hold > LOOKS && look.sight.passes(at_m) {
                    MEETING_LOOKS
                } else {
                    1
                };
                *may_hold = if is_listed {
                    0
                } else {
                    may_hold.saturating_sub(looks)
                };
            }
            if !is_listed && look.is_missed(at_m) {
                *may_hold = LOST_LOOKS;
            }
        }
    }
}

/// What a revolution tells of the lanes.
struct Look<'a> {
    sight: &'a Sight<'a>,
    objects: &'a [Object],
    missing: &'a [([f64; 2], f64)],
}

impl Look<'_> {
    /// Whether somebody was there who is not listed any more.
    fn is_missed(&self, at_m: [f64; 2]) -> bool {
        let mut missing = self.missing.iter();
        missing.any(|&(other_m, reach_m)| is_within(other_m, at_m, reach_m))
    }
}

/// As fast as anybody comes along a ring.
pub(super) fn fastest_mps(ring: &Ring, road_mps: f64) -> f64 {
    match ring.kind {
        LaneKind::Road => road_mps.min(fastest_round_mps(ring.circle.radius_m)),
        LaneKind::Bikeway => CYCLIST_MPS,
        LaneKind::Pavement => WALKER_MPS,
    }
}

fn angle_rad(site: &Site, place: usize, count: usize) -> f64 {
    site.side() * TAU * place as f64 / count as f64
}

/// The place on a ring of so many places in a direction from the middle.
fn place_at(site: &Site, angle_rad: f64, count: usize) -> usize {
    let round_rad = site.round_rad(0.0, angle_rad);
    let place = (round_rad / TAU * count as f64) as usize;
    place.min(count - 1)
}

#[cfg(test)]
mod tests;
