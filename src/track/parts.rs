//! Divides a cluster into parts: what touches, seen from above, is one body, up to the height at
//! which trees and roofs are cut off.
//!
//! Returns that follow each other lie mostly in one cell of the floor, and at one level: what can be
//! said of all of them is said once, of the `Step` that they are.

use std::ops::Range;

use multiversion::multiversion;

use super::above::is_same;
use super::floor::Floor;
use super::placing::{Bounds, Placed, Placing};
use crate::cloud::MAX_LAYERS;
use crate::float::{bounds_of, greatest};

/// The parts of one cluster. Its buffers are made once.
#[derive(Debug, Clone, Default)]
pub(super) struct Parts {
    floor: Floor,
    /// Where on it each return lies, and in the last bits how high.
    keys: Vec<u32>,
    /// Where the steps begin, and where the last one ends.
    begins: Vec<u32>,
    /// Whether there is more above each cell, by [`Floor::number`]: the first one is that of all
    /// that lies in no cell.
    covered: Vec<bool>,
    /// That of what belongs to none, and all others.
    parts: Vec<Part>,
    /// In the order of the scan, and part by part.
    pieces: Vec<Piece>,
    sorted: Vec<Piece>,
}

/// Returns that follow each other in one cell and at one level.
#[derive(Debug, Clone, Copy)]
struct Step {
    /// The place of the cell.
    place: u32,
    level: u32,
    begin: u32,
    end: u32,
}

/// Returns that follow each other in one part.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Piece {
    part: u32,
    begin: u32,
    end: u32,
}

impl Piece {
    /// Where they stand among those of the cluster.
    pub(super) fn stretch(&self) -> Range<usize> {
        self.begin as usize..self.end as usize
    }
}

/// Cells that touch.
#[derive(Debug, Clone, Copy)]
struct Part {
    /// Cells, and those above which there is more.
    cells: u32,
    covered: u32,
    /// Whether what is above the cut belongs to it, too.
    has_upper: bool,
    /// Where its pieces begin among the sorted ones, and later where they end.
    place: usize,
}

impl Part {
    /// That of nothing.
    const EMPTY: Self = Self {
        cells: 0,
        covered: 0,
        has_upper: false,
        place: 0,
    };

    /// Whether what is at a level belongs to it.
    #[inline(always)]
    fn holds(&self, level: u32) -> bool {
        self.has_upper || !is_upper(level)
    }

    /// Whether it is a wall or a trunk.
    fn goes_on(&self) -> bool {
        f64::from(self.covered) >= GOES_ON * f64::from(self.cells)
    }
}

/// How large the cells are of which a part consists.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cells {
    /// Their side near the sensor.
    pub(super) near_m: f32,
    /// What is added to it for each metre of range beyond that.
    pub(super) per_m: f32,
}

impl Cells {
    /// Those of bodies: surfaces of one are closer to each other, seen from above, and people are
    /// farther from the hedge that they pass.
    pub(super) const OF_BODIES: Self = Self {
        near_m: 0.3,
        per_m: 0.012,
    };

    /// Their side, of a cluster so far away.
    fn side_m(&self, range_m: f32) -> f32 {
        self.near_m + self.per_m * greatest(range_m - NEAR_M, 0.0)
    }
}

/// The part of what belongs to none.
const NO_PART: u32 = 0;
/// Nearer, rays are closer together than cells.
const NEAR_M: f32 = 12.0;
/// What is higher is cut off what may stand below it: crowns of trees, roofs.
pub(super) const CUT_M: f32 = 2.1;
/// What is lower joins no parts: grass, kerbs, and what is left of the ground.
pub(super) const LOW_M: f32 = 0.2;
/// How far up a wall is looked for, at least and for each metre of range: three layers.
const ABOVE_CUT_M: f32 = 0.8;
const ABOVE_CUT_PER_M: f32 = 0.07;
/// Share of a part's cells above which there is more, from which on it is a wall or a trunk.
const GOES_ON: f64 = 0.5;
/// Greatest height of vans: what is above the cut and goes on from below belongs to what is below if
/// the whole cluster is lower.
const VAN_TOP_M: f32 = 3.0;

