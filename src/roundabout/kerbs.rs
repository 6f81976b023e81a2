//! Where the road of a roundabout ends that no map knows: the ground steps up there, as at an island or a kerb.
//!
//! Numbers were set by reasoning, and tried with `scripts/evaluate-roundabouts --seeds 1-9`.

use std::f64::consts::TAU;
use std::ops::Range;

use super::sight::Sight;
use crate::roadmap::Edges;

/// Rings of ground are so wide.
const BIN_M: f64 = 0.25;
/// And parted into so many pieces, as roads fall and rise round a middle.
const SECTORS: usize = 24;
/// Kerbs are looked for so far from where the innermost and the outermost driver goes, and not nearer.
const REACH_M: f64 = 6.5;
const LEAST_M: f64 = 0.9;
/// What is compared to either side of a kerb: two rings of ground. Roads that fall outward by 3 % so differ by 1.5 cm.
const SIDE: usize = 2;
/// Pieces that much higher than the road before them are behind a kerb; so many must be, and so high a step in the mean of
/// all: where arms meet the circle there is none.
const KERB_M: f64 = 0.05;
const LEAST_PIECES: usize = 2;
const STEP_M: f64 = 0.03;
/// Returns that say how high a piece is.
const LEAST_RETURNS: f64 = 4.0;

/// Heights of the ground around a middle.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Kerbs {
    centre_m: [f64; 2],
    /// Radii of the ways of the innermost and the outermost driver.
    driven_m: [f64; 2],
    /// From the middle outward, piece by piece.
    bins: Vec<[Heights; SECTORS]>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Heights {
    returns: f64,
    sum_m: f64,
}

impl Heights {
    fn plus(self, other: Self) -> Self {
        Self {
            returns: self.returns + other.returns,
            sum_m: self.sum_m + other.sum_m,
        }
    }

    fn mean_m(self) -> Option<f64> {
        (self.returns >= LEAST_RETURNS).then(|| self.sum_m / self.returns)
    }
}

impl Kerbs {
    /// Around a middle.
    pub(super) fn around(centre_m: [f64; 2]) -> Self {
        Self {
            centre_m,
            driven_m: [0.0; 2],
            bins: vec![],
        }
    }

    /// Whether it is around a middle.
    pub(super) fn is_at(&self, centre_m: [f64; 2]) -> bool {
        let mut off_m = self.centre_m.iter().zip(&centre_m).map(|(a, b)| a - b);
        off_m.all(|off_m| off_m.abs() < BIN_M)
    }

    /// Radii within which one drives.
    pub(super) fn note_driven(&mut self, driven_m: [f64; 2]) {
        self.driven_m = driven_m;
        let count = ((driven_m[1] + REACH_M) / BIN_M) as usize + 2 * SIDE;
        self.bins.resize(count, [Heights::default(); SECTORS]);
    }

    /// Takes in a revolution's ground.
    pub(super) fn take(&mut self, sight: &Sight<'_>) {
        for (at_m, height_m) in sight.ground_m() {
            self.note(at_m, height_m);
        }
    }

    fn note(&mut self, [x, y]: [f64; 2], height_m: f64) {
        let [x, y] = [x - self.centre_m[0], y - self.centre_m[1]];
        let bin = (libm::hypot(x, y) / BIN_M) as usize;
        if let Some(bin) = self.bins.get_mut(bin) {
            let turns = libm::atan2(y, x) / TAU + 0.5;
            let heights = &mut bin[((turns * SECTORS as f64) as usize).min(SECTORS - 1)];
            heights.returns += 1.0;
            heights.sum_m += height_m;
        }
    }

    /// Radii of the road's inner and outer edge, as far as they are seen.
    pub(super) fn edges(&self) -> Edges {
        let bin = |radius_m: f64| (radius_m / BIN_M).max(0.0) as usize;
        let [inner_m, outer_m] = self.driven_m;
        let road = bin(inner_m - LEAST_M)..bin(outer_m + LEAST_M);
        let levels_m = self.levels_m(road.clone());
        let inward = bin(inner_m - REACH_M).max(SIDE)..road.start;
        let outward = road.end..bin(outer_m + REACH_M);
        let highest = |steps: &mut dyn Iterator<Item = (usize, f64)>| {
            let highest = steps.max_by(|a, b| a.1.total_cmp(&b.1));
            highest.map(|(edge, _)| edge as f64 * BIN_M)
        };
        let step_m = |behind, before| self.step_m(behind, before, &levels_m);
        Edges {
            inner_m: highest(
                &mut inward
                    .filter_map(|edge| Some((edge, step_m(edge - SIDE..edge, edge..edge + SIDE)?))),
            ),
            outer_m: highest(
                &mut outward
                    .filter_map(|edge| Some((edge, step_m(edge..edge + SIDE, edge - SIDE..edge)?))),
            ),
        }
    }

