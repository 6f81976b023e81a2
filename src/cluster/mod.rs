//! Step four: returns that belong together, of those above the ground (thesis section 4.1.2) and not
//! above most road users.
//!
//! DBSCAN (Ester et al. 1996) without a tree: the array is sorted by azimuth and elevation
//! already, so that the neighbours of a point stand in a few columns of it. `filling` puts what is
//! clustered into `rows` without gaps, one for each layer. `density` counts the neighbours close by, which is
//! enough for most points; `window` says in which columns and layers all others can be, and `search`
//! compares a point with what stands there; `dbscan` is the algorithm. `joining` says which core
//! points belong together: those that follow each other are `runs`, those that meet are `sets` of
//! runs, and of sets only those whose `boxes` are near each other are looked at closer.

mod boxes;

mod dbscan;

mod density;

mod filling;

mod joining;

mod rows;

mod runs;

mod search;

mod sets;

mod window;

pub use dbscan::Dbscan;

use crate::float::{greatest, least};
use crate::parameter::{choices, parameters};

choices! {
    /// Where neighbours of a point are looked for.
    pub enum WindowSetting {
        /// Wherever they can be: the result is DBSCAN.
        Exact = "exact",
        /// A fixed number of columns to either side, in all layers, as in the thesis. Nearby
        /// surfaces then fall apart where their columns stand closer than eps.
        Columns = "columns",
    }
}

parameters! {
    /// The clusters: DBSCAN over the returns that are not ground.
    pub struct ClusterParameters "cluster" {
        /// Height above the ground up to which returns are clustered: people and cars are lower.
        /// Crowns of trees, fronts of houses and bridges are most of what is above it in a city; what
        /// goes on from a cluster, as a lorry does, the tracks add.
        highest_m: f64 = 2.5, thesis 1000.0, in 1.0..=1000.0, "m";
        /// Where neighbours of a point are looked for.
        window: WindowSetting = WindowSetting::Exact, thesis WindowSetting::Columns, "";
        /// Columns to either side when window is "columns": 2 makes 5 x 16 = 80 candidates.
        window_columns: usize = 2, in 1..=200, "columns";
        /// Distance within which two returns are neighbours, at range 0.
        eps_m: f64 = 0.5, thesis 1.8, in 0.05..=5.0, "m";
        /// What is added to that distance for each metre of range; of two returns, the nearer
        /// one's counts. Layers are 0.035 m apart for each metre.
        eps_per_m: f64 = 0.022, thesis 0.0, in 0.0..=0.1, "m/m";
        /// Neighbours, itself included, that make a return a core point near the sensor.
        min_points: usize = 8, thesis 5, in 1..=100, "returns";
        /// The same far from the sensor, where a pedestrian returns 7 points in all.
        min_points_far: usize = 3, thesis 5, in 1..=100, "returns";
        /// Range up to which min_points holds; behind it the number falls with 1/range, as the
        /// columns on a target do.
        min_points_range_m: f64 = 10.0, in 1.0..=100.0, "m";
    }
}

impl ClusterParameters {
    /// Neighbour distance of a return at a range.
    #[inline(always)]
    fn eps_m(&self, range_m: f32) -> f32 {
        self.eps_m as f32 + self.eps_per_m as f32 * range_m
    }

    /// Neighbours that make a return at a range a core point.
    fn min_points(&self, range_m: f32) -> u32 {
        // Rounded half up, in integers only.
        (self.more_than(range_m) + 1.0) as u32
    }

    /// So many neighbours are not enough, and one more is: [`ClusterParameters::min_points`]
    /// before it is made whole.
    #[inline(always)]
    fn more_than(&self, range_m: f32) -> f32 {
        let scaled = self.min_points as f32 * self.min_points_range_m as f32 / range_m;
        let bounded = greatest(
            least(scaled, self.min_points as f32),
            self.min_points_far as f32,
        );
        bounded - 0.5
    }
}

/// Clusters of one revolution: which points are of any, and those of each, in array order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Clusters {
    members: Vec<bool>,
    points: Vec<u32>,
    ends: Vec<usize>,
}

impl Clusters {
    /// The label of a point that belongs to no cluster.
    pub const NONE: u16 = u16::MAX;

    /// How many clusters there are.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// Of every point of the scan whether it is of a cluster.
    pub fn members(&self) -> &[bool] {
        &self.members
    }

    /// The cluster of every point of the scan, or [`Clusters::NONE`].
    pub fn labels(&self) -> Vec<u16> {
        let mut labels = vec![Self::NONE; self.members.len()];
        for (points, label) in self.iter().zip(0..) {
            for point in points {
                labels[*point as usize] = label;
            }
        }
        labels
    }

    /// The points of a cluster in array order.
    pub fn points(&self, cluster: usize) -> &[u32] {
        let start = match cluster {
            0 => 0,
            _ => self.ends[cluster - 1],
        };
        &self.points[start..self.ends[cluster]]
    }

    /// All clusters, ordered by their first core point.
    pub fn iter(&self) -> impl Iterator<Item = &[u32]> {
        (0..self.len()).map(|cluster| self.points(cluster))
    }
}
