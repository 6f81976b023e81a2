//! Where the odometry frame lies in the local frame: what ties a frame that drifts to one that jumps.

use super::{EgoParameters, Frame, Pose, wrapped_rad};
use crate::odometry::Odometry;
use crate::time::{Span, Time};

/// A turn and a shift from the odometry frame to the local frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anchor {
    /// The odometry frame's origin, metres.
    pub origin_m: [f64; 3],
    /// The direction of its x axis, radians counter-clockwise from east.
    pub yaw_rad: f64,
}

impl Anchor {
    /// The frames are one.
    pub const IDENTITY: Self = Self {
        origin_m: [0.0; 3],
        yaw_rad: 0.0,
    };

    /// The anchor by which a pose in the odometry frame is one in the local frame.
    fn between(odometry: &Pose, local: &Pose) -> Self {
        let yaw_rad = wrapped_rad(local.yaw_rad - odometry.yaw_rad);
        let turned = Self {
            yaw_rad,
            ..Self::IDENTITY
        };
        let from_m = turned.place_m(odometry.position_m);
        Self {
            origin_m: [0, 1, 2].map(|axis| local.position_m[axis] - from_m[axis]),
            yaw_rad,
        }
    }

    /// A place of the odometry frame in the local frame.
    pub fn place_m(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        if *self == Self::IDENTITY {
            return [x, y, z];
        }
        let (sine, cosine) = libm::sincos(self.yaw_rad);
        [
            self.origin_m[0] + x * cosine - y * sine,
            self.origin_m[1] + x * sine + y * cosine,
            self.origin_m[2] + z,
        ]
    }

    /// A direction of the odometry frame in the local frame.
    pub fn yaw_rad(&self, yaw_rad: f64) -> f64 {
        wrapped_rad(yaw_rad + self.yaw_rad)
    }

    /// A pose of the odometry frame in the local frame.
    pub fn pose(&self, pose: &Pose) -> Pose {
        Pose {
            position_m: self.place_m(pose.position_m),
            yaw_rad: self.yaw_rad(pose.yaw_rad),
        }
    }

    /// A place of the local frame in the odometry frame.
    pub fn back_m(&self, at_m: [f64; 2]) -> [f64; 2] {
        let [x, y] = [0, 1].map(|axis| at_m[axis] - self.origin_m[axis]);
        let (sine, cosine) = libm::sincos(self.yaw_rad);
        [x * cosine + y * sine, y * cosine - x * sine]
    }

    /// A pose of the local frame in the odometry frame.
    fn back(&self, pose: &Pose) -> Pose {
        let [east, north, up] = pose.position_m;
        let [x, y] = self.back_m([east, north]);
        Pose {
            position_m: [x, y, up - self.origin_m[2]],
            yaw_rad: wrapped_rad(pose.yaw_rad - self.yaw_rad),
        }
    }
}

/// Follows the anchor: slowly, as the odometry drifts, and at once where the source jumped and stays there.
///
/// What is followed is the vehicle's place by the anchor, not the frame's far origin: a Kalman filter
/// for each of the place's axes and the heading, with the odometry's drift as what changes them.
#[derive(Debug, Clone)]
pub(super) struct Anchoring {
    anchor: Anchor,
    frame: Frame,
    /// Variances of the place and the heading that it gives.
    variance_m2: f64,
    variance_rad2: f64,
    /// Where the sensor was in the odometry frame when it was last compared.
    last: Option<(Time, Pose)>,
    /// Since when the source says otherwise.
    otherwise: Option<Time>,
    /// How far it said that it is off, lately.
    off_m: f64,
    jumps: u64,
}

/// Drift of the odometry: standard deviations after one metre, growing with the square root of the way; and after one second.
const DRIFT_M: f64 = 0.02;
const DRIFT_RAD: f64 = 0.000_5;
const DRIFT_STANDING_M: f64 = 0.002;
const DRIFT_STANDING_RAD: f64 = 0.000_05;
/// How much worse a source is in the long run than from one revolution to the next: what is wrong with it
/// stays for seconds.
const LASTING: f64 = 3.0;
/// How far a sensor goes and turns within the sweep of which the motion is not known.
const UNKNOWN_WAY_M: f64 = 1.0;
const UNKNOWN_TURN_RAD: f64 = 0.05;
/// Time for which a source must say otherwise to be believed.
const INSISTING: Span = Span::from_micros(1_000_000);

