//! Fewer returns of what shows many: near the sensor columns are closer together than it takes to know
//! where something ends, and what stands upright shows the same place once a layer.

use super::Scene;
use super::parts::{CUT_M, LOW_M};
use crate::cloud::Scan;
use crate::float::least;

/// Thins the returns of clusters column by column, and within each column. Its buffers are made once.
#[derive(Debug, Clone, Default)]
pub(super) struct Thinning {
    /// Ranges below which one column of two is kept, and one of four.
    below_m: [f32; 2],
    /// Those of the cluster that is thinned.
    columns: Vec<Column>,
    kept: Vec<u32>,
}

/// What a column shows of a cluster.
#[derive(Debug, Clone, Copy)]
struct Column {
    number: usize,
    /// Where its points stand among those of the cluster.
    begin: usize,
    end: usize,
    /// Least of their ranges: rays pass through panes here and there, but not through all of a body.
    nearest_m: f32,
    /// The layer of the highest one: what stands behind something nearer is higher, or is not seen.
    top: usize,
}

/// Clusters of fewer returns are kept whole: people, and what is far away.
const MANY: usize = 128;
/// How far the columns that are kept are apart at most, across the line of sight: two columns at least
/// show what is as narrow as a head.
const APART_M: f64 = 0.12;
/// A difference of ranges from which on two returns of a column, one above the other, or the nearest
/// ones of two columns are kept: there something ends, or leads away from the sensor.
const JUMP_M: f32 = 0.1;
/// How much nearer or farther than the last column that was kept the next one is kept for that. With
/// the columns between them and a step from the last of these it is less than a cell of which parts
/// consist, so that a surface stays one.
const SLOPE_M: f32 = 0.05;

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
    fn columns_at(&self, range_m: f32) -> usize {
        let halvings = self.below_m.iter().filter(|below_m| range_m < **below_m);
        1 << halvings.count()
    }

    /// The points of a cluster that are kept, in the order of the scan, as they are given.
    pub(super) fn thin<'a>(&'a mut self, points: &'a [u32], scene: &Scene<'_>) -> &'a [u32] {
        if points.len() < MANY {
            return points;
        }
        let (range_m, heights_m) = (scene.scan.range_m(), scene.heights_m);
        self.find_columns(points, scene.scan);
        self.kept.clear();
        let (mut is_begin, mut kept_m) = (true, f32::INFINITY);
        for (place, column) in self.columns.iter().enumerate() {
            let next = self.columns.get(place + 1);
            let is_end = next.is_none_or(|next| !column.is_continued_by(next));
            let leads_away = (column.nearest_m - kept_m).abs() >= SLOPE_M;
            let is_due = column
                .number
                .is_multiple_of(self.columns_at(column.nearest_m));
            if is_begin || is_end || leads_away || is_due {
                let own = &points[column.begin..column.end];
                keep_ends(own, range_m, heights_m, &mut self.kept);
                kept_m = column.nearest_m;
            }
            is_begin = is_end;
        }
        &self.kept
    }

    /// Finds what each column shows of a cluster.
    fn find_columns(&mut self, points: &[u32], scan: &Scan) {
        let number = |point: u32| scan.column(point as usize);
        let ranges_m = scan.range_m();
        self.columns.clear();
        let mut end = 0;
        for own in points.chunk_by(|a, b| number(*a) == number(*b)) {
            let begin = end;
            end += own.len();
            let own_ranges_m = own.iter().map(|point| ranges_m[*point as usize]);
            self.columns.push(Column {
                number: number(own[0]),
                begin,
                end,
                nearest_m: own_ranges_m.fold(f32::INFINITY, least),
                top: scan.layer(own[own.len() - 1] as usize),
            });
        }
    }
}

impl Column {
    /// Whether another one is the next one, and shows the same.
    fn is_continued_by(&self, next: &Self) -> bool {
        let apart_m = (self.nearest_m - next.nearest_m).abs();
        self.number + 1 == next.number && apart_m < JUMP_M && self.top.abs_diff(next.top) <= 1
    }
}

