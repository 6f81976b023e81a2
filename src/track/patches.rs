//! Returns of one revolution that may be road users, placed, cluster by cluster and part by part.

use super::above::Climber;
use super::crowds::Crowds;
use super::flanks::Flanks;
use super::forecast::Forecasts;
use super::newcomers::{self, Newcomers};
use super::parts::{CUT_M, Cells, Parts};
use super::placing::{Bounds, Placed, Placing};
use super::spots::seen_before;
use super::thinning::Thinning;
use super::{Scene, TrackParameters};
use crate::beams::{Hints, Seen};
use crate::cluster::Clusters;

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
    /// What was seen before of the places of most of it.
    pub(super) before: Seen,
    /// How many returns each of its own stands for, on average.
    pub(super) returns_each: f32,
    /// What rays show to its left and to its right.
    pub(super) flanks: Flanks,
}

impl Patch {
    /// From corner to corner.
    pub(super) fn diagonal_m(&self) -> f64 {
        self.bounds.diagonal_m()
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
    thinning: Thinning,
    /// The points of the cluster that is being divided, and its returns.
    points: Vec<u32>,
    cluster: Placing,
    placed: Vec<Placed>,
    patches: Vec<Patch>,
    parts: Parts,
    newcomers: Newcomers,
    crowds: Crowds,
    /// The tracks that move and may be in a patch.
    near: Vec<usize>,
    /// The patches before they were parted once more, and where one of them is cut.
    former: Vec<Patch>,
    cuts: Vec<usize>,
}

/// Smaller clusters are not divided.
const SMALLEST_DIVIDED_M: f64 = 1.0;

impl Placer {
    /// Places the points of every cluster with the sensor's pose at the time of their column,
    /// and divides every cluster into parts that touch each other, seen from above. DBSCAN's
    /// distance must bridge two layers; seen from above there are no layers.
    pub(super) fn place(
        &mut self,
        clusters: &Clusters,
        climber: &mut Climber,
        forecasts: &mut Forecasts,
        scene: &Scene<'_>,
        parameters: &TrackParameters,
    ) {
        let origin_m = scene.sweep.sensor.placement().origin_m();
        self.origin_m = origin_m;
        self.placed.clear();
        self.patches.clear();
        self.thinning.begin(scene.scan);
        self.cluster.begin(scene, origin_m);
        let highest_m = parameters.highest_object_m as f32;
        for points in clusters.iter() {
            let all = points.len();
            let points = self.thinning.thin(points, scene);
            let returns_each = all as f32 / points.len() as f32;
            let top_m = climber.top_m(points, highest_m, scene.heights_m);
            let is_too_tall = top_m > highest_m;
            // Of what is too tall just what covers something is of use.
            let to_m = if is_too_tall { CUT_M } else { highest_m };
            climber.take_up(points, to_m, scene.heights_m, &mut self.points);
            self.cluster.place(&self.points, scene);
            let bounds = Bounds {
                top_m,
                ..self.cluster.bounds()
            };
            let begin = self.placed.len();
            let whole = Patch {
                begin,
                end: begin + self.points.len(),
                bounds,
                goes_on: false,
                is_suspect: false,
                before: Seen::Unknown,
                returns_each,
                flanks: Flanks::default(),
            };
            if whole.diagonal_m() < SMALLEST_DIVIDED_M {
                self.placed.extend(self.cluster.iter());
                self.patches.push(whole);
            } else {
                let is_structure = !whole.can_be_road_user(parameters);
                let first = self.patches.len();
                self.divide(&whole.bounds, is_too_tall);
                for patch in &mut self.patches[first..] {
                    (patch.is_suspect, patch.returns_each) = (is_structure, returns_each);
                }
            }
        }
        self.look_back(forecasts, scene);
        self.part_newcomers(forecasts, scene);
        self.part_crowds(scene, parameters);
        for patch in &mut self.patches {
            patch.flanks = Flanks::of(&self.placed[patch.begin..patch.end], scene.scan);
        }
    }