impl Anchoring {
    /// The odometry frame begins as the local frame, at a first reading of a source.
    pub(super) fn begin(frame: Frame, parameters: &EgoParameters) -> Self {
        let [metres, radians] = lasting(parameters);
        Self {
            anchor: Anchor::IDENTITY,
            frame,
            variance_m2: metres * metres,
            variance_rad2: radians * radians,
            last: None,
            otherwise: None,
            off_m: 0.0,
            jumps: 0,
        }
    }

    /// The frames are tied together where the sensor is now.
    pub(super) fn at(
        frame: Frame,
        odometry: &Pose,
        local: &Pose,
        parameters: &EgoParameters,
    ) -> Self {
        Self {
            anchor: Anchor::between(odometry, local),
            ..Self::begin(frame, parameters)
        }
    }

    /// It is not known how fast the sensor went when the frame began, and so how far until it is.
    pub(super) fn doubt_begin(&mut self) {
        self.variance_m2 += UNKNOWN_WAY_M * UNKNOWN_WAY_M;
        self.variance_rad2 += UNKNOWN_TURN_RAD * UNKNOWN_TURN_RAD;
    }

    /// The local frame is another one, in which a pose is what `anew` says; the sensor is where it is.
    pub(super) fn reframe(&mut self, odometry: &Pose, anew: impl Fn(&Pose) -> Pose) {
        let here = self.anchor.pose(odometry);
        self.anchor = Anchor::between(odometry, &anew(&here));
    }

    pub(super) fn anchor(&self) -> (Frame, Anchor) {
        (self.frame, self.anchor)
    }

    /// How far source and odometry were apart when they were compared last.
    pub(super) fn off_m(&self) -> f64 {
        self.off_m
    }

    pub(super) fn jumps(&self) -> u64 {
        self.jumps
    }

    /// Compares the sensor's pose by odometry and by a source.
    pub(super) fn take(
        &mut self,
        time: Time,
        odometry: &Pose,
        frame: Frame,
        source: &Pose,
        parameters: &EgoParameters,
    ) {
        self.drift(time, odometry);
        let here = self.anchor.pose(odometry);
        let off_m = [0, 1, 2].map(|axis| source.position_m[axis] - here.position_m[axis]);
        let off_rad = wrapped_rad(source.yaw_rad - here.yaw_rad);
        self.off_m = libm::hypot(off_m[0], off_m[1]);
        if frame != self.frame || self.is_far(off_m, off_rad, parameters) {
            let since = *self.otherwise.get_or_insert(time);
            if (time - since) >= INSISTING || frame != self.frame {
                *self = Self {
                    jumps: self.jumps + 1,
                    last: self.last,
                    ..Self::at(frame, odometry, source, parameters)
                };
            }
            return;
        }
        self.otherwise = None;
        let gain = |variance: &mut f64, deviation: f64| {
            let gain = *variance / (*variance + deviation * deviation);
            *variance *= 1.0 - gain;
            gain
        };
        let [metres, radians] = lasting(parameters);
        let by_m = gain(&mut self.variance_m2, metres);
        let by_rad = gain(&mut self.variance_rad2, radians);
        let corrected = Pose {
            position_m: [0, 1, 2].map(|axis| here.position_m[axis] + by_m * off_m[axis]),
            yaw_rad: wrapped_rad(here.yaw_rad + by_rad * off_rad),
        };
        self.anchor = Anchor::between(odometry, &corrected);
    }

    /// The odometry drifts as it goes.
    fn drift(&mut self, time: Time, odometry: &Pose) {
        if let Some((last, from)) = self.last.replace((time, *odometry)) {
            let way = |axis: usize| odometry.position_m[axis] - from.position_m[axis];
            let way_m = libm::hypot(way(0), way(1));
            let passed_s = (time - last).seconds().clamp(0.0, 1.0);
            let square = |value: f64| value * value;
            self.variance_m2 += way_m * square(DRIFT_M) + passed_s * square(DRIFT_STANDING_M);
            self.variance_rad2 += way_m * square(DRIFT_RAD) + passed_s * square(DRIFT_STANDING_RAD);
        }
    }

