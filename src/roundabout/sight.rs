//! What of the circle is seen, and where somebody may be who was not.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::site::Site;
use crate::cloud::{MAX_LAYERS, Scan};
use crate::geometry::Rigid;
use crate::ground::Plane;
use crate::roadmap::LaneKind;

/// Where the last revolution's rays went.
#[derive(Debug, Clone, Copy)]
pub struct Sight<'a> {
    /// Its points.
    pub scan: &'a Scan,
    /// The sensor in the local frame.
    pub sensor: &'a Rigid,
    /// The ground in the sensor frame.
    pub ground: &'a Plane,
}

/// Height above the ground at which a road user is looked for: the bonnet of a car, the wheels of
/// a cyclist.
const LOOK_M: f64 = 0.7;
/// A ray that ends nearer than this before a place is taken to have reached it.
const SHORT_M: f64 = 1.0;
/// And by this share of the range: low rays meet the ground before the place.
const SHORT_SHARE: f64 = 0.05;

impl Sight<'_> {
    /// Whether a ray reached a place of the local frame, a little above the ground.
    pub(super) fn reaches(&self, [x, y]: [f64; 2]) -> bool {
        let level = Vector3::new(x, y, self.sensor.translation_m.z);
        let from = self.sensor.rotation.transpose() * (level - self.sensor.translation_m);
        let out_m = libm::hypot(from.x, from.y);
        if out_m < 1.0 {
            return true;
        }
        let below_m =
            self.ground.above_m(&Vector3::new(from.x, from.y, 0.0)) / self.ground.normal()[2];
        let z_m = LOOK_M - below_m;
        let tangent = z_m / out_m;
        let column = self.scan.column_at(libm::atan2(from.x, from.y));
        let layers = self.scan.sensor().elevation_deg.len();
        let above = (0..layers)
            .find(|&layer| self.scan.slope(layer).0 > tangent)
            .unwrap_or(layers);
        let azimuths = self.scan.azimuths();
        let reaches = |layer: usize| {
            [-1, 0, 1].into_iter().any(|after| {
                let column = azimuths.column_beside(column, after).unwrap_or(column);
                let point = column * MAX_LAYERS + layer;
                let reached_m = f64::from(self.scan.reached_m()[point]);
                reached_m == 0.0 || reached_m > out_m * (1.0 - SHORT_SHARE) - SHORT_M
            })
        };
        [above.wrapping_sub(1), above]
            .into_iter()
            .filter(|&layer| layer < layers)
            .any(reaches)
    }
}

/// Places on the circle, as far apart as this.
const APART_M: f64 = 2.0;

/// Where on the road round the circle somebody may be whom nobody has seen: what is hidden now and
/// was not seen to be empty before, or was reached from there meanwhile.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Unseen {
    /// From east on, in the direction of driving.
    may_hold: Vec<bool>,
    /// How far they may have gone since the last step.
    gone_m: f64,
}

impl Unseen {
    /// Takes in what is seen `passed_s` later; hidden road users go no faster than `speed_mps`.
    pub(super) fn update(&mut self, site: &Site, sight: &Sight<'_>, passed_s: f64, speed_mps: f64) {
        let Some(road) = site.outermost_road() else {
            return;
        };
        let circle = site.rings[road].circle;
        let count = libm::ceil(TAU * circle.radius_m / APART_M).clamp(8.0, 400.0) as usize;
        if self.may_hold.len() != count {
            self.may_hold = vec![true; count];
        }
        self.gone_m += passed_s.clamp(0.0, 10.0) * speed_mps;
        while self.gone_m >= APART_M {
            self.gone_m -= APART_M;
            let last = self.may_hold[count - 1];
            for place in (1..count).rev() {
                self.may_hold[place] |= self.may_hold[place - 1];
            }
            self.may_hold[0] |= last;
        }
        for place in 0..count {
            if self.may_hold[place] && sight.reaches(circle.at(angle_rad(site, place, count))) {
                self.may_hold[place] = false;
            }
        }
    }

    /// How far before a direction the nearest place lies from which somebody may come, if there is one, going back
    /// round the circle; and the share of the circle that holds nobody unseen.
    pub(super) fn before(&self, site: &Site, conflict_rad: f64) -> (Option<f64>, f64) {
        let count = self.may_hold.len();
        let roads = site.rings.iter().filter(|ring| ring.kind == LaneKind::Road);
        let radius_m = roads.map(|ring| ring.circle.radius_m).fold(0.0, f64::max);
        let hidden = (0..count).filter(|&place| self.may_hold[place]);
        let away_m =
            |place: usize| radius_m * site.round_rad(angle_rad(site, place, count), conflict_rad);
        let nearest_m = hidden.clone().map(away_m).min_by(f64::total_cmp);
        (nearest_m, 1.0 - hidden.count() as f64 / count.max(1) as f64)
    }
}

fn angle_rad(site: &Site, place: usize, count: usize) -> f64 {
    let side = if site.is_clockwise { -1.0 } else { 1.0 };
    side * TAU * place as f64 / count as f64
}
