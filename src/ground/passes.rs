//! What is done with many points of a revolution at once. Written so that it vectorises.

use std::iter::StepBy;
use std::ops::Range;

use multiversion::multiversion;

use super::Plane;
use super::profile::Profile;
use crate::cloud::{MAX_LAYERS, Scan};

/// Heights of all points above a plane.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn heights(scan: &Scan, plane: &Plane, heights_m: &mut [f32]) {
    let above_m = plane.heights();
    let count = scan.len();
    let (x_m, y_m, z_m) = (scan.x_m(), scan.y_m(), scan.z_m());
    let (x_m, y_m, z_m) = (&x_m[..count], &y_m[..count], &z_m[..count]);
    let heights_m = &mut heights_m[..count];
    for point in 0..count {
        heights_m[point] = above_m(x_m[point], y_m[point], z_m[point]);
    }
}

/// Heights of the returns of some columns above a plane, if they are no farther than the root of
/// `far_squared` away; infinity for the others.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn heights_nearby(
    scan: &Scan,
    columns: StepBy<Range<usize>>,
    plane: &Plane,
    far_squared: f32,
    heights_m: &mut [[f32; MAX_LAYERS]],
) {
    let above_m = plane.heights();
    let [x_m, y_m, z_m, ranges_m] = [scan.x_m(), scan.y_m(), scan.z_m(), scan.range_m()]
        .map(|metres| metres.as_chunks::<MAX_LAYERS>().0);
    for (heights_m, column) in heights_m.iter_mut().zip(columns) {
        let (x_m, y_m) = (&x_m[column], &y_m[column]);
        let (z_m, ranges_m) = (&z_m[column], &ranges_m[column]);
        for layer in 0..MAX_LAYERS {
            let (x, y, z) = (x_m[layer], y_m[layer], z_m[layer]);
            let is_near = (x * x + y * y <= far_squared) & (ranges_m[layer] > 0.0);
            let height_m = above_m(x, y, z);
            heights_m[layer] = if is_near { height_m } else { f32::INFINITY };
        }
    }
}

/// Horizontal distances of all points; 0 or less where nothing came back.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn distances(scan: &Scan, distances_m: &mut [f32]) {
    let mut cosines = [0.0f32; MAX_LAYERS];
    for (layer, cosine) in cosines.iter_mut().enumerate() {
        *cosine = scan.slope(layer).1 as f32;
    }
    let ranges_m = scan.range_m().as_chunks::<MAX_LAYERS>().0;
    let distances_m = distances_m.as_chunks_mut::<MAX_LAYERS>().0;
    for (distances_m, ranges_m) in distances_m.iter_mut().zip(ranges_m) {
        for layer in 0..MAX_LAYERS {
            distances_m[layer] = ranges_m[layer] * cosines[layer];
        }
    }
}

/// Points that are looked at together: so many stay in the fastest cache, with what is noted of
/// them.
const TOGETHER: usize = 512;
/// Bends of the ground that they are compared with at once.
pub(super) const BENDS: usize = 4;

/// Takes the height of the ground off the heights of points in one sector. What has no return,
/// and therefore no distance, keeps its own.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn lower(profile: &Profile, distances_m: &[f32], heights_m: &mut [f32]) {
    let bends = profile.bends();
    let bends = &bends[..profile.knots().len().next_multiple_of(BENDS)];
    let mut ground_m = [0.0f32; TOGETHER];
    let mut begin = 0;
    while begin < distances_m.len() {
        let end = (begin + TOGETHER).min(distances_m.len());
        let (distances_m, heights_m) = (&distances_m[begin..end], &mut heights_m[begin..end]);
        let ground_m = &mut ground_m[..end - begin];
        ground_m.fill(0.0);
        for [a, b, c, d] in bends.as_chunks::<BENDS>().0 {
            for point in 0..end - begin {
                let distance_m = distances_m[point];
                ground_m[point] += (a.rise_m(distance_m) + b.rise_m(distance_m))
                    + (c.rise_m(distance_m) + d.rise_m(distance_m));
            }
        }
        for point in 0..end - begin {
            heights_m[point] -= ground_m[point];
        }
        begin = end;
    }
}

/// How near to the ground a return is ground.
#[derive(Debug, Clone, Copy)]
pub(super) struct Band {
    pub(super) near_m: f32,
    /// What is added for each metre of range.
    pub(super) per_m: f32,
    /// Whether all that is lower is ground, too.
    pub(super) with_below: bool,
}

/// Marks the returns that are ground, given the ranges and heights of some.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn mark(ranges_m: &[f32], heights_m: &[f32], band: Band, mask: &mut [bool]) {
    let count = mask.len();
    let (ranges_m, heights_m) = (&ranges_m[..count], &heights_m[..count]);
    for point in 0..count {
        let (range_m, above_m) = (ranges_m[point], heights_m[point]);
        let limit_m = band.near_m + band.per_m * range_m;
        let is_within = (above_m >= -limit_m) | band.with_below;
        mask[point] = (range_m > 0.0) & (above_m <= limit_m) & is_within;
    }
}

/// Marks the ground returns that are higher than `least_m`, and `per_m` for each metre of
/// distance, and above which the next layer has no ground.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn mark_edges(
    mask: &[bool],
    heights_m: &[f32],
    distances_m: &[f32],
    (least_m, per_m): (f32, f32),
    marks: &mut [bool],
) {
    let count = marks.len();
    let (mask, heights_m, distances_m) =
        (&mask[..count], &heights_m[..count], &distances_m[..count]);
    for point in 0..count {
        let is_high = heights_m[point] > least_m + per_m * distances_m[point];
        marks[point] = mask[point] & is_high;
    }
    let above = &mask[count.min(1)..];
    for point in 0..above.len() {
        marks[point] &= !above[point];
    }
}
