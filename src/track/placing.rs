//! The returns of one cluster, placed, coordinate by coordinate.

use std::ops::Range;

use super::{Scene, seam};
use crate::beams::Seen;
use crate::cloud::{MAX_LAYERS, Scan};
use crate::float::{bounds_of, greatest, least};

/// Returns of a cluster in the order of the scan, each with the sensor's pose at the time of its
/// column. Its buffers are made once.
#[derive(Debug, Clone, Default)]
pub(super) struct Placing {
    /// How many there are; the buffers hold as many as there ever were.
    count: usize,
    /// Along the axes of the local frame, and relative to where the sensor is at the end.
    x_m: Vec<f32>,
    y_m: Vec<f32>,
    above_m: Vec<f32>,
    range_m: Vec<f32>,
    point: Vec<u32>,
    /// So many of the first ones are placed as if they were seen at the end.
    brought: usize,
    /// Where each column looks.
    columns: Vec<Bearing>,
    /// Cosine of each layer's elevation.
    cosines: [f32; MAX_LAYERS],
}

/// Whence and whither a column looks, along the axes of the local frame.
#[derive(Debug, Clone, Copy)]
struct Bearing {
    /// Relative to where the sensor is at the end.
    origin_m: [f32; 2],
    direction: [f32; 2],
}

/// One return of a cluster.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Placed {
    /// Along the axes of the local frame, and relative to where the sensor is at the end.
    pub(super) at_m: [f32; 2],
    /// Above the ground.
    pub(super) above_m: f32,
    /// Its place in the scan.
    pub(super) point: u32,
    /// Whether it is placed where it would be seen at the end.
    pub(super) is_brought: bool,
    /// What was seen of its place before.
    pub(super) before: Seen,
}

/// How far apart two places are.
pub(super) fn distance_m(from_m: [f32; 2], to_m: [f32; 2]) -> f32 {
    let [x, y] = [0, 1].map(|axis| to_m[axis] - from_m[axis]);
    (x * x + y * y).sqrt()
}

/// The box that holds some returns.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// Its corners from above, in the frame of [`Placed::at_m`].
    pub(super) low_m: [f32; 2],
    pub(super) high_m: [f32; 2],
    /// Its bottom and its top above the ground.
    pub(super) floor_m: f32,
    pub(super) top_m: f32,
}

impl Bounds {
    /// That of no returns.
    pub(super) const NOTHING: Self = Self {
        low_m: [f32::INFINITY; 2],
        high_m: [f32::NEG_INFINITY; 2],
        floor_m: f32::INFINITY,
        top_m: f32::NEG_INFINITY,
    };

    /// Its middle from above.
    pub(super) fn middle_m(&self) -> [f32; 2] {
        [0, 1].map(|axis| 0.5 * (self.low_m[axis] + self.high_m[axis]))
    }

    /// From corner to corner from above.
    pub(super) fn diagonal_m(&self) -> f64 {
        let [x_m, y_m] = [0, 1].map(|axis| f64::from(self.high_m[axis] - self.low_m[axis]));
        (x_m * x_m + y_m * y_m).sqrt()
    }

    /// The box that holds some returns.
    pub(super) fn of(returns: &[Placed]) -> Self {
        let mut bounds = Self::NOTHING;
        for placed in returns {
            bounds.extend(placed);
        }
        bounds
    }

    /// Makes it hold a further return.
    #[inline(always)]
    pub(super) fn extend(&mut self, Placed { at_m, above_m, .. }: &Placed) {
        for (axis, metres) in at_m.iter().enumerate() {
            self.low_m[axis] = least(self.low_m[axis], *metres);
            self.high_m[axis] = greatest(self.high_m[axis], *metres);
        }
        self.floor_m = least(self.floor_m, *above_m);
        self.top_m = greatest(self.top_m, *above_m);
    }
}

impl Placing {
    /// Takes over where the sensor was at each column, relative to where it is at the end, and
    /// where it looked.
    pub(super) fn begin(&mut self, scene: &Scene<'_>, origin_m: [f64; 2]) {
        let scan = scene.scan;
        self.cosines = std::array::from_fn(|layer| scan.slope(layer).1 as f32);
        self.columns.clear();
        let placements = scene.placements.iter().enumerate();
        self.columns.extend(placements.map(|(column, placement)| {
            let own_m = placement.origin_m();
            let direction = placement.turned(scan.direction(column).map(f64::from));
            Bearing {
                origin_m: [0, 1].map(|axis| (own_m[axis] - origin_m[axis]) as f32),
                direction: direction.map(|share| share as f32),
            }
        }));
    }

