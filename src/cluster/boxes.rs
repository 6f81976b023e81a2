//! Boxes around core points, and which of many are near another one.

use std::ops::Range;

use multiversion::multiversion;

use super::ClusterParameters;
use crate::float::{LANES, greatest, least};

/// A box around points, in space and in range.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// Least x, y, z and range of the points.
    pub(super) low_m: Corner,
    /// The greatest ones.
    pub(super) high_m: Corner,
}

/// A corner of a box: x, y, z, and range.
type Corner = [f32; AXES];

const AXES: usize = 4;
/// Of which so many are in space.
const SPACE: usize = 3;
/// The place of the range in a corner.
const RANGE: usize = 3;

impl Bounds {
    /// Around no points.
    pub(super) const NONE: Self = Self {
        low_m: [f32::INFINITY; AXES],
        high_m: [f32::NEG_INFINITY; AXES],
    };

    /// Grows around a point: x, y, z, and range.
    #[inline(always)]
    pub(super) fn hold(&mut self, point_m: Corner) {
        self.hold_all(&Self {
            low_m: point_m,
            high_m: point_m,
        });
    }

    /// Grows around another box.
    #[inline(always)]
    pub(super) fn hold_all(&mut self, other: &Self) {
        for axis in 0..AXES {
            self.low_m[axis] = least(self.low_m[axis], other.low_m[axis]);
            self.high_m[axis] = greatest(self.high_m[axis], other.high_m[axis]);
        }
    }

    /// Range of the nearest point.
    pub(super) fn nearest_m(&self) -> f32 {
        self.low_m[RANGE]
    }

    /// Distance within which any of the points may have a neighbour: that of the farthest one.
    fn eps_m(&self, parameters: &ClusterParameters) -> f32 {
        parameters.eps_m(self.high_m[RANGE])
    }

    /// Square of the distance to a point.
    #[inline(always)]
    pub(super) fn squared_distance_to(&self, position_m: [f32; SPACE]) -> f32 {
        let mut squared = 0.0;
        for (axis, metres) in position_m.into_iter().enumerate() {
            let outside = greatest(self.low_m[axis] - metres, metres - self.high_m[axis]);
            let apart = greatest(outside, 0.0);
            squared += apart * apart;
        }
        squared
    }
}

/// Many boxes, by their numbers, and behind them as many as one register holds that mean nothing.
#[derive(Debug, Clone, Default)]
pub(super) struct Boxes {
    low_m: [Vec<f32>; SPACE],
    high_m: [Vec<f32>; SPACE],
    eps_squared: Vec<f32>,
}

impl Boxes {
    /// Takes boxes over in the place of those it had.
    pub(super) fn set<'a>(
        &mut self,
        boxes: impl ExactSizeIterator<Item = &'a Bounds>,
        parameters: &ClusterParameters,
    ) {
        let count = boxes.len();
        for metres in self.low_m.iter_mut().chain(&mut self.high_m) {
            metres.resize(count + LANES, 0.0);
        }
        self.eps_squared.resize(count + LANES, 0.0);
        for (number, bounds) in boxes.enumerate() {
            for axis in 0..SPACE {
                self.low_m[axis][number] = bounds.low_m[axis];
                self.high_m[axis][number] = bounds.high_m[axis];
            }
            let eps_m = bounds.eps_m(parameters);
            self.eps_squared[number] = eps_m * eps_m;
        }
    }

    /// Which of some boxes are so near to another one that points of both may be neighbours.
    pub(super) fn near<'a>(
        &'a self,
        which: Range<usize>,
        bounds: &'a Bounds,
        parameters: &ClusterParameters,
    ) -> impl Iterator<Item = usize> + use<'a> {
        self.find_near(which, false, bounds, parameters)
    }

    /// The same of boxes that begin in order along x, from one on: the others are too far along it.
    pub(super) fn near_in_order<'a>(
        &'a self,
        first: usize,
        bounds: &'a Bounds,
        parameters: &ClusterParameters,
    ) -> impl Iterator<Item = usize> + use<'a> {
        let count = self.eps_squared.len().saturating_sub(LANES);
        self.find_near(first..count, true, bounds, parameters)
    }

    fn find_near<'a>(
        &'a self,
        which: Range<usize>,
        are_in_order: bool,
        bounds: &'a Bounds,
        parameters: &ClusterParameters,
    ) -> impl Iterator<Item = usize> + use<'a> {
        let (mut begin, eps_m) = (which.start, bounds.eps_m(parameters));
        std::iter::from_fn(move || {
            let found = next_near(self, begin..which.end, are_in_order, bounds, eps_m)?;
            begin = found + 1;
            Some(found)
        })
    }
}