/// Keeps the ends of every stretch of a column that stands upright, be it grass or a body, and all that
/// is above the cut: whether a roof is whose is told from return to return.
fn keep_ends(points: &[u32], range_m: &[f32], heights_m: &[f32], kept: &mut Vec<u32>) {
    let Some((first, others)) = points.split_first() else {
        return;
    };
    let is_continued_by = |below: usize, above: usize| {
        let apart_m = (range_m[above] - range_m[below]).abs();
        let are_grass = [below, above].map(|point| heights_m[point] < LOW_M);
        below + 1 == above
            && apart_m < JUMP_M
            && heights_m[above] <= CUT_M
            && are_grass[0] == are_grass[1]
    };
    let (mut below, mut is_continued_below) = (*first, false);
    for point in others {
        let is_continued = is_continued_by(below as usize, *point as usize);
        if !(is_continued_below && is_continued) {
            kept.push(below);
        }
        (below, is_continued_below) = (*point, is_continued);
    }
    kept.push(below);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::MAX_LAYERS;
    use crate::cloud::tests::scan_of;
    use crate::track::tests::with_scene;

    /// The points that are kept of those that are chosen.
    fn kept_of(scan: &Scan, is_chosen: impl Fn(usize) -> bool) -> Vec<u32> {
        let met = (0..scan.len()).filter(|point| scan.range_m()[*point] > 0.0 && is_chosen(*point));
        let met: Vec<u32> = met.map(|point| point as u32).collect();
        let mut thinning = Thinning::default();
        thinning.begin(scan);
        with_scene(scan, |scene| thinning.thin(&met, scene).to_vec())
    }

    /// The columns that are kept of those that have a return in one layer, given its range.
    fn kept(range_cm: impl Fn(usize) -> u16) -> Vec<u32> {
        let scan = scan_of(1800, |column, layer| {
            u16::from(layer == 7) * range_cm(column)
        });
        columns_of(&kept_of(&scan, |_| true))
    }

    /// The columns of some points.
    fn columns_of(points: &[u32]) -> Vec<u32> {
        let columns = points.iter().map(|point| point / MAX_LAYERS as u32);
        let mut columns: Vec<u32> = columns.collect();
        columns.dedup();
        columns
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
        assert_eq!(away(11).len(), 200);
        assert!(away(4).len() < 200);
        assert!(away(2).len() < 110);
        let before = kept(|column| match column {
            202..=249 => 400,
            101..=299 => 500,
            _ => 0,
        });
        let parts = [101..=201, 202..=249, 250..=299].map(|part| every(4, part));
        assert_eq!(before, parts.concat());
    }

    #[test]
    fn columns_that_stand_alone_are_all_kept() {
        let scan = scan_of(1800, |_, layer| u16::from(layer < 3) * 500);
        let odd = |point: usize| scan.column(point) < 160 && scan.column(point) % 2 == 1;
        let kept = kept_of(&scan, odd);
        assert_eq!(kept.len(), 80 * 2);
    }

    #[test]
    fn what_is_seen_through_panes_leaves_the_body_around_them_whole() {
        // Every third ray of the upper layers passes through to the other side.
        let scan = scan_of(1800, |column, layer| match (column, layer) {
            (100..200, 4..7) => 600,
            (100..200, 7..9) => 600 + 200 * u16::from(column % 3 == 0),
            _ => 0,
        });
        assert_eq!(columns_of(&kept_of(&scan, |_| true)), every(4, 100..=199));
    }

    #[test]
    fn of_what_stands_upright_the_ends_are_kept_and_what_is_beside_a_gap_or_a_cut() {
        // 6 m away and from 1.9 m above the ground layers 0 to 9 pass 0.35, 0.55, 0.75, 0.96, 1.17,
        // 1.38, 1.59, 1.80, 2.00 and 2.21 m above the ground.
        let layers = |is_met: fn(usize) -> bool, farther_cm: fn(usize) -> u16| {
            let scan = scan_of(1800, |column, layer| {
                u16::from(column < 100 && is_met(layer)) * (600 + farther_cm(layer))
            });
            let kept = kept_of(&scan, |_| true);
            let first = kept.iter().filter(|point| **point < MAX_LAYERS as u32);
            first.copied().collect::<Vec<_>>()
        };
        assert_eq!(layers(|layer| layer < 8, |_| 0), [0, 7]);
        assert_eq!(layers(|layer| layer < 12, |_| 0), [0, 8, 9, 10, 11]);
        assert_eq!(layers(|layer| layer < 8 && layer != 4, |_| 0), [0, 3, 5, 7]);
        // A metre farther away layer 0 is 0.09 m above the ground: grass.
        assert_eq!(layers(|layer| layer < 8, |_| 100), [0, 1, 7]);
        let step = |layer| 30 * u16::from(layer > 2);
        assert_eq!(layers(|layer| layer < 8, step), [0, 2, 3, 7]);
    }

    #[test]
    fn what_is_seen_through_low_panes_leaves_the_body_above_them_whole() {
        let scan = scan_of(1800, |column, layer| match (column, layer) {
            (100..200, 4..7) => 600 + 300 * u16::from(column % 3 == 0),
            (100..200, 7..9) => 600,
            _ => 0,
        });
        assert_eq!(columns_of(&kept_of(&scan, |_| true)), every(4, 100..=199));
    }

    #[test]
    fn a_post_behind_something_low_is_kept_with_both_its_ends() {
        let scan = scan_of(1800, |column, layer| match (column, layer) {
            (100..200, 1..3) => 390,
            (105..=110, 6..12) => 420,
            _ => 0,
        });
        let mut of_post = kept_of(&scan, |_| true);
        of_post.retain(|point| scan.layer(*point as usize) > 5);
        assert_eq!(columns_of(&of_post), [105, 108, 110]);
    }

    #[test]
    fn nothing_is_left_of_the_cluster_before() {
        let scan = scan_of(1800, |column, layer| {
            u16::from(column < 200 && layer == 7) * 500
        });
        let points = (0..200).map(|column| scan.index(column, 7) as u32);
        let points: Vec<u32> = points.collect();
        let mut thinning = Thinning::default();
        thinning.begin(&scan);
        with_scene(&scan, |scene| {
            let once = thinning.thin(&points, scene).to_vec();
            assert_eq!(thinning.thin(&points, scene), once);
        });
    }

    #[test]
    fn columns_without_a_step_are_all_kept() {
        let mut thinning = Thinning::default();
        thinning.begin(&Scan::default());
        assert_eq!(thinning.columns_at(1.0), 1);
    }
}
