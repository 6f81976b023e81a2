//! Where the sensor is while it turns once.

use super::geodesy::Geodetic;
use super::{Anchor, Placement, Pose};
use crate::geometry::Rigid;

/// The frame in which states are published.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Frame {
    /// The odometry's own, because no pose is known.
    #[default]
    Odometry,
    /// East, north, up around a WGS84 reference.
    Earth,
    /// A simulation's own.
    Simulation,
}

impl Frame {
    /// The number in `kreisel.ObjectList`.
    pub const fn number(self) -> u32 {
        match self {
            Self::Odometry => 0,
            Self::Earth => 1,
            Self::Simulation => 2,
        }
    }
}

/// The sensor's poses during a sweep, in the odometry frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// The frame that states are published in.
    pub frame: Frame,
    /// The WGS84 reference around which it lies, if it lies on the earth.
    pub reference: Option<Geodetic>,
    /// Where the odometry frame lies in it.
    pub anchor: Anchor,
    /// Counts how often the odometry frame began anew: poses of different epochs cannot be compared.
    pub epoch: u32,
    /// The vehicle's pose at the end in the local frame, if it is known.
    pub vehicle: Option<Pose>,
    /// The sensor's pose at the end.
    pub sensor: Pose,
    /// The same in space.
    pub attitude: Rigid,
    pub(super) knots: [Pose; KNOTS],
}

/// Places in a sweep at which the pose is looked up; between them it is linear. A vehicle that
/// turns at 1 rad/s deviates from the chord of 12.5 ms by 2e-5 rad.
pub(super) const KNOTS: usize = 9;

impl Sweep {
    /// A sweep from one place.
    pub const fn still(epoch: u32) -> Self {
        Self {
            frame: Frame::Odometry,
            reference: None,
            anchor: Anchor::IDENTITY,
            epoch,
            vehicle: None,
            sensor: Pose::SENSOR,
            attitude: Rigid::IDENTITY,
            knots: [Pose::SENSOR; KNOTS],
        }
    }

    /// The sensor's pose at the end in the local frame.
    pub fn local_sensor(&self) -> Pose {
        self.anchor.pose(&self.sensor)
    }

    /// The same in space.
    pub fn local_attitude(&self) -> Rigid {
        let turned = Pose {
            position_m: [0.0; 3],
            yaw_rad: Pose::SENSOR.yaw_rad + self.anchor.yaw_rad,
        };
        Rigid {
            rotation: turned.rigid().rotation * self.attitude.rotation,
            translation_m: self
                .anchor
                .place_m(self.attitude.translation_m.into())
                .into(),
        }
    }

    /// The sensor's pose at the end of the next sweep, if it goes on as in this one.
    pub fn carried_on(&self) -> Pose {
        self.knots[0].toward(&self.sensor, 2.0)
    }

    /// The sensor's mean velocity over the ground in a sweep that took so long.
    pub fn velocity_mps(&self, duration_s: f64) -> [f64; 2] {
        let [begin_m, end_m] = [&self.knots[0], &self.sensor].map(|pose| pose.position_m);
        [0, 1].map(|axis| (end_m[axis] - begin_m[axis]) / duration_s)
    }

    /// How far the sensor went during it.
    pub fn way_m(&self) -> f64 {
        let [x, y] = self.velocity_mps(1.0);
        libm::hypot(x, y)
    }

    /// The sensor's pose at a share of the sweep, 0 its begin and 1 its end.
    pub fn pose(&self, share: f64) -> Pose {
        let position = (share * (KNOTS - 1) as f64).clamp(0.0, (KNOTS - 1) as f64);
        let knot = (position as usize).min(KNOTS - 2);
        self.knots[knot].toward(&self.knots[knot + 1], position - knot as f64)
    }

    /// How the points of each of a sweep's columns are placed, linear between the knots.
    pub fn placements(&self, columns: usize, placements: &mut Vec<Placement>) {
        let knots = self.knots.map(|knot| knot.placement());
        placements.clear();
        placements.extend((1..=columns).map(|column| {
            let position = (KNOTS - 1) as f64 * column as f64 / columns as f64;
            let knot = (position as usize).min(KNOTS - 2);
            knots[knot].toward(&knots[knot + 1], position - knot as f64)
        }));
    }
}
