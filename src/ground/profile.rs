//! How high the ground is along one direction.

use super::passes;
use super::surface::{Ring, STEEPEST};
use crate::cloud::MAX_LAYERS;
use crate::float::greatest;

/// Rings closer to each other say nothing of a slope.
const SHORTEST_RUN_M: f32 = 0.1;

/// Heights above the plane along a direction: straight between knots.
#[derive(Debug, Clone, Copy)]
pub(super) struct Profile {
    count: usize,
    knots: [Knot; Self::MOST],
}

/// Where the slope of the ground changes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Knot {
    pub(super) distance_m: f32,
    pub(super) level_m: f32,
    /// Behind it.
    pub(super) slope: f32,
}

/// A change of the ground's slope.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bend {
    distance_m: f32,
    slope: f32,
}

impl Bend {
    const NONE: Self = Self {
        distance_m: f32::INFINITY,
        slope: 0.0,
    };

    /// How much higher the ground is at a distance than without it.
    #[inline(always)]
    pub(super) fn rise_m(self, distance_m: f32) -> f32 {
        self.slope * greatest(distance_m - self.distance_m, 0.0)
    }
}

impl Profile {
    /// Every layer's ring, the sensor, and the end of what the last one says; bends are looked at
    /// in fours.
    const MOST: usize = (MAX_LAYERS + 2).next_multiple_of(passes::BENDS);

    pub(super) const FLAT: Self = Self {
        count: 1,
        knots: [Knot {
            distance_m: 0.0,
            level_m: 0.0,
            slope: 0.0,
        }; Self::MOST],
    };

    /// Its knots from the inside out; the first one is below the sensor.
    pub(super) fn knots(&self) -> &[Knot] {
        &self.knots[..self.count]
    }

    /// Where it bends, and how much: below the sensor it is 0 high, elsewhere the sum of the rises
    /// behind its bends. Filled up with some that bend nothing.
    pub(super) fn bends(&self) -> [Bend; Self::MOST] {
        let mut bends = [Bend::NONE; Self::MOST];
        let mut slope = 0.0;
        for (bend, knot) in bends.iter_mut().zip(self.knots()) {
            *bend = Bend {
                distance_m: knot.distance_m,
                slope: knot.slope - slope,
            };
            slope = knot.slope;
        }
        bends
    }

    /// Through the rings that are the ground, from the inside out.
    pub(super) fn through(rings: &[Ring; MAX_LAYERS]) -> Self {
        let mut profile = Self::FLAT;
        let mut run_m = 0.0;
        for ring in rings {
            let last = profile.count - 1;
            if ring.distance_m > profile.knots[last].distance_m {
                run_m = ring.distance_m - profile.knots[last].distance_m;
                profile.knots[last].slope = (ring.level_m - profile.knots[last].level_m) / run_m;
                profile.push(ring.distance_m, ring.level_m);
            }
        }
        // Beyond the last ring it goes on as it came there, for as far as that was, if it came
        // so for two rings: a single rise is a kerb.
        let last = profile.count - 1;
        if last > 0 && run_m > SHORTEST_RUN_M {
            let slope = profile.knots[last - 1].slope.clamp(-STEEPEST, STEEPEST);
            let before = last
                .checked_sub(2)
                .map_or(0.0, |ring| profile.knots[ring].slope);
            let slope = if slope > 0.0 {
                slope.min(before.max(0.0))
            } else {
                slope.max(before.min(0.0))
            };
            profile.knots[last].slope = slope;
            let (distance_m, level_m) =
                (profile.knots[last].distance_m, profile.knots[last].level_m);
            profile.push(distance_m + run_m, level_m + slope * run_m);
        }
        profile
    }

    fn push(&mut self, distance_m: f32, level_m: f32) {
        self.knots[self.count] = Knot {
            distance_m,
            level_m,
            slope: 0.0,
        };
        self.count += 1;
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::ground::passes::lower;

    /// How high the ground is above the plane.
    pub(in crate::ground) fn ground_m(profile: &Profile, distance_m: f32) -> f32 {
        let mut height_m = [0.0];
        lower(profile, &[distance_m], &mut height_m);
        -height_m[0]
    }

    #[test]
    fn a_kerb_goes_on_level_and_a_slope_as_it_came() {
        let behind = |levels_m: [f32; 3]| {
            let mut rings = [Ring::default(); MAX_LAYERS];
            let ways = [12.0, 16.5, 22.5].into_iter().zip(levels_m);
            for (ring, (distance_m, level_m)) in rings.iter_mut().zip(ways) {
                *ring = Ring {
                    distance_m,
                    level_m,
                };
            }
            ground_m(&Profile::through(&rings), 28.5)
        };
        assert!((behind([0.0, 0.0, 0.12]) - 0.12).abs() < 1e-6);
        assert!((behind([0.0, 0.0, -0.12]) + 0.12).abs() < 1e-6);
        assert!((behind([0.5, 0.95, 1.55]) - 2.15).abs() < 1e-3);
        assert!((behind([-0.5, -0.95, -1.55]) + 2.15).abs() < 1e-3);
    }
}
