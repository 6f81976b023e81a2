//! Sums over many points at once, for planes: which fits best, and how well one fits.

use multiversion::multiversion;

use super::Plane;
use super::plane::Moments;
use crate::cloud::MAX_LAYERS;
use crate::float::least;

/// Coordinates of points. What stands in the sensor's axis is none.
#[derive(Debug, Clone, Copy)]
pub(super) struct Positions<'a> {
    pub(super) x_m: &'a [f32],
    pub(super) y_m: &'a [f32],
    pub(super) z_m: &'a [f32],
}

/// Sums that take turns, so that none waits for itself.
const TURNS: usize = 2;

/// Sums of each lane; their order is that of the fields of [`Moments`].
type Sums = [[f32; MAX_LAYERS]; 9];

/// The moments of the points within `near_m` of a plane, and no farther than the root of
/// `far_squared` away; of every so many columns, one is looked at.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn moments_near(
    points: Positions<'_>,
    every: usize,
    plane: &Plane,
    near_m: f32,
    far_squared: f32,
) -> Moments {
    let [a, b, c] = plane.normal().map(|component| component as f32);
    let height_m = plane.height_m() as f32;
    let mut sums: [Sums; TURNS] = [[[0.0; MAX_LAYERS]; 9]; TURNS];
    let count = points.x_m.len();
    let (x_m, y_m, z_m) = (points.x_m, &points.y_m[..count], &points.z_m[..count]);
    let (x_m, last_x) = x_m.as_chunks::<MAX_LAYERS>();
    let (y_m, last_y) = y_m.as_chunks::<MAX_LAYERS>();
    let (z_m, last_z) = z_m.as_chunks::<MAX_LAYERS>();
    let last = [last_x, last_y, last_z].map(padded);
    let mut column = 0;
    while column <= x_m.len() {
        let [x, y, z] = if column < x_m.len() {
            [x_m[column], y_m[column], z_m[column]]
        } else {
            last
        };
        let sums = &mut sums[column / every % TURNS];
        let (mut weight, mut x_near) = ([0.0; MAX_LAYERS], [0.0; MAX_LAYERS]);
        let (mut y_near, mut z_near) = ([0.0; MAX_LAYERS], [0.0; MAX_LAYERS]);
        for lane in 0..MAX_LAYERS {
            let above_m = a * x[lane] + b * y[lane] + c * z[lane] + height_m;
            let squared = x[lane] * x[lane] + y[lane] * y[lane];
            let is_near = (above_m.abs() <= near_m) & (squared <= far_squared) & (squared > 0.0);
            weight[lane] = if is_near { 1.0 } else { 0.0 };
            x_near[lane] = if is_near { x[lane] } else { 0.0 };
            y_near[lane] = if is_near { y[lane] } else { 0.0 };
            z_near[lane] = if is_near { z[lane] } else { 0.0 };
        }
        add(&mut sums[0], &weight, &weight);
        add(&mut sums[1], &weight, &x_near);
        add(&mut sums[2], &weight, &y_near);
        add(&mut sums[3], &weight, &z_near);
        add(&mut sums[4], &x_near, &x_near);
        add(&mut sums[5], &x_near, &y_near);
        add(&mut sums[6], &y_near, &y_near);
        add(&mut sums[7], &x_near, &z_near);
        add(&mut sums[8], &y_near, &z_near);
        column += every;
    }
    let total = |moment: usize| -> f64 {
        let lanes = sums.iter().flat_map(|sums| sums[moment]);
        lanes.map(f64::from).sum()
    };
    let [count, x, y, z, xx, xy, yy, xz, yz] = std::array::from_fn(total);
    Moments {
        count,
        x,
        y,
        z,
        xx,
        xy,
        yy,
        xz,
        yz,
    }
}

/// Adds products of numbers to the sums of their lanes.
#[inline(always)]
fn add(sums: &mut [f32; MAX_LAYERS], a: &[f32; MAX_LAYERS], b: &[f32; MAX_LAYERS]) {
    for lane in 0..MAX_LAYERS {
        sums[lane] += a[lane] * b[lane];
    }
}

