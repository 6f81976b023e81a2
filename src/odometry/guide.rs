//! What something else says of the motion: poses, a ground speed, a yaw rate.

use nalgebra::Vector6;

use super::Odometry;
use crate::geometry::Rigid;

impl Odometry {
    /// Takes in where something else says that the sensor is in the plane.
    pub fn guide(&mut self, pose: &Rigid, deviation_m: f64, deviation_rad: f64) {
        let still = Vector6::zeros();
        for (axis, deviation) in [(0, deviation_m), (1, deviation_m), (5, deviation_rad)] {
            let mut row = Vector6::zeros();
            row[axis] = 1.0;
            let off = self.motion.pose.step_to(pose)[axis];
            self.motion
                .measure([&row, &still], off, deviation * deviation);
        }
    }

    /// Takes in how fast something else says that the sensor goes in a direction along the ground.
    pub fn guide_speed(&mut self, ahead_rad: f64, speed_mps: f64, deviation_mps: f64) {
        let (sine, cosine) = libm::sincos(ahead_rad);
        let ahead = Vector6::new(cosine, sine, 0.0, 0.0, 0.0, 0.0);
        let off = speed_mps - self.motion.velocity.dot(&ahead);
        let still = Vector6::zeros();
        self.motion
            .measure([&still, &ahead], off, deviation_mps * deviation_mps);
    }

    /// Takes in how fast something else says that it turns, counter-clockwise.
    pub fn guide_yaw_rate(&mut self, rate_radps: f64, deviation_radps: f64) {
        let mut turning = Vector6::zeros();
        turning[5] = 1.0;
        let off = rate_radps - self.motion.velocity[5];
        let still = Vector6::zeros();
        self.motion
            .measure([&still, &turning], off, deviation_radps * deviation_radps);
    }
}