/// Levels of returns: grass, what may be a road user's, what is close above the cut, and what is
/// higher.
const LOW: u32 = 0;
const BODY: u32 = 1;
const CLOSE: u32 = 2;
const HIGH: u32 = 3;
/// Bits of a key that hold the level; the others hold the place of the cell.
const LEVEL_BITS: u32 = 2;

/// Whether a level is above the cut.
#[inline(always)]
fn is_upper(level: u32) -> bool {
    level >= CLOSE
}

impl Parts {
    /// Divides a cluster in the box `whole`, placed relative to `origin_m`, by cells. What is above
    /// the cut belongs to a part that goes on there, unless all of it is too tall.
    pub(super) fn divide(
        &mut self,
        cluster: &Placing,
        whole: &Bounds,
        cells: Cells,
        is_too_tall: bool,
        origin_m: [f64; 2],
    ) {
        let [nearest_m, _] = bounds_of(cluster.range_m());
        let cell_m = cells.side_m(nearest_m);
        self.floor
            .begin(whole.low_m, whole.high_m, cell_m, origin_m);
        self.floor.find_places(cluster.at_m(), &mut self.keys);
        add_levels(cluster.above_m(), cluster.range_m(), &mut self.keys);
        self.find_begins();
        let steps = steps(&self.keys, &self.begins);
        self.floor
            .add(steps.map(|step| (step.place, step.level == BODY)));
        self.floor.join();
        self.count_cells(is_too_tall);
        self.floor.name_by_parts();
        self.pieces.clear();
        // Of what is lower nothing is above the cut, and what is higher is no van.
        if (CUT_M..VAN_TOP_M).contains(&whole.top_m) {
            self.find_pieces_with_roofs(cluster);
        } else {
            self.find_pieces();
        }
        self.sort_pieces();
    }

    /// Finds where steps begin.
    fn find_begins(&mut self) {
        let count = self.keys.len();
        self.begins.resize(count + 1, 0);
        let (mut steps, mut last) = (0, None);
        for (at, key) in self.keys.iter().enumerate() {
            // Written in any case, and kept if it is one: nobody could foresee the branch.
            self.begins[steps] = at as u32;
            steps += usize::from(Some(*key) != last);
            last = Some(*key);
        }
        self.begins[steps] = count as u32;
        self.begins.truncate(steps + 1);
    }

    /// Counts the cells of every part, and those above which there is more, close to the cut.
    fn count_cells(&mut self, is_too_tall: bool) {
        let cells = self.floor.len();
        self.covered.clear();
        self.covered.resize(1 + cells, false);
        for step in steps(&self.keys, &self.begins) {
            let cell = self.floor.number(step.place) as usize;
            self.covered[cell] |= step.level == CLOSE;
        }
        self.parts.clear();
        self.parts.resize(1 + cells, Part::EMPTY);
        for (part, is_covered) in self.floor.parts().iter().zip(&self.covered[1..]) {
            let part = &mut self.parts[1 + *part as usize];
            part.cells += 1;
            part.covered += u32::from(*is_covered);
        }
        for part in &mut self.parts[1..] {
            part.has_upper = !is_too_tall && part.goes_on();
        }
    }

    /// Finds the pieces of every part.
    fn find_pieces(&mut self) {
        for step in steps(&self.keys, &self.begins) {
            let part = self.floor.number(step.place);
            if part != NO_PART && self.parts[part as usize].holds(step.level) {
                extend(&mut self.pieces, part, step.begin, step.end);
            }
        }
    }

