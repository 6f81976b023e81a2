//! DBSCAN over the rows of the array.

use super::partition::Partition;
use super::row::{Centre, Row};
use super::runs::{Run, Runs};
use super::window::Windows;
use super::{ClusterParameters, Clusters};
use crate::cloud::{MAX_LAYERS, Scan};

/// The cluster step. Its buffers are made once.
#[derive(Debug, Clone)]
pub struct Dbscan {
    parameters: ClusterParameters,
    windows: Windows,
    rows: Vec<Row>,
    /// Points that are looked at, in array order.
    candidates: Vec<u32>,
    /// Whether a point is its only neighbour.
    alone: Vec<bool>,
    runs: Runs,
    /// Number of the run of each core point.
    run_of: Vec<u32>,
    /// Runs that belong together, by their numbers.
    partition: Partition,
    /// Cluster of each set's first run, while clusters are numbered.
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
            candidates: vec![],
            alone: vec![],
            runs: Runs::default(),
            run_of: vec![],
            partition: Partition::default(),
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
        self.windows.prepare(scan);
        self.gather(scan, ground);
        self.find_core_points(scan);
        self.join_core_points(scan);
        self.number_clusters(scan);
        self.adopt_border_points(scan);
        self.collect_points();
        &self.clusters
    }

    fn gather(&mut self, scan: &Scan, ground: &[bool]) {
        self.candidates.clear();
        for (point, is_ground) in ground.iter().enumerate().take(scan.len()) {
            let (column, row) = (scan.column(point), &mut self.rows[scan.layer(point)]);
            if !scan.has_return(point) || *is_ground {
                row.remove(column);
                continue;
            }
            let eps_m = self.parameters.eps_m(scan.range_m()[point]);
            row.put(column, scan.point_m(point), eps_m);
            self.candidates.push(point as u32);
        }
        // The few are within any window of an exact search.
        let few = self.windows.clipped(scan.columns());
        for row in &mut self.rows {
            row.count_close(scan.columns(), few);
        }
    }

    fn centre(&self, scan: &Scan, point: usize) -> Centre {
        let range_m = scan.range_m()[point];
        Centre {
            column: scan.column(point),
            layer: scan.layer(point),
            position_m: scan.point_m(point),
            range_m,
            eps_m: self.parameters.eps_m(range_m),
        }
    }

    fn find_core_points(&mut self, scan: &Scan) {
        self.alone.clear();
        self.alone.resize(scan.len(), false);
        for point in &self.candidates {
            let point = *point as usize;
            let (column, layer) = (scan.column(point), scan.layer(point));
            let needed = self.parameters.min_points(scan.range_m()[point]);
            let mut neighbours = self.rows[layer].close(column);
            if neighbours < needed {
                neighbours = self.neighbours_up_to(&self.centre(scan, point), needed);
            }
            self.rows[layer].core[column] = neighbours >= needed;
            self.alone[point] = neighbours == 1;
        }
    }

    /// How many neighbours a point has, itself included; counting stops at `needed`.
    fn neighbours_up_to(&self, centre: &Centre, needed: u32) -> u32 {
        let mut found = 0;
        for (layer, reach) in self.layers(centre) {
            found += self.count(centre, layer, reach);
            if found >= needed {
                break;
            }
        }
        found
    }

    fn count(&self, centre: &Centre, layer: usize, reach: usize) -> u32 {
        let stretches = self.windows.stretches(centre.column, reach, reach);
        let counts = stretches.map(|stretch| self.rows[layer].count(stretch, centre));
        counts.into_iter().sum()
    }

    fn reach(&self, centre: &Centre, layer: usize) -> Option<usize> {
        self.windows
            .reach(centre.layer, layer, centre.range_m, centre.eps_m)
    }

    /// The layers that can hold neighbours of a point, with their reach: its own first, then
    /// those below and those above until one is too far. The farther a layer, the less it
    /// reaches.
    fn layers(&self, centre: &Centre) -> impl Iterator<Item = (usize, usize)> {
        let within = |layer: usize| self.reach(centre, layer).map(|reach| (layer, reach));
        let below = (0..centre.layer).rev().map_while(within);
        let above = (centre.layer + 1..MAX_LAYERS).map_while(within);
        within(centre.layer).into_iter().chain(below).chain(above)
    }

    /// Joins core points that are neighbours: first along the layers, then along the columns,
    /// then run by run with the runs of the same layer and of those above, because neighbours
    /// see each other.
    fn join_core_points(&mut self, scan: &Scan) {
        self.find_runs(scan);
        let mut partition = std::mem::take(&mut self.partition);
        partition.reset(self.runs.count());
        self.join_along_columns(scan, &mut partition);
        for layer in 0..MAX_LAYERS {
            for run in self.runs.of(layer) {
                self.join_run(scan, &mut partition, layer, run);
            }
        }
        self.partition = partition;
    }

    /// Core points of a layer that follow each other within reach are one run.
    fn find_runs(&mut self, scan: &Scan) {
        self.run_of.resize(scan.len(), 0);
        self.runs.clear();
        for layer in 0..MAX_LAYERS {
            let mut current: Option<Run> = None;
            for column in 0..scan.columns() {
                if !self.rows[layer].core[column] {
                    continue;
                }
                let point = scan.index(column, layer);
                let (range_m, at_m) = (scan.range_m()[point], scan.point_m(point));
                let goes_on = current
                    .as_mut()
                    .filter(|run| self.follows(scan, layer, run.columns.end - 1, column));
                if let Some(run) = goes_on {
                    run.extend(column, range_m, at_m);
                } else {
                    if let Some(run) = current.take() {
                        self.runs.push(layer, run);
                    }
                    current = Some(Run::of(self.runs.count(), column, range_m, at_m));
                }
                self.run_of[point] = self.runs.count() as u32;
            }
            if let Some(run) = current {
                self.runs.push(layer, run);
            }
        }
    }

    /// Whether a core point is a neighbour of the one before it in its layer.
    fn follows(&self, scan: &Scan, layer: usize, last: usize, column: usize) -> bool {
        if last + 1 == column {
            return self.rows[layer].follows(column);
        }
        let last = self.centre(scan, scan.index(last, layer));
        self.sees(&last, layer, column)
    }

    /// Joins the runs that have neighbours in one column of two layers that follow each other.
    fn join_along_columns(&self, scan: &Scan, partition: &mut Partition) {
        for (layer, rows) in self.rows.windows(2).enumerate() {
            let mut last = None;
            for column in 0..scan.columns() {
                if !rows[0].meets(&rows[1], column) {
                    continue;
                }
                let runs = [layer, layer + 1].map(|layer| self.run_of[scan.index(column, layer)]);
                if last.replace(runs) != Some(runs) {
                    partition.join(runs[0], runs[1]);
                }
            }
        }
    }

    /// Joins a run with all others that any of its points has a neighbour in. Its nearest
    /// point reaches farthest.
    fn join_run(&self, scan: &Scan, partition: &mut Partition, layer: usize, run: &Run) {
        let (near_m, far_m) = (run.low_m, run.high_m);
        let (eps_near_m, eps_far_m) = (self.parameters.eps_m(near_m), self.parameters.eps_m(far_m));
        for other in layer..MAX_LAYERS {
            let Some(reach) = self.windows.reach(layer, other, near_m, eps_near_m) else {
                break;
            };
            for stretch in self.windows.around(&run.columns, reach) {
                for candidate in self.runs.within(other, &stretch) {
                    if run.gap_squared(candidate) <= eps_far_m * eps_far_m
                        && partition.find(run.number) != partition.find(candidate.number)
                        && self.touch(scan, (layer, run), (other, candidate), reach)
                    {
                        partition.join(run.number, candidate.number);
                    }
                }
            }
        }
    }

    /// Whether any core point of one run is a neighbour of any of the other, `reach` columns
    /// off at most.
    fn touch(
        &self,
        scan: &Scan,
        (layer, run): (usize, &Run),
        (other_layer, other): (usize, &Run),
        reach: usize,
    ) -> bool {
        let core = |layer: usize| move |column: &usize| self.rows[layer].core[*column];
        let near = self.windows.around(&other.columns, reach).map(|stretch| {
            let start = stretch.start.max(run.columns.start);
            start..stretch.end.min(run.columns.end)
        });
        near.into_iter()
            .flatten()
            .filter(core(layer))
            .any(|column| {
                let centre = self.centre(scan, scan.index(column, layer));
                let row = &self.rows[other_layer];
                let stretches = self.windows.stretches(column, reach, reach);
                stretches.into_iter().any(|stretch| {
                    let start = stretch.start.max(other.columns.start);
                    let both = start..stretch.end.min(other.columns.end).max(start);
                    row.count(both.clone(), &centre) > 0
                        && both
                            .filter(core(other_layer))
                            .any(|column| row.is_neighbour(column, &centre))
                })
            })
    }

    /// Whether the point in a column is a neighbour of a point and in its window.
    fn sees(&self, centre: &Centre, layer: usize, column: usize) -> bool {
        let apart = centre.column.abs_diff(column);
        self.windows.clipped(apart) == apart && self.rows[layer].is_neighbour(column, centre)
    }

    /// Numbers clusters by their first core point.
    fn number_clusters(&mut self, scan: &Scan) {
        self.numbers.clear();
        self.numbers.resize(self.runs.count(), Clusters::NONE);
        let labels = &mut self.clusters.labels;
        labels.clear();
        labels.resize(scan.len(), Clusters::NONE);
        let mut clusters = 0;
        for point in self
            .candidates
            .iter()
            .filter(|point| is_core(&self.rows, scan, **point as usize))
        {
            let run = self.run_of[*point as usize];
            let number = &mut self.numbers[self.partition.find(run) as usize];
            if *number == Clusters::NONE {
                *number = clusters;
                clusters += 1;
            }
            labels[*point as usize] = *number;
        }
        self.clusters.ends.clear();
        self.clusters.ends.resize(clusters as usize, 0);
    }

    /// A point that is no core point belongs to the cluster of the nearest core point that is
    /// its neighbour (of equally near ones, the first in the array), else to none.
    fn adopt_border_points(&mut self, scan: &Scan) {
        for point in &self.candidates {
            let point = *point as usize;
            if is_core(&self.rows, scan, point) || self.alone[point] {
                continue;
            }
            if let Some(core) = self.nearest_core_point(scan, point) {
                self.clusters.labels[point] = self.clusters.labels[core];
            }
        }
    }

    fn nearest_core_point(&self, scan: &Scan, point: usize) -> Option<usize> {
        let centre = self.centre(scan, point);
        let mut nearest: Option<(f32, usize)> = None;
        for (layer, reach) in self.layers(&centre) {
            for stretch in self.windows.stretches(centre.column, reach, reach) {
                for column in stretch {
                    let other = scan.index(column, layer);
                    let distance = self.rows[layer].squared_distance(column, &centre);
                    if let Some(distance) = distance.filter(|_| self.rows[layer].core[column])
                        && nearest.is_none_or(|best| (distance, other) < best)
                    {
                        nearest = Some((distance, other));
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
        let labelled = || {
            let points = self.candidates.iter();
            points.filter(|point| labels[**point as usize] != Clusters::NONE)
        };
        for point in labelled() {
            ends[labels[*point as usize] as usize] += 1;
        }
        let mut total = 0;
        for end in ends.iter_mut() {
            // For now where the cluster begins; the loop below moves it to where it ends.
            total += std::mem::replace(end, total);
        }
        points.clear();
        points.resize(total, 0);
        for point in labelled() {
            let end = &mut ends[labels[*point as usize] as usize];
            points[*end] = *point;
            *end += 1;
        }
    }
}

fn is_core(rows: &[Row], scan: &Scan, point: usize) -> bool {
    rows[scan.layer(point)].core[scan.column(point)]
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
