//! Boxes around what a sensor sees of an object: one or two of its sides.

use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::{Add, Mul, Sub};
use std::sync::LazyLock;

use multiversion::multiversion;

use crate::float::{greatest, least};

/// A rectangle in the plane, seen from a sensor at the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// Its middle.
    pub centre_m: [f64; 2],
    /// Direction of its length, in (-pi, pi].
    pub yaw_rad: f64,
    /// Along the yaw.
    pub length_m: f64,
    /// Across the yaw.
    pub width_m: f64,
}

/// Directions that are tried within a quarter turn.
pub(crate) const DIRECTIONS: usize = 2 * TOGETHER;
/// Those that are tried together.
const TOGETHER: usize = 16;
/// Points that are looked at for the direction: more do not change it.
const MOST_POINTS: usize = 64;
/// Distance to an edge below which a point counts as on it.
const NEAREST_M: f32 = 0.05;

impl Rectangle {
    /// The rectangle around points with its length along `heading_rad`, or, without one, in
    /// the direction in which the points lie closest to its edges (L-shape fit by closeness;
    /// Zhang, Xu, Dong, Dolan 2017, algorithm 4), its length being the longer side.
    pub fn fit(points_m: &[[f64; 2]], heading_rad: Option<f64>) -> Self {
        if let Some(heading_rad) = heading_rad {
            return Self::along(points_m, heading_rad);
        }
        let rectangle = Self::along(points_m, Sample::of(points_m).closest_rad());
        if rectangle.length_m >= rectangle.width_m {
            rectangle
        } else {
            rectangle.quarter_turned()
        }
    }

    fn along(points_m: &[[f64; 2]], yaw_rad: f64) -> Self {
        let (sine, cosine) = libm::sincos(yaw_rad);
        let extent = Extent::of(points_m.iter().copied(), sine, cosine);
        let [u, v] = extent.middle();
        Self {
            centre_m: [u * cosine - v * sine, u * sine + v * cosine],
            yaw_rad,
            length_m: extent.high[0] - extent.low[0],
            width_m: extent.high[1] - extent.low[1],
        }
    }

    /// The same rectangle with length and width exchanged.
    pub fn quarter_turned(self) -> Self {
        let yaw_rad = self.yaw_rad + FRAC_PI_2;
        Self {
            yaw_rad: if yaw_rad > PI {
                yaw_rad - 2.0 * PI
            } else {
                yaw_rad
            },
            length_m: self.width_m,
            width_m: self.length_m,
            ..self
        }
    }

    /// From its middle to its corners.
    pub fn radius_m(&self) -> f64 {
        0.5 * libm::hypot(self.length_m, self.width_m)
    }

    /// Its corners, one after the other.
    pub fn corners(&self) -> [[f64; 2]; 4] {
        let (sine, cosine) = libm::sincos(self.yaw_rad);
        let [x, y] = self.centre_m;
        let (u, v) = (0.5 * self.length_m, 0.5 * self.width_m);
        [(u, v), (-u, v), (-u, -v), (u, -v)]
            .map(|(u, v)| [x + u * cosine - v * sine, y + u * sine + v * cosine])
    }

    /// The same, ready to measure many distances.
    pub fn outline(&self) -> Outline {
        let (sine, cosine) = libm::sincos(self.yaw_rad);
        let half_m = [self.length_m, self.width_m].map(|side_m| 0.5 * side_m as f32);
        Outline {
            centre_m: self.centre_m,
            half_m,
            radius_m: half_m[0].abs() + half_m[1].abs(),
            sine: sine as f32,
            cosine: cosine as f32,
        }
    }
}

/// A rectangle from which distances are measured.
#[derive(Debug, Clone, Copy)]
pub struct Outline {
    centre_m: [f64; 2],
    half_m: [f32; 2],
    /// No corner is farther from the middle.
    radius_m: f32,
    sine: f32,
    cosine: f32,
}

impl Outline {
    /// Whether a place is within, not on the edge.
    pub fn contains(&self, at_m: [f64; 2]) -> bool {
        let distance_m = self.distance_within_m(at_m, 0.0);
        distance_m.is_some_and(|distance_m| distance_m < 0.0)
    }

