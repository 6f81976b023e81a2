//! Returns of one revolution that may be road users, placed in the local frame.

use nalgebra::Vector2;

use super::{Scene, TrackParameters};
use crate::cloud::Scan;
use crate::cluster::Clusters;
use crate::float::{greatest, least};

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

impl Spot {
    /// Whether it may be a road user's below the height at which trees and roofs are cut off,
    /// and above that of grass.
    fn is_at_body_height(&self) -> bool {
        (LOW_M..=CUT_M).contains(&self.above_m)
    }
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
    floor: Floor,
    /// Where on it each spot lies.
    places: Vec<usize>,
    /// Whether there is more above each cell.
    covered: Vec<bool>,
    /// Of the cells of each part, by the part's number: how many, how many covered.
    members: Vec<(usize, usize)>,
    /// The part of each spot, where its spots begin among the others, and the spots themselves.
    part_of: Vec<Option<u32>>,
    begins: Vec<usize>,
    sorted: Vec<Spot>,
}

/// Cells of one cluster, seen from above, and which of them touch.
#[derive(Debug, Clone, Default)]
struct Floor {
    /// Cells in a metre.
    per_m: f64,
    /// The cell in the south-west corner, one beyond the cluster.
    corner: Vector2<f64>,
    /// Cells from south to north, one more than the cluster has on either side.
    height: usize,
    /// For every place, one more than the number of the cell in it; 0 where there is none.
    numbers: Vec<u32>,
    /// Places of the cells that there are, in their order from west to east.
    places: Vec<u32>,
    /// For each cell another one of its part, or itself, the first of the part.
    parts: Vec<u32>,
}

impl Floor {
    /// Empties it for a cluster between these corners.
    fn begin(&mut self, low_m: Vector2<f64>, high_m: Vector2<f64>, cell_m: f64) {
        for place in &self.places {
            self.numbers[*place as usize] = 0;
        }
        self.places.clear();
        self.per_m = 1.0 / cell_m;
        let cells = |at_m: Vector2<f64>| (at_m * self.per_m).map(libm::floor);
        let (low, high) = (cells(low_m), cells(high_m));
        self.corner = low.add_scalar(-1.0);
        let side = |axis: usize| (high[axis] - low[axis]) as usize + 3;
        self.height = side(1);
        let size = side(0) * self.height;
        if self.numbers.len() < size {
            self.numbers.resize(size, 0);
        }
    }

    fn place(&self, at_m: Vector2<f64>) -> usize {
        // Nothing lies outside the corner, so that cutting off the fraction is enough.
        let cell = |axis: usize| (at_m[axis] * self.per_m - self.corner[axis]) as u32 as usize;
        cell(0) * self.height + cell(1)
    }

    /// Adds the cell at a place, if it is not there yet.
    fn add(&mut self, place: usize) {
        if self.numbers[place] == 0 {
            self.numbers[place] = 1;
            self.places.push(place as u32);
        }
    }

    /// The number of the cell at a place.
    fn number(&self, place: usize) -> Option<usize> {
        (self.numbers[place] as usize).checked_sub(1)
    }

    /// Numbers the cells and joins those that touch, also by their corners.
    fn join(&mut self) {
        self.places.sort_unstable();
        for (number, place) in self.places.iter().enumerate() {
            self.numbers[*place as usize] = number as u32 + 1;
        }
        self.parts.clear();
        self.parts.extend(0..self.places.len() as u32);
        for number in 0..self.places.len() {
            let place = self.places[number] as usize;
            let east = place + self.height;
            for neighbour in [place + 1, east - 1, east, east + 1] {
                if let Some(other) = self.number(neighbour) {
                    let (a, b) = (self.root(number), self.root(other));
                    self.parts[a.max(b)] = a.min(b) as u32;
                }
            }
        }
        for number in 0..self.places.len() {
            self.parts[number] = self.root(number) as u32;
        }
    }

