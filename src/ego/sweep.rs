//! Where the sensor is while it turns once.

use super::{Placement, Pose};

/// The frame in which states are published.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Frame {
    /// The sensor's, because no pose is known.
    #[default]
    Sensor,
    /// East, north, up around a WGS84 reference.
    Earth,
    /// A simulation's own.
    Simulation,
}

impl Frame {
    /// The number in `kreisel.ObjectList`.
    pub const fn number(self) -> u32 {
        match self {
            Self::Sensor => 0,
            Self::Earth => 1,
            Self::Simulation => 2,
        }
    }
}

/// The sensor's poses during a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// The frame that they are in, and which of its stretches between jumps.
    pub frame: Frame,
    /// Counts jumps and losses of the source: poses of different epochs cannot be compared.
    pub epoch: u32,
    /// The vehicle's pose at the end, if it is known.
    pub vehicle: Option<Pose>,
    /// The sensor's pose at the end.
    pub sensor: Pose,
    pub(super) knots: [Pose; KNOTS],
}

/// Places in a sweep at which the pose is looked up; between them it is linear. A vehicle that
/// turns at 1 rad/s deviates from the chord of 12.5 ms by 2e-5 rad.
pub(super) const KNOTS: usize = 9;

impl Sweep {
    /// A sweep from one place.
    pub const fn still(epoch: u32) -> Self {
        Self {
            frame: Frame::Sensor,
            epoch,
            vehicle: None,
            sensor: Pose::SENSOR,
            knots: [Pose::SENSOR; KNOTS],
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
