//! Returns of one revolution that may be road users, placed in the local frame.

use nalgebra::Vector2;

use super::{Scene, TrackParameters};
use crate::cloud::Scan;
use crate::cluster::Clusters;
use crate::ego::Placement;

/// One return.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spot {
    /// In the local frame, where the sensor was when it saw it.
    pub(super) at_m: Vector2<f64>,
    /// Above the ground.
    pub(super) above_m: f64,
    /// Before the end of the sweep.
    pub(super) age_s: f64,
    /// Its place in the scan.
    pub(super) point: u32,
    /// The group that it belongs to.
    pub(super) group: u32,
}

/// A cluster, or a part of one, in the local frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    /// Its spots, in the revolution's list.
    pub(super) begin: usize,
    pub(super) end: usize,
    pub(super) low_m: Vector2<f64>,
    pub(super) high_m: Vector2<f64>,
    floor_m: f64,
    top_m: f64,
    /// The columns around the azimuth 0, where a sweep begins and ends, hold some of it.
    pub(super) over_seam: bool,
    /// It goes on above the height at which it was cut.
    goes_on: bool,
    /// It was cut off something that is no road user, and may be a piece of that.
    pub(super) is_suspect: bool,
}

impl Patch {
    /// Whether it can be a road user as a whole.
    pub(super) fn can_be_road_user(&self, parameters: &TrackParameters) -> bool {
        let side_m = self.high_m - self.low_m;
        side_m.norm() <= parameters.longest_object_m
            && self.top_m <= parameters.highest_object_m
            && self.floor_m <= parameters.clearance_m
            && !self.goes_on
    }
}

/// Places returns and divides clusters.
#[derive(Debug, Clone, Default)]
pub(super) struct Placer {
    cell_m: f64,
    /// Cell of a spot, and the spot.
    cells: Vec<([i32; 2], u32)>,
    /// For each cell its first entry, and the part that it belongs to.
    parts: Vec<(usize, usize)>,
    parted: Vec<(usize, Spot)>,
    placements: Vec<Placement>,
}

/// Side of the cells of which a part consists: surfaces of one body are closer to each other,
/// seen from above, and people are farther from the hedge that they pass.
const CELL_M: f64 = 0.3;
/// What is added to it for each metre of range beyond the first.
const CELL_PER_M: f64 = 0.012;
const NEAR_M: f64 = 12.0;
/// What is higher is cut off what may stand below it: crowns of trees, roofs.
const CUT_M: f64 = 2.1;
/// What is lower joins no parts: grass, kerbs, and what is left of the ground.
const LOW_M: f64 = 0.2;
/// How far up a wall is looked for, at least and for each metre of range: three layers.
const ABOVE_CUT_M: f64 = 0.8;
const ABOVE_CUT_PER_M: f64 = 0.07;
/// Share of a part's cells above which there is more, from which on it is a wall or a trunk.
const GOES_ON: f64 = 0.5;
/// Smaller clusters are not divided.
const SMALLEST_DIVIDED_M: f64 = 1.0;

impl Placer {
    /// How the points of each column of the last revolution were placed.
    pub(super) fn placements(&self) -> &[Placement] {
        &self.placements
    }

    /// Places the points of every cluster with the sensor's pose at the time of their column,
    /// and divides every cluster into parts that touch each other, seen from above. DBSCAN's
    /// distance must bridge two layers; seen from above there are no layers.
    pub(super) fn place(
        &mut self,
        clusters: &Clusters,
        scene: &Scene<'_>,
        parameters: &TrackParameters,
        spots: &mut Vec<Spot>,
        patches: &mut Vec<Patch>,
    ) {
        let Scene { scan, sweep, .. } = *scene;
        spots.clear();
        patches.clear();
        sweep.placements(scan.columns(), &mut self.placements);
        for points in clusters.iter() {
            let begin = spots.len();
            for point in points {
                let number = *point as usize;
                let column = scan.column(number);
                let [x, y, _] = scan.point_m(number).map(f64::from);
                spots.push(Spot {
                    at_m: Vector2::from(self.placements[column].local_m([x, y])),
                    above_m: f64::from(scene.heights_m[number]),
                    age_s: scan.age_s(column),
                    point: *point,
                    group: 0,
                });
            }
            let whole = patch_of(spots, begin, scan);
            if (whole.high_m - whole.low_m).norm() < SMALLEST_DIVIDED_M {
                patches.push(whole);
            } else {
                let is_structure = !whole.can_be_road_user(parameters);
                let first = patches.len();
                let is_too_tall = whole.top_m > parameters.highest_object_m;
                self.divide(begin, is_too_tall, scan, spots, patches);
                for patch in &mut patches[first..] {
                    patch.is_suspect = is_structure;
                }
            }
        }
    }

