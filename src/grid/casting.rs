//! Draws the ways of a revolution's rays into the window.

use std::ops::Range;

use super::stretches::Stretch;
use super::window::{Window, cell_of};
use crate::cloud::Scan;
use crate::ego::Placement;

/// What rays passed, as areas.
///
/// A beam is about as wide as the step from column to column (VLP-16 user manual: 3 mrad), so
/// that the beams of a revolution lie side by side, and what they passed is an area with an
/// outline. Only the outline is walked along: across the columns where a stretch begins or ends,
/// and between two columns where one's stretches are not the other's.
#[derive(Debug, Clone, Default)]
pub(super) struct Casting {
    /// The first column that is looked at.
    first: usize,
    /// Between the columns, and on either side of all.
    borders: Vec<Border>,
    ends_m: Vec<f32>,
}

/// The line from the sensor between two columns, in cells from the window's corner.
#[derive(Debug, Clone, Copy)]
struct Border {
    origin: [f64; 2],
    per_metre: [f64; 2],
}

/// A step between columns that is wider is no beam's.
const WIDEST_RAD: f64 = 0.1;

impl Border {
    fn at(&self, metres: f32) -> [f64; 2] {
        let metres = f64::from(metres);
        [0, 1].map(|axis| self.origin[axis] + metres * self.per_metre[axis])
    }
}

/// Where the first stretch of a column ends at one of its borders.
#[derive(Debug, Clone, Copy)]
struct Corner {
    at: [f64; 2],
    cell: [i64; 2],
}

impl Corner {
    fn at(at: [f64; 2]) -> Self {
        Self {
            at,
            cell: at.map(cell_of),
        }
    }
}

/// Goes on with the outline from one corner to the next. Within a cell there is nothing to do: the
/// line that came to it has passed it.
fn connect(from: Corner, to: Corner, window: &mut Window) {
    // What is below the window by less than a place is exact lies in its lowest row, too.
    let is_below = [from, to].map(|corner| corner.at[1] < 0.0);
    if from.cell != to.cell || is_below[0] != is_below[1] {
        window.outline(from.at, to.at);
    }
}

impl Casting {
    /// Marks the cells that rays passed on these stretches. They come by column, of which none is left
    /// out; each column's first begins at the sensor, and the others do not meet it or each other.
    pub(super) fn cast(
        &mut self,
        stretches: &[Stretch],
        scan: &Scan,
        placements: &[Placement],
        cell_m: f64,
        window: &mut Window,
    ) {
        let [Some(first), Some(last)] = [stretches.first(), stretches.last()] else {
            return;
        };
        if libm::fabs(scan.step_rad()) > WIDEST_RAD {
            return;
        }
        let columns = first.column..last.column + 1;
        self.lay_out(columns, scan, placements, cell_m, window.corner());
        // The area of a half turn does not overlap itself, however the sensor moves meanwhile.
        let half = stretches.partition_point(|stretch| stretch.column < scan.columns() / 2);
        let (first, second) = stretches.split_at(half);
        for half in [first, second] {
            let [Some(first), Some(last)] = [half.first(), half.last()] else {
                continue;
            };
            let ends = [first.column, last.column + 1];
            let (mut before, mut reached): (&[Stretch], _) = (&[], None);
            for now in half.chunk_by(|a, b| a.column == b.column) {
                let column = now[0].column;
                let [left, right] = [column, column + 1]
                    .map(|border| Corner::at(self.border(border).at(now[0].to_m)));
                match reached {
                    Some(reached) if before.len() == 1 && now.len() == 1 => {
                        connect(reached, left, window);
                    }
                    _ => self.outline_between(column, before, now, window),
                }
                connect(left, right, window);
                self.outline_across(column, &now[1..], window);
                (before, reached) = (now, Some(right));
            }
            self.outline_between(ends[1], before, &[], window);
            let [begin, end] = ends.map(|border| self.border(border).origin);
            window.outline(begin, end);
            window.pass_outlined();
        }
    }

    fn lay_out(
        &mut self,
        columns: Range<usize>,
        scan: &Scan,
        placements: &[Placement],
        cell_m: f64,
        corner: [f64; 2],
    ) {
        // A chord between two such lines meets the ray between them where it ends.
        let aside = libm::tan(0.5 * scan.step_rad());
        let per_cell = 1.0 / cell_m;
        let border = |column: usize, aside: f64| {
            let [right, ahead] = scan.direction(column).map(f64::from);
            let (right, ahead) = (right + aside * ahead, ahead - aside * right);
            let origin_m = placements[column].origin_m();
            let ahead_m = placements[column].local_m([right, ahead]);
            Border {
                origin: [0, 1].map(|axis| origin_m[axis] * per_cell - corner[axis]),
                per_metre: [0, 1].map(|axis| (ahead_m[axis] - origin_m[axis]) * per_cell),
            }
        };
        self.first = columns.start;
        self.borders.clear();
        self.borders
            .extend(columns.clone().map(|column| border(column, -aside)));
        self.borders
            .extend(columns.last().map(|last| border(last, aside)));
    }

