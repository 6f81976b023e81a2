//! People and riders so close together that they are one part of a cluster.
//!
//! The cells that keep a vehicle in one part join those who walk or ride side by side or one behind
//! another. Smaller cells part them, and tear vehicles. So a part is divided by those where that shows
//! people and riders and hardly anything else.

use super::parts::{Cells, Parts};
use super::placing::{Bounds, Placed, Placing};
use crate::cloud::Scan;

/// Parts crowds. Its buffers are made once.
#[derive(Debug, Clone, Default)]
pub(super) struct Crowds {
    placing: Placing,
    parts: Parts,
    /// For every return whether it is of a piece.
    is_taken: Vec<bool>,
    sorted: Vec<Placed>,
}

/// Cells of people. They and the shares and sizes below were chosen by hand on seeds 1 to 12 of the
/// scenario `groups`, and on the recordings of a street with riders, of a yard and of people indoors. With
/// whole parts instead 52 instead of 63 % of the people who walk in groups are listed
/// (`scripts/evaluate --seeds 13-16 --duration 15 --scenarios groups`).
const CELLS: Cells = Cells {
    near_m: 0.14,
    per_m: 0.006,
};
/// What is smaller from corner to corner is one person at most.
const SMALLEST_M: f64 = 0.8;
/// From corner to corner the largest is a bicycle with its rider, askew.
const LONGEST_M: f64 = 2.2;
/// Tops and lower ends of what is seen of people, at least and at most.
const LEAST_TOP_M: f32 = 1.1;
const HIGHEST_FLOOR_M: f32 = 0.9;
/// Fewer returns are nobody.
const FEWEST: usize = 3;
/// Share of the returns that people and riders have to account for.
const LEAST_SHARE: f64 = 0.6;
/// Whoever is the only one among other things is narrower than any vehicle's rear.
const NARROW_M: f64 = 1.2;

impl Crowds {
    /// Sorts the returns of a patch piece by piece if they are a crowd, what is of no piece last. Gives
    /// where each piece ends; none where there is nothing to part.
    pub(super) fn part(
        &mut self,
        placed: &mut [Placed],
        bounds: &Bounds,
        scan: &Scan,
        origin_m: [f64; 2],
        ends: &mut Vec<usize>,
    ) {
        ends.clear();
        if bounds.diagonal_m() < SMALLEST_M || bounds.top_m < LEAST_TOP_M {
            return;
        }
        self.placing.take(placed, scan);
        self.parts
            .divide(&self.placing, bounds, CELLS, false, origin_m);
        self.sorted.clear();
        self.is_taken.clear();
        self.is_taken.resize(placed.len(), false);
        let (mut people, mut returns, mut is_narrow) = (0, 0, true);
        for pieces in self.parts.pieces() {
            let begin = self.sorted.len();
            for stretch in pieces.iter().map(|piece| piece.stretch()) {
                self.is_taken[stretch.clone()].fill(true);
                self.sorted.extend_from_slice(&placed[stretch]);
            }
            ends.push(self.sorted.len());
            let own = &self.sorted[begin..];
            if is_somebody(own) {
                people += 1;
                returns += own.len();
                is_narrow &= across_m(own, scan) < NARROW_M;
            }
        }
        let is_crowd = people > 1 || (people == 1 && is_narrow);
        if !is_crowd || (returns as f64) < LEAST_SHARE * placed.len() as f64 {
            ends.clear();
            return;
        }
        let rest = placed.iter().zip(&self.is_taken);
        let rest = rest.filter(|(_, is_taken)| !**is_taken);
        self.sorted.extend(rest.map(|(own, _)| *own));
        if self.sorted.len() > ends[ends.len() - 1] {
            ends.push(self.sorted.len());
        }
        placed.copy_from_slice(&self.sorted);
    }
}

/// Whether returns may be all of a person, or of a bicycle with its rider.
fn is_somebody(own: &[Placed]) -> bool {
    let bounds = Bounds::of(own);
    own.len() >= FEWEST
        && bounds.diagonal_m() < LONGEST_M
        && bounds.top_m > LEAST_TOP_M
        && bounds.floor_m < HIGHEST_FLOOR_M
}

/// How wide returns are across the line of sight. They must be some, in the order of the scan.
fn across_m(own: &[Placed], scan: &Scan) -> f64 {
    let [first, last] = [0, own.len() - 1].map(|place| own[place].point as usize);
    let columns = scan.column(last).abs_diff(scan.column(first));
    columns as f64 * scan.step_rad().abs() * f64::from(scan.range_m()[first])
}
