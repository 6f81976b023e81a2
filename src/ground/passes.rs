//! What is done with all points of a revolution at once. Written so that it vectorises.

use multiversion::multiversion;

use super::Plane;
use super::plane::Moments;
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

/// Heights of the returns above a plane that are no farther than the root of `far_squared` away;
/// infinity for the others.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn heights_nearby(scan: &Scan, plane: &Plane, far_squared: f32, heights_m: &mut [f32]) {
    let above_m = plane.heights();
    let count = scan.len();
    let (x_m, y_m, z_m) = (scan.x_m(), scan.y_m(), scan.z_m());
    let (x_m, y_m, z_m) = (&x_m[..count], &y_m[..count], &z_m[..count]);
    let range_m = &scan.range_m()[..count];
    let heights_m = &mut heights_m[..count];
    for point in 0..count {
        let (x, y, z) = (x_m[point], y_m[point], z_m[point]);
        let is_near = (x * x + y * y <= far_squared) & (range_m[point] > 0.0);
        let height_m = above_m(x, y, z);
        heights_m[point] = if is_near { height_m } else { f32::INFINITY };
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

/// Takes the height of the ground off the heights of points in one sector, as far as they have
/// returns.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn lower(
    profile: &Profile,
    ranges_m: &[f32],
    distances_m: &[f32],
    heights_m: &mut [f32],
) {
    let mut begin = 0;
    while begin < ranges_m.len() {
        let end = (begin + TOGETHER).min(ranges_m.len());
        let (ranges_m, distances_m) = (&ranges_m[begin..end], &distances_m[begin..end]);
        let heights_m = &mut heights_m[begin..end];
        let count = end - begin;
        let mut behind = [0u32; TOGETHER];
        let behind = &mut behind[..count];
        let knots = profile.knots();
        for knot in &knots[1..] {
            let from_m = knot.distance_m;
            for point in 0..count {
                behind[point] += u32::from(distances_m[point] >= from_m);
            }
        }
        for point in 0..count {
            let knot = &knots[behind[point] as usize];
            let ground_m = knot.level_m + knot.slope * (distances_m[point] - knot.distance_m);
            let is_return = ranges_m[point] > 0.0;
            heights_m[point] -= if is_return { ground_m } else { 0.0 };
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

/// Marks the returns that are ground.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn mark(scan: &Scan, heights_m: &[f32], band: Band, mask: &mut [bool]) {
    let count = scan.len();
    let (ranges_m, heights_m) = (&scan.range_m()[..count], &heights_m[..count]);
    let mask = &mut mask[..count];
    for point in 0..count {
        let (range_m, above_m) = (ranges_m[point], heights_m[point]);
        let limit_m = band.near_m + band.per_m * range_m;
        let is_within = (above_m >= -limit_m) | band.with_below;
        mask[point] = (range_m > 0.0) & (above_m <= limit_m) & is_within;
    }
}

/// Marks the returns within `near_m` of a plane and no farther than the root of `far_squared`
/// away.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn mark_near(
    scan: &Scan,
    plane: &Plane,
    near_m: f32,
    far_squared: f32,
    marks: &mut [bool],
) {
    let above_m = plane.heights();
    let count = scan.len();
    let (x_m, y_m, z_m) = (scan.x_m(), scan.y_m(), scan.z_m());
    let (x_m, y_m, z_m) = (&x_m[..count], &y_m[..count], &z_m[..count]);
    let ranges_m = &scan.range_m()[..count];
    let marks = &mut marks[..count];
    for point in 0..count {
        let (x, y, z) = (x_m[point], y_m[point], z_m[point]);
        marks[point] = (above_m(x, y, z).abs() <= near_m)
            & (x * x + y * y <= far_squared)
            & (ranges_m[point] > 0.0);
    }
}

/// Points by their coordinates.
#[derive(Debug, Clone, Default)]
pub(super) struct Cloud {
    x_m: Vec<f32>,
    y_m: Vec<f32>,
    z_m: Vec<f32>,
}

impl Cloud {
    pub(super) fn clear(&mut self) {
        self.x_m.clear();
        self.y_m.clear();
        self.z_m.clear();
    }

    pub(super) fn push(&mut self, [x, y, z]: [f32; 3]) {
        self.x_m.push(x);
        self.y_m.push(y);
        self.z_m.push(z);
    }
}

/// The moments of the points within `near_m` of a plane.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn moments_near(cloud: &Cloud, plane: &Plane, near_m: f64) -> Moments {
    let [a, b, c] = plane.normal();
    let height_m = plane.height_m();
    let mut moments = Moments::default();
    let total = cloud.x_m.len();
    let [mut is_near, mut x, mut y, mut z] = [[0.0; TOGETHER]; 4];
    let mut begin = 0;
    while begin < total {
        let end = (begin + TOGETHER).min(total);
        let (x_m, y_m) = (&cloud.x_m[begin..end], &cloud.y_m[begin..end]);
        let z_m = &cloud.z_m[begin..end];
        for point in 0..end - begin {
            let (x_m, y_m) = (f64::from(x_m[point]), f64::from(y_m[point]));
            let z_m = f64::from(z_m[point]);
            let above_m = a * x_m + b * y_m + c * z_m + height_m;
            let weight = if above_m.abs() <= near_m { 1.0 } else { 0.0 };
            is_near[point] = weight;
            x[point] = weight * x_m;
            y[point] = weight * y_m;
            z[point] = weight * z_m;
        }
        // What is not near, or not there, adds nothing.
        for coordinates in [&mut is_near, &mut x, &mut y, &mut z] {
            coordinates[end - begin..].fill(0.0);
        }
        moments.count += dot(&is_near, &is_near);
        moments.x += dot(&is_near, &x);
        moments.y += dot(&is_near, &y);
        moments.z += dot(&is_near, &z);
        moments.xx += dot(&x, &x);
        moments.xy += dot(&x, &y);
        moments.yy += dot(&y, &y);
        moments.xz += dot(&x, &z);
        moments.yz += dot(&y, &z);
        begin = end;
    }
    moments
}

/// The sum of the products of numbers.
#[inline(always)]
fn dot(a: &[f64; TOGETHER], b: &[f64; TOGETHER]) -> f64 {
    const LANES: usize = 8;
    let mut sums = [0.0; LANES];
    let (a, b) = (a.as_chunks::<LANES>().0, b.as_chunks::<LANES>().0);
    for eight in 0..a.len() {
        for lane in 0..LANES {
            sums[lane] += a[eight][lane] * b[eight][lane];
        }
    }
    sums.iter().sum()
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
