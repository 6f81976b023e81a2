//! The ground where it is no plane: heights above or below the plane, sector by sector and
//! ring by ring.
//!
//! A road bends up and down and falls off to its sides. In every sector the lowest returns of
//! each layer say how high the ground is there; a chain of them is followed outward from the
//! plane below the vehicle, and neighbouring sectors vote, so that the side of a car, which
//! fills a sector or two, is not taken for a rise.

use std::ops::Range;

use multiversion::multiversion;

use super::minima::slice_of;
use super::profile::Profile;
use crate::cloud::{MAX_LAYERS, Scan};
use crate::track::{Outline, Rectangle};

/// Heights of the ground relative to the plane.
#[derive(Debug, Clone)]
pub(super) struct Surface {
    sectors: usize,
    /// Per sector: its rings from the inside out.
    rings: Vec<[Ring; MAX_LAYERS]>,
    voted: Vec<[Ring; MAX_LAYERS]>,
    /// Sector of every column.
    sector_of: Vec<u16>,
    profiles: Vec<Profile>,
    /// Heights and distances of the returns of each layer in one sector.
    levels: [Vec<(f32, f32)>; MAX_LAYERS],
    candidates: Vec<(f32, f32)>,
    /// Vehicles in the sector that is looked at.
    vehicles: Vec<Outline>,
}

/// Where a layer meets the ground in a sector.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Ring {
    /// Horizontal distance; 0 where nothing is known.
    pub(super) distance_m: f32,
    /// Above the plane.
    pub(super) level_m: f32,
}

/// Part of a layer's returns in a sector that may lie below the ground: noise and reflections.
const BELOW: f32 = 0.2;
/// Fewer returns of a layer in a sector say nothing.
const FEWEST: usize = 3;
/// Farther rings are too sparse to follow.
const FARTHEST_M: f32 = 70.0;
/// Steepest slope against the plane, and how much it may change: at once, and for each metre.
/// A summit of 150 m radius changes it by 0.0067 each metre.
pub(super) const STEEPEST: f32 = 0.15;
const BEND: f32 = 0.012;
const BEND_PER_M: f32 = 0.0035;
const MOST_BEND: f32 = 0.05;
/// No ground is higher than this above the steepest slope.
const HIGHEST_M: f32 = 0.5;
/// A rise from one return to the next above that no road has.
const STEEP: f32 = 1.0;
/// How far a level may be off besides.
const SLACK_M: f32 = 0.06;
/// Levels this near to the plane are always possible, kerbs among them; farther ones as far
/// as this many times the median of their layer, if so many sectors know it.
const FLAT_M: f32 = 0.07;
const OFF: f32 = 4.0;
const FEWEST_SECTORS: usize = 6;
/// How much farther off the ground of the next layer may be than that of the last.
const SPREAD_M: f32 = 0.03;
const SPREAD: f32 = 2.0;
/// Around a vehicle that is known, for its way during the sweep.
const AROUND_VEHICLES_M: f64 = 0.6;
/// Sectors to either side that vote on a level.
const VOTERS: usize = 3;
/// As many of them know a level that the sector itself cannot see.
const FEWEST_VOTES: usize = 4;

impl Surface {
    pub(super) fn new(sectors: usize) -> Self {
        Self {
            sectors,
            rings: vec![[Ring::default(); MAX_LAYERS]; sectors],
            voted: vec![[Ring::default(); MAX_LAYERS]; sectors],
            sector_of: vec![],
            profiles: vec![Profile::FLAT; sectors],
            levels: Default::default(),
            candidates: vec![],
            vehicles: vec![],
        }
    }

