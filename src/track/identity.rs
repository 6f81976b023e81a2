//! Ids go from old clusters to new ones (thesis section 4.1.3, "Cluster Tracking").

use super::TrackParameters;
use crate::time::Time;

/// Clusters that were seen, with their ids.
#[derive(Debug, Clone, Default)]
pub(super) struct Identities {
    next: u32,
    known: Vec<Known>,
    ids: Vec<u32>,
    moved: Vec<[f64; 2]>,
}

#[derive(Debug, Clone, Copy)]
struct Known {
    id: u32,
    centre_m: [f64; 2],
    time: Time,
}

impl Identities {
    pub(super) fn forget(&mut self) {
        self.known.clear();
    }

    /// Whether an id can still be handed on.
    pub(super) fn knows(&self, id: u32) -> bool {
        self.known.iter().any(|known| known.id == id)
    }

    /// The ids of new clusters: that of the nearest old one within the gate, else the next
    /// one in ascending order. Every old cluster hands its id to the nearest new one, and to
    /// others only within the distance at which they may be pieces of one object. Where an
    /// object is expected already (`owner`), a new cluster is a piece of it.
    pub(super) fn assign(
        &mut self,
        centres_m: &[[f64; 2]],
        now: Time,
        velocity: impl Fn(u32) -> [f64; 2],
        owner: impl Fn(&[f64; 2]) -> Option<u32>,
        parameters: &TrackParameters,
    ) -> &[u32] {
        self.move_known(now, velocity, parameters.predict);
        let nearest: Vec<Option<(f64, usize)>> = centres_m
            .iter()
            .map(|centre| self.nearest(centre, parameters.association_distance_m))
            .collect();
        let heirs = self.heirs(&nearest);
        self.ids.clear();
        for (new, (nearest, centre_m)) in nearest.iter().zip(centres_m).enumerate() {
            let id = match (owner(centre_m), nearest) {
                (Some(id), _) => id,
                (None, Some((distance_m, old)))
                    if heirs[*old] == Some(new) || *distance_m <= parameters.share_distance_m =>
                {
                    self.known[*old].id
                }
                _ => {
                    let id = self.next;
                    self.next = self.next.wrapping_add(1);
                    id
                }
            };
            self.ids.push(id);
        }
        self.remember(centres_m, now, parameters.memory_s);
        &self.ids
    }

    fn move_known(&mut self, now: Time, velocity: impl Fn(u32) -> [f64; 2], predict: bool) {
        self.moved.clear();
        self.moved.extend(self.known.iter().map(|known| {
            let [vx, vy] = if predict {
                velocity(known.id)
            } else {
                [0.0; 2]
            };
            let passed_s = (now - known.time).seconds();
            [
                known.centre_m[0] + vx * passed_s,
                known.centre_m[1] + vy * passed_s,
            ]
        }));
    }

    /// The nearest old cluster; of equally near ones, the one with the lowest id.
    fn nearest(&self, centre_m: &[f64; 2], gate_m: f64) -> Option<(f64, usize)> {
        self.moved
            .iter()
            .map(|old| libm::hypot(old[0] - centre_m[0], old[1] - centre_m[1]))
            .enumerate()
            .filter(|(_, distance_m)| *distance_m <= gate_m)
            .map(|(old, distance_m)| (distance_m, self.known[old].id, old))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map(|(distance_m, _, old)| (distance_m, old))
    }

    /// For each old cluster, the nearest of the new ones that it is nearest to.
    fn heirs(&self, nearest: &[Option<(f64, usize)>]) -> Vec<Option<usize>> {
        let mut heirs: Vec<Option<usize>> = vec![None; self.known.len()];
        for (new, candidate) in nearest.iter().enumerate() {
            let Some((distance_m, old)) = candidate else {
                continue;
            };
            let is_nearer = |heir: usize| nearest[heir].is_none_or(|(best, _)| *distance_m < best);
            if heirs[*old].is_none_or(is_nearer) {
                heirs[*old] = Some(new);
            }
        }
        heirs
    }

    /// New clusters replace the old ones of the same id; others stay for a while.
    fn remember(&mut self, centres_m: &[[f64; 2]], now: Time, memory_s: f64) {
        let ids = &self.ids;
        self.known.retain(|known| {
            let passed_s = (now - known.time).seconds();
            (0.0..=memory_s).contains(&passed_s) && !ids.contains(&known.id)
        });
        let seen = ids.iter().zip(centres_m);
        self.known.extend(seen.map(|(id, centre_m)| Known {
            id: *id,
            centre_m: *centre_m,
            time: now,
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::Profile;

    struct Scene {
        identities: Identities,
        parameters: TrackParameters,
        micros: i64,
    }

    impl Scene {
        fn new(profile: Profile) -> Self {
            Self {
                identities: Identities::default(),
                parameters: TrackParameters::profile(profile),
                micros: 0,
            }
        }

        fn assign(&mut self, centres_m: &[[f64; 2]]) -> Vec<u32> {
            self.micros += 100_000;
            let now = Time::from_micros(self.micros);
            let still = |_| [0.0; 2];
            let nobody = |_: &[f64; 2]| None;
            self.identities
                .assign(centres_m, now, still, nobody, &self.parameters)
                .to_vec()
        }
    }

    #[test]
    fn ids_ascend_and_stay_with_the_nearest_within_three_metres() {
        let mut scene = Scene::new(Profile::Thesis);
        assert_eq!(scene.assign(&[[0.0, 0.0], [10.0, 0.0]]), [0, 1]);
        assert_eq!(
            scene.assign(&[[10.5, 0.0], [1.0, 0.0], [20.0, 0.0]]),
            [1, 0, 2]
        );
        assert_eq!(scene.assign(&[[4.1, 0.0]]), [3]);
    }

    #[test]
    fn in_the_thesis_several_clusters_share_an_id_and_a_gap_costs_it() {
        let mut scene = Scene::new(Profile::Thesis);
        assert_eq!(scene.assign(&[[0.0, 0.0]]), [0]);
        assert_eq!(scene.assign(&[[1.0, 0.0], [-1.5, 0.0]]), [0, 0]);
        assert!(scene.assign(&[]).is_empty());
        assert_eq!(scene.assign(&[[1.0, 0.0]]), [1]);
    }

    #[test]
    fn by_default_a_neighbour_takes_no_id_and_a_short_gap_costs_none() {
        let mut scene = Scene::new(Profile::Default);
        assert_eq!(scene.assign(&[[0.0, 0.0]]), [0]);
        assert_eq!(scene.assign(&[[2.0, 0.0], [0.2, 0.0]]), [1, 0]);
        assert!(scene.assign(&[]).is_empty());
        assert_eq!(scene.assign(&[[0.2, 0.0], [2.0, 0.0]]), [0, 1]);
        for _ in 0..11 {
            scene.assign(&[]);
        }
        assert_eq!(scene.assign(&[[0.2, 0.0]]), [2]);
    }

    #[test]
    fn a_moving_cluster_is_expected_where_it_goes() {
        let mut identities = Identities::default();
        let parameters = TrackParameters::profile(Profile::Default);
        let at = |tenths: i64| Time::from_micros(tenths * 100_000);
        let along_x = |_| [10.0, 0.0];
        let nobody = |_: &[f64; 2]| None;
        assert_eq!(
            identities.assign(&[[0.0, 0.0]], at(0), along_x, nobody, &parameters),
            [0]
        );
        // Half a second unseen: five metres on.
        assert_eq!(
            identities.assign(&[[5.0, 0.0]], at(5), along_x, nobody, &parameters),
            [0]
        );
    }
}
