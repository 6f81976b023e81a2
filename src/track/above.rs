//! What goes on above a cluster.
//!
//! Clusters end at a height that few road users exceed. Whether what they show ends there, too, is
//! told column by column: from return to return upwards, as long as they are equally far away.

use multiversion::multiversion;

use super::Scene;
use super::parts::CUT_M;
use crate::cloud::{MAX_LAYERS, Scan};
use crate::float::greatest;

/// Difference of ranges of two returns of a column, one above the other, within which they are of
/// the same thing.
const SAME_M: f32 = 0.8;

/// Whether the return above one is there and of the same thing, given their ranges.
#[inline(always)]
pub(super) fn is_same(own_m: f32, above_m: f32) -> bool {
    (above_m > 0.0) & ((above_m - own_m).abs() < SAME_M)
}

/// Climbs up from returns. Its buffers are made once.
#[derive(Debug, Clone, Default)]
pub(super) struct Climber {
    /// Of every point whether the return directly above goes on from it, above the cut and in no
    /// cluster.
    goes_on: Vec<bool>,
    /// Of every point whether it is of a cluster, or goes on above one.
    members: Vec<bool>,
}

impl Climber {
    /// Takes a revolution over, given which of its points are of any cluster.
    pub(super) fn begin(&mut self, scene: &Scene<'_>, members: &[bool]) {
        self.members.clear();
        self.members.extend_from_slice(members);
        self.goes_on.clear();
        self.goes_on.resize(members.len(), false);
        mark(
            scene.scan.range_m(),
            scene.heights_m,
            members,
            &mut self.goes_on,
        );
    }

    /// Height above the ground to which the points of a cluster go on, themselves included; if that
    /// is more than `enough_m`, any height above that.
    pub(super) fn top_m(&self, points: &[u32], enough_m: f32, heights_m: &[f32]) -> f32 {
        let mut top_m = f32::NEG_INFINITY;
        for point in points {
            let mut top = *point as usize;
            while self.goes_on[top] {
                top += 1;
            }
            top_m = greatest(top_m, heights_m[top]);
            if top_m > enough_m {
                break;
            }
        }
        top_m
    }

    /// Height above the ground up to which most columns of a cluster go on: a branch over a roof is none of it.
    pub(super) fn usual_top_m(
        &self,
        points: &[u32],
        scene: &Scene<'_>,
        tops_m: &mut Vec<f32>,
    ) -> f64 {
        let column_of = |point: &u32| scene.scan.column(*point as usize);
        let columns = points.chunk_by(|a, b| column_of(a) == column_of(b));
        tops_m.clear();
        tops_m.extend(columns.map(|column| self.top_m(column, f32::INFINITY, scene.heights_m)));
        if tops_m.is_empty() {
            return 0.0;
        }
        let middle = tops_m.len() / 2;
        f64::from(*tops_m.select_nth_unstable_by(middle, f32::total_cmp).1)
    }

    /// Takes over the points of a cluster, each followed by what goes on above it, up to the first
    /// return above `to_m`.
    pub(super) fn take_up(
        &mut self,
        points: &[u32],
        to_m: f32,
        heights_m: &[f32],
        taken: &mut Vec<u32>,
    ) {
        taken.clear();
        for point in points {
            taken.push(*point);
            let mut top = *point as usize;
            while self.goes_on[top] {
                if heights_m[top] <= to_m {
                    taken.push(top as u32 + 1);
                }
                top += 1;
                self.members[top] = true;
            }
        }
    }

    /// Of every point whether it is of a cluster, or goes on above one that was taken over.
    pub(super) fn members(&self) -> &[bool] {
        &self.members
    }
}

/// Notes from which returns the next one goes on.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn mark(range_m: &[f32], heights_m: &[f32], members: &[bool], goes_on: &mut [bool]) {
    let Some(count) = range_m.len().checked_sub(1) else {
        return;
    };
    let (own_m, above_m) = (&range_m[..count], &range_m[1..]);
    let (heights_m, members) = (&heights_m[1..=count], &members[1..=count]);
    let marks = &mut goes_on[..count];
    for point in 0..count {
        marks[point] =
            is_same(own_m[point], above_m[point]) & (heights_m[point] > CUT_M) & !members[point];
    }
    // The next one of the highest layer is the lowest of another column.
    for column in goes_on.as_chunks_mut::<MAX_LAYERS>().0 {
        column[MAX_LAYERS - 1] = false;
    }
}

