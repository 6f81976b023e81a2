//! What touches, seen from above.

use multiversion::multiversion;

use crate::float::{greatest, least, rounded};
use crate::partition::Partition;

/// Cells of one cluster, seen from above, and which of them touch.
#[derive(Debug, Clone, Default)]
pub(super) struct Floor {
    /// Cells in a metre.
    per_m: f32,
    /// The middle of the cell in the south-west.
    low_m: [f32; 2],
    /// Cells from south to north, one more than the cluster has on either side.
    height: u32,
    /// For every place what [`Floor::number`] says of it.
    numbers: Vec<u32>,
    /// Places of the cells that there are, in the order in which they were added.
    places: Vec<u32>,
    /// Cells of one part.
    partition: Partition,
}

/// Cells along a side, of which the last one holds all that is farther: more than any cluster has.
const MOST: f32 = 2047.0;

impl Floor {
    /// Empties it for a cluster between these corners, which are relative to `origin_m`. The cells
    /// lie still in the local frame, so that what stands is parted alike again and again.
    pub(super) fn begin(
        &mut self,
        low_m: [f32; 2],
        high_m: [f32; 2],
        cell_m: f32,
        origin_m: [f64; 2],
    ) {
        for place in &self.places {
            self.numbers[*place as usize] = 0;
        }
        self.places.clear();
        self.per_m = 1.0 / cell_m;
        self.low_m = [0, 1].map(|axis| {
            let side_m = f64::from(cell_m);
            let cell = libm::floor((origin_m[axis] + f64::from(low_m[axis])) / side_m);
            ((cell + 0.5) * side_m - origin_m[axis]) as f32
        });
        let [width, height] = [0, 1].map(|axis| self.cell(high_m, axis) + 2);
        self.height = height;
        let size = (width * height) as usize;
        if self.numbers.len() < size {
            self.numbers.resize(size, 0);
        }
    }

    /// The column or the row of a place between the corners. Those at the edges stay empty.
    #[inline(always)]
    fn cell(&self, at_m: [f32; 2], axis: usize) -> u32 {
        let cells = (at_m[axis] - self.low_m[axis]) * self.per_m + 1.0;
        u32::from(rounded(least(greatest(cells, 1.0), MOST)))
    }

    /// The number of a place between the corners.
    #[inline(always)]
    fn place(&self, at_m: [f32; 2]) -> u32 {
        self.cell(at_m, 0) * self.height + self.cell(at_m, 1)
    }

    /// The numbers of many places between the corners.
    pub(super) fn find_places(&self, [x_m, y_m]: [&[f32]; 2], places: &mut Vec<u32>) {
        places.resize(x_m.len(), 0);
        find_places(self, x_m, y_m, places);
    }

    /// Adds the cells at those of some places that count, each of them once.
    pub(super) fn add(&mut self, places: impl ExactSizeIterator<Item = (u32, bool)>) {
        let mut count = self.places.len();
        self.places.resize(count + places.len(), 0);
        for (place, counts) in places {
            // Written in any case, and kept if it is new: nobody could foresee the branch.
            self.places[count] = place;
            let number = &mut self.numbers[place as usize];
            let is_new = counts & (*number == 0);
            count += usize::from(is_new);
            *number = if is_new { count as u32 } else { *number };
        }
        self.places.truncate(count);
    }

    /// One more than the number of the cell at a place, counted from 0 in the order in which they
    /// were added; after [`Floor::name_by_parts`] one more than that of its part. 0 where there is
    /// no cell.
    #[inline(always)]
    pub(super) fn number(&self, place: u32) -> u32 {
        self.numbers[place as usize]
    }

    /// How many cells there are.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// Joins the cells that touch, also by their corners.
    pub(super) fn join(&mut self) {
        self.partition.reset(self.places.len());
        for (number, place) in self.places.iter().enumerate() {
            let east = place + self.height;
            for neighbour in [place + 1, east - 1, east, east + 1] {
                if let Some(other) = self.number(neighbour).checked_sub(1) {
                    self.partition.join(number as u32, other);
                }
            }
        }
        self.partition.flatten();
    }

    /// Gives every cell the number of the part that it belongs to, in the place of its own.
    pub(super) fn name_by_parts(&mut self) {
        for (place, part) in self.places.iter().zip(self.partition.parents()) {
            self.numbers[*place as usize] = part + 1;
        }
    }

    /// For each cell the part that it belongs to: the first cell of that.
    pub(super) fn parts(&self) -> &[u32] {
        self.partition.parents()
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn find_places(floor: &Floor, x_m: &[f32], y_m: &[f32], places: &mut [u32]) {
    let (x_m, y_m) = (&x_m[..places.len()], &y_m[..places.len()]);
    for at in 0..places.len() {
        places[at] = floor.place([x_m[at], y_m[at]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_that_touch_by_a_corner_are_one_part_and_others_are_not() {
        let mut floor = Floor::default();
        let at_m = [[2.0, 2.0], [2.3, 2.3], [4.0, 2.0], [2.3, 2.9], [2.0, 2.6]];
        // What was there before is gone.
        for cell_m in [0.1, 0.3] {
            floor.begin([2.0, 2.0], [4.0, 2.9], cell_m, [0.0; 2]);
            let places = at_m.map(|at_m| floor.place(at_m));
            floor.add(places.into_iter().map(|place| (place, true)));
            floor.add(places.into_iter().map(|place| (place, true)));
            floor.join();
        }
        assert_eq!(floor.len(), 5);
        assert_eq!(floor.parts(), [0, 0, 2, 0, 0]);
        assert_eq!(floor.number(floor.place([2.3, 2.9])), 4);
        assert_eq!(floor.number(floor.place([3.5, 2.0])), 0);
        floor.add([(floor.place([3.5, 2.0]), false)].into_iter());
        assert_eq!(floor.len(), 5);
    }

    #[test]
    fn what_is_too_far_for_the_floor_falls_into_its_last_cell() {
        let mut floor = Floor::default();
        floor.begin([0.0; 2], [1e6, 5.0], 0.3, [7.0; 2]);
        let places = [[1e6, 5.0], [1e5, 5.0], [0.0, 0.0]].map(|at_m| floor.place(at_m));
        floor.add(places.into_iter().map(|place| (place, true)));
        floor.join();
        assert_eq!(floor.len(), 2);
    }
}
