//! Core points of a layer that follow each other: a surface is a few runs, not many points.

use std::ops::Range;

use crate::cloud::MAX_LAYERS;

/// Core points of one layer, each a neighbour of the one before.
#[derive(Debug, Clone)]
pub(super) struct Run {
    /// From the first to behind the last; points between that are no core points do not count.
    pub(super) columns: Range<usize>,
    /// Least range of a point.
    pub(super) low_m: f32,
    /// Greatest range of a point.
    pub(super) high_m: f32,
}

/// The runs of every layer, in the order of their columns.
#[derive(Debug, Clone, Default)]
pub(super) struct Runs {
    layers: [Vec<Run>; MAX_LAYERS],
}

impl Runs {
    /// Forgets the runs of a layer.
    pub(super) fn begin_layer(&mut self, layer: usize) {
        self.layers[layer].clear();
    }

    /// Begins a run with one point.
    pub(super) fn begin(&mut self, layer: usize, column: usize, range_m: f32) {
        self.layers[layer].push(Run {
            columns: column..column + 1,
            low_m: range_m,
            high_m: range_m,
        });
    }

    /// Adds a point to the layer's last run.
    pub(super) fn extend(&mut self, layer: usize, column: usize, range_m: f32) {
        if let Some(run) = self.layers[layer].last_mut() {
            run.columns.end = column + 1;
            run.low_m = run.low_m.min(range_m);
            run.high_m = run.high_m.max(range_m);
        }
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
        for (column, range_m) in [(10, 5.0), (12, 4.0), (13, 6.0)] {
            match column {
                10 => runs.begin(3, column, range_m),
                _ => runs.extend(3, column, range_m),
            }
        }
        runs.begin(3, 20, 9.0);
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
