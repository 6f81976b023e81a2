//! What of the circle is seen, and where somebody may be who was not.
//!
//! Numbers without another source were set with `scripts/evaluate-roundabouts --seeds 1-8`.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::site::{Conflict, Site};
use crate::cloud::{MAX_LAYERS, Scan};
use crate::cluster::Clusters;
use crate::geometry::Rigid;
use crate::ground::Plane;
use crate::roadmap::LaneKind;
use crate::track::Object;

/// Where the last revolution's rays went.
#[derive(Debug, Clone, Copy)]
pub struct Sight<'a> {
    /// Its points.
    pub scan: &'a Scan,
    /// The sensor in the local frame.
    pub sensor: &'a Rigid,
    /// The ground in the sensor frame.
    pub ground: &'a Plane,
    /// Which points belong together.
    pub clusters: &'a Clusters,
    /// Heights of the points above the ground.
    pub heights_m: &'a [f32],
}

/// Height above the ground at which a road user is looked for: the bonnet of a car, the wheels of
/// a cyclist.
const LOOK_M: f64 = 0.7;
/// So near the vehicle is seen around, though its lowest rays pass above.
const NEAR_M: f64 = 6.0;
/// A ray that ends nearer than this before a place is taken to have reached it.
const SHORT_M: f64 = 1.0;
/// And by this share of the range: low rays meet the ground before the place.
const SHORT_SHARE: f64 = 0.05;

impl Sight<'_> {
    /// Places of the local frame where something is: a few points of every cluster, at the height of road users.
    fn things_m(&self) -> impl Iterator<Item = [f64; 2]> {
        /// Of each cluster, whose points are in the order of their columns.
        const POINTS: usize = 5;
        const HEIGHTS_M: std::ops::Range<f32> = 0.3..2.5;
        let sampled = self.clusters.iter().flat_map(|points| {
            let every = (points.len() / POINTS).max(1);
            points.iter().skip(every / 2).step_by(every)
        });
        let sampled = sampled.map(|&point| point as usize);
        let high = sampled.filter(|&point| HEIGHTS_M.contains(&self.heights_m[point]));
        high.map(|point| {
            let place = self
                .sensor
                .place(&self.scan.point_m(point).map(f64::from).into());
            [place.x, place.y]
        })
    }

    /// Whether a ray reached a place of the local frame, a little above the ground.
    fn reaches(&self, [x, y]: [f64; 2]) -> bool {
        let level = Vector3::new(x, y, self.sensor.translation_m.z);
        let from = self.sensor.rotation.transpose() * (level - self.sensor.translation_m);
        let out_m = libm::hypot(from.x, from.y);
        // Nearer than the lowest rays fall.
        if out_m < NEAR_M {
            return true;
        }
        let plane = self.ground;
        let below_m = plane.above_m(&Vector3::new(from.x, from.y, 0.0)) / plane.normal()[2];
        let tangent = (LOOK_M - below_m) / out_m;
        let column = self.scan.column_at(libm::atan2(from.x, from.y));
        let layers = self.scan.sensor().elevation_deg.len();
        let above = (0..layers).find(|&layer| self.scan.slope(layer).0 > tangent);
        let above = above.unwrap_or(layers);
        let azimuths = self.scan.azimuths();
        let near_m = out_m * (1.0 - SHORT_SHARE) - SHORT_M;
        let seen = [above.wrapping_sub(1), above]
            .into_iter()
            .filter(|&layer| layer < layers);
        let reached = |layer: usize, after: isize| {
            let column = azimuths.column_beside(column, after).unwrap_or(column);
            let reached_m = self.scan.reached_m()[column * MAX_LAYERS + layer];
            reached_m == 0.0 || f64::from(reached_m) > near_m
        };
        // Two of three rays side by side.
        let mut seen = seen.map(|layer| [-1, 0, 1].map(|after| reached(layer, after)));
        seen.any(|rays| rays.into_iter().filter(|&reached| reached).count() >= 2)
    }
}

/// Who is listed within this of a place is who is there.
const LISTED_M: f64 = 3.5;
/// What is on a ring is within this share of its width: beside it kerbs, signs and bushes begin.
const ON_RING: f64 = 0.8;
/// Nobody on a cycle path or on foot comes faster out of where nothing is seen.
const CYCLIST_MPS: f64 = 6.0;
const WALKER_MPS: f64 = 2.0;

/// Places on the circle, as far apart as this.
const APART_M: f64 = 2.0;

