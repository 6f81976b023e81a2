//! Step three: the ground, and which returns lie on it (thesis section 4.1.1).
//!
//! `slices` cuts the revolution like a pie, `minima` gathers the lowest returns of every slice,
//! `ransac` finds the plane that most of them lie on, `plane` has the geometry, `moments` sums over
//! points for it. `surface` follows the heights above and below that plane outward: `lowest` says
//! where each layer meets it but for `vehicles`, neighbours have their `votes`, and a `profile` is
//! what comes of it for each direction. `passes` is what is done with many points at once, and this
//! file follows the plane from revolution to revolution and marks the points.

mod lowest;
mod minima;
mod moments;
mod passes;
mod plane;
mod profile;
mod ransac;
mod slices;
mod surface;
mod vehicles;
mod votes;

pub use plane::Plane;

use crate::cloud::{CAPACITY, MAX_LAYERS, Scan};
use crate::geometry::Rectangle;
use crate::marks;
use crate::parameter::{choices, parameters};
use crate::random::Random;
use minima::Minima;
use moments::{Positions, moments_near};
use passes::Band;
use surface::Surface;
use vehicles::Vehicle;

choices! {
    /// What the ground is thought to be.
    pub enum Model {
        /// A plane, and heights above and below it that are followed outward.
        Surface = "surface",
        /// One plane.
        Plane = "plane",
    }
}

choices! {
    /// How the error of a candidate plane is summed.
    pub enum Scoring {
        /// Squared distances of all minima, as in the thesis.
        All = "all",
        /// The same, but none counts for more than a point at the inlier distance
        /// (MSAC; Torr, Zisserman 2000): cars and kerbs do not pull the choice.
        Truncated = "truncated",
    }
}

parameters! {
    /// The ground plane: RANSAC over the lowest returns, refined by least squares.
    pub struct GroundParameters "ground" {
        /// What the ground is thought to be.
        model: Model = Model::Surface, thesis Model::Plane, "";
        /// Pie slices of the circle. In each the lowest returns are gathered, so that they do
        /// not all come from one place.
        segments: usize = 36, in 6..=360, "";
        /// Lowest returns of a slice that are kept.
        lowest_per_segment: usize = 6, thesis 10, in 1..=64, "returns";
        /// Horizontal range within which lowest returns are sought. Farther out a slope or a
        /// distant hollow is lower than the road around the vehicle.
        candidate_range_m: f64 = 25.0, thesis 130.0, in 5.0..=200.0, "m";
        /// Of so many columns one is looked at for lowest returns: neighbours meet the same road.
        candidate_every: usize = 4, thesis 1, in 1..=16, "columns";
        /// Whether lowest returns are sought below what stands upright alone: the foot of a wall
        /// near the sensor is the lowest that is seen there, and no road.
        candidate_below_upright: bool = true, thesis false, "";
        /// Random draws of three returns.
        iterations: usize = 50, in 1..=1000, "";
        /// Distance to a candidate plane within which a lowest return supports it.
        inlier_distance_m: f64 = 0.15, thesis 0.2, in 0.01..=1.0, "m";
        /// Part of the lowest returns that must support a plane.
        least_support: f64 = 0.25, thesis 0.0, in 0.0..=1.0, "";
        /// How the error of a candidate plane is summed.
        scoring: Scoring = Scoring::Truncated, thesis Scoring::All, "";
        /// Least height of the sensor above a plausible plane.
        height_low_m: f64 = 0.4, thesis 1.9, in 0.0..=10.0, "m";
        /// Greatest height of the sensor above a plausible plane.
        height_high_m: f64 = 4.0, thesis 2.2, in 0.1..=20.0, "m";
        /// Greatest tilt of a plausible plane against the sensor.
        tilt_high_deg: f64 = 12.0, thesis 90.0, in 0.5..=90.0, "degrees";
        /// Whether the plane is followed: once found, lowest returns are judged by their
        /// height above the last plane, and the next one must be near it.
        follow: bool = true, thesis false, "";
        /// How much the height may change from revolution to revolution.
        follow_height_m: f64 = 0.25, in 0.01..=5.0, "m";
        /// How much the tilt may change from revolution to revolution.
        follow_tilt_deg: f64 = 4.0, in 0.1..=45.0, "degrees";
        /// Revolutions in a row without a plausible plane after which it is sought anew,
        /// within the whole range of heights and tilts.
        follow_patience: usize = 10, in 1..=1000, "revolutions";
        /// How often the plane is fitted again to the returns near it, within the range of the
        /// candidates. The lowest returns lie below the road by their noise and in its hollows;
        /// all of them together lie on it.
        refinements: usize = 2, thesis 0, in 0..=20, "";
        /// Height of the sensor that is taken when no plane was ever plausible.
        fallback_height_m: f64 = 1.9, thesis 2.05, in 0.1..=10.0, "m";
        /// Distance to the ground within which a return belongs to it.
        mark_distance_m: f64 = 0.12, thesis 0.5, in 0.01..=2.0, "m";
        /// What is added to that distance for each metre of range: a real road bends away
        /// from any plane.
        mark_distance_per_m: f64 = 0.001, thesis 0.0, in 0.0..=0.1, "m/m";
        /// Whether everything below the plane is ground, too. It is no road user: it is a
        /// ditch, a slope, or a reflection in a wet road.
        below_is_ground: bool = true, thesis false, "";
        /// Seed of the draws. The same seed and recording give the same planes.
        seed: usize = 1, "";
    }
}

