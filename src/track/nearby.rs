//! What is near a place, found quickly among many.

use multiversion::multiversion;
use nalgebra::Vector2;

use crate::geometry::{Outline, Rectangle};
use crate::marks::marked;

/// Discs in the plane, by their numbers. Most are far from any place that is asked for, and are
/// told apart from those that are not by a rough look at many at once.
#[derive(Debug, Clone, Default)]
pub(super) struct Discs {
    origin_m: Vector2<f64>,
    /// Their middles, relative to the origin, and their radii.
    x_m: Vec<f32>,
    y_m: Vec<f32>,
    radius_m: Vec<f32>,
    marks: Vec<bool>,
}

/// Boxes by their numbers, each found near as much around it as it was given.
#[derive(Debug, Clone, Default)]
pub(super) struct Places {
    boxes: Vec<(Rectangle, Outline)>,
    reaches: Discs,
}

/// What single precision may be off within the range of a sensor.
const ROUNDING_M: f64 = 0.001;

impl Discs {
    /// Forgets all discs. Places near `origin_m` are the most exact.
    pub(super) fn begin(&mut self, origin_m: Vector2<f64>) {
        self.origin_m = origin_m;
        for metres in [&mut self.x_m, &mut self.y_m, &mut self.radius_m] {
            metres.clear();
        }
        self.marks.clear();
    }

    /// Adds a disc.
    pub(super) fn push(&mut self, middle_m: Vector2<f64>, radius_m: f64) {
        let [x, y] = self.relative_m(middle_m);
        self.x_m.push(x);
        self.y_m.push(y);
        self.radius_m.push((radius_m + ROUNDING_M) as f32);
        self.marks.push(false);
    }

    /// A place in the frame in which boxes are given.
    pub(super) fn relative_m(&self, at_m: Vector2<f64>) -> [f32; 2] {
        (at_m - self.origin_m).map(|metres| metres as f32).into()
    }

    /// The numbers of all discs that reach into a box, and perhaps of some that end close to its
    /// corners. The corners are relative to the origin.
    pub(super) fn near_box(
        &mut self,
        low_m: [f32; 2],
        high_m: [f32; 2],
    ) -> impl Iterator<Item = usize> + use<'_> {
        let middles_m = [&self.x_m[..], &self.y_m[..]];
        mark_near([low_m, high_m], middles_m, &self.radius_m, &mut self.marks);
        marked(&self.marks)
    }

    /// The numbers of all discs that hold a place, and perhaps of some that end close to it.
    pub(super) fn near(&mut self, at_m: Vector2<f64>) -> impl Iterator<Item = usize> + use<'_> {
        let at_m = self.relative_m(at_m);
        self.near_box(at_m, at_m)
    }
}

impl Places {
    /// Forgets all of them; as [`Discs::begin`].
    pub(super) fn begin(&mut self, origin_m: Vector2<f64>) {
        self.boxes.clear();
        self.reaches.begin(origin_m);
    }

    /// Adds a box that is found from `more_m` beyond its corners.
    pub(super) fn push(&mut self, place: Rectangle, more_m: f64) {
        let reach_m = place.radius_m() + more_m;
        self.reaches.push(place.centre_m.into(), reach_m);
        self.boxes.push((place, place.outline()));
    }

    pub(super) fn len(&self) -> usize {
        self.boxes.len()
    }

    pub(super) fn rectangle(&self, number: usize) -> &Rectangle {
        &self.boxes[number].0
    }

    /// All that may reach a place, by their numbers; as [`Discs::near`].
    pub(super) fn near(
        &mut self,
        at_m: Vector2<f64>,
    ) -> impl Iterator<Item = (usize, &(Rectangle, Outline))> {
        let boxes = &self.boxes;
        let near = self.reaches.near(at_m);
        near.map(move |number| (number, &boxes[number]))
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn mark_near(
    [low_m, high_m]: [[f32; 2]; 2],
    [x_m, y_m]: [&[f32]; 2],
    radius_m: &[f32],
    marks: &mut [bool],
) {
    let count = marks.len();
    let (x_m, y_m, radius_m) = (&x_m[..count], &y_m[..count], &radius_m[..count]);
    for disc in 0..count {
        let (x, y, radius_m) = (x_m[disc], y_m[disc], radius_m[disc]);
        marks[disc] = (low_m[0] - radius_m <= x)
            & (x <= high_m[0] + radius_m)
            & (low_m[1] - radius_m <= y)
            & (y <= high_m[1] + radius_m);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_reaches_a_place_is_near_it() {
        let mut discs = Discs::default();
        let origin_m = Vector2::new(5000.0, -3000.0);
        for radius_m in [1.0, 2.0] {
            discs.begin(origin_m);
            for x in 0..20 {
                discs.push(origin_m + Vector2::new(10.0 * f64::from(x), 3.0), radius_m);
            }
            let near: Vec<_> = discs.near(origin_m + Vector2::new(70.0, 4.5)).collect();
            assert_eq!(near, if radius_m < 1.5 { vec![] } else { vec![7] });
            let near: Vec<_> = discs.near_box([21.5, 0.0], [48.5, 9.0]).collect();
            assert_eq!(
                near,
                if radius_m < 1.5 {
                    vec![3, 4]
                } else {
                    vec![2, 3, 4, 5]
                }
            );
        }
    }
}
