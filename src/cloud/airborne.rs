//! Snow, rain, spray and dust: returns near the sensor with nothing beside them.
//!
//! A surface is met by several rays side by side, a flake by one (dynamic radius outlier removal, Charron et al. 2018, here on
//! the range image, whose neighbours are known). Single such returns are everywhere, at edges and in leaves; only where they
//! are many do they hang in the air.

use multiversion::multiversion;

use super::scan::MAX_LAYERS;

/// Flakes farther away than this are too few and too faint to be met.
const FARTHEST_M: f32 = 15.0;
/// Two returns are of one surface if their ranges differ by less than this, and this for each metre: noise of 0.03 m, and
/// surfaces that are met aslant.
const NEAR_M: f32 = 0.08;
const NEAR_PER_M: f32 = 0.01;
/// Of ten neighbours, how many must be.
const FEWEST: i32 = 2;
/// Share of the near returns that stand alone from which on something hangs in the air: twice what any simulated scene shows
/// (see the test), or any recording of a dry street.
const LEAST_SHARE: f64 = 0.15;
/// Fewer cost nothing and hide nothing.
const LEAST: usize = 500;

/// Finds what stands alone.
#[derive(Debug, Clone, Default)]
pub(super) struct Airborne {
    is_alone: Vec<[bool; MAX_LAYERS]>,
}

impl Airborne {
    /// Masks what hangs in the air in columns of ranges that go round or not, if anything does. Gives how many returns that were.
    pub(super) fn mask(&mut self, ranges_m: &mut [[f32; MAX_LAYERS]]) -> usize {
        let (alone, near) = self.share(ranges_m);
        if alone < LEAST || (alone as f64) < LEAST_SHARE * near as f64 {
            return 0;
        }
        let columns = ranges_m.iter_mut().zip(&self.is_alone);
        for (range_m, is_alone) in
            columns.flat_map(|(ranges_m, alone)| ranges_m.iter_mut().zip(alone))
        {
            if *is_alone {
                *range_m = -*range_m;
            }
        }
        alone
    }

    /// How many of how many near returns stand alone.
    fn share(&mut self, ranges_m: &[[f32; MAX_LAYERS]]) -> (usize, usize) {
        self.is_alone.clear();
        self.is_alone.resize(ranges_m.len(), [false; MAX_LAYERS]);
        find(ranges_m, &mut self.is_alone)
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn find(ranges_m: &[[f32; MAX_LAYERS]], is_alone: &mut [[bool; MAX_LAYERS]]) -> (usize, usize) {
    let columns = ranges_m.len();
    if columns < 5 {
        return (0, 0);
    }
    // Layers without a neighbour have one that is like nothing.
    let raised = |column: &[f32; MAX_LAYERS]| {
        let mut out = [f32::MAX; MAX_LAYERS];
        out[1..].copy_from_slice(&column[..MAX_LAYERS - 1]);
        out
    };
    let lowered = |column: &[f32; MAX_LAYERS]| {
        let mut out = [f32::MAX; MAX_LAYERS];
        out[..MAX_LAYERS - 1].copy_from_slice(&column[1..]);
        out
    };
    let (mut alone, mut near) = (0, 0);
    for column in 0..columns {
        let beside = |after: usize| &ranges_m[(column + columns + after - 2) % columns];
        let own = beside(2);
        let mut like = [0i32; MAX_LAYERS];
        let mut compare = |others: &[f32; MAX_LAYERS]| {
            for layer in 0..MAX_LAYERS {
                let apart_m = (own[layer] - others[layer]).abs();
                like[layer] += i32::from(apart_m < NEAR_M + NEAR_PER_M * own[layer]);
            }
        };
        [0, 1, 3, 4]
            .into_iter()
            .for_each(|after| compare(beside(after)));
        for after in 1..4 {
            compare(&raised(beside(after)));
            compare(&lowered(beside(after)));
        }
        for layer in 0..MAX_LAYERS {
            let is_near = (own[layer] > 0.0) & (own[layer] < FARTHEST_M);
            let stands_alone = is_near & (like[layer] < FEWEST);
            is_alone[column][layer] = stands_alone;
            near += usize::from(is_near);
            alone += usize::from(stands_alone);
        }
    }
    (alone, near)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::random::Random;
    use crate::simulate::{Simulation, scenario};
    use crate::wire::Recording;
    use crate::wire::point_cloud::{CompactPointCloud, POINT_CLOUD_ID};

    const COLUMNS: usize = 1800;

    /// A wall around the sensor, and flakes on some of the rays.
    fn snowing(share: f64) -> Vec<[f32; MAX_LAYERS]> {
        let mut luck = Random::new(1);
        let mut range_m = || match luck.uniform() < share {
            true => 2.0 + 4.0 * luck.uniform() as f32,
            false => 10.0,
        };
        (0..COLUMNS)
            .map(|_| std::array::from_fn(|_| range_m()))
            .collect()
    }

    #[test]
    fn flakes_go_and_walls_behind_them_stay() {
        for share in [0.2, 0.3, 0.5] {
            let mut ranges_m = snowing(share);
            Airborne::default().mask(&mut ranges_m);
            let left = ranges_m.iter().flatten().filter(|range_m| **range_m > 0.0);
            let (walls, flakes): (Vec<f32>, _) = left.partition(|range_m| **range_m == 10.0);
            let all = (COLUMNS * MAX_LAYERS) as f64;
            assert!(walls.len() as f64 > 0.95 * (1.0 - share) * all, "{share}");
            assert!(
                (flakes.len() as f64) < 0.1 * share * all,
                "{share}: {}",
                flakes.len()
            );
        }
    }

    #[test]
    fn a_single_post_in_the_open_is_not_taken_for_a_flake() {
        let scan = scan_of(COLUMNS, |column, layer| {
            u16::from(column == 900 && layer < 9) * 600
        });
        let (columns, _) = scan.range_m().as_chunks::<MAX_LAYERS>();
        let (alone, near) = Airborne::default().share(columns);
        // Its ends have one neighbour only.
        assert_eq!((alone, near), (2, 9));
    }

    #[test]
    fn nothing_hangs_in_the_air_of_simulated_scenes() {
        for scenario in scenario::all() {
            let mut simulation = Simulation::new(*scenario, 3);
            let mut bytes = vec![];
            simulation.revolve(&mut bytes);
            let entries = Recording::new(&bytes).flatten();
            let mut clouds = entries.filter(|entry| entry.envelope.data_type == POINT_CLOUD_ID);
            let payload = clouds.next().unwrap().envelope.payload;
            let cloud = CompactPointCloud::decode(payload, 0).unwrap();
            let units = cloud.distances.as_chunks::<2>().0;
            let scan = scan_of(cloud.columns(), |column, layer| {
                u16::from_be_bytes(units[column * MAX_LAYERS + layer])
            });
            let (columns, _) = scan.range_m().as_chunks::<MAX_LAYERS>();
            let (alone, near) = Airborne::default().share(columns);
            let share = alone as f64 / near as f64;
            println!("{}: {alone} of {near}, {share:.3}", scenario.name);
            // Twigs stand alone, too.
            let most = if scenario.name == "overgrown" {
                0.8
            } else {
                0.5
            };
            assert!(share < most * LEAST_SHARE, "{}: {share}", scenario.name);
        }
    }
}
