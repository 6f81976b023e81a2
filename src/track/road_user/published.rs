//! What is published of a track.

use nalgebra::Vector2;

use super::Track;
use crate::time::Time;
use crate::track::Object;
use crate::track::confidence::confidence;

/// An object that is farther than this from where it is said to be is not there.
const THERE_M: f64 = 2.0;

impl Track {
    /// The existence of a road user, by the track and what it looks like.
    fn road_user_existence(&self) -> f64 {
        self.existence.probability() * self.belief.road_user()
    }

    /// How likely it exists at most, wherever it is: never less than [`Object::existence`].
    pub(in crate::track) fn most_confidence(&self) -> f64 {
        confidence(self.road_user_existence())
    }

    /// What is published, valid at `end`.
    pub(in crate::track) fn object(&self, end: Time) -> Object {
        let (motion, shape) = self.later(end);
        let estimate = motion.estimate();
        let [length_m, width_m] = shape.size_m(self.belief.vehicle());
        let (class, class_probability) = self.belief.class();
        let (sine, cosine) = libm::sincos(shape.yaw_rad);
        let ahead = Vector2::new(cosine, sine);
        let stands = estimate.standing > 0.5 || !self.moves;
        let moving_mps = if shape.front_known {
            estimate.velocity_mps.dot(&ahead)
        } else {
            estimate.velocity_mps.norm()
        };
        // Of a normal distribution in the plane the share within a distance (Rayleigh).
        let variance = 0.5 * estimate.position_covariance.trace();
        let there = 1.0 - libm::exp(-0.5 * THERE_M * THERE_M / variance.max(1e-6));
        let height_m = shape.top_m.max(0.1);
        let speed_variance = (ahead.transpose() * estimate.velocity_covariance * ahead)[0];
        Object {
            id: self.id,
            class,
            class_probability,
            measured: self.points > 0,
            centre_m: [
                estimate.position_m.x,
                estimate.position_m.y,
                self.floor_z_m + 0.5 * height_m,
            ],
            yaw_rad: shape.yaw_rad,
            speed_mps: if stands { 0.0 } else { moving_mps },
            yaw_rate_radps: if stands { 0.0 } else { estimate.yaw_rate_radps },
            length_m,
            width_m,
            height_m,
            position_deviation_m: [0, 1]
                .map(|axis| libm::sqrt(estimate.position_covariance[(axis, axis)])),
            yaw_deviation_rad: libm::sqrt(shape.yaw_variance),
            speed_deviation_mps: libm::sqrt(speed_variance),
            existence: confidence(self.road_user_existence() * there),
            first_seen: self.first_seen,
            seen_since: self.seen_since,
            last_measured: self.last_measured,
            points: self.points,
        }
    }
}
