//! The lowest returns of every pie slice.

use nalgebra::Vector3;

use super::{Plane, passes};
use crate::cloud::{CAPACITY, MAX_LAYERS, Scan};
use crate::float::least_of;

/// The lowest returns, slice by slice. The buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct Minima {
    per_segment: usize,
    segments: Vec<Vec<Minimum>>,
    points: Vec<(usize, Vector3<f64>)>,
    /// Of all points; infinity where they do not count.
    heights_m: Vec<f32>,
}

#[derive(Debug, Clone, Copy)]
struct Minimum {
    above_m: f32,
    point: u32,
}

impl Minima {
    pub(super) fn new(segments: usize, per_segment: usize) -> Self {
        Self {
            per_segment,
            segments: vec![Vec::with_capacity(per_segment); segments],
            points: Vec::with_capacity(segments * per_segment),
            heights_m: Vec::with_capacity(CAPACITY),
        }
    }

    /// Gathers the returns of each slice that are lowest above `reference`.
    pub(super) fn gather(&mut self, scan: &Scan, reference: &Plane, range_m: f64) {
        for segment in &mut self.segments {
            segment.clear();
        }
        self.heights_m.resize(scan.len(), 0.0);
        let far_squared = (range_m * range_m) as f32;
        passes::heights_nearby(scan, reference, far_squared, &mut self.heights_m);
        let heights_m = self.heights_m.as_chunks::<MAX_LAYERS>().0;
        for (column, heights_m) in heights_m.iter().enumerate() {
            let slice = slice_of(scan, column, self.segments.len());
            let segment = &mut self.segments[slice];
            let highest_m = segment
                .get(self.per_segment - 1)
                .map_or(f32::INFINITY, |highest| highest.above_m);
            if least_of(*heights_m) >= highest_m {
                continue;
            }
            for (layer, above_m) in heights_m.iter().copied().enumerate() {
                if above_m < f32::INFINITY {
                    let point = scan.index(column, layer) as u32;
                    insert(segment, self.per_segment, Minimum { above_m, point });
                }
            }
        }
        self.points.clear();
        for (segment, minima) in self.segments.iter().enumerate() {
            self.points.extend(minima.iter().map(|minimum| {
                let point = scan.point_m(minimum.point as usize).map(f64::from);
                (segment, Vector3::from(point))
            }));
        }
    }

    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    /// How many slices there are.
    pub(super) fn segments(&self) -> usize {
        self.segments.len()
    }

    /// A return by its number, with the slice it lies in.
    pub(super) fn get(&self, number: usize) -> (usize, Vector3<f64>) {
        self.points[number]
    }

    pub(super) fn points(&self) -> impl Iterator<Item = Vector3<f64>> + Clone {
        self.points.iter().map(|(_, point)| *point)
    }

    /// How many returns lie within `distance_m` of a plane.
    pub(super) fn support(&self, plane: &Plane, distance_m: f64) -> usize {
        self.points()
            .filter(|point| plane.above_m(point).abs() <= distance_m)
            .count()
    }
}

/// The slice of a column by its azimuth, wherever the revolution begins.
pub(super) fn slice_of(scan: &Scan, column: usize, segments: usize) -> usize {
    let turns = scan.azimuth_rad(column) / std::f64::consts::TAU;
    let part = turns - libm::floor(turns);
    ((part * segments as f64) as usize).min(segments - 1)
}

/// Keeps the lowest `capacity`, lowest first; of equal ones the first to come.
fn insert(minima: &mut Vec<Minimum>, capacity: usize, minimum: Minimum) {
    if minima.len() == capacity {
        if minima
            .last()
            .is_none_or(|highest| minimum.above_m >= highest.above_m)
        {
            return;
        }
        minima.pop();
    }
    let place = minima.partition_point(|kept| kept.above_m <= minimum.above_m);
    minima.insert(place, minimum);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;

    #[test]
    fn every_slice_gives_its_lowest_returns_and_nothing_beyond_the_range() {
        // The far half of the circle is lower, but too far.
        let scan = scan_of(360, |column, layer| {
            if layer > 3 {
                0
            } else if column < 180 {
                500 + column as u16
            } else {
                6000
            }
        });
        let mut minima = Minima::new(36, 10);
        minima.gather(&scan, &Plane::level(0.0), 25.0);
        assert_eq!(minima.len(), 18 * 10);
        let lowest = |segment| {
            let of_slice = (0..minima.len())
                .map(|n| minima.get(n))
                .filter(|(s, _)| *s == segment);
            of_slice
                .map(|(_, point)| point.z)
                .fold(f64::INFINITY, f64::min)
        };
        let expected = -5.99 * 15f64.to_radians().sin();
        assert!((lowest(9) - expected).abs() < 1e-4);
    }
}
