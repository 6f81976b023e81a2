//! Returns of one revolution that may be road users, placed, cluster by cluster and part by part.

use super::floor::Floor;
use super::look::SAME_M;
use super::placing::{Bounds, Placed, Placing};
use super::{Scene, TrackParameters, people};
use crate::cloud::MAX_LAYERS;
use crate::cluster::Clusters;
use crate::float::{bounds_of, greatest};

/// A cluster, or a part of one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    /// Its returns, in the list of all that are placed.
    begin: usize,
    end: usize,
    /// The box that holds them.
    pub(super) bounds: Bounds,
    /// It goes on above the height at which it was cut.
    goes_on: bool,
    /// It was cut off something that is no road user, and may be a piece of that.
    pub(super) is_suspect: bool,
    /// One of several people: their patches follow each other, so many before this one and after.
    pub(super) beside: [usize; 2],
}

impl Patch {
    /// From corner to corner.
    pub(super) fn diagonal_m(&self) -> f64 {
        let side_m = |axis: usize| f64::from(self.bounds.high_m[axis] - self.bounds.low_m[axis]);
        (side_m(0) * side_m(0) + side_m(1) * side_m(1)).sqrt()
    }

    /// Whether it is one of several people side by side.
    pub(super) fn is_one_of_several(&self) -> bool {
        self.beside != [0; 2]
    }

    /// Whether it can be a road user as a whole.
    pub(super) fn can_be_road_user(&self, parameters: &TrackParameters) -> bool {
        self.diagonal_m() <= parameters.longest_object_m
            && f64::from(self.bounds.top_m) <= parameters.highest_object_m
            && f64::from(self.bounds.floor_m) <= parameters.clearance_m
            && !self.goes_on
    }
}

/// Places returns and divides clusters.
#[derive(Debug, Clone, Default)]
pub(super) struct Placer {
    /// Where the sensor is, in the local frame.
    origin_m: [f64; 2],
    /// The returns of the cluster that is being divided.
    cluster: Placing,
    placed: Vec<Placed>,
    patches: Vec<Patch>,
    floor: Floor,
    /// Where on it each return lies.
    places: Vec<u32>,
    /// Whether there is more above each cell, by [`Floor::number`]: the first one is that of all
    /// that lies in no cell.
    covered: Vec<bool>,
    /// That of what belongs to none, and all others.
    parts: Vec<Part>,
    /// The part of each return.
    part_of: Vec<u32>,
    /// The patches before people were told apart, and where one of them is cut.
    former: Vec<Patch>,
    cuts: Vec<usize>,
}

/// Cells of a cluster that touch.
#[derive(Debug, Clone, Copy)]
struct Part {
    /// Cells, and those above which there is more.
    cells: u32,
    covered: u32,
    /// What is higher does not belong to it, but for the roof of a van.
    cut_m: f32,
    /// Where its returns begin; later where they end.
    place: usize,
}

impl Part {
    /// That of nothing.
    const EMPTY: Self = Self {
        cells: 0,
        covered: 0,
        cut_m: f32::NEG_INFINITY,
        place: 0,
    };

    /// Whether it is a wall or a trunk.
    fn goes_on(&self) -> bool {
        f64::from(self.covered) >= GOES_ON * f64::from(self.cells)
    }
}

