//! DBSCAN over the rows of the array.

use super::joining::{Joiner, Points};
use super::row::{self, Centre, Row};
use super::turning;
use super::window::{Cone, Windows};
use super::{ClusterParameters, Clusters};
use crate::cloud::{MAX_COLUMNS, MAX_LAYERS, Scan};
use crate::marks::marked;

/// The cluster step. Its buffers are made once.
#[derive(Debug, Clone)]
pub struct Dbscan {
    parameters: ClusterParameters,
    windows: Windows,
    rows: Vec<Row>,
    /// Which of many pairs are neighbours, while they are counted.
    near: Box<[f32; MAX_COLUMNS]>,
    /// Points that their nearest do not make core points; later those of them that are none but
    /// have neighbours.
    open: Vec<Centre>,
    joiner: Joiner,
    /// First core point of each set of runs, and the set.
    firsts: Vec<(usize, u32)>,
    /// Cluster of each set of runs.
    numbers: Vec<i32>,
    clusters: Clusters,
}

impl Dbscan {
    /// A cluster step with its buffers.
    pub fn new(parameters: &ClusterParameters) -> Self {
        Self {
            parameters: parameters.clone(),
            windows: Windows::new(parameters),
            rows: (0..MAX_LAYERS).map(|_| Row::new()).collect(),
            near: Box::new([0.0; MAX_COLUMNS]),
            open: vec![],
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

    /// Finds the clusters of the returns that `ground` does not mark.
    pub fn process(&mut self, scan: &Scan, ground: &[bool]) -> &Clusters {
        let columns = scan.columns();
        self.windows.prepare(scan);
        turning::turn(scan, ground, &mut self.rows);
        // The few are within any window of an exact search.
        let few = self.windows.clipped(columns);
        for row in &mut self.rows {
            row::count_along(row, columns, few, &self.parameters, &mut self.near);
        }
        for layer in 1..MAX_LAYERS {
            let (below, above) = self.rows.split_at_mut(layer);
            let row = &mut below[layer - 1];
            row::count_across(row, &mut above[0], columns, few, &mut self.near);
        }
        for row in &mut self.rows {
            row::judge(row, columns, &self.parameters);
        }
        self.find_core_points(columns);
        // From here on only they count.
        for row in &mut self.rows {
            row::keep_core(row, columns);
        }
        let points = Points {
            parameters: &self.parameters,
            windows: &self.windows,
            columns,
        };
        self.joiner.join(&mut self.rows, points);
        self.number_clusters(scan);
        self.adopt_border_points(scan);
        self.collect_points();
        &self.clusters
    }

    /// Looks closer at the points of which the nearest along and across their layer did not say
    /// enough.
    fn find_core_points(&mut self, columns: usize) {
        self.open.clear();
        for layer in 0..MAX_LAYERS {
            let row = &self.rows[layer];
            let open = marked(&row.is_open[..columns]);
            let centres = open.map(|column| row.centre(layer, column, &self.parameters));
            self.open.extend(centres);
        }
        let mut open = std::mem::take(&mut self.open);
        open.retain(|centre| {
            let needed = self.parameters.min_points(centre.range_m);
            let neighbours = self.neighbours_up_to(centre, needed);
            self.rows[centre.layer].core[centre.column] = neighbours >= needed;
            (2..needed).contains(&neighbours)
        });
        self.open = open;
    }

    /// How many neighbours a point has, itself included; counting stops at `needed`.
    fn neighbours_up_to(&self, centre: &Centre, needed: u32) -> u32 {
        let mut found = 0;
        for (layer, reach) in self.layers(centre) {
            let stretches = self.windows.stretches(centre.column, reach, reach);
            for stretch in stretches.into_iter().filter(|stretch| !stretch.is_empty()) {
                found += row::count(&self.rows[layer], stretch, centre);
            }
            if found >= needed {
                break;
            }
        }
        found
    }

    /// The layers that can hold neighbours of a point, with their reach: its own first, then
    /// those below and those above until one is too far. The farther a layer, the less it
    /// reaches.
    fn layers(&self, centre: &Centre) -> impl Iterator<Item = (usize, usize)> + use<'_> {
        let cone = Cone::around(centre.range_m, centre.eps_m);
        let own = centre.layer;
        let within = move |layer: usize| {
            let reach = self.windows.reach(own, layer, cone);
            reach.map(|reach| (layer, reach))
        };
        let below = (0..own).rev().map_while(within);
        let above = (own + 1..MAX_LAYERS).map_while(within);
        within(own).into_iter().chain(below).chain(above)
    }

    /// Numbers clusters by their first core point.
    fn number_clusters(&mut self, scan: &Scan) {
        let Joiner {
            runs, partition, ..
        } = &mut self.joiner;
        let layered =
            || (0..MAX_LAYERS).flat_map(|layer| runs.of(layer).iter().map(move |run| (layer, run)));
        self.firsts.clear();
        self.firsts
            .extend((0..runs.count() as u32).map(|set| (usize::MAX, set)));
        for (layer, run) in layered() {
            let first = &mut self.firsts[partition.find(run.number) as usize].0;
            *first = scan.index(run.columns.start, layer).min(*first);
        }
        self.firsts.retain(|(first, _)| *first != usize::MAX);
        self.firsts.sort_unstable();
        self.numbers.clear();
        self.numbers.resize(runs.count(), Clusters::NONE);
        for (number, (_, set)) in self.firsts.iter().enumerate() {
            self.numbers[*set as usize] = number as i32;
        }
        let Clusters { labels, ends, .. } = &mut self.clusters;
        ends.clear();
        ends.resize(self.firsts.len(), 0);
        labels.clear();
        labels.resize(scan.len(), Clusters::NONE);
        for (layer, run) in layered() {
            let number = self.numbers[partition.find(run.number) as usize];
            ends[number as usize] += run.points as usize;
            let (columns, own) = (run.columns.clone(), run.number as u16);
            let run_of = &self.rows[layer].run_of[columns.clone()];
            for (column, run) in columns.zip(run_of) {
                if *run == own {
                    labels[scan.index(column, layer)] = number;
                }
            }
        }
    }

    /// A point that is no core point belongs to the cluster of the nearest core point that is
    /// its neighbour (of equally near ones, the first in the array), else to none.
    fn adopt_border_points(&mut self, scan: &Scan) {
        for centre in &self.open {
            if let Some(core) = self.nearest_core_point(scan, centre) {
                let number = self.clusters.labels[core];
                self.clusters.labels[scan.index(centre.column, centre.layer)] = number;
                self.clusters.ends[number as usize] += 1;
            }
        }
    }

    fn nearest_core_point(&self, scan: &Scan, centre: &Centre) -> Option<usize> {
        /// Rounding must not lose a point that is as near as the best one.
        const SLACK: f32 = 1.001;
        let mut nearest: Option<(f32, usize)> = None;
        let mut cone = Cone::around(centre.range_m, centre.eps_m);
        for (layer, _) in self.layers(centre) {
            // What is farther than the best one does not matter.
            let Some(reach) = self.windows.reach(centre.layer, layer, cone) else {
                continue;
            };
            for stretch in self.windows.stretches(centre.column, reach, reach) {
                if let Some((squared, column)) = row::nearest(&self.rows[layer], stretch, centre) {
                    let found = (squared, scan.index(column, layer));
                    if nearest.is_none_or(|best| found < best) {
                        nearest = Some(found);
                        cone = Cone::around(centre.range_m, SLACK * squared.sqrt());
                    }
                }
            }
        }
        nearest.map(|(_, point)| point)
    }

    /// Sorts points into their clusters by counting.
    fn collect_points(&mut self) {
        let Clusters {
            labels,
            points,
            ends,
        } = &mut self.clusters;
        let mut total = 0;
        for end in ends.iter_mut() {
            // For now where the cluster begins; the loop below moves it to where it ends.
            total += std::mem::replace(end, total);
        }
        points.clear();
        points.resize(total, 0);
        for (point, label) in labels.iter().enumerate() {
            if *label != Clusters::NONE {
                let end = &mut ends[*label as usize];
                points[*end] = point as u32;
                *end += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::parameter::Profile;

    fn cluster(scan: &Scan, profile: Profile) -> Clusters {
        let ground = vec![false; scan.len()];
        Dbscan::new(&ClusterParameters::profile(profile))
            .process(scan, &ground)
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
        let clusters = dbscan.process(&scan, &ground);
        assert_eq!(clusters.len(), 1);
        assert_eq!(clusters.points(0).len(), 51 * 16);
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