    /// The same, and gives what is above the cut, and goes on from the return below, the part of
    /// that.
    fn find_pieces_with_roofs(&mut self, cluster: &Placing) {
        let (points, range_m) = (cluster.points(), cluster.range_m());
        let mut before = NO_PART;
        for step in steps(&self.keys, &self.begins) {
            let number = self.floor.number(step.place);
            let own = if self.parts[number as usize].holds(step.level) {
                number
            } else {
                NO_PART
            };
            for at in step.begin as usize..step.end as usize {
                let is_roof = own == NO_PART
                    && is_upper(step.level)
                    && at > 0
                    && is_below(points[at - 1], points[at])
                    && is_same(range_m[at - 1], range_m[at]);
                before = if is_roof { before } else { own };
                if before != NO_PART {
                    extend(&mut self.pieces, before, at as u32, at as u32 + 1);
                }
            }
        }
    }

    /// Puts the pieces of every part side by side, each part's in the order of the scan.
    fn sort_pieces(&mut self) {
        for piece in &self.pieces {
            self.parts[piece.part as usize].place += 1;
        }
        let mut next = 0;
        for part in &mut self.parts {
            next += std::mem::replace(&mut part.place, next);
        }
        self.sorted.resize(self.pieces.len(), Piece::default());
        for piece in &self.pieces {
            let place = &mut self.parts[piece.part as usize].place;
            self.sorted[*place] = *piece;
            *place += 1;
        }
    }

    /// Adds the returns of every part to those that were placed, and says where they begin, which
    /// box holds them, and whether it is a wall or a trunk.
    pub(super) fn put(
        &self,
        cluster: &Placing,
        placed: &mut Vec<Placed>,
        mut has_put: impl FnMut(Range<usize>, Bounds, bool),
    ) {
        for pieces in self.pieces() {
            let (begin, mut bounds) = (placed.len(), Bounds::NOTHING);
            for piece in pieces {
                let own = cluster.stretch(piece.stretch());
                placed.extend(own.inspect(|own| bounds.extend(own)));
            }
            let part = &self.parts[pieces[0].part as usize];
            has_put(begin..placed.len(), bounds, part.goes_on());
        }
    }

    /// The pieces of every part, part by part.
    pub(super) fn pieces(&self) -> impl Iterator<Item = &[Piece]> {
        self.sorted.chunk_by(|a, b| a.part == b.part)
    }
}

/// All returns, step by step, given their keys and where steps begin.
fn steps(keys: &[u32], begins: &[u32]) -> impl ExactSizeIterator<Item = Step> {
    begins.windows(2).map(|ends| {
        let key = keys[ends[0] as usize];
        Step {
            place: key >> LEVEL_BITS,
            level: key % (1 << LEVEL_BITS),
            begin: ends[0],
            end: ends[1],
        }
    })
}

/// Adds returns to the last piece, if they follow it, or else a piece.
#[inline(always)]
fn extend(pieces: &mut Vec<Piece>, part: u32, begin: u32, end: u32) {
    if let Some(last) = pieces.last_mut()
        && last.part == part
        && last.end == begin
    {
        last.end = end;
    } else {
        pieces.push(Piece { part, begin, end });
    }
}

/// Whether a point is the next one below another in its column.
fn is_below(below: u32, point: u32) -> bool {
    !point.is_multiple_of(MAX_LAYERS as u32) && below + 1 == point
}

/// Makes keys of the places of returns on the floor, given their heights above the ground and their
/// ranges.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn add_levels(above_m: &[f32], range_m: &[f32], keys: &mut [u32]) {
    let (above_m, range_m) = (&above_m[..keys.len()], &range_m[..keys.len()]);
    for at in 0..keys.len() {
        let above_m = above_m[at];
        let most_m = CUT_M + greatest(ABOVE_CUT_M, ABOVE_CUT_PER_M * range_m[at]);
        let lower = if above_m < LOW_M { LOW } else { BODY };
        let upper = if above_m < most_m { CLOSE } else { HIGH };
        let level = if above_m <= CUT_M { lower } else { upper };
        keys[at] = keys[at] << LEVEL_BITS | level;
    }
}
