//! What is published of a track.

use nalgebra::Vector2;

use super::Track;
use crate::time::Time;
use crate::track::Object;
use crate::track::confidence::confidence;

/// An object that is farther than this from where it is said to be is not there.
const THERE_M: f64 = 2.0;
/// Standard deviations of its velocity above which something goes by its motion alone, though no ray has shown
/// yet that its place was empty: with three, a third more of what stands in a real yard seems to move.
const SURELY_DEVIATIONS: f64 = 5.0;

impl Track {
    /// The existence of a road user, by the track and what it looks like, given how likely it is where
    /// it is said to be.
    fn road_user_existence(&self, there: f64) -> f64 {
        let road_user = self.belief.road_user();
        let probability = self.standing_vehicle.unwrap_or(road_user);
        confidence(self.existence.probability() * probability * there)
    }

    /// Whether it moves: by what rays have shown, or by its motion alone.
    pub(in crate::track) fn goes_beyond_doubt(&self) -> bool {
        let estimate = self.motion.estimate();
        let least_sure_mps = SURELY_DEVIATIONS * estimate.velocity_deviation_mps();
        self.moves || (self.goes() && estimate.velocity_mps.norm() > least_sure_mps)
    }

    /// How likely it exists at most, wherever it is: never less than [`Object::existence`].
    pub(in crate::track) fn most_confidence(&self) -> f64 {
        self.road_user_existence(1.0)
    }

    /// Whether it may be as likely as that, and was once.
    pub(in crate::track) fn may_be_listed(&self, least_confidence: f64) -> bool {
        self.was_likely && self.most_confidence() >= least_confidence
    }

    /// What is published, valid at `end`.
    pub(in crate::track) fn object(&self, end: Time) -> Object {
        let (motion, shape) = self.later(end);
        let estimate = motion.estimate();
        let [length_m, width_m] = shape.size_m(self.belief.vehicle());
        let (class, class_probability) = self.belief.class();
        let (sine, cosine) = libm::sincos(shape.yaw_rad);
        let ahead = Vector2::new(cosine, sine);
        let stands = estimate.standing > 0.5 || !self.goes_beyond_doubt();
        let moving_mps = if shape.front_known {
            estimate.velocity_mps.dot(&ahead)
        } else {
            estimate.velocity_mps.norm()
        };
        // Of a normal distribution in the plane the share within a distance (Rayleigh).
        let variance = 0.5 * estimate.position_covariance.trace();
        let there = 1.0 - libm::exp(-0.5 * THERE_M * THERE_M / variance.max(1e-6));
        let height_m = shape.top_m.max(0.1);
        let along_variance = (ahead.transpose() * estimate.velocity_covariance * ahead)[0];
        let speed_variance = motion.innovation_ratio() * along_variance;
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
            existence: self.road_user_existence(there),
            first_seen: self.first_seen,
            seen_since: self.seen_since,
            last_measured: self.last_measured,
            points: self.points,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::cloud::Scan;
    use crate::cloud::tests::scan_of;
    use crate::track::tests::followed;

    #[test]
    fn what_goes_beyond_doubt_has_its_speed_though_no_place_of_it_was_seen_empty() {
        // 4.2 m across the line of sight, 20 m away, and a metre on in each revolution.
        let met = |revolution: usize| {
            let columns = 300 + 14 * revolution..360 + 14 * revolution;
            scan_of(1800, |column, layer| match layer {
                5..8 if columns.contains(&column) => 2000,
                _ => 0,
            })
        };
        let speed_mps = |revolutions: usize| {
            let scans: Vec<Scan> = (0..revolutions).map(met).collect();
            let (mut track, end) = followed(&scans);
            track.moves = false;
            track.object(end).speed_mps.abs()
        };
        assert_eq!(speed_mps(2), 0.0);
        let known_mps = speed_mps(15);
        assert!((known_mps - 9.8).abs() < 1.5, "{known_mps}");
    }
}