    /// [`Outline::distance_m`] of a place that is nearer than this; most are far away, and only
    /// looked at roughly.
    #[inline]
    pub fn distance_within_m(&self, at_m: [f64; 2], most_m: f64) -> Option<f64> {
        let reach_m = f64::from(self.radius_m) + most_m;
        let is_far = |axis: usize| (at_m[axis] - self.centre_m[axis]).abs() > reach_m;
        if is_far(0) || is_far(1) {
            return None;
        }
        let distance_m = self.distance_m(at_m);
        (distance_m <= most_m).then_some(distance_m)
    }

    /// Distance of a place from the edge, negative within.
    #[inline]
    pub fn distance_m(&self, at_m: [f64; 2]) -> f64 {
        f64::from(self.off_edge_m([0, 1].map(|axis| (at_m[axis] - self.centre_m[axis]) as f32)))
    }

    /// The same, by where the place is relative to the middle.
    #[inline(always)]
    pub(crate) fn off_edge_m(&self, offset_m: [f32; 2]) -> f32 {
        let [along_m, across_m] = turned(&offset_m, self.sine, self.cosine);
        let (along_m, across_m) = (
            along_m.abs() - self.half_m[0],
            across_m.abs() - self.half_m[1],
        );
        let (beyond_m, beside_m) = (greatest(along_m, 0.0), greatest(across_m, 0.0));
        let outside_m = (beyond_m * beyond_m + beside_m * beside_m).sqrt();
        outside_m + least(greatest(along_m, across_m), 0.0)
    }
}

/// Some of many points, relative to the first one.
struct Sample {
    count: usize,
    points_m: [[f32; 2]; MOST_POINTS],
}

impl Sample {
    fn of(points_m: &[[f64; 2]]) -> Self {
        let stride = points_m.len().div_ceil(MOST_POINTS).max(1);
        let mut sample = Self {
            count: points_m.len().div_ceil(stride),
            points_m: [[0.0; 2]; MOST_POINTS],
        };
        let some = points_m.iter().step_by(stride);
        for (place, point_m) in sample.points_m.iter_mut().zip(some) {
            *place = [0, 1].map(|axis| (point_m[axis] - points_m[0][axis]) as f32);
        }
        sample
    }

    /// The direction in which the points lie closest to the edges of their rectangle.
    fn closest_rad(&self) -> f64 {
        closest_rad(self.closeness().as_flattened())
    }

    fn closeness(&self) -> [[f32; TOGETHER]; DIRECTIONS / TOGETHER] {
        let points_m = &self.points_m[..self.count];
        TRIED.each_ref().map(|tried| closeness(points_m, tried))
    }
}

/// How close points lie on average to the edges of the rectangle around them, in each direction that
/// is tried: the mean of 1/distance.
pub(crate) fn mean_closeness(points_m: &[[f64; 2]]) -> [f32; DIRECTIONS] {
    let sample = Sample::of(points_m);
    let sums = sample.closeness();
    std::array::from_fn(|number| sums.as_flattened()[number] / sample.count as f32)
}

/// The direction of the greatest closeness of all that are tried, the first of equal ones.
pub(crate) fn closest_rad(closeness: &[f32]) -> f64 {
    let mut best = (f32::MIN, 0);
    for (number, closeness) in closeness.iter().enumerate() {
        if *closeness > best.0 {
            best = (*closeness, number);
        }
    }
    tried_rad(best.1)
}

/// Sines and cosines of some directions.
type Directions = [[f32; TOGETHER]; 2];

/// Those of all that are tried.
static TRIED: LazyLock<[Directions; DIRECTIONS / TOGETHER]> = LazyLock::new(|| {
    std::array::from_fn(|number| {
        let turns: [_; TOGETHER] =
            std::array::from_fn(|lane| libm::sincos(tried_rad(number * TOGETHER + lane)));
        [
            turns.map(|turn| turn.0 as f32),
            turns.map(|turn| turn.1 as f32),
        ]
    })
});

fn tried_rad(number: usize) -> f64 {
    FRAC_PI_2 * number as f64 / DIRECTIONS as f64
}

