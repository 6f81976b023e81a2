//! Poles, posts and trunks: thin things that stand out from what is behind them.
//!
//! Where there is no wall they are all that holds a place and a heading. In one layer each is a short run of
//! columns between two that lead farther; its middle is the same from every side.

use nalgebra::Vector3;

use super::features::{Feature, late_s};
use crate::cloud::{MAX_LAYERS, Scan};

/// How much farther away what is beside a pole must be.
const GAP_M: f32 = 0.6;
/// How much nearer or farther a column of it may be than the one before.
const RAGGED_M: f32 = 0.2;
/// Greatest width.
const WIDEST_M: f32 = 0.5;
/// Ranges at which it is looked for.
const NEAREST_M: f32 = 1.5;
const FARTHEST_M: f32 = 50.0;
/// How far the layer above or below may meet it nearer or farther.
const LEANING_M: f32 = 0.25;
/// Fewest columns of it.
const FEWEST_COLUMNS: usize = 2;

/// Gathers the middles of what is thin, where `is_used` says so of a column and a point.
pub(super) fn gather(
    scan: &Scan,
    is_used: impl Fn(usize, [f32; 3]) -> bool,
    poles: &mut Vec<Feature>,
) {
    poles.clear();
    let (ranges_m, _) = scan.range_m().as_chunks::<MAX_LAYERS>();
    let columns = scan.columns();
    if !scan.sensor().sees_all_round() || columns < 2 {
        return;
    }
    let step = scan.step_rad().abs() as f32;
    for column in 0..columns {
        let before = &ranges_m[if column == 0 { columns - 1 } else { column - 1 }];
        let here = &ranges_m[column];
        let mut opens = 0u32;
        for layer in 0..MAX_LAYERS {
            let (range_m, before_m) = (here[layer], before[layer]);
            let is_begin = (range_m > NEAREST_M)
                & (range_m < FARTHEST_M)
                & ((before_m == 0.0) | (before_m > range_m + GAP_M));
            opens |= u32::from(is_begin) << layer;
        }
        while opens != 0 {
            let layer = opens.trailing_zeros() as usize;
            opens &= opens - 1;
            if let Some(pole) = pole(scan, ranges_m, column, layer, step)
                && is_used(column, pole.point_m.map(|metres| metres as f32).into())
            {
                poles.push(pole);
            }
        }
    }
}

/// The pole that begins at a column.
fn pole(
    scan: &Scan,
    ranges_m: &[[f32; MAX_LAYERS]],
    first: usize,
    layer: usize,
    step: f32,
) -> Option<Feature> {
    let range_m = ranges_m[first][layer];
    let most = (WIDEST_M / (range_m * step)) as usize + 1;
    let (mut count, mut sum_m, mut last_m) = (1, range_m, range_m);
    let closes = loop {
        let next_m = ranges_m[scan.over_seam(first + count)][layer];
        if next_m == 0.0 || next_m > last_m + GAP_M {
            break true;
        }
        if (next_m - last_m).abs() > RAGGED_M || count == most {
            break false;
        }
        (count, sum_m, last_m) = (count + 1, sum_m + next_m, next_m);
    };
    if !closes || count < FEWEST_COLUMNS {
        return None;
    }
    let middle = scan.over_seam(first + count / 2);
    let mean_m = sum_m / count as f32;
    let goes_on = |other: usize| (ranges_m[middle][other] - mean_m).abs() < LEANING_M;
    let is_upright =
        (layer > 0 && goes_on(layer - 1)) || (layer + 1 < MAX_LAYERS && goes_on(layer + 1));
    if !is_upright {
        return None;
    }
    // The returns lie on the half that faces the sensor, a quarter of pi of the radius before the axis.
    let radius_m = 0.5 * count as f64 * f64::from(mean_m * step);
    let (slope, cosine) = scan.slope(layer);
    let distance_m = f64::from(mean_m) * cosine + std::f64::consts::FRAC_PI_4 * radius_m;
    let azimuth_rad = scan.azimuth_rad(first) + 0.5 * (count - 1) as f64 * scan.step_rad();
    let (sine, cosine) = libm::sincos(azimuth_rad);
    Some(Feature {
        point_m: Vector3::new(distance_m * sine, distance_m * cosine, distance_m * slope),
        normal: Vector3::zeros(),
        late_s: late_s(scan, middle),
    })
}