    /// Replaces the spots from `begin` on by their parts, one after the other. What is above
    /// the cut belongs to a part that goes on there, unless all of it is too tall.
    fn divide(
        &mut self,
        begin: usize,
        is_too_tall: bool,
        scan: &Scan,
        spots: &mut Vec<Spot>,
        patches: &mut Vec<Patch>,
    ) {
        let nearest_m = spots[begin..]
            .iter()
            .map(|spot| scan.range_m()[spot.point as usize])
            .fold(f32::MAX, f32::min);
        self.cell_m = CELL_M + CELL_PER_M * (f64::from(nearest_m) - NEAR_M).max(0.0);
        self.cells.clear();
        for (number, spot) in spots[begin..].iter().enumerate() {
            if (LOW_M..=CUT_M).contains(&spot.above_m) {
                self.cells.push((self.cell_of(spot), number as u32));
            }
        }
        self.cells.sort_unstable();
        self.parts.clear();
        let mut first = 0;
        for cell in self.cells.chunk_by(|a, b| a.0 == b.0) {
            self.parts.push((first, self.parts.len()));
            first += cell.len();
        }
        self.join_neighbours();
        let cells = self.parts.len();
        let mut above = vec![false; cells];
        self.look_up(&spots[begin..], scan, &mut above);
        self.parted.clear();
        let mut members = vec![(0usize, 0usize); cells];
        for (cell, is_covered) in above.iter().enumerate() {
            let part = self.root(cell);
            members[part].0 += 1;
            members[part].1 += usize::from(*is_covered);
            let end = self
                .parts
                .get(cell + 1)
                .map_or(self.cells.len(), |next| next.0);
            for entry in &self.cells[self.parts[cell].0..end] {
                self.parted.push((part, spots[begin + entry.1 as usize]));
            }
        }
        if !is_too_tall {
            let goes_on = |part: usize| members[part].1 as f64 >= GOES_ON * members[part].0 as f64;
            self.keep(spots, begin, |spot, part| {
                spot.above_m > CUT_M && goes_on(part)
            });
        }
        self.keep(spots, begin, |spot, _| spot.above_m < LOW_M);
        // Stable, so that the order of the scan stays within a part.
        self.parted.sort_by_key(|(part, spot)| (*part, spot.point));
        spots.truncate(begin);
        for part in self.parted.chunk_by(|a, b| a.0 == b.0) {
            let start = spots.len();
            spots.extend(part.iter().map(|(_, spot)| *spot));
            let (count, covered) = members[part[0].0];
            let mut patch = patch_of(spots, start, scan);
            patch.goes_on = is_too_tall && covered as f64 >= GOES_ON * count as f64;
            patches.push(patch);
        }
    }

    /// Adds the spots above or below the cells of a part to it, where they are wanted.
    fn keep(&mut self, spots: &[Spot], begin: usize, is_wanted: impl Fn(&Spot, usize) -> bool) {
        for spot in &spots[begin..] {
            let part = self.cell_at(self.cell_of(spot)).map(|cell| self.root(cell));
            if let Some(part) = part.filter(|part| is_wanted(spot, *part)) {
                self.parted.push((part, *spot));
            }
        }
    }

    /// The part of a cell: the first of its cells.
    fn root(&self, mut cell: usize) -> usize {
        while self.parts[cell].1 != cell {
            cell = self.parts[cell].1;
        }
        cell
    }

    fn join_neighbours(&mut self) {
        for cell in 0..self.parts.len() {
            let [x, y] = self.cells[self.parts[cell].0].0;
            for neighbour in [[x, y + 1], [x + 1, y - 1], [x + 1, y], [x + 1, y + 1]] {
                if let Some(other) = self.cell_at(neighbour) {
                    let (a, b) = (self.root(cell), self.root(other));
                    self.parts[a.max(b)].1 = a.min(b);
                }
            }
        }
        for cell in 0..self.parts.len() {
            self.parts[cell].1 = self.root(cell);
        }
    }

    fn cell_at(&self, at: [i32; 2]) -> Option<usize> {
        self.parts
            .binary_search_by(|(first, _)| self.cells[*first].0.cmp(&at))
            .ok()
    }

    fn cell_of(&self, spot: &Spot) -> [i32; 2] {
        let cell = |metres: f64| {
            let cells = metres / self.cell_m;
            let toward_0 = cells as i32;
            toward_0 - i32::from(f64::from(toward_0) > cells)
        };
        [cell(spot.at_m.x), cell(spot.at_m.y)]
    }

    /// Marks the cells above which there is more, close to the cut.
    fn look_up(&self, spots: &[Spot], scan: &Scan, above: &mut [bool]) {
        for spot in spots {
            let range_m = f64::from(scan.range_m()[spot.point as usize]);
            let limit_m = CUT_M + ABOVE_CUT_M.max(ABOVE_CUT_PER_M * range_m);
            if spot.above_m > CUT_M
                && spot.above_m < limit_m
                && let Some(cell) = self.cell_at(self.cell_of(spot))
            {
                above[cell] = true;
            }
        }
    }
}

/// The patch of all spots from `begin` on.
fn patch_of(spots: &[Spot], begin: usize, scan: &Scan) -> Patch {
    let mut patch = Patch {
        begin,
        end: spots.len(),
        low_m: Vector2::repeat(f64::MAX),
        high_m: Vector2::repeat(f64::MIN),
        floor_m: f64::MAX,
        top_m: f64::MIN,
        over_seam: false,
        goes_on: false,
        is_suspect: false,
    };
    let (mut oldest_s, mut newest_s) = (f64::MIN, f64::MAX);
    for spot in &spots[begin..] {
        patch.low_m = patch.low_m.inf(&spot.at_m);
        patch.high_m = patch.high_m.sup(&spot.at_m);
        patch.floor_m = patch.floor_m.min(spot.above_m);
        patch.top_m = patch.top_m.max(spot.above_m);
        (oldest_s, newest_s) = (oldest_s.max(spot.age_s), newest_s.min(spot.age_s));
    }
    patch.over_seam = oldest_s - newest_s > 0.5 * scan.duration_s();
    patch
}
