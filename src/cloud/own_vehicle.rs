//! What of the own vehicle the sensor sees: its roof, its bonnet, what is mounted beside the sensor.
//!
//! It keeps its place in the sensor frame while the world passes, and ends near the sensor: a wall or a guard rail may
//! keep its distance, too, but goes on. As long as the vehicle never moved, what is nearer than a road user
//! is expected and does not stir is taken for it; whoever stands beside a vehicle that just begins to
//! look around is seen when he stirs.

use super::{CloudParameters, MAX_LAYERS, Scan};
use crate::ego::wrapped_rad;

/// What is learned of the own vehicle, direction by direction.
#[derive(Debug, Clone)]
pub struct OwnVehicle {
    cells: Vec<[Cell; MAX_LAYERS]>,
    /// What the revolution shows.
    seen: Vec<[Bounds; MAX_LAYERS]>,
    /// Revolutions until the piece is gathered again.
    wait: u32,
    /// Cells of one piece.
    piece: Vec<(usize, usize)>,
    /// How far the sensor went so far.
    way_m: f32,
    extent: Option<Extent>,
}

/// How far the own vehicle reaches from the sensor, in its frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Lowest x, y and z, metres.
    pub low_m: [f32; 3],
    /// Highest.
    pub high_m: [f32; 3],
}

impl Extent {
    /// Whether a place of the sensor frame is on the vehicle, seen from above.
    pub fn contains(&self, at_m: [f64; 2]) -> bool {
        (0..2).all(|axis| {
            let [low_m, high_m] = [self.low_m, self.high_m].map(|end_m| f64::from(end_m[axis]));
            (low_m..=high_m).contains(&at_m[axis])
        })
    }
}

/// One direction.
#[derive(Debug, Clone, Copy)]
struct Cell {
    bounds: Bounds,
    /// Revolutions in which it was met there, less those in which it was not.
    steady: u32,
    /// Way of the sensor meanwhile.
    way_m: f32,
    is_own: bool,
    is_gathered: bool,
}

/// Ranges of what is in a direction.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low_m: f32,
    high_m: f32,
}

/// Directions around: one degree each.
const DIRECTIONS: usize = 360;
/// Range within which it ends where the vehicle never moved, and where it was the same over a way; and up to which
/// it is looked for: what goes on to there is something else.
const STANDING_REACH_M: f32 = 2.2;
const REACH_M: f32 = 3.7;
const FARTHEST_M: f32 = 4.0;
const LEAST_WAY_M: f32 = 5.0;
/// Revolutions for which it must keep its place, and after which it is gone if it does not.
const STEADY: u32 = 15;
const MOST_STEADY: u32 = 30;
/// The same of what goes on from what kept its place.
const STEADY_BESIDE: u32 = 4;
/// How much a range may change from revolution to revolution, within a direction, and to the next one.
const SLACK_M: f32 = 0.1;
const WIDEST_M: f32 = 0.5;
const CONTINUOUS_M: f32 = 0.3;
/// Lower returns may be of the road.
const LEAST_HEIGHT_M: f32 = 0.3;
/// Revolutions from which on the piece is gathered again.
const PERIOD: u32 = 3;

impl Bounds {
    const NONE: Self = Self {
        low_m: f32::INFINITY,
        high_m: f32::NEG_INFINITY,
    };

    fn is_none(&self) -> bool {
        self.low_m > self.high_m
    }

    fn with(&self, other: &Self) -> Self {
        Self {
            low_m: self.low_m.min(other.low_m),
            high_m: self.high_m.max(other.high_m),
        }
    }

    /// How far apart two are: 0 where they overlap.
    fn gap_m(&self, other: &Self) -> f32 {
        (self.low_m - other.high_m)
            .max(other.low_m - self.high_m)
            .max(0.0)
    }
}

