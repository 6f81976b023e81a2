//! Points on a raster of centimetres, of which sixteen are compared at once.

use std::ops::Range;

use multiversion::multiversion;

use super::ClusterParameters;
use crate::float::{greatest, least, rounded, rounded_signed};

/// Some points in a row, rounded to whole centimetres: enough to say of most pairs that they are
/// neighbours, but not that they are none. Its buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct Raster<const POINTS: usize> {
    x_cm: Box<[i16; POINTS]>,
    y_cm: Box<[i16; POINTS]>,
    z_cm: Box<[i16; POINTS]>,
    /// Others whose square of the distance is below this are neighbours for sure.
    limit: Box<[u16; POINTS]>,
}

/// Points that are taken over: where they are, their ranges, and which of them count.
#[derive(Clone, Copy)]
pub(super) struct Given<'a> {
    pub(super) at_m: [&'a [f32]; 3],
    pub(super) range_m: &'a [f32],
    pub(super) is_taken: &'a [bool],
}

const CM_PER_M: f32 = 100.0;
/// Two roundings in three directions make a distance wrong by the root of 3 at most, and single
/// precision by a little more.
const DOUBT_CM: f32 = 1.75;
/// The greatest difference of which 16 bits hold the square.
const MOST_CM: u16 = 255;
/// What is farther than 16 bits of centimetres reach is in doubt.
const FARTHEST_M: f32 = 320.0;

impl<const POINTS: usize> Raster<POINTS> {
    pub(super) fn new() -> Self {
        Self {
            x_cm: Box::new([0; POINTS]),
            y_cm: Box::new([0; POINTS]),
            z_cm: Box::new([0; POINTS]),
            limit: Box::new([0; POINTS]),
        }
    }

    /// Puts points in some places.
    pub(super) fn put(
        &mut self,
        places: Range<usize>,
        given: Given<'_>,
        parameters: &ClusterParameters,
    ) {
        let at_cm = [&mut self.x_cm, &mut self.y_cm, &mut self.z_cm];
        for (at_cm, at_m) in at_cm.into_iter().zip(given.at_m) {
            round(at_m, &mut at_cm[places.clone()]);
        }
        find_limits(given, parameters, &mut self.limit[places]);
    }

    /// Forgets the first half of the points, and puts the second one in its place.
    pub(super) fn advance(&mut self) {
        for at_cm in [&mut self.x_cm, &mut self.y_cm, &mut self.z_cm] {
            at_cm.copy_within(POINTS / 2.., 0);
        }
        self.limit.copy_within(POINTS / 2.., 0);
    }

