//! How well a group fits a track.

use nalgebra::{Matrix2, Vector2};

use super::Track;
use crate::track::look::Look;
use crate::track::shape::is_tall;
use crate::track::spots::Spot;
use crate::track::view::View;

/// Noise of a box's middle beside that of its edges, because its shape is not a box.
const MIDDLE_M: f64 = 0.08;

/// Variance of a direction from which on the hidden middle grows no more unsure: a box that may lie
/// anywhere about what is seen has its middle within half a length of it all the same.
const MOST_YAW_VARIANCE: f64 = 0.09;

/// Length of the longest lorries with their trailers (Directive 96/53/EC).
const LONGEST_M: f64 = 18.75;

/// Cost beyond which a group is not a track: chi-squared of two degrees of freedom at 0.9997,
/// and the prices for size and spread.
pub(in crate::track) const GATE: f64 = 16.0;

impl Track {
    /// Longest extent that more of the same object may have, if that is so high.
    pub(in crate::track) fn most_m(&self, top_m: f64) -> [f64; 2] {
        let [length_m, width_m] = self.shape.size_m(self.belief.vehicle());
        let growth_m = if self.is_confirmed() { 0.6 } else { 2.0 };
        if self.may_be_lorry(top_m) {
            let askew_m = LONGEST_M * libm::sqrt(self.shape.yaw_variance);
            return [LONGEST_M, width_m + 0.4 + askew_m.min(1.0)];
        }
        [length_m + growth_m, width_m + 0.4]
    }

    /// Whether it and something so high may both be parts of a lorry.
    fn may_be_lorry(&self, top_m: f64) -> bool {
        // What is hardly a road user would grow over all that stands around it.
        self.is_moving_vehicle()
            && self.belief.road_user() > 0.5
            && self.shape.is_tall()
            && is_tall(top_m)
    }

    pub(super) fn centre(
        &self,
        view: &View,
        expected_m: Vector2<f64>,
    ) -> (Vector2<f64>, Matrix2<f64>) {
        let vehicle = self.belief.vehicle();
        let (centre_m, noise) = view.centre(
            self.shape.size_m(vehicle),
            self.shape.size_deviation_m(vehicle),
            expected_m,
            self.shape.yaw_variance.min(MOST_YAW_VARIANCE),
            self.is_moving_vehicle(),
        );
        (centre_m, noise + Matrix2::identity() * MIDDLE_M * MIDDLE_M)
    }

    /// How unlikely it is that a group is this object: the squared Mahalanobis distance of its
    /// place, with a price for a spread that would take anything and for a size that does not fit.
    pub(in crate::track) fn cost(&self, spots: &[Spot], look: &Look) -> f64 {
        let view = View::of(look, spots, self.shape.yaw_rad);
        let estimate = self.motion.estimate();
        let (centre_m, noise) = self.centre(&view, estimate.position_m);
        let spread = estimate.position_covariance + noise;
        let off = centre_m - estimate.position_m;
        let Some(inverse) = spread.try_inverse() else {
            return f64::MAX;
        };
        let squared = (off.transpose() * inverse * off)[0];
        let most = self.most_m(look.top_m);
        let extent = view.extent_m();
        let excess_m = (extent[0] - most[0]).max(extent[1] - most[1]).max(0.0);
        let vanished = if self.is_confirmed() {
            let ratio = (look.points as f64 + 3.0) / (self.points as f64 + 3.0);
            libm::log(ratio).abs()
        } else {
            0.0
        };
        squared
            + 0.5 * libm::log(spread.determinant().max(1e-6) / 0.01).max(0.0)
            + 4.0 * excess_m
            + 0.3 * vanished
    }
}