impl Default for OwnVehicle {
    fn default() -> Self {
        let cell = Cell {
            bounds: Bounds::NONE,
            steady: 0,
            way_m: 0.0,
            is_own: false,
            is_gathered: false,
        };
        Self {
            cells: vec![[cell; MAX_LAYERS]; DIRECTIONS],
            seen: vec![[Bounds::NONE; MAX_LAYERS]; DIRECTIONS],
            wait: 0,
            piece: vec![],
            way_m: 0.0,
            extent: None,
        }
    }
}

impl OwnVehicle {
    /// How far it reaches, if anything of it is seen.
    pub fn extent(&self) -> Option<Extent> {
        self.extent
    }

    /// Whether a return is on the own vehicle.
    pub(super) fn holds(&self, direction: usize, layer: usize, range_m: f32) -> bool {
        let cell = &self.cells[direction][layer];
        let bounds = Bounds {
            low_m: range_m,
            high_m: range_m,
        };
        cell.is_own && cell.bounds.gap_m(&bounds) < SLACK_M
    }

    /// Whether anything of it is in a direction.
    pub(super) fn is_in(&self, direction: usize) -> bool {
        self.cells[direction].iter().any(|cell| cell.is_own)
    }

    /// Learns from a scan, with the heights of its points above the ground, after the sensor went so far.
    pub fn learn(
        &mut self,
        scan: &Scan,
        heights_m: &[f32],
        way_m: f64,
        parameters: &CloudParameters,
    ) {
        if !parameters.own_vehicle {
            return;
        }
        self.way_m = (self.way_m + way_m as f32).min(LEAST_WAY_M);
        self.look(scan, heights_m, parameters.minimum_range_m as f32);
        for (cells, seen) in self.cells.iter_mut().zip(&self.seen) {
            for (cell, seen) in cells.iter_mut().zip(seen) {
                cell.take(seen, way_m as f32);
            }
        }
        self.wait = self.wait.saturating_sub(1);
        if self.wait == 0 {
            self.wait = PERIOD;
            self.gather(scan);
        }
    }

    /// Notes what is near in each direction.
    fn look(&mut self, scan: &Scan, heights_m: &[f32], nearest_m: f32) {
        self.seen.fill([Bounds::NONE; MAX_LAYERS]);
        let (ranges_m, _) = scan.range_m().as_chunks::<MAX_LAYERS>();
        for (column, ranges_m) in ranges_m.iter().enumerate() {
            let is_near: [bool; MAX_LAYERS] = std::array::from_fn(|layer| {
                (ranges_m[layer] != 0.0) & (ranges_m[layer].abs() < FARTHEST_M)
            });
            if is_near == [false; MAX_LAYERS] {
                continue;
            }
            let direction = direction_of(scan, column);
            for layer in (0..MAX_LAYERS).filter(|layer| is_near[*layer]) {
                let range_m = ranges_m[layer].abs();
                // What is dropped as too near has no place that could be compared with the ground.
                if range_m < nearest_m || heights_m[scan.index(column, layer)] > LEAST_HEIGHT_M {
                    let here = Bounds {
                        low_m: range_m,
                        high_m: range_m,
                    };
                    let seen = &mut self.seen[direction][layer];
                    *seen = seen.with(&here);
                }
            }
        }
    }

    /// Finds the pieces that end within reach.
    fn gather(&mut self, scan: &Scan) {
        let has_moved = self.way_m >= LEAST_WAY_M;
        let reach_m = if has_moved { REACH_M } else { STANDING_REACH_M };
        let counts =
            |cell: &Cell| cell.steady >= STEADY && (!has_moved || cell.way_m >= LEAST_WAY_M);
        for cell in self.cells.as_flattened_mut() {
            (cell.is_own, cell.is_gathered) = (false, false);
        }
        for direction in 0..DIRECTIONS {
            for layer in 0..MAX_LAYERS {
                self.piece.clear();
                self.reach_from(direction, layer, counts);
                let cells = &mut self.cells;
                let ends = |(direction, layer): &(usize, usize)| {
                    cells[*direction][*layer].bounds.high_m < reach_m
                };
                if self.piece.iter().all(ends) {
                    for (direction, layer) in &self.piece {
                        cells[*direction][*layer].is_own = true;
                    }
                }
            }
        }
        self.extent = self.measured_extent(scan);
    }