/// Where a revolution's plane comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// Found in this revolution.
    Found,
    /// No plane was plausible: the last good one.
    Held,
    /// No plane was ever plausible: level, at the configured height.
    Fallback,
}

/// What the ground step says about a revolution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundReport {
    /// The plane that was used.
    pub plane: Plane,
    /// Where it comes from.
    pub origin: Origin,
    /// Lowest returns that were gathered.
    pub candidates: usize,
    /// How many of them lie on the plane.
    pub support: usize,
    /// Positions marked as ground.
    pub points: usize,
}

/// The ground step: follows the plane and owns the mask.
#[derive(Debug, Clone)]
pub struct Ground {
    parameters: GroundParameters,
    last: Option<Plane>,
    misses: usize,
    revolutions: u64,
    minima: Minima,
    mask: Vec<bool>,
    surface: Surface,
    heights_m: Vec<f32>,
    /// Horizontal distances of the points.
    distances_m: Vec<f32>,
    /// Ground that ends, towards the next layer.
    edges: Vec<bool>,
    vehicles: Vec<Vehicle>,
}

/// Sectors in which the surface is followed, of 5 degrees each.
const SECTORS: usize = 72;
/// Height from which on a return may be a foot, and what is added for each metre of distance.
const FOOT_M: f32 = 0.02;
const FOOT_PER_M: f32 = 0.0015;
/// Slope from there to the next return above that no road has.
const STEEP: f32 = 1.0;

impl Ground {
    /// A ground step that knows nothing yet.
    pub fn new(parameters: &GroundParameters) -> Self {
        Self {
            parameters: parameters.clone(),
            last: None,
            misses: 0,
            revolutions: 0,
            minima: Minima::new(parameters.segments, parameters.lowest_per_segment),
            mask: Vec::with_capacity(CAPACITY),
            surface: Surface::new(SECTORS),
            heights_m: Vec::with_capacity(CAPACITY),
            distances_m: Vec::with_capacity(CAPACITY),
            edges: Vec::with_capacity(CAPACITY),
            vehicles: vec![],
        }
    }

    /// Forgets the plane, for a session that begins anew.
    pub fn reset(&mut self) {
        (self.last, self.misses) = (None, 0);
    }

    /// Which points of the last revolution are ground.
    pub fn mask(&self) -> &[bool] {
        &self.mask
    }

    /// Heights of the points of the last revolution above the ground.
    pub fn heights_m(&self) -> &[f32] {
        &self.heights_m
    }

    /// Finds the plane of a revolution and marks its points. `vehicles` are known to be there,
    /// in the sensor frame, and lift no ground.
    pub fn process(&mut self, scan: &Scan, vehicles: &[Rectangle]) -> GroundReport {
        let followed = self.last.filter(|_| self.parameters.follow);
        let reference = followed.unwrap_or(Plane::level(0.0));
        self.minima.gather(scan, &reference, &self.parameters);
        let mut random = Random::new(self.parameters.seed as u64 ^ self.revolutions << 20);
        let near = followed.filter(|_| self.misses < self.parameters.follow_patience);
        let found = ransac::find(&self.minima, near.as_ref(), &self.parameters, &mut random);
        let found = found.map(|plane| {
            let refined = self.refined(scan, plane);
            let is_plausible = ransac::is_plausible(&refined, near.as_ref(), &self.parameters);
            if is_plausible { refined } else { plane }
        });
        self.revolutions += 1;

        let (plane, origin) = match (found, self.last) {
            (Some(plane), _) => (plane, Origin::Found),
            (None, Some(last)) => (last, Origin::Held),
            (None, None) => (
                Plane::level(self.parameters.fallback_height_m),
                Origin::Fallback,
            ),
        };
        self.misses = if found.is_some() { 0 } else { self.misses + 1 };
        self.last = found.or(self.last);
        GroundReport {
            plane,
            origin,
            candidates: self.minima.len(),
            support: self
                .minima
                .support(&plane, self.parameters.inlier_distance_m),
            points: self.mark(scan, &plane, vehicles),
        }
    }

