//! Core points of a layer that follow each other: a surface is a few runs, not many points.

use std::ops::Range;

use crate::cloud::MAX_LAYERS;
use crate::float::{greatest, least};

/// Core points of one layer, each a neighbour of the one before.
#[derive(Debug, Clone)]
pub(super) struct Run {
    /// Counts the runs of all layers.
    pub(super) number: u32,
    /// From the first to behind the last; points between that are no core points do not count.
    pub(super) columns: Range<usize>,
    /// Least range of a point.
    pub(super) low_m: f32,
    /// Greatest range of a point.
    pub(super) high_m: f32,
    /// The box that holds all points.
    low: [f32; 3],
    high: [f32; 3],
}

impl Run {
    /// A run of one point.
    pub(super) fn of(number: usize, column: usize, range_m: f32, at_m: [f32; 3]) -> Self {
        Self {
            number: number as u32,
            columns: column..column + 1,
            low_m: range_m,
            high_m: range_m,
            low: at_m,
            high: at_m,
        }
    }

    /// Adds the next point.
    pub(super) fn extend(&mut self, column: usize, range_m: f32, at_m: [f32; 3]) {
        self.columns.end = column + 1;
        self.low_m = least(self.low_m, range_m);
        self.high_m = greatest(self.high_m, range_m);
        for (axis, metres) in at_m.into_iter().enumerate() {
            self.low[axis] = least(self.low[axis], metres);
            self.high[axis] = greatest(self.high[axis], metres);
        }
    }

    /// Squared distance of the boxes of two runs: none of their points are closer.
    pub(super) fn gap_squared(&self, other: &Self) -> f32 {
        let gaps = [0, 1, 2].map(|axis| {
            let gap = (other.low[axis] - self.high[axis]).max(self.low[axis] - other.high[axis]);
            gap.max(0.0)
        });
        gaps.iter().map(|gap| gap * gap).sum()
    }
}

/// The runs of every layer, in the order of their columns.
#[derive(Debug, Clone, Default)]
pub(super) struct Runs {
    layers: [Vec<Run>; MAX_LAYERS],
    count: u32,
}

impl Runs {
    /// Forgets all of them.
    pub(super) fn clear(&mut self) {
        for runs in &mut self.layers {
            runs.clear();
        }
        self.count = 0;
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.count as usize
    }

    /// Begins a run in a layer. Its number is that of the runs before.
    pub(super) fn push(&mut self, layer: usize, run: Run) {
        self.layers[layer].push(run);
        self.count += 1;
    }

    /// The runs of a layer.
    pub(super) fn of(&self, layer: usize) -> &[Run] {
        &self.layers[layer]
    }

    /// The runs that reach into a stretch of columns.
    pub(super) fn within(
        &self,
        layer: usize,
        stretch: &Range<usize>,
    ) -> impl Iterator<Item = &Run> {
        let runs = &self.layers[layer];
        let first = runs.partition_point(|run| run.columns.end <= stretch.start);
        let end = stretch.end;
        runs[first..]
            .iter()
            .take_while(move |run| run.columns.start < end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_found_by_the_columns_that_they_reach() {
        let mut runs = Runs::default();
        let mut run = Run::of(0, 10, 5.0, [5.0; 3]);
        run.extend(12, 4.0, [4.0; 3]);
        run.extend(13, 6.0, [6.0; 3]);
        runs.push(3, run);
        runs.push(3, Run::of(1, 20, 9.0, [9.0; 3]));
        let found = |stretch| {
            runs.within(3, &stretch)
                .map(|run| run.low_m)
                .collect::<Vec<_>>()
        };
        assert!(found(0..10).is_empty());
        assert_eq!(found(11..12), [4.0]);
        assert_eq!(found(13..21), [4.0, 9.0]);
        assert!(found(14..20).is_empty());
    }
}
