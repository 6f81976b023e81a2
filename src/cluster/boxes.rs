//! Boxes around core points, and which of many are near another one.

use std::ops::Range;

use multiversion::multiversion;

use super::ClusterParameters;
use crate::float::{greatest, least};
use crate::marks::marked;

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

/// Many boxes, by their numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct Boxes {
    low_m: [Vec<f32>; SPACE],
    high_m: [Vec<f32>; SPACE],
    eps_squared: Vec<f32>,
    marks: Vec<bool>,
}

impl Boxes {
    /// Takes boxes over in the place of those it had.
    pub(super) fn set<'a>(
        &mut self,
        boxes: impl Iterator<Item = &'a Bounds> + Clone,
        parameters: &ClusterParameters,
    ) {
        for axis in 0..SPACE {
            self.low_m[axis].clear();
            self.low_m[axis].extend(boxes.clone().map(|bounds| bounds.low_m[axis]));
            self.high_m[axis].clear();
            self.high_m[axis].extend(boxes.clone().map(|bounds| bounds.high_m[axis]));
        }
        let eps_m = boxes.map(|bounds| bounds.eps_m(parameters));
        self.eps_squared.clear();
        self.eps_squared.extend(eps_m.map(|eps_m| eps_m * eps_m));
        self.marks.resize(self.eps_squared.len(), false);
    }

    /// The number behind the last box that begins so early along x that it can be near another
    /// one. All begin in order.
    pub(super) fn end_of_near(&self, bounds: &Bounds, parameters: &ClusterParameters) -> usize {
        let last_m = bounds.high_m[0] + bounds.eps_m(parameters);
        self.low_m[0].partition_point(|x| *x <= last_m)
    }

    /// Which of some boxes are so near to another one that points of both may be neighbours.
    pub(super) fn near(
        &mut self,
        which: Range<usize>,
        bounds: &Bounds,
        parameters: &ClusterParameters,
    ) -> impl Iterator<Item = usize> + use<'_> {
        let first = which.start;
        let marks = &mut self.marks[which.clone()];
        mark_near(
            (bounds, bounds.eps_m(parameters)),
            self.low_m.each_ref().map(|low_m| &low_m[which.clone()]),
            self.high_m.each_ref().map(|high_m| &high_m[which.clone()]),
            &self.eps_squared[which.clone()],
            marks,
        );
        marked(marks).map(move |place| first + place)
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn mark_near(
    (bounds, eps_m): (&Bounds, f32),
    low_m: [&[f32]; SPACE],
    high_m: [&[f32]; SPACE],
    eps_squared: &[f32],
    marks: &mut [bool],
) {
    let count = marks.len();
    let (low_m, high_m) = (low_m.map(|m| &m[..count]), high_m.map(|m| &m[..count]));
    let eps_squared = &eps_squared[..count];
    for place in 0..count {
        let mut squared = 0.0;
        for axis in 0..SPACE {
            let below = bounds.low_m[axis] - high_m[axis][place];
            let above = low_m[axis][place] - bounds.high_m[axis];
            let apart = greatest(greatest(below, above), 0.0);
            squared += apart * apart;
        }
        marks[place] = squared <= least(eps_m * eps_m, eps_squared[place]);
    }
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
        let end = boxes.end_of_near(&own, &parameters);
        assert!(end < 300 && expected.iter().all(|place| *place < end));
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
