//! Returns of one revolution that may be road users, placed, cluster by cluster and part by part.

use super::floor::Floor;
use super::{Scene, TrackParameters};
use crate::cloud::Scan;
use crate::cluster::Clusters;
use crate::float::{greatest, least};

/// One return of a cluster.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed {
    /// Where the sensor was when it saw it, along the axes of the local frame, and relative to
    /// where the sensor is now.
    pub(super) at_m: [f32; 2],
    /// Above the ground.
    pub(super) above_m: f32,
    /// Its place in the scan.
    pub(super) point: u32,
}

impl Placed {
    /// Whether it may be a road user's below the height at which trees and roofs are cut off,
    /// and above that of grass.
    fn is_at_body_height(&self) -> bool {
        (self.above_m >= LOW_M) & (self.above_m <= CUT_M)
    }
}

/// A cluster, or a part of one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    /// Its returns, in the list of all that are placed.
    begin: usize,
    end: usize,
    /// The corners of its box, in the frame of [`Placed::at_m`].
    pub(super) low_m: [f32; 2],
    pub(super) high_m: [f32; 2],
    floor_m: f32,
    top_m: f32,
    /// It goes on above the height at which it was cut.
    goes_on: bool,
    /// It was cut off something that is no road user, and may be a piece of that.
    pub(super) is_suspect: bool,
}

impl Patch {
    /// The patch of all returns from `begin` on.
    fn of(placed: &[Placed], begin: usize) -> Self {
        let mut patch = Self {
            begin,
            end: placed.len(),
            low_m: [f32::MAX; 2],
            high_m: [f32::MIN; 2],
            floor_m: f32::MAX,
            top_m: f32::MIN,
            goes_on: false,
            is_suspect: false,
        };
        for Placed { at_m, above_m, .. } in &placed[begin..] {
            for (axis, metres) in at_m.iter().enumerate() {
                patch.low_m[axis] = least(patch.low_m[axis], *metres);
                patch.high_m[axis] = greatest(patch.high_m[axis], *metres);
            }
            patch.floor_m = least(patch.floor_m, *above_m);
            patch.top_m = greatest(patch.top_m, *above_m);
        }
        patch
    }

    /// From corner to corner.
    fn diagonal_m(&self) -> f64 {
        let side_m = |axis: usize| f64::from(self.high_m[axis] - self.low_m[axis]);
        (side_m(0) * side_m(0) + side_m(1) * side_m(1)).sqrt()
    }

    /// Whether it can be a road user as a whole.
    pub(super) fn can_be_road_user(&self, parameters: &TrackParameters) -> bool {
        self.diagonal_m() <= parameters.longest_object_m
            && f64::from(self.top_m) <= parameters.highest_object_m
            && f64::from(self.floor_m) <= parameters.clearance_m
            && !self.goes_on
    }
}

/// Places returns and divides clusters.
#[derive(Debug, Clone, Default)]
pub(super) struct Placer {
    /// Where the sensor is, in the local frame.
    origin_m: [f64; 2],
    placed: Vec<Placed>,
    patches: Vec<Patch>,
    floor: Floor,
    /// Where on it each return lies.
    places: Vec<u32>,
    /// Whether there is more above each cell.
    covered: Vec<bool>,
    parts: Vec<Part>,
    /// The part of each return, or [`NO_PART`].
    part_of: Vec<u32>,
    /// The returns of a cluster, while they are sorted.
    unsorted: Vec<Placed>,
}

/// Cells of a cluster that touch.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    /// Cells, and those above which there is more.
    cells: u32,
    covered: u32,
    /// Whether what is above the cut belongs to it.
    has_upper: bool,
    /// Where its returns begin; later where they end.
    place: usize,
}

impl Part {
    /// Whether it is a wall or a trunk.
    fn goes_on(&self) -> bool {
        f64::from(self.covered) >= GOES_ON * f64::from(self.cells)
    }
}

