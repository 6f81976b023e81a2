//! Fewer returns of what shows many: near the sensor columns are closer together than it takes to know
//! where something ends.

use crate::cloud::{MAX_LAYERS, Scan};

/// Thins the returns of clusters column by column. Its buffers are made once.
#[derive(Debug, Clone, Default)]
pub(super) struct Thinning {
    /// Ranges below which one column of two is kept, and one of four.
    below_m: [f32; 2],
    kept: Vec<u32>,
}

/// Clusters of fewer returns are kept whole: people, and what is far away.
const MANY: usize = 128;
/// How far the columns that are kept are apart at most, seen from the sensor.
const APART_M: f64 = 0.12;
/// A difference of ranges from one column to the next from which on both are kept: there something
/// ends, or leads away from the sensor.
const JUMP_M: f32 = 0.1;

impl Thinning {
    /// Prepares for the returns of a scan.
    pub(super) fn begin(&mut self, scan: &Scan) {
        let step_rad = libm::fabs(scan.step_rad());
        self.below_m = [2.0, 4.0].map(|columns| {
            let below_m = APART_M / (columns * step_rad);
            if step_rad > 0.0 { below_m as f32 } else { 0.0 }
        });
    }

    /// Of how many columns one is kept at a range.
    fn columns(&self, range_m: f32) -> u32 {
        let [two, four] = self.below_m.map(|below_m| u32::from(range_m < below_m));
        1 << (two + four)
    }

    /// The points of a cluster that are kept, given the ranges of all points of the scan.
    pub(super) fn thin<'a>(&'a mut self, points: &'a [u32], range_m: &[f32]) -> &'a [u32] {
        if points.len() < MANY {
            return points;
        }
        let mut kept = std::mem::take(&mut self.kept);
        kept.clear();
        let column = |point: &u32| point / MAX_LAYERS as u32;
        for own in points.chunk_by(|a, b| column(a) == column(b)) {
            let point = own[own.len() / 2] as usize;
            let columns = self.columns(range_m[point]);
            if column(&own[0]).is_multiple_of(columns) || jumps(point, range_m) {
                kept.extend_from_slice(own);
            }
        }
        self.kept = kept;
        // Of what was met in every second column only, by accident or by intent, all may be left out.
        if self.kept.is_empty() {
            points
        } else {
            &self.kept
        }
    }
}

/// Whether the next column on either side shows something else beside a point.
fn jumps(point: usize, range_m: &[f32]) -> bool {
    let is_beside = |other: Option<usize>| {
        let beside_m = other.and_then(|other| range_m.get(other));
        beside_m.is_some_and(|beside_m| (beside_m - range_m[point]).abs() < JUMP_M)
    };
    let (before, after) = (point.checked_sub(MAX_LAYERS), point + MAX_LAYERS);
    !is_beside(before) || !is_beside(Some(after))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;

    /// The columns that are kept of those that have a return in one layer, given its range.
    fn kept(range_cm: impl Fn(usize) -> u16) -> Vec<u32> {
        let scan = scan_of(1800, |column, layer| {
            u16::from(layer == 7) * range_cm(column)
        });
        let points = (0..1800).map(|column| scan.index(column, 7));
        let met = points.filter(|point| scan.range_m()[*point] > 0.0);
        let met: Vec<u32> = met.map(|point| point as u32).collect();
        let mut thinning = Thinning::default();
        thinning.begin(&scan);
        let kept = thinning.thin(&met, scan.range_m());
        kept.iter().map(|point| point / MAX_LAYERS as u32).collect()
    }

    /// Some columns with their ends.
    fn every(columns: u32, of: std::ops::RangeInclusive<u32>) -> Vec<u32> {
        let is_end = |column: &u32| column == of.start() || column == of.end();
        let kept = of
            .clone()
            .filter(|column| column % columns == 0 || is_end(column));
        kept.collect()
    }

    #[test]
    fn columns_are_kept_that_are_no_farther_apart_than_twelve_centimetres_and_both_ends() {
        for (range_m, columns) in [(1, 4), (8, 4), (9, 2), (17, 2), (18, 1)] {
            let kept = kept(|column| u16::from((101..300).contains(&column)) * 100 * range_m);
            assert_eq!(kept, every(columns, 101..=299), "{range_m} m");
            assert!(f64::from(columns) * f64::from(range_m) * 0.2_f64.to_radians() < APART_M);
        }
    }

    #[test]
    fn what_shows_few_returns_is_kept_whole() {
        let kept = |count| kept(|column| u16::from(column < count) * 200).len();
        assert_eq!((kept(MANY - 1), kept(MANY)), (MANY - 1, MANY / 4 + 1));
    }

    #[test]
    fn what_leads_away_is_kept_whole_and_so_is_the_edge_of_what_stands_before_something() {
        let away =
            |step_cm| kept(|column| u16::from(column < 200) * (500 + step_cm * column as u16));
        assert_eq!(away(15).len(), 200);
        assert!(away(5).len() < 110);
        let before = kept(|column| match column {
            202..=249 => 400,
            101..=299 => 500,
            _ => 0,
        });
        let parts = [101..=201, 202..=249, 250..=299].map(|part| every(4, part));
        assert_eq!(before, parts.concat());
    }

    #[test]
    fn something_is_kept_of_what_the_columns_in_between_do_not_show() {
        let scan = scan_of(1800, |_, _| 500);
        let odd = (1..21).step_by(2);
        let points = odd.flat_map(|column| scan.points_of(&(column..column + 1)));
        let points: Vec<u32> = points.map(|point| point as u32).collect();
        let mut thinning = Thinning::default();
        thinning.begin(&scan);
        assert_eq!(thinning.thin(&points, scan.range_m()), points);
    }

    #[test]
    fn columns_without_a_step_are_all_kept() {
        let mut thinning = Thinning::default();
        thinning.begin(&Scan::default());
        assert_eq!(thinning.columns(1.0), 1);
    }
}