    /// Places the returns of a cluster.
    pub(super) fn place(&mut self, points: &[u32], scene: &Scene<'_>) {
        self.make_room(points.len());
        self.point.clear();
        self.point.extend_from_slice(points);
        let scan = scene.scan;
        let (range_m, heights_m) = (scan.range_m(), &scene.heights_m[..scan.len()]);
        let places = self.x_m.iter_mut().zip(&mut self.y_m);
        let others = self.above_m.iter_mut().zip(&mut self.range_m);
        for ((point, place), other) in points.iter().zip(places).zip(others) {
            let number = *point as usize;
            let range_m = range_m[number];
            let distance_m = range_m * self.cosines[scan.layer(number)];
            let bearing = &self.columns[scan.column(number)];
            *place.0 = bearing.origin_m[0] + distance_m * bearing.direction[0];
            *place.1 = bearing.origin_m[1] + distance_m * bearing.direction[1];
            *other.0 = heights_m[number];
            *other.1 = range_m;
        }
        self.brought = 0;
        if let Some(step_m) = seam::step_m(points, scene) {
            self.bring_older(step_m, scene);
        }
    }

    /// Takes returns of a scan that were placed before, in their order.
    pub(super) fn take(&mut self, placed: &[Placed], scan: &Scan) {
        self.make_room(placed.len());
        self.point.clear();
        self.brought = 0;
        for (place, own) in placed.iter().enumerate() {
            [self.x_m[place], self.y_m[place]] = own.at_m;
            self.above_m[place] = own.above_m;
            self.range_m[place] = scan.range_m()[own.point as usize];
            self.point.push(own.point);
        }
    }

    /// Makes the buffers hold so many.
    fn make_room(&mut self, count: usize) {
        self.count = count;
        let most = count.max(self.x_m.len());
        for metres in [
            &mut self.x_m,
            &mut self.y_m,
            &mut self.above_m,
            &mut self.range_m,
        ] {
            metres.resize(most, 0.0);
        }
    }

    /// Places what is on the older side of the seam as if it was seen at the end, so much farther
    /// away.
    fn bring_older(&mut self, step_m: f32, scene: &Scene<'_>) {
        let (scan, Some(end)) = (scene.scan, scene.placements.last()) else {
            return;
        };
        let is_older = |point: &u32| scan.column(*point as usize) < scan.columns() / 2;
        self.brought = self.point.partition_point(is_older);
        let origin_m = self.columns[scan.columns() - 1].origin_m;
        for place in 0..self.brought {
            let point = self.point[place] as usize;
            let direction = end.turned(scan.direction(scan.column(point)).map(f64::from));
            let distance_m = (self.range_m[place] + step_m) * self.cosines[scan.layer(point)];
            self.x_m[place] = origin_m[0] + distance_m * direction[0] as f32;
            self.y_m[place] = origin_m[1] + distance_m * direction[1] as f32;
        }
    }

    /// Where they are from above.
    pub(super) fn at_m(&self) -> [&[f32]; 2] {
        [&self.x_m[..self.count], &self.y_m[..self.count]]
    }

    /// Their places in the scan.
    pub(super) fn points(&self) -> &[u32] {
        &self.point
    }

    /// Their heights above the ground.
    pub(super) fn above_m(&self) -> &[f32] {
        &self.above_m[..self.count]
    }

    /// Their ranges.
    pub(super) fn range_m(&self) -> &[f32] {
        &self.range_m[..self.count]
    }

    /// All of them.
    pub(super) fn iter(&self) -> impl Iterator<Item = Placed> {
        self.stretch(0..self.count)
    }

    /// Some that follow each other.
    #[inline(always)]
    pub(super) fn stretch(&self, places: Range<usize>) -> impl Iterator<Item = Placed> {
        let (x_m, y_m) = (&self.x_m[places.clone()], &self.y_m[places.clone()]);
        let (above_m, point) = (&self.above_m[places.clone()], &self.point[places.clone()]);
        let (begin, count) = (places.start, places.len());
        (0..count).map(move |at| Placed {
            at_m: [x_m[at], y_m[at]],
            above_m: above_m[at],
            point: point[at],
            is_brought: begin + at < self.brought,
            before: Seen::Unknown,
        })
    }

    /// The box that holds all of them.
    pub(super) fn bounds(&self) -> Bounds {
        let [[west, east], [south, north]] = self.at_m().map(bounds_of);
        let [floor_m, top_m] = bounds_of(self.above_m());
        Bounds {
            low_m: [west, south],
            high_m: [east, north],
            floor_m,
            top_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretch_is_what_all_of_them_are_there() {
        let numbers = vec![1.0, 2.0, 3.0, 4.0];
        let placing = Placing {
            x_m: numbers.clone(),
            y_m: numbers.iter().map(|number| 10.0 * number).collect(),
            above_m: numbers.iter().map(|number| 0.1 * number).collect(),
            point: vec![5, 6, 7, 8],
            count: 4,
            brought: 2,
            ..Placing::default()
        };
        let own = |placed: Placed| (placed.at_m, placed.point, placed.is_brought);
        let stretch: Vec<_> = placing.stretch(1..3).map(own).collect();
        assert_eq!(stretch, [([2.0, 20.0], 6, true), ([3.0, 30.0], 7, false)]);
        let all: Vec<_> = placing.iter().map(own).collect();
        assert_eq!(all[1..3], stretch);
        assert_eq!(all.len(), 4);
    }
}