/// Where on the rings somebody may be who is not listed: what is hidden now and was not seen to be
/// free before, what was reached from there meanwhile, where a listed road user was hidden and
/// is not listed any more, and where something is that is not listed.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Unseen {
    rings: Vec<Stretch>,
}

/// Of one ring.
#[derive(Debug, Clone, Default, PartialEq)]
struct Stretch {
    /// From east on, in the direction of driving.
    may_hold: Vec<bool>,
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
        self.rings.resize_with(site.rings.len(), Stretch::default);
        for (ring, stretch) in site.rings.iter().zip(&mut self.rings) {
            let count = libm::ceil(TAU * ring.circle.radius_m / APART_M).clamp(8.0, 400.0) as usize;
            if stretch.may_hold.len() != count {
                stretch.may_hold = vec![true; count];
            }
            stretch.gone_m += passed_s.clamp(0.0, 10.0) * fastest_mps(ring.kind, road_mps);
            while stretch.gone_m >= APART_M {
                stretch.gone_m -= APART_M;
                stretch.spread(ring.kind == LaneKind::Pavement);
            }
            for place in 0..count {
                let at_m = ring.circle.at(angle_rad(site, place, count));
                if sight.reaches(at_m) {
                    stretch.may_hold[place] = false;
                } else {
                    // Should he not be listed any more, he is still there.
                    stretch.may_hold[place] |= is_listed(objects, at_m);
                }
            }
        }
        for at_m in sight.things_m() {
            for (ring, stretch) in site.rings.iter().zip(&mut self.rings) {
                let count = stretch.may_hold.len();
                let is_on = ring.circle.off_m(at_m).abs() < ON_RING * ring.width_m / 2.0;
                if is_on && !is_listed(objects, at_m) {
                    let round_rad = site.round_rad(0.0, ring.circle.angle_rad(at_m));
                    let place = (round_rad / TAU * count as f64) as usize;
                    stretch.may_hold[place.min(count - 1)] = true;
                }
            }
        }
    }

    /// How long it takes from the nearest place where somebody may be who is not listed to a conflict point, if
    /// there is one; and the share of the ring where nobody is.
    pub(super) fn before(&self, site: &Site, conflict: &Conflict, road_mps: f64) -> (f64, f64) {
        let mut soonest_s = f64::INFINITY;
        let mut least_share: f64 = 1.0;
        // Who comes round an inner lane counts, too.
        let rings = site.rings.iter().zip(&self.rings);
        for (ring, stretch) in rings.filter(|(ring, _)| ring.kind == conflict.kind) {
            let count = stretch.may_hold.len();
            let hidden = (0..count).filter(|&place| stretch.may_hold[place]);
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
            soonest_s = soonest_s.min(nearest_m / fastest_mps(ring.kind, road_mps));
            least_share = least_share.min(1.0 - hidden.count() as f64 / count.max(1) as f64);
        }
        (soonest_s, least_share)
    }
}

fn is_listed(objects: &[Object], at_m: [f64; 2]) -> bool {
    objects.iter().any(|object| {
        let [x, y, _] = object.centre_m;
        let reach_m = LISTED_M.max(object.length_m / 2.0 + 1.0);
        libm::hypot(x - at_m[0], y - at_m[1]) < reach_m
    })
}

impl Stretch {
    /// One place further on; on foot one goes both ways.
    fn spread(&mut self, both_ways: bool) {
        let (Some(&first), Some(&last)) = (self.may_hold.first(), self.may_hold.last()) else {
            return;
        };
        let count = self.may_hold.len();
        for place in (1..count).rev() {
            self.may_hold[place] |= self.may_hold[place - 1];
        }
        self.may_hold[0] |= last;
        if both_ways {
            // What came forward came from here: nobody goes two places back.
            for place in 0..count - 1 {
                self.may_hold[place] |= self.may_hold[place + 1];
            }
            self.may_hold[count - 1] |= first;
        }
    }
}

pub(super) fn fastest_mps(kind: LaneKind, road_mps: f64) -> f64 {
    match kind {
        LaneKind::Road => road_mps,
        LaneKind::Bikeway => CYCLIST_MPS,
        LaneKind::Pavement => WALKER_MPS,
    }
}

fn angle_rad(site: &Site, place: usize, count: usize) -> f64 {
    let side = if site.is_clockwise { -1.0 } else { 1.0 };
    side * TAU * place as f64 / count as f64
}
