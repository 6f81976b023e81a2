//! What is done with all points of a revolution at once. Written so that it vectorises.

use multiversion::multiversion;

use super::Dialect;
use super::scan::{MAX_LAYERS, UNSEEN};
use crate::float::greatest;

/// Reads the ranges of columns of so many layers. What is not within the two that are kept is
/// masked, and so are the layers above.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn read_ranges(
    distances: &[u8],
    layers: usize,
    dialect: Dialect,
    [low_m, high_m]: [f32; 2],
    ranges_m: &mut [[f32; MAX_LAYERS]],
) {
    let mut bytes = [[0u8; 2]; MAX_LAYERS];
    let columns = distances.chunks_exact(2 * layers);
    for (ranges_m, distances) in ranges_m.iter_mut().zip(columns) {
        let distances = distances.as_chunks::<2>().0;
        if let Ok(all) = distances.try_into() {
            bytes = all;
        } else {
            bytes[..layers].copy_from_slice(distances);
        }
        for layer in 0..MAX_LAYERS {
            let units = dialect.byte_order.join(bytes[layer]) & dialect.distance_mask;
            let range_m = f32::from(units) * dialect.unit_m;
            let is_kept = (range_m >= low_m) & (range_m <= high_m);
            let kept_m = if is_kept { range_m } else { -range_m };
            ranges_m[layer] = if units == 0 { 0.0 } else { kept_m };
        }
        ranges_m[layers..].fill(UNSEEN);
    }
}

/// The points of a revolution, column by column.
pub(super) struct Coordinates<'a> {
    pub(super) x_m: &'a mut [[f32; MAX_LAYERS]],
    pub(super) y_m: &'a mut [[f32; MAX_LAYERS]],
    pub(super) z_m: &'a mut [[f32; MAX_LAYERS]],
}

/// Polar to Cartesian: x = d cos(v) sin(a), y = d cos(v) cos(a), z = d sin(v), with the azimuth a
/// clockwise from y and the elevation v; given are sine and cosine of each layer's v and of each
/// column's a. What has no range stands in the origin.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn place(
    ranges_m: &[[f32; MAX_LAYERS]],
    elevations: &[[f32; MAX_LAYERS]; 2],
    directions: &[[f32; 2]],
    coordinates: Coordinates<'_>,
) {
    let [sines, cosines] = elevations;
    let columns = ranges_m.len();
    let Coordinates { x_m, y_m, z_m } = coordinates;
    let (x_m, y_m) = (&mut x_m[..columns], &mut y_m[..columns]);
    let (z_m, directions) = (&mut z_m[..columns], &directions[..columns]);
    for column in 0..columns {
        let [sine, cosine] = directions[column];
        let (mut horizontal_m, mut vertical_m) = ([0.0; MAX_LAYERS], [0.0; MAX_LAYERS]);
        for layer in 0..MAX_LAYERS {
            let range_m = greatest(ranges_m[column][layer], 0.0);
            horizontal_m[layer] = range_m * cosines[layer];
            vertical_m[layer] = range_m * sines[layer];
        }
        x_m[column] = horizontal_m.map(|metres| metres * sine);
        y_m[column] = horizontal_m.map(|metres| metres * cosine);
        z_m[column] = vertical_m;
    }
}

/// Turns the points of every layer clockwise by an angle of its own; given are its sine and cosine.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn turn(
    turns: &[[f32; 2]; MAX_LAYERS],
    x_m: &mut [[f32; MAX_LAYERS]],
    y_m: &mut [[f32; MAX_LAYERS]],
) {
    for (x_m, y_m) in x_m.iter_mut().zip(y_m) {
        for layer in 0..MAX_LAYERS {
            let ([sine, cosine], x, y) = (turns[layer], x_m[layer], y_m[layer]);
            x_m[layer] = x * cosine + y * sine;
            y_m[layer] = y * cosine - x * sine;
        }
    }
}