/// What belongs to no part.
const NO_PART: u32 = u32::MAX;
/// Side of the cells of which a part consists: surfaces of one body are closer to each other,
/// seen from above, and people are farther from the hedge that they pass.
const CELL_M: f32 = 0.3;
/// What is added to it for each metre of range beyond the first.
const CELL_PER_M: f32 = 0.012;
const NEAR_M: f32 = 12.0;
/// What is higher is cut off what may stand below it: crowns of trees, roofs.
const CUT_M: f32 = 2.1;
/// What is lower joins no parts: grass, kerbs, and what is left of the ground.
const LOW_M: f32 = 0.2;
/// How far up a wall is looked for, at least and for each metre of range: three layers.
const ABOVE_CUT_M: f32 = 0.8;
const ABOVE_CUT_PER_M: f32 = 0.07;
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
    ) {
        let origin_m = scene.sweep.sensor.placement().origin_m();
        self.origin_m = origin_m;
        self.placed.clear();
        self.patches.clear();
        for points in clusters.iter() {
            let begin = self.placed.len();
            self.placed.extend(points.iter().map(|point| {
                let number = *point as usize;
                let [x, y, _] = scene.scan.point_m(number).map(f64::from);
                let [x, y] = scene.placements[scene.scan.column(number)].local_m([x, y]);
                Placed {
                    at_m: [(x - origin_m[0]) as f32, (y - origin_m[1]) as f32],
                    above_m: scene.heights_m[number],
                    point: *point,
                }
            }));
            let whole = Patch::of(&self.placed, begin);
            if whole.diagonal_m() < SMALLEST_DIVIDED_M {
                self.patches.push(whole);
            } else {
                let is_structure = !whole.can_be_road_user(parameters);
                let first = self.patches.len();
                let is_too_tall = f64::from(whole.top_m) > parameters.highest_object_m;
                self.divide(&whole, is_too_tall, scene.scan);
                for patch in &mut self.patches[first..] {
                    patch.is_suspect = is_structure;
                }
            }
        }
    }

    /// The parts of all clusters.
    pub(super) fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// The returns of a patch, in the order of the scan.
    pub(super) fn placed(&self, patch: &Patch) -> &[Placed] {
        &self.placed[patch.begin..patch.end]
    }

    /// Replaces the returns of a cluster, which are the last ones, by its parts, one after the
    /// other and each in the order of the scan. What is above the cut belongs to a part that goes
    /// on there, unless all of it is too tall.
    fn divide(&mut self, whole: &Patch, is_too_tall: bool, scan: &Scan) {
        let own = &self.placed[whole.begin..];
        let range_m = |placed: &Placed| scan.range_m()[placed.point as usize];
        let nearest_m = own.iter().map(range_m).fold(f32::MAX, least);
        let cell_m = CELL_M + CELL_PER_M * greatest(nearest_m - NEAR_M, 0.0);
        self.floor
            .begin(whole.low_m, whole.high_m, cell_m, self.origin_m);
        self.places.clear();
        for placed in own {
            let place = self.floor.place(placed.at_m);
            self.places.push(place);
            if placed.is_at_body_height() {
                self.floor.add(place);
            }
        }
        self.floor.join();
        self.count_cells(whole.begin, is_too_tall, scan);
        self.assign(whole.begin);
        self.sort(whole.begin, is_too_tall);
    }

    /// Counts the cells of every part, and those above which there is more, close to the cut.
    fn count_cells(&mut self, begin: usize, is_too_tall: bool, scan: &Scan) {
        let cells = self.floor.len();
        self.covered.clear();
        self.covered.resize(cells, false);
        let own = self.placed[begin..].iter().zip(&self.places);
        for (placed, place) in own.filter(|(placed, _)| placed.above_m > CUT_M) {
            let range_m = scan.range_m()[placed.point as usize];
            if placed.above_m < CUT_M + greatest(ABOVE_CUT_M, ABOVE_CUT_PER_M * range_m)
                && let Some(cell) = self.floor.number(*place)
            {
                self.covered[cell] = true;
            }
        }
        self.parts.clear();
        self.parts.resize(cells, Part::default());
        for (part, is_covered) in self.floor.parts().iter().zip(&self.covered) {
            let part = &mut self.parts[*part as usize];
            part.cells += 1;
            part.covered += u32::from(*is_covered);
        }
        for part in &mut self.parts {
            part.has_upper = !is_too_tall && part.goes_on();
        }
    }

    /// Finds the part of every return, and where each part's returns begin.
    fn assign(&mut self, begin: usize) {
        self.part_of.clear();
        for (placed, place) in self.placed[begin..].iter().zip(&self.places) {
            let mut own = NO_PART;
            if let Some(cell) = self.floor.number(*place) {
                let number = self.floor.parts()[cell];
                let part = &mut self.parts[number as usize];
                if (placed.above_m <= CUT_M) | part.has_upper {
                    part.place += 1;
                    own = number;
                }
            }
            self.part_of.push(own);
        }
        let mut next = begin;
        for part in &mut self.parts {
            next += std::mem::replace(&mut part.place, next);
        }
    }

    /// Puts the returns of every part side by side, and makes the parts patches.
    fn sort(&mut self, begin: usize, is_too_tall: bool) {
        self.unsorted.clear();
        self.unsorted.extend_from_slice(&self.placed[begin..]);
        for (placed, part) in self.unsorted.iter().zip(&self.part_of) {
            if *part != NO_PART {
                let place = &mut self.parts[*part as usize].place;
                self.placed[*place] = *placed;
                *place += 1;
            }
        }
        // Each part now ends where the next one begins.
        let mut start = begin;
        for part in &self.parts {
            if part.place > start {
                let mut patch = Patch::of(&self.placed[..part.place], start);
                patch.goes_on = is_too_tall && part.goes_on();
                self.patches.push(patch);
                start = part.place;
            }
        }
        self.placed.truncate(start);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::cluster::{ClusterParameters, Dbscan};
    use crate::ego::Sweep;
    use crate::ground::{GroundReport, Origin, Plane};
    use crate::parameter::Profile;

    /// The patches of what is seen from 1.9 m above the ground.
    fn patches(distance_cm: impl Fn(usize, usize) -> u16) -> (Placer, Scan) {
        let scan = scan_of(1800, distance_cm);
        let heights_m: Vec<f32> = scan.z_m().iter().map(|z| z + 1.9).collect();
        let mut dbscan = Dbscan::new(&ClusterParameters::profile(Profile::Default));
        let clusters = dbscan.process(&scan, &vec![false; scan.len()]);
        let ground = GroundReport {
            plane: Plane::level(1.9),
            origin: Origin::Found,
            candidates: 0,
            support: 0,
            points: 0,
        };
        let sweep = Sweep::still(0);
        let mut placements = vec![];
        sweep.placements(scan.columns(), &mut placements);
        let scene = Scene {
            scan: &scan,
            heights_m: &heights_m,
            ground: &ground,
            sweep: &sweep,
            placements: &placements,
        };
        let parameters = TrackParameters::profile(Profile::Default);
        let mut placer = Placer::default();
        placer.place(clusters, &scene, &parameters);
        (placer, scan)
    }

    #[test]
    fn what_does_not_touch_from_above_is_parted_though_it_is_one_cluster() {
        // 10 m away, of which eps is 0.72 m: posts 0.35 m wide and 0.65 m apart.
        let (placer, scan) = patches(|column, layer| match column {
            100..110 | 128..138 if (4..10).contains(&layer) => 1000,
            _ => 0,
        });
        let [left, right] = placer.patches() else {
            panic!("{:?}", placer.patches());
        };
        for (patch, columns) in [(left, 100..110), (right, 128..138)] {
            let own = placer.placed(patch);
            assert_eq!(own.len(), 60);
            assert!(own.is_sorted_by_key(|placed| placed.point));
            let mut of_own = own.iter().map(|placed| scan.column(placed.point as usize));
            assert!(of_own.all(|column| columns.contains(&column)));
            assert!(!patch.is_suspect);
        }
    }

    #[test]
    fn a_house_is_structure_and_what_stands_apart_before_it_is_suspect() {
        let parameters = TrackParameters::profile(Profile::Default);
        // 15 m away a wall higher than a truck; a person stands 0.78 m before it.
        let (placer, _) = patches(|column, layer| match column {
            40..44 if layer < 8 => 1422,
            10..80 => 1500,
            _ => 0,
        });
        let (people, walls): (Vec<&Patch>, Vec<&Patch>) = placer
            .patches()
            .iter()
            .partition(|patch| patch.can_be_road_user(&parameters));
        assert_eq!((people.len(), walls.len()), (1, 1), "{people:?} {walls:?}");
        assert!(people[0].is_suspect && people[0].diagonal_m() < 1.0);
    }
}
