//! The ground where it is no plane: heights above or below the plane, sector by sector and
//! ring by ring.
//!
//! A road bends up and down and falls off to its sides. In every sector the lowest returns of
//! each layer say how high the ground is there; a chain of them is followed outward from the
//! plane below the vehicle, and neighbouring sectors vote, so that the side of a car, which
//! fills a sector or two, is not taken for a rise.

use std::ops::Range;

use super::lowest::{Lowest, MOST_COLUMNS, Points};
use super::profile::Profile;
use super::slices::slices;
use super::vehicles::Vehicle;
use super::votes::{VOTERS, elected};
use crate::cloud::{MAX_LAYERS, Scan};

/// Heights of the ground relative to the plane.
#[derive(Debug, Clone)]
pub(super) struct Surface {
    sectors: usize,
    /// Sine of half the width of one.
    slack: f64,
    /// Per sector: its rings from the inside out.
    rings: Vec<[Ring; MAX_LAYERS]>,
    voted: Vec<[Ring; MAX_LAYERS]>,
    profiles: Vec<Profile>,
    /// The lowest returns of each layer in one sector.
    lowest: Lowest,
    candidates: Vec<(f32, f32)>,
}

/// Where a layer meets the ground in a sector.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Ring {
    /// Horizontal distance; 0 where nothing is known.
    pub(super) distance_m: f32,
    /// Above the plane.
    pub(super) level_m: f32,
}

/// Steepest slope against the plane, and how much it may change: at once, and for each metre.
/// A summit of 150 m radius changes it by 0.0067 each metre.
pub(super) const STEEPEST: f32 = 0.15;
const BEND: f32 = 0.012;
const BEND_PER_M: f32 = 0.0035;
const MOST_BEND: f32 = 0.05;
/// How far a level may be off besides: as much as a kerb is high, with a pavement behind it.
pub(super) const KERB_M: f32 = 0.15;
/// Levels this near to the plane are always possible, kerbs among them; farther ones as far
/// as this many times the median of their layer, if so many sectors know it.
const FLAT_M: f32 = 0.07;
const OFF: f32 = 4.0;
const FEWEST_SECTORS: usize = 6;
/// How much farther off the ground of the next layer may be than that of the last.
const SPREAD_M: f32 = 0.03;
const SPREAD: f32 = 2.0;

impl Surface {
    pub(super) fn new(sectors: usize) -> Self {
        Self {
            sectors,
            slack: libm::sin(std::f64::consts::PI / sectors as f64),
            rings: vec![[Ring::default(); MAX_LAYERS]; sectors],
            voted: vec![[Ring::default(); MAX_LAYERS]; sectors],
            profiles: vec![Profile::FLAT; sectors],
            lowest: Lowest::new(),
            candidates: vec![],
        }
    }

    /// Follows the ground of a revolution, given the heights of its points above the plane.
    pub(super) fn find(
        &mut self,
        scan: &Scan,
        heights_m: &[f32],
        distances_m: &[f32],
        vehicles: &[Vehicle],
    ) {
        let points = Points {
            scan,
            heights_m,
            distances_m,
        };
        for rings in &mut self.rings {
            *rings = [Ring::default(); MAX_LAYERS];
        }
        for (sector, stretch) in slices(scan, self.sectors) {
            for first in stretch.clone().step_by(MOST_COLUMNS) {
                let columns = first..stretch.end.min(first + MOST_COLUMNS);
                self.measure_sector(&points, columns, sector, vehicles);
            }
        }
        for rings in &mut self.rings {
            follow(rings);
        }
        self.reject_loners();
        self.vote();
        for (profile, rings) in self.profiles.iter_mut().zip(&self.voted) {
            *profile = Profile::through(rings);
        }
    }

    /// Forgets levels that are far up where the ground is flat all around: what stands on a
    /// flat road is more likely than a hill in one place. A layer's median says how flat it is.
    fn reject_loners(&mut self) {
        let mut spread_m = 0.0f32;
        for layer in 0..MAX_LAYERS {
            self.candidates.clear();
            let of_layer = self.rings.iter().map(|rings| rings[layer]);
            let known = of_layer.filter(|ring| ring.distance_m > 0.0);
            self.candidates
                .extend(known.map(|ring| (ring.level_m.abs(), ring.distance_m)));
            let count = self.candidates.len();
            if count >= FEWEST_SECTORS {
                let by_height = |a: &(f32, f32), b: &(f32, f32)| a.0.total_cmp(&b.0);
                let (_, (median_m, _), _) =
                    self.candidates.select_nth_unstable_by(count / 2, by_height);
                spread_m = median_m.min(SPREAD_M + SPREAD * spread_m);
            }
            let most_m = FLAT_M + OFF * spread_m;
            for rings in &mut self.rings {
                if rings[layer].level_m > most_m {
                    rings[layer] = Ring::default();
                }
            }
        }
    }