/// The return directly above one, if it is there and of the same thing.
pub(super) fn same_above(scan: &Scan, point: usize) -> Option<usize> {
    let ranges_m = scan.range_m();
    let above = point + 1;
    let is_there = scan.layer(above) > 0 && is_same(ranges_m[point], ranges_m[above]);
    is_there.then_some(above)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::track::tests::with_scene;

    /// What goes on from which points of two columns of returns 10 m away and 3 m above the ground,
    /// but for one in layer 5 that is as given.
    fn going_on(range_m: f32, height_m: f32, is_member: bool) -> Vec<usize> {
        const COUNT: usize = 2 * MAX_LAYERS;
        let (mut ranges_m, mut heights_m) = ([10.0; COUNT], [3.0; COUNT]);
        let (mut members, mut goes_on) = ([false; COUNT], [false; COUNT]);
        (ranges_m[5], heights_m[5], members[5]) = (range_m, height_m, is_member);
        mark(&ranges_m, &heights_m, &members, &mut goes_on);
        (0..COUNT).filter(|point| goes_on[*point]).collect()
    }

    #[test]
    fn only_a_return_above_that_is_high_and_equally_far_away_and_of_no_cluster_goes_on() {
        let all: Vec<usize> = (0..15).chain(16..31).collect();
        let but = |points: &[usize]| -> Vec<usize> {
            let all = all.iter().copied();
            all.filter(|point| !points.contains(point)).collect()
        };
        assert_eq!(going_on(10.7, 2.2, false), all);
        assert_eq!(going_on(10.9, 2.2, false), but(&[4, 5]));
        assert_eq!(going_on(0.0, 2.2, false), but(&[4, 5]));
        assert_eq!(going_on(10.0, 2.0, false), but(&[4]));
        assert_eq!(going_on(10.0, 2.2, true), but(&[4]));
    }

    #[test]
    fn a_branch_over_a_part_of_a_roof_is_not_how_high_most_of_it_is() {
        let covered = |columns: std::ops::Range<usize>| {
            // 20 m away layers 6 to 10 pass 0.9, 1.6, 2.2, 2.9 and 3.6 m above the ground.
            let scan = scan_of(1800, |column, layer| match layer {
                6..=8 if (100..110).contains(&column) => 2000,
                9..=10 if columns.contains(&column) => 2000,
                _ => 0,
            });
            let own: Vec<u32> = (100..110)
                .flat_map(|column| (6..=8).map(move |layer| (column, layer)))
                .map(|(column, layer)| scan.index(column, layer) as u32)
                .collect();
            let mut members = vec![false; scan.len()];
            for point in &own {
                members[*point as usize] = true;
            }
            let mut top_m = 0.0;
            with_scene(&scan, |scene| {
                let mut climber = Climber::default();
                climber.begin(scene, &members);
                top_m = climber.usual_top_m(&own, scene, &mut vec![]);
            });
            top_m
        };
        assert!((2.1..2.4).contains(&covered(104..108)));
        assert!((3.4..3.8).contains(&covered(100..108)));
    }

    #[test]
    fn what_goes_on_is_taken_to_its_end_or_to_the_first_return_that_is_too_high() {
        // 20 m away layers 6 to 11 pass 0.9, 1.6, 2.2, 2.9, 3.6 and 4.3 m above the ground.
        let scan = scan_of(1800, |column, layer| match column {
            100 if (6..12).contains(&layer) => 2000,
            101 if (6..8).contains(&layer) => 2000,
            _ => 0,
        });
        let points = |layers: &[(usize, usize)]| -> Vec<u32> {
            let points = layers.iter();
            points
                .map(|(column, layer)| scan.index(*column, *layer) as u32)
                .collect()
        };
        let own = points(&[(100, 6), (100, 7), (101, 6), (101, 7)]);
        let mut members = vec![false; scan.len()];
        for point in &own {
            members[*point as usize] = true;
        }
        with_scene(&scan, |scene| {
            let mut climber = Climber::default();
            climber.begin(scene, &members);
            let mut taken = |to_m: f32| {
                let mut taken = points(&[(0, 0)]);
                climber.take_up(&own, to_m, scene.heights_m, &mut taken);
                let above = taken.iter().filter(|point| !own.contains(point)).count();
                assert!(taken.is_sorted_by(|a, b| a < b) && taken.len() == own.len() + above);
                assert_eq!(climber.members().iter().filter(|is| **is).count(), 8);
                above
            };
            assert_eq!([CUT_M, 2.5, 3.0, 10.0].map(&mut taken), [1, 2, 3, 4]);
            let top_m = |enough_m| climber.top_m(&own, enough_m, scene.heights_m);
            assert!((4.2..4.5).contains(&top_m(10.0)), "{}", top_m(10.0));
            assert!(top_m(1.0) > 1.0);
        });
    }
}