    /// How high the road is in each piece and those beside it; where it is not seen, as in the mean of all.
    fn levels_m(&self, road: Range<usize>) -> [f64; SECTORS] {
        let of = |sector: usize| self.heights(road.clone(), sector);
        let all = (0..SECTORS).map(of).fold(Heights::default(), Heights::plus);
        std::array::from_fn(|sector| {
            let beside = [SECTORS - 1, 0, 1].map(|step| of((sector + step) % SECTORS));
            let near = beside.into_iter().fold(Heights::default(), Heights::plus);
            near.mean_m().or(all.mean_m()).unwrap_or(0.0)
        })
    }

    fn heights(&self, rings: Range<usize>, sector: usize) -> Heights {
        let rings = self.bins.get(rings).unwrap_or_default().iter();
        let heights = rings.map(|ring| ring[sector]);
        heights.fold(Heights::default(), Heights::plus)
    }

    /// By how much the ground is higher behind an edge than before it, in the mean of the pieces seen, if it is as at a kerb.
    fn step_m(
        &self,
        behind: Range<usize>,
        before: Range<usize>,
        levels_m: &[f64; SECTORS],
    ) -> Option<f64> {
        let above_m = |rings: Range<usize>| -> Vec<f64> {
            let pieces = levels_m.iter().enumerate().filter_map(|(sector, level_m)| {
                Some(self.heights(rings.clone(), sector).mean_m()? - level_m)
            });
            pieces.collect()
        };
        let (behind_m, before_m) = (above_m(behind), above_m(before));
        let mean_m = |pieces: &[f64]| pieces.iter().sum::<f64>() / pieces.len().max(1) as f64;
        let high = behind_m.iter().filter(|height_m| **height_m >= KERB_M);
        let step_m = mean_m(&behind_m) - mean_m(&before_m);
        let is_kerb = high.count() >= LEAST_PIECES && !before_m.is_empty() && step_m >= STEP_M;
        is_kerb.then_some(step_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CENTRE_M: [f64; 2] = [5.0, -3.0];

    /// What is seen of ground that is so high at a distance and a direction from the middle, if one drives 11 m from it.
    fn seen(height_m: impl Fn(f64, f64) -> f64) -> Edges {
        let mut kerbs = Kerbs::around(CENTRE_M);
        kerbs.note_driven([11.0, 11.0]);
        for ring in 0..200 {
            for step in 0..360 {
                let (away_m, angle_rad) = (0.1 * f64::from(ring), f64::from(step).to_radians());
                let (sine, cosine) = libm::sincos(angle_rad);
                let at_m = [CENTRE_M[0] + away_m * cosine, CENTRE_M[1] + away_m * sine];
                kerbs.note(at_m, height_m(away_m, angle_rad));
            }
        }
        kerbs.edges()
    }

    fn is_at(found_m: Option<f64>, due_m: f64) -> bool {
        found_m.is_some_and(|found_m| (found_m - due_m).abs() <= BIN_M)
    }

    #[test]
    fn a_road_ends_where_the_ground_steps_up() {
        let found = seen(|away_m, angle_rad| {
            // Arms meet the circle in four places.
            let is_open = libm::cos(4.0 * angle_rad) > 0.0;
            let is_kerb = away_m < 7.0 || ((15.0..15.4).contains(&away_m) && !is_open);
            if is_kerb { 0.12 } else { 0.0 }
        });
        assert!(
            is_at(found.inner_m, 7.0) && is_at(found.outer_m, 15.0),
            "{found:?}"
        );
    }

    #[test]
    fn a_road_that_falls_outward_ends_nowhere() {
        assert_eq!(seen(|away_m, _| -0.03 * away_m), Edges::default());
    }

    #[test]
    fn a_slope_across_the_whole_is_none() {
        let found = seen(|away_m, angle_rad| 0.04 * away_m * libm::cos(angle_rad));
        assert_eq!(found, Edges::default());
    }
}