    /// Follows the ground of a revolution, given the heights of its points above the plane.
    pub(super) fn find(
        &mut self,
        scan: &Scan,
        heights_m: &[f32],
        distances_m: &[f32],
        vehicles: &[Rectangle],
    ) {
        let points = Points {
            scan,
            heights_m,
            distances_m,
        };
        self.sector_of.clear();
        let sectors = self.sectors;
        let of_column = |column| slice_of(scan, column, sectors) as u16;
        self.sector_of.extend((0..scan.columns()).map(of_column));
        for rings in &mut self.rings {
            *rings = [Ring::default(); MAX_LAYERS];
        }
        let mut first = 0;
        while first < scan.columns() {
            let sector = self.sector_of[first];
            let count = self.sector_of[first..]
                .iter()
                .take_while(|other| **other == sector)
                .count();
            self.look_out(scan.azimuth_rad(first + count / 2), vehicles);
            self.measure_sector(&points, first..first + count, sector as usize);
            first += count;
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

    /// Notes the vehicles that a sector may meet.
    fn look_out(&mut self, azimuth_rad: f64, vehicles: &[Rectangle]) {
        let (sine, cosine) = libm::sincos(azimuth_rad);
        let slack = libm::sin(std::f64::consts::PI / self.sectors as f64);
        let may_meet = |vehicle: &&Rectangle| {
            let [x, y] = vehicle.centre_m;
            let reach_m = 0.5 * (vehicle.length_m + vehicle.width_m) + slack * libm::hypot(x, y);
            x * sine + y * cosine > 0.0 && (x * cosine - y * sine).abs() < reach_m
        };
        self.vehicles.clear();
        self.vehicles
            .extend(vehicles.iter().filter(may_meet).map(Rectangle::outline));
    }

    /// The low level of each layer in the columns of a sector.
    fn measure_sector(&mut self, points: &Points<'_>, columns: Range<usize>, sector: usize) {
        let scan = points.scan;
        let (ranges_m, _) = scan.range_m().as_chunks::<MAX_LAYERS>();
        let (heights_m, _) = points.heights_m.as_chunks::<MAX_LAYERS>();
        let (distances_m, _) = points.distances_m.as_chunks::<MAX_LAYERS>();
        for levels in &mut self.levels {
            levels.clear();
        }
        for column in columns {
            let (heights_m, distances_m) = (&heights_m[column], &distances_m[column]);
            let (returns, mut low) = low_returns(&ranges_m[column], heights_m, distances_m);
            while low != 0 {
                let layer = low.trailing_zeros() as usize;
                low &= low - 1;
                let (level_m, distance_m) = (heights_m[layer], distances_m[layer]);
                // Above the highest return nothing rises.
                let above = returns >> layer >> 1;
                let upper = layer + 1 + above.trailing_zeros() as usize;
                let rises_steeply = above != 0
                    && heights_m[upper] - level_m > STEEP * (distances_m[upper] - distance_m);
                if !rises_steeply && !self.is_taken(scan, scan.index(column, layer)) {
                    self.levels[layer].push((level_m, distance_m));
                }
            }
        }
        for (levels, ring) in self.levels.iter_mut().zip(&mut self.rings[sector]) {
            if levels.len() < FEWEST {
                continue;
            }
            let low = (levels.len() as f32 * BELOW) as usize;
            let by_height = |a: &(f32, f32), b: &(f32, f32)| a.0.total_cmp(&b.0);
            let (_, (level_m, distance_m), _) = levels.select_nth_unstable_by(low, by_height);
            // A sweep that overlaps itself comes here twice.
            if ring.distance_m == 0.0 || *level_m < ring.level_m {
                *ring = Ring {
                    distance_m: *distance_m,
                    level_m: *level_m,
                };
            }
        }
    }

    /// Whether a vehicle of the sector stands there.
    fn is_taken(&self, scan: &Scan, point: usize) -> bool {
        if self.vehicles.is_empty() {
            return false;
        }
        let [x, y, _] = scan.point_m(point).map(f64::from);
        self.vehicles.iter().any(|vehicle| {
            let distance_m = vehicle.distance_within_m([x, y], AROUND_VEHICLES_M);
            distance_m.is_some_and(|distance_m| distance_m < AROUND_VEHICLES_M)
        })
    }

    /// The median of neighbouring sectors' levels, layer by layer.
    fn vote(&mut self) {
        let sectors = self.sectors;
        for sector in 0..sectors {
            for layer in 0..MAX_LAYERS {
                let own = self.rings[sector][layer];
                let mut levels = [0.0f32; 2 * VOTERS + 1];
                let mut count = 0;
                let mut distance_m = 0.0;
                for step in 0..=2 * VOTERS {
                    let neighbour = (sector + sectors + step - VOTERS) % sectors;
                    let ring = self.rings[neighbour][layer];
                    let is_alike = own.distance_m == 0.0
                        || (ring.distance_m - own.distance_m).abs() < 0.35 * own.distance_m;
                    if ring.distance_m > 0.0 && is_alike {
                        levels[count] = ring.level_m;
                        distance_m += ring.distance_m;
                        count += 1;
                    }
                }
                self.voted[sector][layer] = if count < FEWEST_VOTES && own.distance_m == 0.0 {
                    Ring::default()
                } else {
                    let levels = &mut levels[..count];
                    let (_, level_m, _) = levels.select_nth_unstable_by(count / 2, f32::total_cmp);
                    Ring {
                        distance_m: distance_m / count as f32,
                        level_m: *level_m,
                    }
                };
            }
        }
    }

    /// The ground along the columns: stretches of them, and how high it is there above the plane.
    pub(super) fn stretches(&self) -> impl Iterator<Item = (Range<usize>, &Profile)> {
        let mut first = 0;
        self.sector_of.chunk_by(|a, b| a == b).map(move |columns| {
            let stretch = first..first + columns.len();
            first = stretch.end;
            (stretch, &self.profiles[columns[0] as usize])
        })
    }
}

/// The points of a revolution.
struct Points<'a> {
    scan: &'a Scan,
    /// Above the plane.
    heights_m: &'a [f32],
    distances_m: &'a [f32],
}

/// The layers of a column that have a return, and those whose return is near and low enough to
/// be the ground, a bit for each.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn low_returns(
    ranges_m: &[f32; MAX_LAYERS],
    heights_m: &[f32; MAX_LAYERS],
    distances_m: &[f32; MAX_LAYERS],
) -> (u32, u32) {
    let (mut returns, mut low) = (0, 0);
    for layer in 0..MAX_LAYERS {
        let is_return = ranges_m[layer] > 0.0;
        let is_low = (distances_m[layer] < FARTHEST_M)
            & (heights_m[layer] < HIGHEST_M + STEEPEST * distances_m[layer]);
        returns |= u32::from(is_return) << layer;
        low |= u32::from(is_return & is_low) << layer;
    }
    (returns, low)
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
            && (ring.level_m - expected_m).abs() < SLACK_M + bend * run_m
            && (ring.level_m - last.level_m).abs() < SLACK_M + STEEPEST * run_m;
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

    #[test]
    fn a_rise_is_followed_and_a_car_on_it_is_not() {
        let scan = rising_road(0.06);
        let mut surface = Surface::new(72);
        let heights_m: Vec<f32> = scan.z_m().iter().map(|z| z + 1.8).collect();
        let mut distances_m = vec![0.0; scan.len()];
        distances(&scan, &mut distances_m);
        surface.find(&scan, &heights_m, &distances_m, &[]);
        for column in [10, 400, 1200] {
            let mut stretches = surface.stretches();
            let (_, profile) = stretches
                .find(|(stretch, _)| stretch.contains(&column))
                .unwrap();
            assert!(ground_m(profile, 8.0).abs() < 0.1);
            let level_m = ground_m(profile, 20.0);
            assert!((level_m - 0.6).abs() < 0.15, "{column}: {level_m}");
        }
    }
}
