//! DBSCAN over the array.

use std::ops::Range;

use super::density::Density;
use super::joining::Joiner;
use super::returns::{Centre, FARTHEST, Returns, nearer};
use super::runs::Core;
use super::window::{Cone, Windows};
use super::{ClusterParameters, Clusters};
use crate::cloud::Scan;
use crate::float::least;
use crate::marks::marked;

/// The cluster step. Its buffers are made once.
#[derive(Debug, Clone)]
pub struct Dbscan {
    parameters: ClusterParameters,
    windows: Windows,
    density: Density,
    /// Points that have neighbours, but are no core points.
    border: Vec<Centre>,
    joiner: Joiner,
    /// Cluster of each run.
    numbers: Vec<u16>,
    clusters: Clusters,
}

impl Dbscan {
    /// A cluster step with its buffers.
    pub fn new(parameters: &ClusterParameters) -> Self {
        Self {
            parameters: parameters.clone(),
            windows: Windows::new(parameters),
            density: Density::new(),
            border: vec![],
            joiner: Joiner::new(),
            numbers: vec![],
            clusters: Clusters::default(),
        }
    }

    /// The clusters of the last revolution.
    pub fn clusters(&self) -> &Clusters {
        &self.clusters
    }

    /// Finds the clusters of the returns that `ground` does not mark, and that are not too high
    /// above it.
    pub fn process(&mut self, scan: &Scan, ground: &[bool], heights_m: &[f32]) -> &Clusters {
        self.windows.prepare(scan);
        // The few are within any window of an exact search.
        let few = self.windows.clipped(scan.columns());
        self.density
            .count(scan, (ground, heights_m), few, &self.parameters);
        self.find_core_points(scan);
        // From here on only they count.
        self.density.keep_core(scan.len());
        let core = Core {
            parameters: &self.parameters,
            windows: &self.windows,
            returns: self.density.returns(scan),
        };
        self.joiner.join(&core, &self.density);
        self.number_clusters();
        self.adopt_border_points(scan);
        self.collect_points(scan.len());
        &self.clusters
    }

    /// Looks closer at the points of which those close by did not say enough.
    fn find_core_points(&mut self, scan: &Scan) {
        self.border.clear();
        let (returns, is_open, is_core) = self.density.judged(scan);
        for point in marked(is_open) {
            let centre = returns.centre(point, &self.parameters);
            let needed = self.parameters.min_points(centre.range_m);
            let neighbours = neighbours_up_to(needed, &centre, &returns, &self.windows);
            is_core[point] = neighbours >= needed;
            if (2..needed).contains(&neighbours) {
                self.border.push(centre);
            }
        }
    }

    /// Numbers clusters by their first core point: runs are numbered by theirs already.
    fn number_clusters(&mut self) {
        let Joiner {
            runs, partition, ..
        } = &mut self.joiner;
        let Clusters { ends, .. } = &mut self.clusters;
        partition.flatten();
        self.numbers.clear();
        ends.clear();
        for (run, first) in partition.parents().iter().enumerate() {
            if *first as usize == run {
                // There are no more than runs.
                self.numbers.push(ends.len() as u16);
                ends.push(0);
            } else {
                self.numbers.push(self.numbers[*first as usize]);
            }
        }
        for (run, number) in runs.all().iter().zip(&self.numbers) {
            ends[usize::from(*number)] += run.columns().len();
        }
    }

    /// A point that is no core point belongs to the cluster of the nearest core point that is
    /// its neighbour (of equally near ones, the first in the array), else to none.
    fn adopt_border_points(&mut self, scan: &Scan) {
        let (returns, _, members) = self.density.judged(scan);
        let runs = &mut self.joiner.runs;
        for centre in &self.border {
            let (_, core) = nearest(centre, &returns, &self.windows);
            if let Some(run) = runs.numbers(scan.len()).get(core).copied() {
                self.clusters.ends[usize::from(self.numbers[usize::from(run)])] += 1;
                runs.adopt(centre.point, core);
                members[centre.point] = true;
            }
        }
    }

    /// Sorts points into their clusters by counting.
    fn collect_points(&mut self, len: usize) {
        let Clusters {
            members,
            points,
            ends,
        } = &mut self.clusters;
        let mut total = 0;
        for end in ends.iter_mut() {
            // For now where the cluster begins; the loop below moves it to where it ends.
            total += std::mem::replace(end, total);
        }
        points.resize(total, 0);
        members.clear();
        members.extend_from_slice(&self.density.is_core[..len]);
        let runs = self.joiner.runs.numbers(len);
        for point in marked(members) {
            let end = &mut ends[usize::from(self.numbers[usize::from(runs[point])])];
            points[*end] = point as u32;
            *end += 1;
        }
    }
}

/// Columns to either side in which the neighbours of a point are looked for first.
const FEW: usize = 8;