/// The part of what belongs to none.
const NO_PART: u32 = 0;
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
/// Greatest height of vans: what is above the cut and goes on from below belongs to what is below if
/// the whole cluster is lower.
const VAN_TOP_M: f32 = 3.0;
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
        self.cluster.begin(scene, origin_m);
        for points in clusters.iter() {
            self.cluster.place(points, scene);
            let mut bounds = self.cluster.bounds();
            if (CUT_M..parameters.highest_object_m as f32).contains(&bounds.top_m) {
                // What was too high to be clustered says that this is no road user either.
                bounds.top_m = greatest(bounds.top_m, self.cluster.goes_on_to_m(scene));
            }
            let begin = self.placed.len();
            let whole = Patch {
                begin,
                end: begin + points.len(),
                bounds,
                goes_on: false,
                is_suspect: false,
                beside: [0; 2],
            };
            if whole.diagonal_m() < SMALLEST_DIVIDED_M {
                self.placed.extend(self.cluster.iter());
                self.patches.push(whole);
            } else {
                let is_structure = !whole.can_be_road_user(parameters);
                let first = self.patches.len();
                let is_too_tall = f64::from(whole.bounds.top_m) > parameters.highest_object_m;
                self.divide(&whole.bounds, is_too_tall);
                for patch in &mut self.patches[first..] {
                    patch.is_suspect = is_structure;
                }
            }
        }
        self.tell_people_apart(scene);
    }

    /// Makes a patch of each of several people that are one.
    fn tell_people_apart(&mut self, scene: &Scene<'_>) {
        std::mem::swap(&mut self.patches, &mut self.former);
        self.patches.clear();
        for patch in &self.former {
            let placed = &self.placed[patch.begin..patch.end];
            if patch.goes_on {
                self.cuts.clear();
            } else {
                people::cuts(placed, &patch.bounds, scene.scan, &mut self.cuts);
            }
            if self.cuts.is_empty() {
                self.patches.push(*patch);
                continue;
            }
            let mut begin = patch.begin;
            let count = self.cuts.len();
            let ends = self.cuts.iter().map(|cut| patch.begin + cut);
            for (number, end) in ends.chain([patch.end]).enumerate() {
                self.patches.push(Patch {
                    begin,
                    end,
                    bounds: Bounds::of(&self.placed[begin..end]),
                    beside: [number, count - number],
                    ..*patch
                });
                begin = end;
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

    /// Adds the parts of the cluster, one after the other and each in the order of the scan. What is
    /// above the cut belongs to a part that goes on there, unless all of it is too tall.
    fn divide(&mut self, whole: &Bounds, is_too_tall: bool) {
        let [nearest_m, _] = bounds_of(self.cluster.range_m());
        let cell_m = CELL_M + CELL_PER_M * greatest(nearest_m - NEAR_M, 0.0);
        self.floor
            .begin(whole.low_m, whole.high_m, cell_m, self.origin_m);
        self.floor
            .find_places(self.cluster.at_m(), &mut self.places);
        let places = self.places.iter().zip(self.cluster.above_m());
        self.floor
            .add(places.map(|(place, above_m)| (*place, is_at_body_height(*above_m))));
        self.floor.join();
        self.count_cells(is_too_tall, whole.top_m);
        self.assign(whole.top_m);
        self.sort(is_too_tall);
    }

    /// Counts the cells of every part, and those above which there is more, close to the cut.
    fn count_cells(&mut self, is_too_tall: bool, top_m: f32) {
        let cells = self.floor.len();
        self.covered.clear();
        self.covered.resize(1 + cells, false);
        if top_m > CUT_M {
            let heights_m = self.cluster.above_m().iter();
            let others = self.cluster.range_m().iter().zip(&self.places);
            for (above_m, (range_m, place)) in heights_m.zip(others) {
                let most_m = CUT_M + greatest(ABOVE_CUT_M, ABOVE_CUT_PER_M * range_m);
                let cell = self.floor.number(*place) as usize;
                self.covered[cell] |= (*above_m > CUT_M) & (*above_m < most_m);
            }
        }
        self.parts.clear();
        self.parts.resize(1 + cells, Part::EMPTY);
        for (part, is_covered) in self.floor.parts().iter().zip(&self.covered[1..]) {
            let part = &mut self.parts[1 + *part as usize];
            part.cells += 1;
            part.covered += u32::from(*is_covered);
        }
        for part in &mut self.parts[1..] {
            let has_upper = !is_too_tall && part.goes_on();
            part.cut_m = if has_upper { f32::INFINITY } else { CUT_M };
        }
    }

    /// Finds the part of every return, and where each part's returns begin.
    fn assign(&mut self, top_m: f32) {
        self.floor.name_by_parts();
        self.part_of.clear();
        let own = self.places.iter().zip(self.cluster.above_m());
        self.part_of.extend(own.map(|(place, above_m)| {
            let number = self.floor.number(*place);
            let is_its = *above_m <= self.parts[number as usize].cut_m;
            if is_its { number } else { NO_PART }
        }));
        // Of what is lower nothing is above the cut, and what is higher is no van.
        if (CUT_M..VAN_TOP_M).contains(&top_m) {
            self.assign_roofs();
        }
        for part in &self.part_of {
            self.parts[*part as usize].place += 1;
        }
        let mut next = self.placed.len();
        for part in &mut self.parts[1..] {
            next += std::mem::replace(&mut part.place, next);
        }
        // What belongs to none goes behind all others, again and again to the same place.
        self.parts[NO_PART as usize].place = next;
        self.placed.resize(next + 1, Placed::default());
    }

    /// Gives what is above the cut, and goes on from the return below, the part of that.
    fn assign_roofs(&mut self) {
        let (above_m, range_m) = (self.cluster.above_m(), self.cluster.range_m());
        let points = self.cluster.points();
        for place in 1..points.len() {
            if self.part_of[place] == NO_PART
                && above_m[place] > CUT_M
                && is_below(points[place - 1], points[place])
                && (range_m[place] - range_m[place - 1]).abs() < SAME_M
            {
                self.part_of[place] = self.part_of[place - 1];
            }
        }
    }

    /// Puts the returns of every part side by side, and makes the parts patches.
    fn sort(&mut self, is_too_tall: bool) {
        for (placed, part) in self.cluster.iter().zip(&self.part_of) {
            let place = &mut self.parts[*part as usize].place;
            self.placed[*place] = placed;
            *place += usize::from(*part != NO_PART);
        }
        self.placed.pop();
        // Each part now ends where the next one begins.
        for part in &self.parts[1..] {
            let begin = self.patches.last().map_or(0, |patch| patch.end);
            if part.place > begin {
                self.patches.push(Patch {
                    begin,
                    end: part.place,
                    bounds: Bounds::of(&self.placed[begin..part.place]),
                    goes_on: is_too_tall && part.goes_on(),
                    is_suspect: false,
                    beside: [0; 2],
                });
            }
        }
    }
}

/// Whether a point is the next one below another in its column.
fn is_below(below: u32, point: u32) -> bool {
    !point.is_multiple_of(MAX_LAYERS as u32) && below + 1 == point
}

/// Whether a return may be a road user's below the height at which trees and roofs are cut off,
/// and above that of grass.
fn is_at_body_height(above_m: f32) -> bool {
    (LOW_M..=CUT_M).contains(&above_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::Scan;
    use crate::cloud::tests::scan_of;
    use crate::cluster::{ClusterParameters, Dbscan};
    use crate::parameter::Profile;
    use crate::track::tests::with_scene;

    /// The patches of what is seen from 1.9 m above the ground.
    fn patches(distance_cm: impl Fn(usize, usize) -> u16) -> (Placer, Scan) {
        let scan = scan_of(1800, distance_cm);
        let mut placer = Placer::default();
        with_scene(&scan, |scene| {
            let mut dbscan = Dbscan::new(&ClusterParameters::profile(Profile::Default));
            let clusters = dbscan.process(&scan, &vec![false; scan.len()], scene.heights_m);
            placer.place(clusters, scene, &TrackParameters::profile(Profile::Default));
        });
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
    fn the_roof_of_a_van_belongs_to_it_and_the_crown_above_a_car_does_not() {
        // 10 m away layers 8 to 10 pass 2.1, 2.4 and 2.8 m above the ground; what is met there lies
        // behind the foot of the screen, or a metre behind and above a gap.
        let top_m = |roof_cm: u16, gap: Option<usize>| {
            let (placer, _) = patches(|column, layer| match (column, layer) {
                (_, layer) if Some(layer) == gap => 0,
                (100..150, 3..7) => 1000,
                (100..150, 7..9) => 1030,
                (100..150, 9) => roof_cm,
                (100..150, 10) => roof_cm + 30,
                _ => 0,
            });
            let patches = placer.patches().iter();
            patches.map(|patch| patch.bounds.top_m).fold(0.0, f32::max)
        };
        assert!(top_m(1060, None) > 2.7);
        assert!(top_m(1060, Some(8)) < CUT_M);
    }

    #[test]
    fn what_goes_on_above_all_that_is_clustered_is_no_road_user() {
        let parameters = TrackParameters::profile(Profile::Default);
        // 17 m away layers 12 and 13 pass 4.0 and 4.6 m above the ground.
        let highest = |layers: usize| {
            let (placer, _) = patches(|column, layer| match column {
                100..105 if layer < layers => 1700,
                _ => 0,
            });
            placer.patches()[0]
        };
        assert!(highest(12).can_be_road_user(&parameters));
        assert!(!highest(13).can_be_road_user(&parameters));
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