    /// Adds a cell to the piece, and all that go on from it.
    fn reach_from(&mut self, direction: usize, layer: usize, counts: impl Fn(&Cell) -> bool) {
        let first = &mut self.cells[direction][layer];
        if first.is_gathered || !counts(first) {
            return;
        }
        first.is_gathered = true;
        self.piece.push((direction, layer));
        let mut next = 0;
        while let Some((direction, layer)) = self.piece.get(next).copied() {
            next += 1;
            let from = self.cells[direction][layer].bounds;
            for (turn, rise) in [-1, 0, 1]
                .into_iter()
                .flat_map(|i| [-1, 0, 1].map(|j| (i, j)))
            {
                let beside = (direction as i32 + turn).rem_euclid(DIRECTIONS as i32) as usize;
                let Some(row) = layer
                    .checked_add_signed(rise)
                    .filter(|row| *row < MAX_LAYERS)
                else {
                    continue;
                };
                let cell = &mut self.cells[beside][row];
                let goes_on =
                    cell.steady >= STEADY_BESIDE && cell.bounds.gap_m(&from) < CONTINUOUS_M;
                if !cell.is_gathered && goes_on {
                    cell.is_gathered = true;
                    self.piece.push((beside, row));
                }
            }
        }
    }

    fn measured_extent(&self, scan: &Scan) -> Option<Extent> {
        let mut extent: Option<Extent> = None;
        for (direction, cells) in self.cells.iter().enumerate() {
            let (sine, cosine) = libm::sincosf((direction as f32 + 0.5).to_radians());
            for (layer, cell) in cells.iter().enumerate().filter(|(_, cell)| cell.is_own) {
                let (slope, along) = scan.slope(layer);
                let distance_m = cell.bounds.high_m * along as f32;
                let at_m = [
                    distance_m * sine,
                    distance_m * cosine,
                    distance_m * slope as f32,
                ];
                let extent = extent.get_or_insert(Extent {
                    low_m: at_m,
                    high_m: at_m,
                });
                for (axis, metres) in at_m.into_iter().enumerate() {
                    extent.low_m[axis] = extent.low_m[axis].min(metres);
                    extent.high_m[axis] = extent.high_m[axis].max(metres);
                }
            }
        }
        extent
    }
}

impl Cell {
    fn take(&mut self, seen: &Bounds, way_m: f32) {
        if seen.is_none() {
            self.steady = self.steady.saturating_sub(1);
        } else if self.steady == 0
            || self.bounds.gap_m(seen) > SLACK_M
            || self.bounds.with(seen).high_m - self.bounds.with(seen).low_m > WIDEST_M
        {
            if self.steady > 1 {
                self.steady -= 2;
                return;
            }
            (self.bounds, self.steady, self.way_m) = (*seen, 1, 0.0);
        } else {
            self.bounds = self.bounds.with(seen);
            self.steady = (self.steady + 1).min(MOST_STEADY);
            self.way_m = (self.way_m + way_m).min(LEAST_WAY_M);
        }
    }
}

/// The direction that a column looks in.
pub(super) fn direction_of(scan: &Scan, column: usize) -> usize {
    let degrees = wrapped_rad(scan.azimuth_rad(column)).to_degrees();
    let degrees = if degrees < 0.0 {
        degrees + 360.0
    } else {
        degrees
    };
    (degrees as usize).min(DIRECTIONS - 1)
}

impl Scan {
    /// Masks what is on the own vehicle.
    pub(super) fn mask_own(&mut self, own: &OwnVehicle) {
        if own.extent.is_none() {
            return;
        }
        for column in 0..self.columns() {
            let direction = direction_of(self, column);
            if !own.is_in(direction) {
                continue;
            }
            for layer in 0..MAX_LAYERS {
                let point = self.index(column, layer);
                let range_m = self.range_m()[point];
                if range_m > 0.0 && own.holds(direction, layer, range_m) {
                    self.mask(point);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