    fn is_far(&self, off_m: [f64; 3], off_rad: f64, parameters: &EgoParameters) -> bool {
        libm::hypot(off_m[0], off_m[1]) > parameters.jump_m
            || off_rad.abs() > parameters.jump_deg.to_radians()
    }

    /// Tells the odometry what a source says, where it agrees: it counts where nothing was seen that
    /// tells better.
    pub(super) fn guide(&self, odometry: &mut Odometry, source: &Pose, parameters: &EgoParameters) {
        let at = self.anchor.back(source);
        let expected = Pose::of(&odometry.pose());
        let off_m = [0, 1, 2].map(|axis| at.position_m[axis] - expected.position_m[axis]);
        let off_rad = wrapped_rad(at.yaw_rad - expected.yaw_rad);
        if self.otherwise.is_some() || self.is_far(off_m, off_rad, parameters) {
            return;
        }
        let [metres, radians] = lasting(parameters);
        let deviation_m = libm::hypot(metres, libm::sqrt(self.variance_m2));
        let deviation_rad = libm::hypot(radians, libm::sqrt(self.variance_rad2));
        odometry.guide(&at.rigid(), deviation_m, deviation_rad);
    }
}

/// How far a source is off in the long run: standard deviations in metres and radians.
fn lasting(parameters: &EgoParameters) -> [f64; 2] {
    let radians = parameters.pose_deviation_deg.to_radians();
    [LASTING * parameters.pose_deviation_m, LASTING * radians]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::Profile;

    fn pose(x: f64, y: f64, yaw_rad: f64) -> Pose {
        Pose {
            position_m: [x, y, 0.0],
            yaw_rad,
        }
    }

    fn parameters() -> EgoParameters {
        EgoParameters::profile(Profile::Default)
    }

    fn at(seconds: f64) -> Time {
        Time::ZERO + Span::from_seconds(seconds)
    }

    #[test]
    fn there_and_back_is_the_same_place() {
        let anchor = Anchor::between(&pose(3.0, -2.0, 0.4), &pose(100.0, 50.0, 2.1));
        let there = anchor.pose(&pose(3.0, -2.0, 0.4));
        assert!((there.position_m[0] - 100.0).abs() < 1e-9 && (there.yaw_rad - 2.1).abs() < 1e-9);
        let back = anchor.back(&anchor.pose(&pose(7.0, 8.0, -3.0)));
        assert!((back.position_m[0] - 7.0).abs() < 1e-9 && (back.position_m[1] - 8.0).abs() < 1e-9);
    }

    /// Drives east at 10 m/s for so many revolutions; the source lies off by what `off` says of the revolution.
    fn drive(anchoring: &mut Anchoring, steps: std::ops::Range<usize>, off: impl Fn(usize) -> f64) {
        for step in steps {
            let x = step as f64;
            let (odometry, source) = (pose(x, 0.0, 0.0), pose(x, off(step), 0.0));
            let seconds = 0.1 * x;
            anchoring.take(at(seconds), &odometry, Frame::Earth, &source, &parameters());
        }
    }

    #[test]
    fn drift_is_followed_slowly_and_an_outlier_is_not() {
        let mut anchoring = Anchoring::begin(Frame::Earth, &parameters());
        drive(&mut anchoring, 0..600, |step| 0.002 * step as f64);
        let off_m = anchoring.anchor().1.place_m([600.0, 0.0, 0.0])[1];
        assert!((off_m - 1.2).abs() < 0.2, "{off_m}");
        let before = anchoring.anchor();
        drive(&mut anchoring, 600..605, |_| 9.0);
        assert_eq!(anchoring.anchor(), before);
        assert_eq!(anchoring.jumps(), 0);
    }

    #[test]
    fn a_jump_that_persists_moves_the_anchor_at_once() {
        let mut anchoring = Anchoring::begin(Frame::Earth, &parameters());
        drive(&mut anchoring, 0..50, |_| 0.0);
        drive(&mut anchoring, 50..65, |_| 5.0);
        let off_m = anchoring.anchor().1.place_m([65.0, 0.0, 0.0])[1];
        assert!((off_m - 5.0).abs() < 0.05, "{off_m}");
        assert_eq!(anchoring.jumps(), 1);
    }
}