    /// That before a column.
    fn border(&self, column: usize) -> Border {
        self.borders[column - self.first]
    }

    /// Where a column's stretches but the first begin, and where they end.
    fn outline_across(&self, column: usize, stretches: &[Stretch], window: &mut Window) {
        let [left, right] = [0, 1].map(|side| self.border(column + side));
        for stretch in stretches {
            for metres in [stretch.from_m, stretch.to_m] {
                window.outline(left.at(metres), right.at(metres));
            }
        }
    }

    /// What is passed on one side of a border and not on the other. That is where an odd number
    /// of the ends on both sides lies before.
    fn outline_between(
        &mut self,
        border: usize,
        left: &[Stretch],
        right: &[Stretch],
        window: &mut Window,
    ) {
        let line = self.border(border);
        self.ends_m.clear();
        for stretch in left.iter().chain(right) {
            self.ends_m.extend([stretch.from_m, stretch.to_m]);
        }
        self.ends_m.sort_unstable_by(f32::total_cmp);
        for ends_m in self.ends_m.as_chunks::<2>().0 {
            window.outline(line.at(ends_m[0]), line.at(ends_m[1]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::ego::Pose;
    use crate::random::Random;

    const CELL_M: f64 = 0.1;
    const COLUMNS: usize = 1810;

    fn is_passed(window: &Window, [x, y]: [f64; 2]) -> bool {
        let (x, y) = (x as usize, y as usize);
        window.free(x / 64, y / 64, y % 64) >> (x % 64) & 1 == 1
    }

    /// Every column's stretches: the farthest at 25 m, many gaps where `gaps` is 1.
    fn stretches(random: &mut Random, gaps: f64) -> Vec<Stretch> {
        let mut stretches = vec![];
        for column in 0..COLUMNS {
            let (mut from_m, mut to_m) = (0.0, 25.0);
            if (300..500).contains(&column) {
                to_m = 7.3;
            }
            while random.uniform() < gaps * 0.6 && from_m < 24.0 {
                let end_m = from_m + 5.0 * random.uniform() as f32;
                stretches.push(Stretch {
                    column,
                    from_m,
                    to_m: end_m,
                });
                from_m = end_m + 3.0 * random.uniform() as f32;
            }
            if from_m == 0.0 || from_m < to_m {
                stretches.push(Stretch {
                    column,
                    from_m,
                    to_m,
                });
            }
        }
        stretches
    }

    #[test]
    fn every_cell_on_a_ray_is_marked_and_none_beside_its_beam() {
        let scan = scan_of(COLUMNS, |_, _| 100);
        let mut random = Random::new(4);
        for (gaps, moved_m) in [(0.0, 0.0), (0.0, 1.5), (0.1, 0.0), (1.0, 1.5)] {
            let stretches = stretches(&mut random, gaps);
            let at_share = |share: f64| Pose {
                position_m: [share * moved_m, 0.3 * share * moved_m, 0.0],
                yaw_rad: 0.05 * share * moved_m,
            };
            let placements: Vec<_> = (0..COLUMNS)
                .map(|column| at_share(column as f64 / COLUMNS as f64).placement())
                .collect();
            let mut window = Window::new(10);
            window.begin([-5, -5]);
            Casting::default().cast(&stretches, &scan, &placements, CELL_M, &mut window);
            let corner = window.corner();
            let cells = 10 * 64;
            let mut near = vec![false; cells * cells];
            for stretch in &stretches {
                let [right, ahead] = scan.direction(stretch.column).map(f64::from);
                // While a column is measured, the sensor moves by less than a millimetre.
                let (from_m, to_m) = (f64::from(stretch.from_m), f64::from(stretch.to_m) - 1e-3);
                let steps = ((to_m - from_m) / 0.01) as usize;
                for step in 0..=steps {
                    let metres = from_m + (to_m - from_m) * step as f64 / steps.max(1) as f64;
                    let at_m = placements[stretch.column].local_m([metres * right, metres * ahead]);
                    let at = [0, 1].map(|axis| at_m[axis] / CELL_M - corner[axis]);
                    assert!(
                        is_passed(&window, at),
                        "{stretch:?} {metres} {gaps} {moved_m}"
                    );
                    let [x, y] = at.map(|at| at as usize);
                    for (x, y) in (y - 2..=y + 2).flat_map(|y| (x - 2..=x + 2).map(move |x| (x, y)))
                    {
                        near[y * cells + x] = true;
                    }
                }
            }
            for (cell, near) in near.into_iter().enumerate() {
                let at = [cell % cells, cell / cells].map(|at| at as f64 + 0.5);
                assert!(near || !is_passed(&window, at), "{at:?} {gaps} {moved_m}");
            }
        }
    }
}
