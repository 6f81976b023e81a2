//! Stretches of one ray's way.

use crate::cloud::MAX_LAYERS;

/// Stretches that do not overlap, at most one for each layer and one around the sensor.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Intervals {
    stretches_m: [(f32, f32); MAX_LAYERS + 1],
    count: usize,
}

impl Intervals {
    /// Adds a stretch; where it meets others they become one.
    pub(super) fn add(&mut self, from_m: f32, to_m: f32) {
        if from_m >= to_m {
            return;
        }
        let (mut from_m, mut to_m) = (from_m, to_m);
        let mut kept = 0;
        for at in 0..self.count {
            let (begin_m, end_m) = self.stretches_m[at];
            if begin_m <= to_m && from_m <= end_m {
                (from_m, to_m) = (from_m.min(begin_m), to_m.max(end_m));
            } else {
                self.stretches_m[kept] = (begin_m, end_m);
                kept += 1;
            }
        }
        self.stretches_m[kept] = (from_m, to_m);
        self.count = kept + 1;
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (f32, f32)> {
        self.stretches_m[..self.count].iter().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_that_meet_become_one() {
        let mut intervals = Intervals::default();
        for (from_m, to_m) in [(1.0, 2.0), (5.0, 6.0), (3.0, 4.0), (7.0, 7.0), (1.5, 3.5)] {
            intervals.add(from_m, to_m);
        }
        let mut stretches: Vec<_> = intervals.iter().collect();
        stretches.sort_by(|a, b| a.0.total_cmp(&b.0));
        assert_eq!(stretches, [(1.0, 4.0), (5.0, 6.0)]);
    }

    #[test]
    fn there_is_room_for_one_of_every_layer_and_one_more() {
        let mut intervals = Intervals::default();
        for n in 0..=MAX_LAYERS {
            intervals.add(2.0 * n as f32, 2.0 * n as f32 + 1.0);
        }
        assert_eq!(intervals.iter().count(), MAX_LAYERS + 1);
    }
}
