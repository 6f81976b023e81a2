//! Ids go from old clusters to new ones (thesis section 4.1.3, "Cluster Tracking").

/// The clusters of the last revolution, with their ids.
#[derive(Debug, Clone, Default)]
pub(super) struct Identities {
    next: u32,
    known: Vec<(u32, [f64; 2])>,
    ids: Vec<u32>,
}

impl Identities {
    pub(super) fn forget(&mut self) {
        self.known.clear();
    }

    /// The ids of new clusters: that of the nearest old one within the gate, else the next one
    /// in ascending order. Several may have the same; what is not seen once is forgotten.
    pub(super) fn assign(&mut self, centres_m: &[[f64; 2]], gate_m: f64) -> &[u32] {
        self.ids.clear();
        for centre_m in centres_m {
            let id = self.nearest(centre_m, gate_m).unwrap_or_else(|| {
                let id = self.next;
                self.next = self.next.wrapping_add(1);
                id
            });
            self.ids.push(id);
        }
        self.known.clear();
        self.known
            .extend(self.ids.iter().copied().zip(centres_m.iter().copied()));
        &self.ids
    }

    /// The id of the nearest old cluster; of equally near ones, the lowest.
    fn nearest(&self, centre_m: &[f64; 2], gate_m: f64) -> Option<u32> {
        let distances = self.known.iter().map(|(id, old)| {
            let distance_m = libm::hypot(old[0] - centre_m[0], old[1] - centre_m[1]);
            (distance_m, *id)
        });
        distances
            .filter(|(distance_m, _)| *distance_m <= gate_m)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map(|(_, id)| id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_ascend_and_stay_with_the_nearest_within_three_metres() {
        let mut identities = Identities::default();
        assert_eq!(identities.assign(&[[0.0, 0.0], [10.0, 0.0]], 3.0), [0, 1]);
        assert_eq!(
            identities.assign(&[[10.5, 0.0], [1.0, 0.0], [20.0, 0.0]], 3.0),
            [1, 0, 2]
        );
        assert_eq!(identities.assign(&[[4.1, 0.0]], 3.0), [3]);
    }

    #[test]
    fn several_clusters_share_an_id_and_a_gap_costs_it() {
        let mut identities = Identities::default();
        assert_eq!(identities.assign(&[[0.0, 0.0]], 3.0), [0]);
        assert_eq!(identities.assign(&[[1.0, 0.0], [-1.5, 0.0]], 3.0), [0, 0]);
        assert!(identities.assign(&[], 3.0).is_empty());
        assert_eq!(identities.assign(&[[1.0, 0.0]], 3.0), [1]);
    }
}