/// How close points lie to the edges of their rectangle, for each of some directions: the sum of
/// 1/distance.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn closeness(points_m: &[[f32; 2]], [sine, cosine]: &Directions) -> [f32; TOGETHER] {
    let (mut low_u, mut low_v) = ([f32::MAX; TOGETHER], [f32::MAX; TOGETHER]);
    let (mut high_u, mut high_v) = ([f32::MIN; TOGETHER], [f32::MIN; TOGETHER]);
    for point_m in points_m {
        for lane in 0..TOGETHER {
            let [u, v] = turned(point_m, sine[lane], cosine[lane]);
            (low_u[lane], high_u[lane]) = (least(low_u[lane], u), greatest(high_u[lane], u));
            (low_v[lane], high_v[lane]) = (least(low_v[lane], v), greatest(high_v[lane], v));
        }
    }
    let mut sums = [0.0; TOGETHER];
    for point_m in points_m {
        for lane in 0..TOGETHER {
            let [u, v] = turned(point_m, sine[lane], cosine[lane]);
            let along_m = least(u - low_u[lane], high_u[lane] - u);
            let across_m = least(v - low_v[lane], high_v[lane] - v);
            sums[lane] += 1.0 / greatest(least(along_m, across_m), NEAREST_M);
        }
    }
    sums
}

/// Least and greatest coordinates along and across a direction.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Extent {
    pub(crate) low: [f64; 2],
    pub(crate) high: [f64; 2],
}

impl Extent {
    #[inline]
    pub(crate) fn of(points_m: impl Iterator<Item = [f64; 2]>, sine: f64, cosine: f64) -> Self {
        let nothing = Self {
            low: [f64::MAX; 2],
            high: [f64::MIN; 2],
        };
        points_m.fold(nothing, |extent, point| {
            let [u, v] = turned(&point, sine, cosine);
            Self {
                low: [least(extent.low[0], u), least(extent.low[1], v)],
                high: [greatest(extent.high[0], u), greatest(extent.high[1], v)],
            }
        })
    }

    fn middle(&self) -> [f64; 2] {
        [0, 1].map(|axis| 0.5 * (self.low[axis] + self.high[axis]))
    }
}

/// A point's coordinates along and across a direction.
#[inline(always)]
pub(crate) fn turned<T>([x, y]: &[T; 2], sine: T, cosine: T) -> [T; 2]
where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T>,
{
    [*x * cosine + *y * sine, *y * cosine - *x * sine]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The two sides of a car that a sensor at the origin sees.
    fn corner(yaw_rad: f64) -> Vec<[f64; 2]> {
        let (sine, cosine) = yaw_rad.sin_cos();
        let side = (0..40).map(|n| [f64::from(n) * 0.1, 0.0]);
        let rear = (0..17).map(|n| [0.0, f64::from(n) * 0.1]);
        side.chain(rear)
            .map(|[u, v]| [8.0 + u * cosine - v * sine, 3.0 + u * sine + v * cosine])
            .collect()
    }

    #[test]
    fn the_direction_of_an_l_shape_is_found() {
        for degrees in [0.0f64, 15.0, 40.0, 75.0] {
            let rectangle = Rectangle::fit(&corner(degrees.to_radians()), None);
            let error = rectangle.yaw_rad.to_degrees() - degrees;
            assert!(error.abs() < 2.0, "{degrees} {rectangle:?}");
            assert!((rectangle.length_m - 3.9).abs() < 0.2);
            assert!((rectangle.width_m - 1.6).abs() < 0.2);
        }
    }

    #[test]
    fn distances_are_counted_from_the_edge() {
        let rectangle = Rectangle {
            centre_m: [10.0, 0.0],
            yaw_rad: std::f64::consts::FRAC_PI_2,
            length_m: 4.0,
            width_m: 2.0,
        };
        assert!((rectangle.outline().distance_m([10.0, 0.0]) + 1.0).abs() < 1e-9);
        assert!((rectangle.outline().distance_m([10.0, 3.0]) - 1.0).abs() < 1e-9);
        assert!((rectangle.outline().distance_m([14.0, 6.0]) - 5.0).abs() < 1e-9);
        let [x, y] = rectangle.corners()[0];
        assert!((x - 9.0).abs() < 1e-9 && (y - 2.0).abs() < 1e-9);
    }

    #[test]
    fn a_quarter_turn_exchanges_the_sides() {
        let rectangle = Rectangle::fit(&corner(0.0), None);
        let turned = rectangle.quarter_turned();
        assert_eq!(turned.length_m, rectangle.width_m);
        assert!((turned.yaw_rad - FRAC_PI_2).abs() < 1e-9);
    }
}