    /// The low level of each layer in the columns of a sector.
    fn measure_sector(
        &mut self,
        points: &Points<'_>,
        columns: Range<usize>,
        sector: usize,
        vehicles: &[Vehicle],
    ) {
        let levels_m = self.lowest.note(points, columns.clone());
        let middle = points.scan.direction(columns.start + columns.len() / 2);
        let middle = middle.map(f64::from);
        let may_reach = |vehicle: &&Vehicle| vehicle.may_reach_into(middle, self.slack);
        for vehicle in vehicles.iter().filter(may_reach) {
            vehicle.take_out(points.scan, columns.clone(), levels_m);
        }
        self.lowest.sort();
        for (layer, ring) in self.rings[sector].iter_mut().enumerate() {
            let Some(column) = self.lowest.low_column(layer) else {
                continue;
            };
            let point = points.scan.index(columns.start + column, layer);
            let level_m = points.heights_m[point];
            // A sweep that overlaps itself comes here twice.
            if ring.distance_m == 0.0 || level_m < ring.level_m {
                *ring = Ring {
                    distance_m: points.distances_m[point],
                    level_m,
                };
            }
        }
    }

    /// The median of neighbouring sectors' levels, layer by layer.
    fn vote(&mut self) {
        let sectors = self.sectors;
        for (sector, voted) in self.voted.iter_mut().enumerate() {
            let neighbour = |step| (sector + sectors + step - VOTERS) % sectors;
            let voters = std::array::from_fn(|step| self.rings[neighbour(step)]);
            *voted = elected(&voters);
        }
    }

    /// The ground along the columns: stretches of them, and how high it is there above the plane.
    pub(super) fn stretches(&self, scan: &Scan) -> impl Iterator<Item = (Range<usize>, &Profile)> {
        let slices = slices(scan, self.sectors);
        slices.map(|(sector, columns)| (columns, &self.profiles[sector]))
    }
}

/// Keeps the rings that can be one ground, from the inside out, and forgets the others.
fn follow(rings: &mut [Ring; MAX_LAYERS]) {
    let mut last = Ring::default();
    let mut slope = 0.0f32;
    for ring in rings {
        if ring.distance_m == 0.0 {
            continue;
        }
        let run_m = ring.distance_m - last.distance_m;
        let expected_m = last.level_m + slope * run_m;
        let bend = (BEND + BEND_PER_M * run_m.max(0.0)).min(MOST_BEND);
        let is_ground = run_m > 0.3
            && (ring.level_m - expected_m).abs() < KERB_M + bend * run_m
            && (ring.level_m - last.level_m).abs() < KERB_M + STEEPEST * run_m;
        if is_ground {
            // The slope from a short run is noise.
            let fresh = (ring.level_m - last.level_m) / run_m;
            let trust = (run_m / 4.0).min(1.0);
            slope += trust * (fresh - slope);
            last = *ring;
        } else {
            *ring = Ring::default();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::sensor::VLP16;
    use crate::cloud::tests::scan_of;
    use crate::ground::passes::distances;
    use crate::ground::profile::tests::ground_m;

    /// A road that is level to 10 m and then rises, with a car's rear across it.
    fn rising_road(slope: f64) -> Scan {
        scan_of(1800, |column, layer| {
            let tangent = VLP16.elevation_deg[layer].to_radians().tan();
            let cosine = VLP16.elevation_deg[layer].to_radians().cos();
            let level_m = -1.8 / tangent;
            // On the rise: z = slope (d - 10) - 1.8 = d tan(v).
            let rise_m = (-1.8 - 10.0 * slope) / (tangent - slope);
            let distance_m = if tangent < 0.0 && level_m <= 10.0 {
                level_m
            } else if tangent < slope && rise_m > 0.0 {
                rise_m
            } else {
                0.0
            };
            let azimuth_deg = column as f64 * 0.2;
            let is_car = azimuth_deg < 6.0 && distance_m > 20.0;
            let distance_m = if is_car { 20.0 } else { distance_m };
            if distance_m < 60.0 {
                (100.0 * distance_m / cosine).round() as u16
            } else {
                0
            }
        })
    }

    /// What a sector's ring holds of a layer that meets the ground so far away and so high.
    fn followed(rings: &[[f32; 2]]) -> Vec<bool> {
        let mut all = [Ring::default(); MAX_LAYERS];
        for (ring, [distance_m, level_m]) in all.iter_mut().zip(rings) {
            (ring.distance_m, ring.level_m) = (*distance_m, *level_m);
        }
        follow(&mut all);
        let known = all.iter().map(|ring| ring.distance_m > 0.0);
        known.take(rings.len()).collect()
    }

    #[test]
    fn a_pavement_behind_a_kerb_is_ground_and_a_bench_is_none() {
        let street = |beyond_m: f32| [[4.0, 0.0], [5.0, 0.0], [6.5, 0.0], [9.0, beyond_m]];
        assert_eq!(followed(&street(0.14)), [true; 4]);
        assert_eq!(followed(&street(0.45)), [true, true, true, false]);
    }

    #[test]
    fn a_rise_is_followed_and_a_car_on_it_is_not() {
        let scan = rising_road(0.06);
        let mut surface = Surface::new(72);
        let heights_m: Vec<f32> = scan.z_m().iter().map(|z| z + 1.8).collect();
        let mut distances_m = vec![0.0; scan.len()];
        distances(&scan, &mut distances_m);
        surface.find(&scan, &heights_m, &distances_m, &[]);
        for column in [10, 400, 1200] {
            let mut stretches = surface.stretches(&scan);
            let (_, profile) = stretches
                .find(|(stretch, _)| stretch.contains(&column))
                .unwrap();
            assert!(ground_m(profile, 8.0).abs() < 0.1);
            let level_m = ground_m(profile, 20.0);
            assert!((level_m - 0.6).abs() < 0.15, "{column}: {level_m}");
        }
    }
}
