//! DBSCAN over the array.

use multiversion::multiversion;

use super::joining::Joiner;
use super::rows::{Address, Rows};
use super::runs::{Core, Runs};
use super::search::Centre;
use super::window::{Cone, Windows};
use super::{ClusterParameters, Clusters, density};
use crate::cloud::{CAPACITY, Scan};
use crate::marks::marked;

/// The cluster step. Its buffers are made once.
#[derive(Debug, Clone)]
pub struct Dbscan {
    parameters: ClusterParameters,
    windows: Windows,
    rows: Rows,
    /// Points of which it is not known whether they are core points.
    open: Vec<Address>,
    /// Points that have neighbours, but are no core points.
    border: Vec<Centre>,
    joiner: Joiner,
    /// First point in the array of each set of runs, and that set's first run.
    firsts: Vec<(usize, usize)>,
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
            rows: Rows::new(),
            open: vec![],
            border: vec![],
            joiner: Joiner::new(),
            firsts: vec![],
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
        let (rows, windows, parameters) = (&mut self.rows, &mut self.windows, &self.parameters);
        windows.prepare(scan);
        rows.fill(scan, (ground, heights_m), parameters);
        density::count(rows, windows, parameters);
        find_open(rows, &mut self.open);
        find_core_points(rows, windows, parameters, &self.open, &mut self.border);
        // From here on only they count.
        density::keep_core(rows);
        self.joiner.join(&Core {
            parameters,
            windows,
            rows,
        });
        self.number_clusters();
        self.adopt_border_points();
        self.collect_points(scan.len());
        &self.clusters
    }

    /// Numbers clusters by their first core point.
    fn number_clusters(&mut self) {
        let Joiner {
            runs, partition, ..
        } = &mut self.joiner;
        let Clusters { ends, .. } = &mut self.clusters;
        partition.flatten();
        let sets = partition.parents();
        self.firsts.clear();
        self.numbers.clear();
        for (number, (run, set)) in runs.all().iter().zip(sets).enumerate() {
            let (point, set) = (self.rows.point(run.first()), *set as usize);
            if set == number {
                // For now where the set stands among the firsts.
                self.numbers.push(self.firsts.len() as u16);
                self.firsts.push((point, set));
            } else {
                let place = self.numbers[set];
                self.numbers.push(place);
                let first = &mut self.firsts[usize::from(place)].0;
                *first = point.min(*first);
            }
        }
        self.firsts.sort_unstable();
        for (number, (_, set)) in self.firsts.iter().enumerate() {
            self.numbers[*set] = number as u16;
        }
        ends.clear();
        ends.resize(self.firsts.len(), 0);
        for (number, (run, set)) in runs.all().iter().zip(sets).enumerate() {
            self.numbers[number] = self.numbers[*set as usize];
            ends[usize::from(self.numbers[number])] += run.places().len();
        }
    }

    /// A point that is no core point belongs to the cluster of the nearest core point that is
    /// its neighbour (of equally near ones, the first in the array), else to none.
    fn adopt_border_points(&mut self) {
        let runs = &mut self.joiner.runs;
        for centre in &self.border {
            if let Some(core) = nearest(centre, &self.rows, &self.windows) {
                runs.adopt(self.rows.point(centre.address), core);
                let run = usize::from(runs.of_points(CAPACITY)[core]);
                self.clusters.ends[usize::from(self.numbers[run])] += 1;
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
        let runs = self.joiner.runs.of_points(len);
        members.clear();
        members.extend(runs.iter().map(|run| *run != Runs::NONE));
        // Where the next point of the cluster goes to which the last one went.
        let (mut cluster, mut next) = (0, ends.first().copied().unwrap_or_default());
        for point in marked(members) {
            let own = usize::from(self.numbers[usize::from(runs[point])]);
            if own != cluster {
                ends[cluster] = next;
                (cluster, next) = (own, ends[own]);
            }
            points[next] = point as u32;
            next += 1;
        }
        if let Some(end) = ends.get_mut(cluster) {
            *end = next;
        }
    }
}

/// Finds the points of which those close by did not say enough.
fn find_open(rows: &Rows, open: &mut Vec<Address>) {
    open.clear();
    for (layer, row) in rows.all().iter().enumerate() {
        let places = row.places();
        let marked = marked(&row.is_open[places.clone()]);
        open.extend(marked.map(|place| Address {
            layer,
            place: places.start + place,
        }));
    }
}

/// Looks closer at the points of which those close by did not say enough, and notes those that have
/// neighbours, but not enough.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn find_core_points(
    rows: &mut Rows,
    windows: &Windows,
    parameters: &ClusterParameters,
    open: &[Address],
    border: &mut Vec<Centre>,
) {
    border.clear();
    for address in open {
        let centre = Centre::of(rows, *address, parameters);
        let needed = parameters.min_points(centre.range_m);
        let neighbours = neighbours_up_to(needed, &centre, rows, windows);
        rows.of_mut(address.layer).is_core[address.place] = neighbours >= needed;
        if (2..needed).contains(&neighbours) {
            border.push(centre);
        }
    }
}

/// How many neighbours a point has, itself included, if they are less than `needed`; else that many
/// at least.
#[inline(always)]
fn neighbours_up_to(needed: u32, centre: &Centre, rows: &Rows, windows: &Windows) -> u32 {
    let own = centre.address.layer;
    let cone = Cone::around(centre.range_m, centre.eps_m);
    let (layers, reach) = windows.extent(own, cone);
    let stretches = windows.stretches(centre.column, reach);
    let mut found = 0;
    // Most neighbours are in its own layer, and most of the others above the ground.
    for layer in (own..layers.end).chain((layers.start..own).rev()) {
        for columns in stretches.iter().filter(|columns| !columns.is_empty()) {
            found += centre.count(rows.of(layer), rows.places(layer, columns));
        }
        if found >= needed {
            break;
        }
    }
    found
}

/// The point of the array that is the nearest neighbour of a return; of equally near ones the first.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn nearest(centre: &Centre, rows: &Rows, windows: &Windows) -> Option<usize> {
    let cone = Cone::around(centre.range_m, centre.eps_m);
    let (layers, reach) = windows.extent(centre.address.layer, cone);
    let mut best = (f32::INFINITY, usize::MAX);
    for layer in layers {
        let row = rows.of(layer);
        for columns in windows.stretches(centre.column, reach) {
            let places = rows.places(layer, &columns);
            let squared = centre.squared_to_nearest(row, places.clone());
            if squared < f32::INFINITY
                && squared <= best.0
                && let Some(place) = centre.first_at(squared, row, places)
            {
                let nearest = (squared, rows.point(Address { layer, place }));
                best = if nearest < best { nearest } else { best };
            }
        }
    }
    (best.0 < f32::INFINITY).then_some(best.1)
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
    fn what_is_higher_than_most_road_users_is_not_clustered() {
        let scan = scan_of(1800, |column, _| if column < 20 { 1000 } else { 0 });
        let heights_m: Vec<f32> = scan.z_m().iter().map(|z| z + 2.0).collect();
        let ground = vec![false; scan.len()];
        let clustered = |profile| {
            let mut dbscan = Dbscan::new(&ClusterParameters::profile(profile));
            let clusters = dbscan.process(&scan, &ground, &heights_m);
            assert_eq!(clusters.len(), 1);
            clusters.points(0).to_vec()
        };
        let low = clustered(Profile::Default);
        assert!(low.iter().all(|point| heights_m[*point as usize] <= 2.5));
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