/// The first of some boxes that is near another one.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn next_near(
    boxes: &Boxes,
    which: Range<usize>,
    are_in_order: bool,
    bounds: &Bounds,
    eps_m: f32,
) -> Option<usize> {
    let most = eps_m * eps_m;
    for begin in which.clone().step_by(LANES) {
        let lanes = begin..begin + LANES;
        let (west_m, east_m) = (
            &boxes.low_m[0][lanes.clone()],
            &boxes.high_m[0][lanes.clone()],
        );
        let (south_m, north_m) = (
            &boxes.low_m[1][lanes.clone()],
            &boxes.high_m[1][lanes.clone()],
        );
        let (bottom_m, top_m) = (
            &boxes.low_m[2][lanes.clone()],
            &boxes.high_m[2][lanes.clone()],
        );
        let eps_squared = &boxes.eps_squared[lanes];
        // Compared as below: rounding must not part what is exactly as far as neighbours can be.
        let ahead_m = greatest(west_m[0] - bounds.high_m[0], 0.0);
        if are_in_order && ahead_m * ahead_m > most {
            return None;
        }
        let apart_m = |axis: usize, low_m: f32, high_m: f32| {
            let outside_m = greatest(bounds.low_m[axis] - high_m, low_m - bounds.high_m[axis]);
            greatest(outside_m, 0.0)
        };
        let mut excess = [0.0; LANES];
        for lane in 0..LANES {
            let dx = apart_m(0, west_m[lane], east_m[lane]);
            let dy = apart_m(1, south_m[lane], north_m[lane]);
            let dz = apart_m(2, bottom_m[lane], top_m[lane]);
            let squared = dx * dx + dy * dy + dz * dz;
            excess[lane] = squared - least(most, eps_squared[lane]);
        }
        let mut is_any = false;
        for lane_excess in excess {
            is_any |= lane_excess <= 0.0;
        }
        if is_any {
            let first = excess.iter().position(|excess| *excess <= 0.0);
            return first
                .map(|lane| begin + lane)
                .filter(|found| *found < which.end);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::Profile;
    use crate::random::Random;

    #[test]
    fn boxes_are_near_if_points_of_both_can_be_neighbours() {
        let parameters = ClusterParameters::profile(Profile::Default);
        let mut random = Random::new(5);
        let mut any_box = || {
            let low_m = [0; AXES].map(|_| 12.0 * random.uniform() as f32);
            let high_m = low_m.map(|metres| metres + 2.0 * random.uniform() as f32);
            Bounds { low_m, high_m }
        };
        let mut all: Vec<Bounds> = (0..300).map(|_| any_box()).collect();
        all.sort_by(|a, b| a.low_m[0].total_cmp(&b.low_m[0]));
        let mut boxes = Boxes::default();
        boxes.set(all.iter(), &parameters);
        let own = Bounds {
            low_m: [5.0; AXES],
            high_m: [6.0; AXES],
        };
        let are_near = |other: &Bounds| {
            let squared: f32 = (0..3)
                .map(|axis| {
                    let between_m = own.low_m[axis] - other.high_m[axis];
                    between_m.max(other.low_m[axis] - own.high_m[axis]).max(0.0)
                })
                .map(|apart_m| apart_m * apart_m)
                .sum();
            let eps_m = 0.5 + 0.022 * own.high_m[3].min(other.high_m[3]);
            squared.sqrt() <= eps_m
        };
        let expected: Vec<usize> = (100..300).filter(|place| are_near(&all[*place])).collect();
        assert!(expected.len() >= 3, "{expected:?}");
        let found: Vec<usize> = boxes.near(100..300, &own, &parameters).collect();
        assert_eq!(found, expected);
        let found: Vec<usize> = boxes.near_in_order(100, &own, &parameters).collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn a_box_holds_what_it_grew_around() {
        let parameters = ClusterParameters::profile(Profile::Default);
        let mut bounds = Bounds::NONE;
        assert_eq!(bounds.squared_distance_to([0.0; 3]), f32::INFINITY);
        let around = |metres| Bounds {
            low_m: [metres; AXES],
            high_m: [metres + 1.0; AXES],
        };
        bounds.hold_all(&around(3.0));
        bounds.hold_all(&around(7.0));
        assert_eq!((bounds.low_m, bounds.high_m), ([3.0; AXES], [8.0; AXES]));
        assert_eq!(bounds.squared_distance_to([5.0, 9.0, 1.0]), 1.0 + 4.0);
        assert_eq!(bounds.nearest_m(), 3.0);
        assert_eq!(bounds.eps_m(&parameters), 0.5 + 0.022 * 8.0);
        bounds.hold([2.0; AXES]);
        bounds.hold([9.0; AXES]);
        assert_eq!((bounds.low_m, bounds.high_m), ([2.0; AXES], [9.0; AXES]));
    }
}