    /// Looks up what was in the place of every return before. What moves may have been there itself.
    fn look_back(&mut self, forecasts: &mut Forecasts, scene: &Scene<'_>) {
        let mut hints = Hints::default();
        for patch in &self.patches {
            self.near.clear();
            self.near.extend(forecasts.near(patch));
            self.near.retain(|track| forecasts.of(*track).moves());
            for placed in &mut self.placed[patch.begin..patch.end] {
                let at_m = placed.at_m;
                placed.before = seen_before(scene, placed.point, at_m, &mut hints, |image| {
                    let was_there = |track: &usize| forecasts.of(*track).reached(at_m, image);
                    self.near.iter().any(was_there)
                });
            }
        }
    }

    /// Makes a patch of what is in places that were empty, where it touches what stands.
    fn part_newcomers(&mut self, forecasts: &mut Forecasts, scene: &Scene<'_>) {
        std::mem::swap(&mut self.patches, &mut self.former);
        self.patches.clear();
        for patch in &self.former {
            self.near.clear();
            self.near.extend(forecasts.near(patch));
            self.near.retain(|track| forecasts.of(*track).is_new);
            let is_moving = |placed: &Placed| {
                let holds = |track: &usize| forecasts.of(*track).holds(placed.at_m);
                self.near.iter().any(holds)
            };
            let placed = &mut self.placed[patch.begin..patch.end];
            self.newcomers
                .part(placed, scene.scan, is_moving, &mut self.cuts);
            let mut begin = patch.begin;
            for end in self.cuts.iter().map(|cut| patch.begin + cut) {
                self.patches.push(Patch {
                    begin,
                    end,
                    bounds: Bounds::of(&self.placed[begin..end]),
                    goes_on: false,
                    is_suspect: false,
                    before: Seen::Empty,
                    ..*patch
                });
                begin = end;
            }
            let rest = &self.placed[begin..patch.end];
            if begin == patch.begin {
                self.patches.push(Patch {
                    before: newcomers::most(rest),
                    ..*patch
                });
            } else if !rest.is_empty() {
                self.patches.push(Patch {
                    begin,
                    before: Seen::Occupied,
                    bounds: Bounds {
                        top_m: patch.bounds.top_m,
                        ..Bounds::of(rest)
                    },
                    ..*patch
                });
            }
        }
    }

    /// Makes a patch of everybody in a crowd.
    fn part_crowds(&mut self, scene: &Scene<'_>, parameters: &TrackParameters) {
        std::mem::swap(&mut self.patches, &mut self.former);
        self.patches.clear();
        for patch in &self.former {
            if patch.can_be_road_user(parameters) {
                let placed = &mut self.placed[patch.begin..patch.end];
                let (scan, ends) = (scene.scan, &mut self.cuts);
                self.crowds
                    .part(placed, &patch.bounds, scan, self.origin_m, ends);
            } else {
                self.cuts.clear();
            }
            if self.cuts.is_empty() {
                self.patches.push(*patch);
            }
            let mut begin = patch.begin;
            for end in self.cuts.iter().map(|cut| patch.begin + cut) {
                let own = &self.placed[begin..end];
                self.patches.push(Patch {
                    begin,
                    end,
                    bounds: Bounds::of(own),
                    before: newcomers::most(own),
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

    /// Adds the parts of the cluster, one after the other and each in the order of the scan.
    fn divide(&mut self, whole: &Bounds, is_too_tall: bool) {
        let cluster = &self.cluster;
        self.parts
            .divide(cluster, whole, Cells::OF_BODIES, is_too_tall, self.origin_m);
        self.parts
            .put(cluster, &mut self.placed, |own, bounds, goes_on| {
                self.patches.push(Patch {
                    begin: own.start,
                    end: own.end,
                    bounds,
                    goes_on: is_too_tall && goes_on,
                    is_suspect: false,
                    before: Seen::Unknown,
                    returns_each: 1.0,
                    flanks: Flanks::default(),
                });
            });
    }
}

#[cfg(test)]
mod tests;
