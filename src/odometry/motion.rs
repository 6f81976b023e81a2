//! Where the sensor is and how it moves: a Kalman filter over pose and velocity.
//!
//! It goes on at constant velocity and turn rate (white noise acceleration; Bar-Shalom, Li,
//! Kirubarajan 2001, section 6.2.2). A measurement is of the pose alone; what it says of the
//! velocity follows from how the two go together.

use nalgebra::{Matrix6, Vector6};

use crate::geometry::{self, Rigid};

/// Pose and velocity at a time that the caller keeps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    pub(super) pose: Rigid,
    /// Metres and radians a second, in the odometry frame.
    pub(super) velocity: Vector6<f64>,
    /// Covariances of a step that would correct the pose, of it with the velocity, of the velocity.
    pose_covariance: Matrix6<f64>,
    mixed_covariance: Matrix6<f64>,
    velocity_covariance: Matrix6<f64>,
}

/// How much the velocity wanders in a second, squared: along the ground, upward, and of turns about level axes
/// and the upright one. A car that brakes hard changes its speed by 0.8 m/s in a revolution; one over
/// a bump nods by 0.2 rad/s.
const WANDER: [f64; 6] = [1.0, 1.0, 0.2, 0.1, 0.1, 0.6];
/// Standard deviations of what is not known at all.
const UNKNOWN_MPS: f64 = 15.0;
const UNKNOWN_RADPS: f64 = 0.5;
/// And of what a source of poses gives.
const GUESSED_MPS: f64 = 2.0;
const GUESSED_RADPS: f64 = 0.2;
/// Standard deviations of the pose where the frame begins: it begins there by definition.
const KNOWN_M: f64 = 1e-3;
const KNOWN_RAD: f64 = 1e-4;

impl Motion {
    /// A motion that begins somewhere, at a velocity if that is known.
    pub(super) fn begin(pose: Rigid, velocity: Option<Vector6<f64>>) -> Self {
        let square = |[m, rad]: [f64; 2]| {
            Matrix6::from_diagonal(&Vector6::new(m, m, m, rad, rad, rad).map(|each| each * each))
        };
        Self {
            pose,
            velocity: velocity.unwrap_or_else(Vector6::zeros),
            pose_covariance: square([KNOWN_M, KNOWN_RAD]),
            mixed_covariance: Matrix6::zeros(),
            velocity_covariance: square(match velocity {
                Some(_) => [GUESSED_MPS, GUESSED_RADPS],
                None => [UNKNOWN_MPS, UNKNOWN_RADPS],
            }),
        }
    }

    /// So many seconds later.
    pub(super) fn predict(&mut self, seconds: f64) {
        let step = self.velocity * seconds;
        self.pose = self.pose.moved(&step);
        // Speed keeps its direction in the vehicle.
        let turned = geometry::turn(&geometry::angular(&step)) * geometry::linear(&self.velocity);
        self.velocity.fixed_rows_mut::<3>(0).copy_from(&turned);
        let wander = Matrix6::from_diagonal(&Vector6::from(WANDER)) * self.liveliness();
        let mixed = self.mixed_covariance;
        self.pose_covariance += (mixed + mixed.transpose()) * seconds
            + self.velocity_covariance * (seconds * seconds)
            + wander * (seconds * seconds * seconds / 3.0);
        self.mixed_covariance +=
            self.velocity_covariance * seconds + wander * (0.5 * seconds * seconds);
        self.velocity_covariance += wander * seconds;
    }

    /// What stands goes on standing: the share of the wander of what moves.
    fn liveliness(&self) -> f64 {
        /// Speed at which half of it is reached; a turn counts as the motion of what is so far away.
        const SLOW_MPS: f64 = 0.3;
        const AWAY_M: f64 = 5.0;
        const LEAST: f64 = 0.005;
        let speed_mps = libm::sqrt(geometry::linear(&self.velocity).norm_squared())
            + AWAY_M * libm::sqrt(geometry::angular(&self.velocity).norm_squared());
        let square = speed_mps * speed_mps;
        (square / (square + SLOW_MPS * SLOW_MPS)).max(LEAST)
    }

    /// What the pose's prediction is worth: the inverse of its covariance.
    pub(super) fn information(&self) -> Matrix6<f64> {
        inverse(&self.pose_covariance).unwrap_or_else(Matrix6::identity)
    }

