//! A revolution cut like a pie.

use std::f64::consts::TAU;
use std::ops::Range;

use crate::cloud::Scan;

/// The slices of a revolution, of which so many are a whole turn, in the order in which it comes
/// through them: the number of each, which counts clockwise from forward, and its columns. Where
/// the sweep begins within a slice, or overlaps itself, that slice comes twice.
pub(super) fn slices(scan: &Scan, count: usize) -> impl Iterator<Item = (usize, Range<usize>)> {
    // A whole slice has so many columns at least; the others are tried one by one.
    let width_rad = TAU / count as f64;
    let sure = (width_rad / scan.step_rad().abs()) as usize;
    let sure = sure.saturating_sub(1).max(1);
    let mut first = 0;
    std::iter::from_fn(move || {
        let begin = first;
        if begin == scan.columns() {
            return None;
        }
        let slice = slice_of(scan, begin, count);
        // The first one may be cut off.
        let known = if begin == 0 { 1 } else { sure };
        first = first.saturating_add(known).min(scan.columns());
        while first < scan.columns() && slice_of(scan, first, count) == slice {
            first += 1;
        }
        Some((slice, begin..first))
    })
}

/// The slice of a column by its azimuth, wherever the revolution begins.
fn slice_of(scan: &Scan, column: usize, count: usize) -> usize {
    let turns = scan.azimuth_rad(column) / TAU;
    let part = turns - libm::floor(turns);
    ((part * count as f64) as usize).min(count - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::{scan_from, scan_of};

    #[test]
    fn every_column_is_in_its_slice_and_slices_are_whole() {
        for (columns, count) in [
            (1812, 72),
            (2000, 36),
            (360, 360),
            (100, 360),
            (1, 6),
            (0, 6),
        ] {
            assert_slices_are_whole(&scan_of(columns, |_, _| 0), count);
        }
        // From the end of a slice on, the other way round, and more than once around.
        for (start_deg, step_deg, columns) in
            [(4.0, 0.2, 1800), (3.0, -0.2, 1800), (1.0, 0.2, 1990)]
        {
            assert_slices_are_whole(&scan_from(start_deg, step_deg, columns, |_, _| 0), 72);
        }
    }

    fn assert_slices_are_whole(scan: &Scan, count: usize) {
        let mut next = 0;
        let mut last = None;
        for (slice, stretch) in slices(scan, count) {
            assert_eq!(stretch.start, next);
            assert!(!stretch.is_empty() && last != Some(slice));
            for column in stretch.clone() {
                let columns = scan.columns();
                assert_eq!(
                    slice_of(scan, column, count),
                    slice,
                    "{columns} {count} {column}"
                );
            }
            (next, last) = (stretch.end, Some(slice));
        }
        assert_eq!(next, scan.columns());
    }
}