    /// The plane fitted to the returns near it, again and again.
    fn refined(&self, scan: &Scan, plane: Plane) -> Plane {
        /// Neighbouring columns meet the same road.
        const EVERY: usize = 4;
        let near_m = self.parameters.inlier_distance_m as f32;
        let far_squared = self.parameters.candidate_range_m.powi(2) as f32;
        let points = Positions {
            x_m: scan.x_m(),
            y_m: scan.y_m(),
            z_m: scan.z_m(),
        };
        (0..self.parameters.refinements).fold(plane, |plane, _| {
            let moments = moments_near(points, EVERY, &plane, near_m, far_squared);
            moments.plane().unwrap_or(plane)
        })
    }

    fn mark(&mut self, scan: &Scan, plane: &Plane, vehicles: &[Rectangle]) -> usize {
        let band = Band {
            near_m: self.parameters.mark_distance_m as f32,
            per_m: self.parameters.mark_distance_per_m as f32,
            with_below: self.parameters.below_is_ground,
        };
        self.heights_m.resize(scan.len(), 0.0);
        passes::heights(scan, plane, &mut self.heights_m);
        self.mask.resize(scan.len(), false);
        match self.parameters.model {
            Model::Plane => passes::mark(scan.range_m(), &self.heights_m, band, &mut self.mask),
            Model::Surface => self.mark_surface(scan, band, vehicles),
        }
        marks::count(&self.mask)
    }

    /// Lowers the heights to those above the surface, and marks what lies on it.
    fn mark_surface(&mut self, scan: &Scan, band: Band, vehicles: &[Rectangle]) {
        self.distances_m.resize(scan.len(), 0.0);
        passes::distances(scan, &mut self.distances_m);
        self.vehicles.clear();
        self.vehicles.extend(vehicles.iter().map(Vehicle::at));
        self.surface
            .find(scan, &self.heights_m, &self.distances_m, &self.vehicles);
        self.edges.resize(scan.len(), false);
        for (columns, profile) in self.surface.stretches(scan) {
            let points = scan.points_of(&columns);
            let distances_m = &self.distances_m[points.clone()];
            let heights_m = &mut self.heights_m[points.clone()];
            let mask = &mut self.mask[points.clone()];
            passes::lower(profile, distances_m, heights_m);
            passes::mark(&scan.range_m()[points.clone()], heights_m, band, mask);
            let edges = &mut self.edges[points];
            passes::mark_edges(mask, heights_m, distances_m, (FOOT_M, FOOT_PER_M), edges);
        }
        self.spare_feet(scan);
        for vehicle in &self.vehicles {
            vehicle.spare(scan, &self.heights_m, &mut self.mask);
        }
    }

    /// Takes the mark off what stands on the ground: a return that is a little too high for it,
    /// below one that rises steeply from there and is no ground. Feet of people, tyres, bumpers
    /// and the foot of a wall lie as near to the ground as its own bumps do.
    fn spare_feet(&mut self, scan: &Scan) {
        let columns = self.edges.as_chunks::<MAX_LAYERS>().0.iter().enumerate();
        let (ranges_m, _) = scan.range_m().as_chunks::<MAX_LAYERS>();
        let (heights_m, _) = self.heights_m.as_chunks::<MAX_LAYERS>();
        let (distances_m, _) = self.distances_m.as_chunks::<MAX_LAYERS>();
        let (mask, _) = self.mask.as_chunks_mut::<MAX_LAYERS>();
        // What stands lies below an edge, or below what was found to stand.
        for (column, _) in columns.filter(|(_, edges)| **edges != [false; MAX_LAYERS]) {
            let mut above: Option<(f32, f32)> = None;
            for layer in (0..MAX_LAYERS).rev() {
                if ranges_m[column][layer] <= 0.0 {
                    continue;
                }
                let distance_m = distances_m[column][layer];
                let height_m = heights_m[column][layer];
                let least_m = FOOT_M + FOOT_PER_M * distance_m;
                let stands = above.is_some_and(|(upper_m, upper_distance_m)| {
                    height_m > least_m
                        && upper_m - height_m > STEEP * (upper_distance_m - distance_m).abs()
                });
                let is_ground = &mut mask[column][layer];
                *is_ground &= !stands;
                above = (!*is_ground).then_some((height_m, distance_m));
            }
        }
    }
}

#[cfg(test)]
mod tests;
