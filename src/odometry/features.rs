//! A few hundred returns on smooth surfaces, with the surfaces' normals: what is aligned.
//!
//! The normal comes from the range image: along the layer between two neighbours a quarter of a metre
//! to either side, and across the layers between the returns above and below. What is not flat there (an
//! edge, a leaf, a person) is left out.

use nalgebra::Vector3;

use crate::cloud::{MAX_LAYERS, Scan};

/// A return and the direction of the surface there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Feature {
    /// Where it is, metres; first as the scan has it, then as seen from the middle of the sweep.
    pub(super) point_m: Vector3<f64>,
    /// Unit normal of the surface, towards the sensor.
    pub(super) normal: Vector3<f64>,
    /// When it was met, after the middle of the sweep.
    pub(super) late_s: f64,
}

/// One in so many columns is looked at where the surface lies flat: the ground has more than enough.
const EVERY_FLAT: usize = 3;
/// The vertical part of a normal from which on its surface lies flat.
const FLAT: f64 = 0.8;
/// Half of the way along a layer over which the direction is taken, and most columns of it.
const HALF_BASE_M: f32 = 0.3;
const MOST_COLUMNS: f32 = 12.0;
/// How far the middle one of three returns may lie off the line between the others, and what is added
/// for each metre of that line.
const OFF_M: f64 = 0.04;
const OFF_PER_M: f64 = 0.02;
/// Longest such line across layers: the next rings of a road 25 m away.
const LONGEST_M: f64 = 18.0;
/// Least cosine between ray and normal.
const LEAST_INCIDENCE: f64 = 0.03;
/// Farthest return that is looked at.
const FARTHEST_M: f32 = 80.0;

/// Farthest return from foliage.
const FOLIAGE_FARTHEST_M: f32 = 40.0;

/// When a column was met, after the middle of the sweep.
pub(super) fn late_s(scan: &Scan, column: usize) -> f64 {
    0.5 * scan.duration_s() - scan.age_s(column)
}

/// Gathers the features of one in `every` columns of a scan, where `is_used` says so of a column and a point.
pub(super) fn gather(
    scan: &Scan,
    every: usize,
    is_used: impl Fn(usize, [f32; 3]) -> bool,
    features: &mut Vec<Feature>,
    foliage: &mut Vec<Feature>,
) {
    features.clear();
    foliage.clear();
    let columns = scan.columns();
    if columns < 2 * MOST_COLUMNS as usize {
        return;
    }
    let per_step = HALF_BASE_M / (scan.step_rad().abs() as f32).max(1e-6);
    let all_round = scan.sensor().sees_all_round();
    let (ranges_m, _) = scan.range_m().as_chunks::<MAX_LAYERS>();
    for (number, column) in (0..columns).step_by(every).enumerate() {
        let takes_flat = number % EVERY_FLAT == 0;
        for layer in 1..MAX_LAYERS - 1 {
            let range_m = ranges_m[column][layer];
            let is_near = range_m > 0.0 && range_m < FARTHEST_M;
            if !is_near || ranges_m[column][layer - 1] <= 0.0 || ranges_m[column][layer + 1] <= 0.0
            {
                continue;
            }
            let aside = (per_step / range_m).clamp(2.0, MOST_COLUMNS) as usize;
            let (before, after) = if all_round {
                let before = column + columns - aside;
                (scan.over_seam(before), scan.over_seam(column + aside))
            } else if column < aside || column + aside >= columns {
                continue;
            } else {
                (column - aside, column + aside)
            };
            if ranges_m[before][layer] <= 0.0 || ranges_m[after][layer] <= 0.0 {
                continue;
            }
            let at = |column: usize, layer: usize| {
                Vector3::from(scan.point_m(scan.index(column, layer)).map(f64::from))
            };
            let point_m = at(column, layer);
            let (below, above) = (at(column, layer - 1), at(column, layer + 1));
            let normal = normal(
                &point_m,
                [at(before, layer), at(after, layer)],
                [below, above],
            );
            let Some(normal) = normal else {
                let is_steep = |other: &Vector3<f64>| {
                    let way = other - point_m;
                    let along = libm::sqrt(way.x * way.x + way.y * way.y);
                    along < 1.5 * way.z.abs()
                };
                if (is_steep(&above) || is_steep(&below))
                    && range_m < FOLIAGE_FARTHEST_M
                    && is_used(column, scan.point_m(scan.index(column, layer)))
                {
                    foliage.push(Feature {
                        point_m,
                        normal: Vector3::zeros(),
                        late_s: late_s(scan, column),
                    });
                }
                continue;
            };
            if (normal.z.abs() > FLAT && !takes_flat)
                || !is_used(column, scan.point_m(scan.index(column, layer)))
            {
                continue;
            }
            features.push(Feature {
                point_m,
                normal,
                late_s: late_s(scan, column),
            });
        }
    }
}

/// The normal at a point between two others along the layer and two across the layers.
fn normal(
    point_m: &Vector3<f64>,
    along: [Vector3<f64>; 2],
    across: [Vector3<f64>; 2],
) -> Option<Vector3<f64>> {
    let along_m = line(point_m, &along)?;
    let across_m = line(point_m, &across)?;
    let normal = along_m.cross(&across_m);
    let length = libm::sqrt(normal.norm_squared());
    if length < 1e-6 {
        return None;
    }
    let normal = normal / length;
    let towards = -normal.dot(point_m);
    let range_m = libm::sqrt(point_m.norm_squared());
    (towards.abs() > LEAST_INCIDENCE * range_m).then(|| normal * towards.signum())
}

/// From one end to the other, if the point lies on the line between them.
fn line(point_m: &Vector3<f64>, [from, to]: &[Vector3<f64>; 2]) -> Option<Vector3<f64>> {
    let way = to - from;
    let length_squared = way.norm_squared();
    let share = (point_m - from).dot(&way) / length_squared.max(1e-12);
    let off_squared = (point_m - from - way * share).norm_squared();
    let length_m = libm::sqrt(length_squared);
    let is_line = length_m < LONGEST_M
        && (0.1..0.9).contains(&share)
        && off_squared < (OFF_M + OFF_PER_M * length_m).powi(2);
    is_line.then_some(way)
}