    /// Finds which of the first points are for sure neighbours of those so far behind: 1 for each
    /// that is, else 0.
    pub(super) fn compare(&self, apart: usize, near: &mut [u16]) {
        let at_cm = [&self.x_cm[..], &self.y_cm[..], &self.z_cm[..]];
        compare(at_cm, &self.limit[..], apart, near);
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn round(at_m: &[f32], at_cm: &mut [i16]) {
    let at_cm = &mut at_cm[..at_m.len()];
    for point in 0..at_m.len() {
        at_cm[point] = rounded_signed(at_m[point] * CM_PER_M);
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn find_limits(given: Given<'_>, parameters: &ClusterParameters, limit: &mut [u16]) {
    let count = limit.len();
    let (range_m, is_taken) = (&given.range_m[..count], &given.is_taken[..count]);
    for point in 0..count {
        let eps_cm = CM_PER_M * parameters.eps_m(range_m[point]);
        let sure_cm = greatest(least(eps_cm - DOUBT_CM, f32::from(MOST_CM)), 0.0);
        let counts = is_taken[point] & (range_m[point] < FARTHEST_M);
        limit[point] = if counts {
            rounded(sure_cm * sure_cm)
        } else {
            0
        };
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn compare([x, y, z]: [&[i16]; 3], limit: &[u16], apart: usize, near: &mut [u16]) {
    let count = near.len();
    let (x, x2) = (&x[..count], &x[apart..][..count]);
    let (y, y2) = (&y[..count], &y[apart..][..count]);
    let (z, z2) = (&z[..count], &z[apart..][..count]);
    let (limit, limit2) = (&limit[..count], &limit[apart..][..count]);
    for pair in 0..count {
        let dx = least(x2[pair].wrapping_sub(x[pair]).unsigned_abs(), MOST_CM);
        let dy = least(y2[pair].wrapping_sub(y[pair]).unsigned_abs(), MOST_CM);
        let dz = least(z2[pair].wrapping_sub(z[pair]).unsigned_abs(), MOST_CM);
        let squared = (dx * dx).saturating_add(dy * dy).saturating_add(dz * dz);
        near[pair] = u16::from(squared < least(limit[pair], limit2[pair]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::Profile;
    use crate::random::Random;

    const POINTS: usize = 200;
    const APART: usize = 3;

    /// Which points are for sure neighbours of those three places behind, around a place so far
    /// away, how far they are from each other, and the distance of neighbours.
    fn compared(range_m: f32, scatter_m: f64) -> Vec<(bool, f32, f32)> {
        let parameters = ClusterParameters::profile(Profile::Default);
        let mut random = Random::new(7);
        let mut metres = |middle_m: f32| -> Vec<f32> {
            let mut scattered = || middle_m + (scatter_m * (random.uniform() - 0.5)) as f32;
            (0..POINTS).map(|_| scattered()).collect()
        };
        let [x_m, y_m, z_m] = [-0.6, 0.8, 0.0].map(|share| metres(share * range_m));
        let mut raster = Raster::<POINTS>::new();
        let given = Given {
            at_m: [&x_m, &y_m, &z_m],
            range_m: &[range_m; POINTS],
            is_taken: &[true; POINTS],
        };
        raster.put(0..POINTS, given, &parameters);
        let mut near = [0; POINTS - APART];
        raster.compare(APART, &mut near);
        let pairs = near.into_iter().enumerate().map(|(a, near)| {
            let apart_m = [&x_m, &y_m, &z_m].map(|metres| metres[a + APART] - metres[a]);
            let squared: f32 = apart_m.iter().map(|apart_m| apart_m * apart_m).sum();
            (near == 1, squared.sqrt(), parameters.eps_m(range_m))
        });
        pairs.collect()
    }

    #[test]
    fn what_is_near_for_sure_is_near_and_little_is_in_doubt() {
        for range_m in [1.0, 30.0, 80.0] {
            for (near, apart_m, eps_m) in compared(range_m, 3.0) {
                assert!(!near || apart_m <= eps_m, "{apart_m} {eps_m}");
                assert!(near || apart_m > eps_m - 0.04, "{apart_m} {eps_m}");
            }
        }
    }

    #[test]
    fn beyond_what_sixteen_bits_hold_everything_is_in_doubt() {
        // Distances of neighbours longer than 2.55 m, and places farther than 320 m.
        for (near, apart_m, _) in compared(200.0, 8.0) {
            assert!(!near || apart_m < 2.55, "{apart_m}");
            assert!(near || apart_m > 2.51, "{apart_m}");
        }
        assert!(compared(330.0, 8.0).iter().all(|(near, ..)| !near));
    }

    #[test]
    fn points_that_do_not_count_are_near_none_and_the_second_half_comes_first() {
        let mut is_taken = [true; POINTS];
        is_taken[POINTS / 2 + 1] = false;
        let given = Given {
            at_m: [&[5.0; POINTS]; 3],
            range_m: &[8.0; POINTS],
            is_taken: &is_taken,
        };
        let mut raster = Raster::<POINTS>::new();
        raster.put(
            0..POINTS,
            given,
            &ClusterParameters::profile(Profile::Default),
        );
        raster.advance();
        let mut near = [0; 4];
        raster.compare(1, &mut near);
        assert_eq!(near, [0, 0, 1, 1]);
    }
}