/// The sum of the squared distances of points to a plane, of which none counts for more than
/// `most`.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn squared_distances(points: Positions<'_>, plane: &Plane, most: f32) -> f32 {
    let [a, b, c] = plane.normal().map(|component| component as f32);
    let height_m = plane.height_m() as f32;
    let count = points.x_m.len();
    let (x_m, y_m, z_m) = (points.x_m, &points.y_m[..count], &points.z_m[..count]);
    let mut sums = [0.0f32; MAX_LAYERS];
    let mut begin = 0;
    let mut squared = [0.0f32; BLOCK];
    while begin < count {
        let end = (begin + BLOCK).min(count);
        let (x, y, z) = (&x_m[begin..end], &y_m[begin..end], &z_m[begin..end]);
        for point in 0..end - begin {
            let above_m = a * x[point] + b * y[point] + c * z[point] + height_m;
            squared[point] = least(above_m * above_m, most);
        }
        squared[end - begin..].fill(0.0);
        for column in squared.as_chunks::<MAX_LAYERS>().0 {
            for lane in 0..MAX_LAYERS {
                sums[lane] += column[lane];
            }
        }
        begin = end;
    }
    sums.iter().sum()
}

/// Positions whose distances are noted before they are summed.
const BLOCK: usize = 512;

/// A column that holds the last few points.
#[inline(always)]
fn padded(last: &[f32]) -> [f32; MAX_LAYERS] {
    let mut column = [0.0; MAX_LAYERS];
    column[..last.len()].copy_from_slice(last);
    column
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use nalgebra::Vector3;

    /// Coordinates around a plane, in front and behind, and some that are none.
    fn points(count: usize) -> [Vec<f32>; 3] {
        let mut random = Random::new(3);
        let mut metres = |most: f64| (most * (2.0 * random.uniform() - 1.0)) as f32;
        let mut points = [vec![], vec![], vec![]];
        for number in 0..count {
            let (x, y, off) = (metres(20.0), metres(20.0), metres(0.5));
            let point = match number % 7 {
                0 => [0.0; 3],
                _ => [x, y, off - 1.8 + 0.05 * x],
            };
            for (metres, coordinate) in points.iter_mut().zip(point) {
                metres.push(coordinate);
            }
        }
        points
    }

    fn near(points: &[Vec<f32>; 3], plane: &Plane) -> Vec<Vector3<f64>> {
        let [x, y, z] = points;
        let all = (0..x.len()).map(|n| Vector3::new(x[n], y[n], z[n]).map(f64::from));
        all.filter(|point| {
            let squared = point.x * point.x + point.y * point.y;
            plane.above_m(point).abs() <= 0.15 && squared <= 225.0 && squared > 0.0
        })
        .collect()
    }

    #[test]
    fn the_plane_is_that_of_the_points_that_are_near() {
        for count in [3 * MAX_LAYERS, 1000, 1007] {
            let points = points(count);
            let plane = Plane::level(1.8);
            let [x_m, y_m, z_m] = [0, 1, 2].map(|axis| points[axis].as_slice());
            let moments = moments_near(Positions { x_m, y_m, z_m }, 1, &plane, 0.15, 225.0);
            let near = near(&points, &plane);
            assert_eq!(moments.count, near.len() as f64);
            let (found, expected) = (
                moments.plane().unwrap(),
                Plane::fit(near.iter().copied()).unwrap(),
            );
            assert!((found.height_m() - expected.height_m()).abs() < 1e-5);
            assert!(found.angle_to_rad(&expected) < 1e-5);
        }
    }

    #[test]
    fn squared_distances_are_cut_at_the_most() {
        let points = points(700);
        let [x_m, y_m, z_m] = [0, 1, 2].map(|axis| points[axis].as_slice());
        let plane = Plane::level(1.8);
        let sum: f64 = (0..700)
            .map(|n| plane.above_m(&Vector3::new(x_m[n], y_m[n], z_m[n]).map(f64::from)))
            .map(|above_m| (above_m * above_m).min(0.0225))
            .sum();
        let found = squared_distances(Positions { x_m, y_m, z_m }, &plane, 0.0225);
        assert!((f64::from(found) - sum).abs() < 1e-3 * sum, "{found} {sum}");
    }
}