    /// The first cell of a cell's part.
    fn root(&self, mut number: usize) -> usize {
        while self.parts[number] as usize != number {
            number = self.parts[number] as usize;
        }
        number
    }
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
        let scan = scene.scan;
        spots.clear();
        patches.clear();
        for points in clusters.iter() {
            let begin = spots.len();
            spots.extend(points.iter().map(|point| {
                let number = *point as usize;
                let column = scan.column(number);
                let [x, y, _] = scan.point_m(number).map(f64::from);
                Spot {
                    at_m: Vector2::from(scene.placements[column].local_m([x, y])),
                    above_m: f64::from(scene.heights_m[number]),
                    age_s: scan.age_s(column),
                    point: *point,
                    group: 0,
                }
            }));
            let whole = patch_of(spots, begin, scan);
            if (whole.high_m - whole.low_m).norm() < SMALLEST_DIVIDED_M {
                patches.push(whole);
            } else {
                let is_structure = !whole.can_be_road_user(parameters);
                let first = patches.len();
                let is_too_tall = whole.top_m > parameters.highest_object_m;
                self.divide(&whole, is_too_tall, scan, spots, patches);
                for patch in &mut patches[first..] {
                    patch.is_suspect = is_structure;
                }
            }
        }
    }

    /// Replaces the spots of a cluster, which are the last ones, by its parts, one after the
    /// other and each in the order of the scan. What is above the cut belongs to a part that goes
    /// on there, unless all of it is too tall.
    fn divide(
        &mut self,
        whole: &Patch,
        is_too_tall: bool,
        scan: &Scan,
        spots: &mut Vec<Spot>,
        patches: &mut Vec<Patch>,
    ) {
        let own = &spots[whole.begin..];
        let range_m = |spot: &Spot| scan.range_m()[spot.point as usize];
        let nearest_m = own.iter().map(range_m).fold(f32::MAX, f32::min);
        let cell_m = CELL_M + CELL_PER_M * (f64::from(nearest_m) - NEAR_M).max(0.0);
        self.floor.begin(whole.low_m, whole.high_m, cell_m);
        self.places.clear();
        self.places
            .extend(own.iter().map(|spot| self.floor.place(spot.at_m)));
        for (spot, place) in own.iter().zip(&self.places) {
            if spot.is_at_body_height() {
                self.floor.add(*place);
            }
        }
        self.floor.join();
        self.count_cells(own, scan);
        self.assign(own, is_too_tall);
        let first = whole.begin;
        self.sorted.clear();
        self.sorted.extend_from_slice(&spots[first..]);
        let total = self.begins.last().copied().unwrap_or(0);
        spots.truncate(first + total);
        let mut next = std::mem::take(&mut self.begins);
        for (spot, part) in self.sorted.iter().zip(&self.part_of) {
            if let Some(part) = part {
                let at = &mut next[*part as usize];
                spots[first + *at] = *spot;
                *at += 1;
            }
        }
        // Each part now ends where the next one begins.
        let mut start = first;
        for (part, (count, covered)) in self.members.iter().enumerate() {
            let end = first + next[part];
            if end > start {
                let mut patch = patch_of(&spots[..end], start, scan);
                patch.goes_on = is_too_tall && *covered as f64 >= GOES_ON * *count as f64;
                patches.push(patch);
            }
            start = end;
        }
        self.begins = next;
    }

    /// Counts the cells of every part, and those above which there is more, close to the cut.
    fn count_cells(&mut self, spots: &[Spot], scan: &Scan) {
        let cells = self.floor.places.len();
        self.covered.clear();
        self.covered.resize(cells, false);
        let placed = spots.iter().zip(&self.places);
        for (spot, place) in placed.filter(|(spot, _)| spot.above_m > CUT_M) {
            let range_m = f64::from(scan.range_m()[spot.point as usize]);
            if spot.above_m < CUT_M + ABOVE_CUT_M.max(ABOVE_CUT_PER_M * range_m)
                && let Some(cell) = self.floor.number(*place)
            {
                self.covered[cell] = true;
            }
        }
        self.members.clear();
        self.members.resize(cells, (0, 0));
        for (part, is_covered) in self.floor.parts.iter().zip(&self.covered) {
            let (count, covered) = &mut self.members[*part as usize];
            *count += 1;
            *covered += usize::from(*is_covered);
        }
    }

    /// Finds the part of every spot, and where each part's spots begin.
    fn assign(&mut self, spots: &[Spot], is_too_tall: bool) {
        self.part_of.clear();
        self.begins.clear();
        self.begins.resize(self.members.len() + 1, 0);
        for (spot, place) in spots.iter().zip(&self.places) {
            let cell = self.floor.number(*place);
            let part = cell.map(|cell| self.floor.parts[cell]);
            let part = part.filter(|part| {
                let (count, covered) = self.members[*part as usize];
                let goes_on = covered as f64 >= GOES_ON * count as f64;
                spot.above_m <= CUT_M || (!is_too_tall && goes_on)
            });
            if let Some(part) = part {
                self.begins[part as usize + 1] += 1;
            }
            self.part_of.push(part);
        }
        for part in 1..self.begins.len() {
            self.begins[part] += self.begins[part - 1];
        }
    }
}

/// The patch of all spots from `begin` on, which are in the order of the scan.
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
    for spot in &spots[begin..] {
        for axis in 0..2 {
            patch.low_m[axis] = least(patch.low_m[axis], spot.at_m[axis]);
            patch.high_m[axis] = greatest(patch.high_m[axis], spot.at_m[axis]);
        }
        patch.floor_m = least(patch.floor_m, spot.above_m);
        patch.top_m = greatest(patch.top_m, spot.above_m);
    }
    if let [oldest, .., newest] = &spots[begin..] {
        patch.over_seam = oldest.age_s - newest.age_s > 0.5 * scan.duration_s();
    }
    patch
}
