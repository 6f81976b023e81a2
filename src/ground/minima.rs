//! The lowest returns of every pie slice.

use nalgebra::Vector3;

use super::lowest::STEEP;
use super::moments::{Positions, moments_near};
use super::slices::slices;
use super::{GroundParameters, Plane, passes};
use crate::cloud::{MAX_COLUMNS, MAX_LAYERS, Scan};
use crate::float::least_of;

/// The lowest returns, slice by slice. The buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct Minima {
    per_segment: usize,
    segments: Vec<Vec<Minimum>>,
    /// The slice of each, and its coordinates.
    slices: Vec<usize>,
    at_m: [Vec<f32>; 3],
    /// Of the points of a slice that are looked at; infinity where they do not count.
    heights_m: Vec<[f32; MAX_LAYERS]>,
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
            slices: Vec::with_capacity(segments * per_segment),
            at_m: std::array::from_fn(|_| Vec::with_capacity(segments * per_segment)),
            heights_m: Vec::with_capacity(MAX_COLUMNS),
        }
    }

    /// Gathers the returns of each slice that are lowest above `reference` and may be ground.
    pub(super) fn gather(&mut self, scan: &Scan, reference: &Plane, parameters: &GroundParameters) {
        for segment in &mut self.segments {
            segment.clear();
        }
        let far_squared = parameters.candidate_range_m.powi(2) as f32;
        for (slice, columns) in slices(scan, self.segments.len()) {
            let columns = columns.step_by(parameters.candidate_every);
            self.heights_m.resize(columns.len(), [0.0; MAX_LAYERS]);
            let heights_m = &mut self.heights_m;
            passes::heights_nearby(scan, columns.clone(), reference, far_squared, heights_m);
            let segment = &mut self.segments[slice];
            let mut highest_m = highest_m(segment, self.per_segment);
            for (column, heights_m) in columns.zip(&self.heights_m) {
                if least_of(*heights_m) >= highest_m {
                    continue;
                }
                let layers = if parameters.candidate_below_upright {
                    layers_below_upright(scan, column, heights_m)
                } else {
                    MAX_LAYERS
                };
                for (layer, above_m) in heights_m[..layers].iter().copied().enumerate() {
                    if above_m < highest_m {
                        let point = scan.index(column, layer) as u32;
                        insert(segment, self.per_segment, Minimum { above_m, point });
                        highest_m = self::highest_m(segment, self.per_segment);
                    }
                }
            }
        }
        self.slices.clear();
        for metres in &mut self.at_m {
            metres.clear();
        }
        for (slice, minima) in self.segments.iter().enumerate() {
            for minimum in minima {
                self.slices.push(slice);
                let at_m = scan.point_m(minimum.point as usize);
                for (metres, coordinate) in self.at_m.iter_mut().zip(at_m) {
                    metres.push(coordinate);
                }
            }
        }
    }

    pub(super) fn len(&self) -> usize {
        self.slices.len()
    }

    /// How many slices there are.
    pub(super) fn segments(&self) -> usize {
        self.segments.len()
    }

    /// A return by its number, with the slice it lies in.
    pub(super) fn get(&self, number: usize) -> (usize, Vector3<f64>) {
        let at_m = [0, 1, 2].map(|axis| f64::from(self.at_m[axis][number]));
        (self.slices[number], at_m.into())
    }

    pub(super) fn points(&self) -> Positions<'_> {
        let [x_m, y_m, z_m] = &self.at_m;
        Positions { x_m, y_m, z_m }
    }

    /// How many returns lie within `distance_m` of a plane.
    pub(super) fn support(&self, plane: &Plane, distance_m: f64) -> usize {
        let moments = moments_near(self.points(), 1, plane, distance_m as f32, f32::INFINITY);
        moments.count as usize
    }
}