    /// The motion with the pose that explains both the prediction and a measurement best, given the
    /// information of both together.
    pub(super) fn corrected(&self, pose: Rigid, information: &Matrix6<f64>) -> Self {
        let (Some(before), Some(after)) = (inverse(&self.pose_covariance), inverse(information))
        else {
            return *self;
        };
        // What is learned of the pose is handed on to the velocity by regression.
        let gain = self.mixed_covariance.transpose() * before;
        let gained = self.pose_covariance - after;
        Self {
            pose,
            velocity: self.velocity + gain * self.pose.step_to(&pose),
            pose_covariance: after,
            mixed_covariance: after * gain.transpose(),
            velocity_covariance: self.velocity_covariance - gain * gained * gain.transpose(),
        }
    }

    /// Whether a sweep looks otherwise with this velocity than with another: by more than what is measured of a return.
    pub(super) fn skews_otherwise(&self, velocity: &Vector6<f64>) -> bool {
        const MOST_MPS: f64 = 1.0;
        const MOST_RADPS: f64 = 0.1;
        let off = self.velocity - velocity;
        geometry::linear(&off).norm_squared() > MOST_MPS * MOST_MPS
            || geometry::angular(&off).norm_squared() > MOST_RADPS * MOST_RADPS
    }

    /// How far what is ten metres away may be from where the pose puts it: its standard deviation.
    pub(super) fn slack_m(&self) -> f64 {
        const AWAY_M: f64 = 10.0;
        let variance = |i: usize| self.pose_covariance[(i, i)];
        let shift = (0..3).map(variance).fold(0.0, f64::max);
        let turn = (3..6).map(variance).fold(0.0, f64::max);
        libm::sqrt(shift + AWAY_M * AWAY_M * turn)
    }

    /// Takes in one number that pose and velocity give in the directions of two rows, and which is off by so much
    /// (the scalar Kalman update).
    pub(super) fn measure(
        &mut self,
        [pose_row, velocity_row]: [&Vector6<f64>; 2],
        off: f64,
        variance: f64,
    ) {
        let of_pose = self.pose_covariance * pose_row + self.mixed_covariance * velocity_row;
        let of_velocity =
            self.mixed_covariance.transpose() * pose_row + self.velocity_covariance * velocity_row;
        let spread = pose_row.dot(&of_pose) + velocity_row.dot(&of_velocity) + variance;
        if spread <= 0.0 {
            return;
        }
        self.pose = self.pose.moved(&(of_pose * (off / spread)));
        self.velocity += of_velocity * (off / spread);
        self.pose_covariance -= of_pose * of_pose.transpose() / spread;
        self.mixed_covariance -= of_pose * of_velocity.transpose() / spread;
        self.velocity_covariance -= of_velocity * of_velocity.transpose() / spread;
    }

    /// How unlikely a pose is, beside one at the standard deviation of the prediction: their squared distances' ratio.
    pub(super) fn surprise(&self, pose: &Rigid) -> f64 {
        let by = self.pose.step_to(pose);
        by.dot(&(self.information() * by)) / 6.0
    }

    /// Trusts the prediction less: all variances are so many times what they were.
    pub(super) fn loosen(&mut self, factor: f64) {
        self.pose_covariance *= factor;
        self.mixed_covariance *= factor;
        self.velocity_covariance *= factor;
    }

    /// The sensor moved otherwise than predicted in the last seconds, by about so much; nobody knows exactly.
    pub(super) fn jerk(&mut self, by: &Vector6<f64>, seconds: f64) {
        const ABOUT_M: f64 = 0.3;
        const ABOUT_RAD: f64 = 0.02;
        self.pose = self.pose.moved(by);
        self.velocity += by / seconds;
        let [m, rad] = [ABOUT_M, ABOUT_RAD].map(|each| each * each);
        let slack = Matrix6::from_diagonal(&Vector6::new(m, m, m, rad, rad, rad));
        self.pose_covariance += slack;
        self.mixed_covariance += slack / seconds;
        self.velocity_covariance += slack / (seconds * seconds);
    }
}

/// The inverse of a symmetric matrix, if it is positive definite.
pub(super) fn inverse(matrix: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    let symmetric = (matrix + matrix.transpose()) * 0.5;
    symmetric.cholesky().map(|root| root.inverse())
}
