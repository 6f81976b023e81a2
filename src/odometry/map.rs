//! What stands around, and what of a revolution is aligned with it.

use super::features::Feature;
use super::surfaces::Surfaces;
use super::uprights::Uprights;
use crate::geometry::Rigid;

/// What stands around, as far as it was seen.
#[derive(Debug, Clone)]
pub(super) struct Map {
    pub(super) surfaces: Surfaces,
    pub(super) uprights: Uprights,
}

/// What of a revolution is aligned with it.
#[derive(Debug, Clone)]
pub(super) struct View {
    pub(super) surfaces: Vec<Feature>,
    pub(super) poles: Vec<Feature>,
    pub(super) foliage: Vec<Feature>,
}

impl Map {
    pub(super) fn new() -> Self {
        Self {
            surfaces: Surfaces::new(),
            uprights: Uprights::new(),
        }
    }

    pub(super) fn clear(&mut self) {
        self.surfaces.clear();
        self.uprights.clear();
    }

    /// The sensor has gone so far in a revolution.
    pub(super) fn advance(&mut self, way_m: f64) {
        self.surfaces.advance(way_m);
        self.uprights.advance(way_m);
    }

    /// Takes a revolution in.
    pub(super) fn add(&mut self, view: &View, pose: &Rigid) {
        for feature in &view.surfaces {
            let normal = pose.rotation * feature.normal;
            self.surfaces.add(&pose.place(&feature.point_m), &normal);
        }
        for feature in &view.poles {
            self.uprights.add_pole(&pose.place(&feature.point_m));
        }
        for feature in &view.foliage {
            self.uprights.add(&pose.place(&feature.point_m));
        }
    }
}

impl Default for View {
    fn default() -> Self {
        let room = || Vec::with_capacity(MOST_FEATURES);
        Self {
            surfaces: room(),
            poles: room(),
            foliage: room(),
        }
    }
}

/// Room for features of a kind.
const MOST_FEATURES: usize = 2048;

impl View {
    /// The same, each feature changed.
    pub(super) fn put(&self, into: &mut Self, change: impl Fn(&Feature) -> Feature) {
        for (from, into) in [
            (&self.surfaces, &mut into.surfaces),
            (&self.poles, &mut into.poles),
            (&self.foliage, &mut into.foliage),
        ] {
            into.clear();
            into.extend(from.iter().map(&change));
        }
    }
}
