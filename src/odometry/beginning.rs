//! How a frame begins: where the sensor is, how fast it goes, and with which revolution.

use nalgebra::Vector6;

use super::motion::Motion;
use super::registration::Agreement;
use super::{FIRST_OFF_M, Odometry, State};
use crate::geometry::Rigid;
use crate::time::Time;

impl Odometry {
    /// Begins a new frame, in which the sensor is at `pose` in the middle of the next sweep, and at a velocity (metres and
    /// radians a second, in that frame) if that is known, to within so many m/s.
    pub fn begin(&mut self, pose: &Rigid, velocity: Option<(Vector6<f64>, f64)>) {
        self.motion = Motion::begin(*pose, velocity.map(|(velocity, _)| velocity));
        self.led_within_mps = velocity.map(|(_, within_mps)| within_mps);
        (self.followed, self.doubted) = (0, 0);
        self.time = None;
        self.map.clear();
        self.state = State::New;
        (self.usual_off_m, self.usual_agreement) = (FIRST_OFF_M, Agreement::default());
        self.unsettled = None;
    }

    /// Whether the frame began at a velocity that was told.
    pub(super) fn is_led(&self) -> bool {
        self.led_within_mps.is_some()
    }

    /// Whether the next scan begins a frame.
    pub fn begins(&self) -> bool {
        self.state == State::New
    }

    /// The middle of the sweep with which the frame began, if that was the last one.
    pub fn begun_at(&self) -> Option<Time> {
        self.time.filter(|_| self.state == State::Begun)
    }

    /// Takes the sweep with which the frame began anew: the sensor was at `pose` in its middle, and went at a velocity that is
    /// known to within so many m/s.
    pub fn lead(&mut self, pose: &Rigid, velocity: (Vector6<f64>, f64)) {
        let time = self.time;
        self.begin(pose, Some(velocity));
        self.time = time;
        self.begin_map();
    }

    /// The first revolution of a frame, as it was met, becomes its map.
    pub(super) fn begin_map(&mut self) {
        self.unskew(&self.motion.clone());
        self.map.add(&self.view, &self.motion.pose);
        self.state = State::Begun;
    }
}
