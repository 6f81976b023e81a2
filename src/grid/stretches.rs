//! What the rays of a column passed, seen from above: stretches of its way.

use crate::float::{greatest, least};

/// A stretch of a column's way, seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stretch {
    pub(super) column: usize,
    pub(super) from_m: f32,
    pub(super) to_m: f32,
}

/// Collects what one column's rays passed. They come in the order of their layers, the lowest
/// first, and so, nearly, in that of their beginnings: what meets the stretch before joins it at
/// once.
pub(super) struct Stretches<'a> {
    passed: &'a mut Vec<Stretch>,
    /// Of the column's first.
    first: usize,
    last: Stretch,
}

impl<'a> Stretches<'a> {
    /// With the stretch around the sensor.
    pub(super) fn new(column: usize, nearest_m: f32, passed: &'a mut Vec<Stretch>) -> Self {
        let last = Stretch {
            column,
            from_m: 0.0,
            to_m: nearest_m,
        };
        let first = passed.len();
        Self {
            passed,
            first,
            last,
        }
    }

    /// Adds what one ray passed.
    pub(super) fn add(&mut self, from_m: f32, to_m: f32) {
        if from_m >= to_m {
            return;
        }
        if from_m > self.last.to_m || to_m < self.last.from_m {
            self.passed.push(self.last);
            (self.last.from_m, self.last.to_m) = (from_m, to_m);
        } else {
            self.last.from_m = least(self.last.from_m, from_m);
            self.last.to_m = greatest(self.last.to_m, to_m);
        }
    }

    /// Leaves the column's stretches in order, with a gap between any two.
    pub(super) fn finish(self) {
        self.passed.push(self.last);
        let of_column = &mut self.passed[self.first..];
        if of_column.is_sorted_by(|a, b| a.to_m < b.from_m) {
            return;
        }
        of_column.sort_unstable_by(|a, b| a.from_m.total_cmp(&b.from_m));
        let mut last = self.first;
        for next in self.first + 1..self.passed.len() {
            let stretch = self.passed[next];
            if stretch.from_m <= self.passed[last].to_m {
                self.passed[last].to_m = self.passed[last].to_m.max(stretch.to_m);
            } else {
                last += 1;
                self.passed[last] = stretch;
            }
        }
        self.passed.truncate(last + 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_that_meet_become_one() {
        let mut passed = vec![];
        let mut stretches = Stretches::new(3, 1.0, &mut passed);
        for (from_m, to_m) in [
            (0.5, 2.0),
            (2.0, 4.0),
            (3.0, 3.0),
            (5.0, 6.0),
            (5.5, 7.0),
            (8.0, 9.0),
            (3.5, 4.5),
            (6.5, 8.5),
        ] {
            stretches.add(from_m, to_m);
        }
        stretches.finish();
        let ends: Vec<_> = passed.iter().map(|at| (at.from_m, at.to_m)).collect();
        assert_eq!(ends, [(0.0, 4.5), (5.0, 9.0)]);
        assert!(passed.iter().all(|stretch| stretch.column == 3));
    }
}
