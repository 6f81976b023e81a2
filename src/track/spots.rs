//! Returns of one revolution that may be road users.

use super::Scene;
use crate::float::{greatest, least};

/// One return.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spot {
    /// Along the axes of the local frame, and relative to where the sensor is at the end.
    pub(super) at_m: [f32; 2],
    /// Above the ground.
    pub(super) above_m: f32,
    /// Before the end of the sweep.
    pub(super) age_s: f32,
    /// Its place in the scan.
    pub(super) point: u32,
    /// How many returns it stands for, on average.
    pub(super) returns: f32,
    /// The group that it belongs to.
    pub(super) group: u32,
}

impl Spot {
    /// A point of the scan that belongs to a group, where it was placed.
    pub(super) fn new(scene: &Scene<'_>, point: u32, at_m: [f32; 2], group: u32) -> Self {
        let column = scene.scan.column(point as usize);
        Self {
            at_m,
            above_m: scene.heights_m[point as usize],
            age_s: scene.scan.age_s(column) as f32,
            point,
            returns: 1.0,
            group,
        }
    }
}

/// Where spots are, relative to where the sensor is at the end of the sweep.
pub(super) fn places_m(spots: &[Spot]) -> impl Iterator<Item = [f64; 2]> {
    spots.iter().map(|spot| spot.at_m.map(f64::from))
}

/// The corners of the box that holds spots, in the frame of [`Spot::at_m`]; infinite around none.
pub(super) fn bounds_m<'a>(spots: impl Iterator<Item = &'a Spot>) -> [[f32; 2]; 2] {
    let nothing = [[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]];
    spots.fold(nothing, |[low_m, high_m], spot| {
        [
            [0, 1].map(|axis: usize| least(low_m[axis], spot.at_m[axis])),
            [0, 1].map(|axis: usize| greatest(high_m[axis], spot.at_m[axis])),
        ]
    })
}
