//! What of the lanes is seen.
//!
//! Numbers without another source were set with `scripts/evaluate-roundabouts --seeds 1-8`.

use std::ops::Range;

use nalgebra::Vector3;

use crate::cloud::{MAX_LAYERS, Scan};
use crate::cluster::Clusters;
use crate::geometry::Rigid;
use crate::ground::Plane;

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
/// No car is lower.
const LOW_CAR_M: f64 = 1.2;
/// A ray that ends so far behind a place met nobody there.
const BEYOND_M: f64 = 1.0;

impl Sight<'_> {
    /// Places of the local frame where something is at the height of road users: a few points of every cluster, and all
    /// that are of none, as far away too few meet somebody to be one.
    pub(super) fn things_m(&self) -> impl Iterator<Item = [f64; 2]> {
        /// Of each cluster, whose points are in the order of their columns.
        const POINTS: usize = 5;
        const HEIGHTS_M: Range<f32> = 0.3..2.5;
        let sampled = self.clusters.iter().flat_map(|points| {
            let every = (points.len() / POINTS).max(1);
            points.iter().skip(every / 2).step_by(every)
        });
        let sampled = sampled.map(|&point| point as usize);
        let sampled = sampled.filter(|&point| HEIGHTS_M.contains(&self.heights_m[point]));
        let loose = self.loose(HEIGHTS_M);
        sampled.chain(loose).map(|point| self.place_m(point))
    }

    /// Places of the local frame where the ground is seen, or what is hardly higher, and how high above a level plane: the
    /// ground itself steps up at a kerb.
    pub(super) fn ground_m(&self) -> impl Iterator<Item = ([f64; 2], f64)> {
        const HEIGHTS_M: Range<f32> = -0.3..0.35;
        self.loose(HEIGHTS_M).map(|point| {
            let point_m = self.scan.point_m(point).map(f64::from).into();
            (self.place_m(point), self.ground.above_m(&point_m))
        })
    }

    /// Returns at these heights above the ground that are of no cluster.
    fn loose(&self, wanted_m: Range<f32>) -> impl Iterator<Item = usize> {
        let (heights_m, _) = self.heights_m.as_chunks::<MAX_LAYERS>();
        let (ranges_m, _) = self.scan.range_m().as_chunks::<MAX_LAYERS>();
        let (members, _) = self.clusters.members().as_chunks::<MAX_LAYERS>();
        let (from_m, to_m) = (wanted_m.start, wanted_m.end);
        let is_loose = move |column: usize, layer: usize| {
            let height_m = heights_m[column][layer];
            let is_return = ranges_m[column][layer] > 0.0;
            (height_m >= from_m) & (height_m < to_m) & is_return & !members[column][layer]
        };
        // Most columns have none: all layers of one are looked at at once.
        let columns = heights_m.len().min(ranges_m.len()).min(members.len());
        let has_some = move |&column: &usize| {
            let layers = (0..MAX_LAYERS).map(|layer| u32::from(is_loose(column, layer)));
            layers.fold(0, |some, is_loose| some | is_loose) > 0
        };
        let columns = (0..columns).filter(has_some);
        columns.flat_map(move |column| {
            let layers = (0..MAX_LAYERS).filter(move |&layer| is_loose(column, layer));
            layers.map(move |layer| column * MAX_LAYERS + layer)
        })
    }

    /// Where a point is in the local frame.
    fn place_m(&self, point: usize) -> [f64; 2] {
        let point_m = self.scan.point_m(point).map(f64::from);
        let place = self.sensor.place(&point_m.into());
        [place.x, place.y]
    }

    /// Whether a ray reached a place of the local frame, a little above the ground.
    pub(super) fn reaches(&self, at_m: [f64; 2]) -> bool {
        self.is_met(at_m, |out_m, _, reached_m| {
            reached_m > out_m * (1.0 - SHORT_SHARE) - SHORT_M
        })
    }

    /// Whether one passed over it where even a low car would have stopped it.
    pub(super) fn passes(&self, at_m: [f64; 2]) -> bool {
        self.is_met(at_m, |out_m, height_m, reached_m| {
            height_m < LOW_CAR_M && reached_m > out_m + BEYOND_M
        })
    }

    /// Whether two of three rays side by side, next below or above the height of road users, are as is asked, by the place's
    /// distance, their height there and how far they came.
    fn is_met(&self, [x, y]: [f64; 2], is_as_asked: impl Fn(f64, f64, f64) -> bool) -> bool {
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
        let seen = [above.wrapping_sub(1), above]
            .into_iter()
            .filter(|&layer| layer < layers);
        let is_met = |layer: usize, after: isize| {
            let column = azimuths.column_beside(column, after).unwrap_or(column);
            let reached_m = self.scan.reached_m()[column * MAX_LAYERS + layer];
            let reached_m = if reached_m == 0.0 {
                f64::INFINITY
            } else {
                f64::from(reached_m)
            };
            is_as_asked(out_m, below_m + out_m * self.scan.slope(layer).0, reached_m)
        };
        let mut seen = seen.map(|layer| [-1, 0, 1].map(|after| is_met(layer, after)));
        seen.any(|rays| rays.into_iter().filter(|&met| met).count() >= 2)
    }
}