/// How many layers of a column are below the first return from which it rises steeply to the next
/// one above.
fn layers_below_upright(scan: &Scan, column: usize, heights_m: &[f32; MAX_LAYERS]) -> usize {
    let stands = |layer: usize| {
        let [(height_m, distance_m), (next_m, next_distance_m)] = [layer, layer + 1].map(|layer| {
            let point = scan.index(column, layer);
            (heights_m[layer], scan.distance_m(point))
        });
        let are_met = height_m.is_finite() && next_m.is_finite();
        are_met && next_m - height_m > STEEP * (next_distance_m - distance_m)
    };
    (0..MAX_LAYERS - 1)
        .find(|layer| stands(*layer))
        .unwrap_or(MAX_LAYERS)
}

/// What is as high as this does not belong to the lowest.
fn highest_m(minima: &[Minimum], capacity: usize) -> f32 {
    let highest = minima.get(capacity - 1);
    highest.map_or(f32::INFINITY, |highest| highest.above_m)
}

/// Adds one of the lowest `capacity`, lowest first; of equal ones the first to come.
fn insert(minima: &mut Vec<Minimum>, capacity: usize, minimum: Minimum) {
    minima.truncate(capacity - 1);
    minima.push(minimum);
    // They are few: each is passed on its own.
    let mut place = minima.len() - 1;
    while place > 0 && minima[place - 1].above_m > minimum.above_m {
        minima.swap(place - 1, place);
        place -= 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::parameter::Profile;

    /// Of so many columns one is looked at, whatever stands there.
    fn every(columns: usize) -> GroundParameters {
        GroundParameters {
            candidate_every: columns,
            candidate_below_upright: false,
            ..GroundParameters::profile(Profile::Default)
        }
    }

    #[test]
    fn what_stands_upright_and_all_above_it_is_not_among_the_lowest() {
        // 0.8 m above a floor, between a wall 1.5 m away, before which no ray reaches the floor, and one 6 m away.
        let scan = scan_of(360, |column, layer| {
            let (sine, cosine) = (2.0 * layer as f64 - 15.0).to_radians().sin_cos();
            let wall_m = if column < 180 { 1.5 } else { 6.0 };
            let floor_m = if sine < 0.0 { -0.8 / sine } else { f64::MAX };
            (100.0 * floor_m.min(wall_m / cosine)) as u16
        });
        let parameters = GroundParameters {
            candidate_below_upright: true,
            ..every(1)
        };
        let mut minima = Minima::new(36, 6);
        minima.gather(&scan, &Plane::level(0.0), &parameters);
        let mut lowest = (0..minima.len()).map(|number| minima.get(number).1);
        assert_eq!(minima.len(), 18 * 6);
        assert!(lowest.all(|at_m| (at_m.z + 0.8).abs() < 0.02 && at_m.x.hypot(at_m.y) < 6.0));
    }

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
        minima.gather(&scan, &Plane::level(0.0), &every(1));
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

    #[test]
    fn columns_between_those_that_are_looked_at_give_none() {
        let scan = scan_of(
            360,
            |column, _| if column % 10 % 4 == 0 { 900 } else { 500 },
        );
        let mut minima = Minima::new(36, 64);
        minima.gather(&scan, &Plane::level(0.0), &every(4));
        // Ten columns of a slice, of which three are looked at.
        assert_eq!(minima.len(), 36 * 3 * MAX_LAYERS);
        let mut ranges_m = (0..minima.len()).map(|n| minima.get(n).1.norm());
        assert!(ranges_m.all(|range_m| range_m > 8.9));
    }

    #[test]
    fn the_few_lowest_are_kept_lowest_first_and_of_equal_ones_the_first_to_come() {
        let mut minima = vec![];
        for (point, above_m) in (0..).zip([0.3, 0.1, 0.3, 0.2, 0.1, 0.4]) {
            insert(&mut minima, 4, Minimum { above_m, point });
        }
        // The last one is not asked whether it is low enough.
        let points: Vec<u32> = minima.iter().map(|minimum| minimum.point).collect();
        assert_eq!(points, [1, 4, 3, 5]);
    }
}
