//! Returns of one revolution that may be road users, in the local frame.

use nalgebra::Vector2;

use super::Scene;

/// One return.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spot {
    /// In the local frame, where the sensor was when it saw it.
    pub(super) at_m: Vector2<f64>,
    /// Above the ground.
    pub(super) above_m: f64,
    /// Before the end of the sweep.
    pub(super) age_s: f64,
    /// Its place in the scan.
    pub(super) point: u32,
    /// The group that it belongs to.
    pub(super) group: u32,
}

impl Spot {
    /// A point of the scan that belongs to a group, where it was placed.
    pub(super) fn new(scene: &Scene<'_>, point: u32, at_m: Vector2<f64>, group: u32) -> Self {
        let column = scene.scan.column(point as usize);
        Self {
            at_m,
            above_m: f64::from(scene.heights_m[point as usize]),
            age_s: scene.scan.age_s(column),
            point,
            group,
        }
    }
}