/// How many neighbours a point has, itself included, if they are less than `needed`; else that many
/// at least.
fn neighbours_up_to(needed: u32, centre: &Centre, returns: &Returns<'_>, windows: &Windows) -> u32 {
    let cone = Cone::around(centre.range_m, centre.eps_m);
    let (layers, reach) = windows.extent(centre.layer, cone);
    let count = |stretches: [Range<usize>; 2]| -> u32 {
        let counts = stretches.map(|columns| returns.count(&columns, &layers, centre));
        counts.into_iter().sum()
    };
    let few = reach.min(FEW);
    let mut found = count(windows.stretches(centre.column, few, few));
    if found < needed
        && let Some(sides) = windows.beside(centre.column, few, reach)
    {
        found += sides.into_iter().map(count).sum::<u32>();
    }
    found
}

/// The nearest neighbour of a point: squared distance and place.
fn nearest(centre: &Centre, returns: &Returns<'_>, windows: &Windows) -> (f32, usize) {
    /// Rounding must not lose a point that is as near as the nearest one so far.
    const SLACK: f32 = 1.001;
    let cone = Cone::around(centre.range_m, centre.eps_m);
    let (layers, reach) = windows.extent(centre.layer, cone);
    let nearest = |stretches: [Range<usize>; 2]| {
        let found = stretches.map(|columns| returns.nearest(&columns, &layers, centre));
        found.into_iter().fold(FARTHEST, nearer)
    };
    let few = reach.min(FEW);
    let found = nearest(windows.stretches(centre.column, few, few));
    // What is farther than the nearest one so far does not matter.
    let cone = Cone::around(centre.range_m, least(centre.eps_m, SLACK * found.0.sqrt()));
    let (_, reach) = windows.extent(centre.layer, cone);
    let sides = windows.beside(centre.column, few, reach);
    sides.into_iter().flatten().map(nearest).fold(found, nearer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::parameter::Profile;

    fn cluster(scan: &Scan, profile: Profile) -> Clusters {
        let ground = vec![false; scan.len()];
        Dbscan::new(&ClusterParameters::profile(profile))
            .process(scan, &ground, &vec![0.0; scan.len()])
            .clone()
    }

    #[test]
    fn two_posts_apart_are_two_clusters_and_a_stray_return_is_none() {
        let scan = scan_of(1800, |column, layer| match (column, layer) {
            (100..110, 4..9) | (200..210, 4..9) => 1000,
            (900, 3) => 1000,
            _ => 0,
        });
        let clusters = cluster(&scan, Profile::Default);
        assert_eq!(
            clusters.iter().map(<[u32]>::len).collect::<Vec<_>>(),
            [50, 50]
        );
        assert_eq!(clusters.labels()[scan.index(900, 3)], Clusters::NONE);
        assert_eq!(clusters.labels()[scan.index(205, 6)], 1);
        assert!(clusters.points(1).is_sorted());
    }

    #[test]
    fn the_azimuth_seam_is_no_edge() {
        for profile in Profile::ALL {
            let scan = scan_of(1800, |column, layer| match (column, layer) {
                (1795.. | ..5, 6..9) => 1000,
                _ => 0,
            });
            assert_eq!(cluster(&scan, profile).len(), 1);
        }
    }

    #[test]
    fn ground_is_not_clustered() {
        let scan = scan_of(1800, |_, _| 1000);
        let ground: Vec<bool> = (0..scan.len())
            .map(|point| scan.column(point) > 50)
            .collect();
        let mut dbscan = Dbscan::new(&ClusterParameters::profile(Profile::Default));
        let clusters = dbscan.process(&scan, &ground, &vec![0.0; scan.len()]);
        assert_eq!(clusters.len(), 1);
        assert_eq!(clusters.points(0).len(), 51 * 16);
    }

    #[test]
    fn what_hangs_above_all_road_users_is_not_clustered() {
        let scan = scan_of(1800, |column, _| if column < 20 { 1000 } else { 0 });
        let heights_m: Vec<f32> = scan.z_m().iter().map(|z| z + 4.0).collect();
        let ground = vec![false; scan.len()];
        let clustered = |profile| {
            let mut dbscan = Dbscan::new(&ClusterParameters::profile(profile));
            let clusters = dbscan.process(&scan, &ground, &heights_m);
            assert_eq!(clusters.len(), 1);
            clusters.points(0).to_vec()
        };
        let low = clustered(Profile::Default);
        assert!(low.iter().all(|point| heights_m[*point as usize] <= 4.5));
        // 1 degree up are 0.17 m, 3 degrees 0.52 m.
        assert_eq!(low.len(), 20 * 9);
        assert_eq!(clustered(Profile::Thesis).len(), 20 * 16);
    }

    #[test]
    fn a_wall_close_by_stays_whole_where_a_fixed_window_tears_it() {
        // Every sixth column returns: more than two columns apart, yet within eps.
        let scan = scan_of(1800, |column, layer| match (column % 6, layer) {
            (0, 5..8) if column < 120 => 500,
            _ => 0,
        });
        assert_eq!(cluster(&scan, Profile::Default).len(), 1);
        assert_eq!(cluster(&scan, Profile::Thesis).len(), 0);
    }

    #[test]
    fn a_pedestrian_at_forty_metres_is_a_cluster() {
        let scan = scan_of(1800, |column, layer| match (column, layer) {
            (300..304, 7) => 4000,
            _ => 0,
        });
        assert_eq!(cluster(&scan, Profile::Default).len(), 1);
    }
}
