//! Returns of one revolution that may be road users.

use nalgebra::Vector3;

use super::Scene;
use crate::beams::{Hints, Seen};
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
    /// What was seen of its place before.
    pub(super) before: Seen,
}

impl Spot {
    /// A point of the scan that belongs to a group, where it was placed.
    pub(super) fn new(scene: &Scene<'_>, point: u32, at_m: [f32; 2], group: u32) -> Self {
        let column = scene.scan.column(point as usize);
        Self {
            before: Seen::Unknown,
            at_m,
            above_m: scene.heights_m[point as usize],
            age_s: scene.scan.age_s(column) as f32,
            point,
            returns: 1.0,
            group,
        }
    }
}

/// What was seen before of the place of a point of the scan, but for what `is_own`.
pub(super) fn seen_before(
    scene: &Scene<'_>,
    point: u32,
    at_m: [f32; 2],
    hints: &mut Hints,
    is_own: impl Fn(usize) -> bool,
) -> Seen {
    let attitude = &scene.sweep.attitude;
    let point_m = Vector3::from(scene.scan.point_m(point as usize)).map(f64::from);
    let [x, y, _] = scene.sweep.sensor.position_m;
    let z_m = attitude.rotation.row(2).tr_dot(&point_m) + attitude.translation_m.z;
    let at_m = Vector3::new(x + f64::from(at_m[0]), y + f64::from(at_m[1]), z_m);
    let azimuth_rad = scene.scan.azimuth_rad(scene.scan.column(point as usize));
    scene
        .beams
        .seen(scene.sweep.epoch, &at_m, azimuth_rad, hints, is_own)
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
