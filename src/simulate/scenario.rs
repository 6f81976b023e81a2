//! Scenes: who is there, on which path, and what stands around.

use super::path::Path;
use super::scenery::Scenery;
use super::scenes;
use super::terrain::Terrain;
use super::variant::Variant;
use crate::random::Random;
use crate::roadmap::Roadmap;

/// A road user on its path.
#[derive(Debug, Clone)]
pub struct Actor {
    /// What it looks like.
    pub variant: Variant,
    /// Where it goes.
    pub path: Path,
}

/// In which messages the vehicle says where it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PoseMessages {
    /// It does not.
    None,
    /// Applanix position group 1.
    Applanix,
    /// OpenDLV's position and heading.
    OpenDlv,
}

/// A scene at its beginning.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Height of the sensor above the road.
    pub sensor_height_m: f64,
    /// How the sensor's vehicle goes.
    pub ego: Path,
    /// How it says so.
    pub poses: PoseMessages,
    /// Who is there.
    pub actors: Vec<Actor>,
    pub(super) scenery: Scenery,
    pub(super) terrain: Terrain,
    /// Standard deviation of a range at right angles.
    pub(super) range_deviation_m: f64,
}

/// A scene that can be made.
#[derive(Debug, Clone, Copy)]
pub struct Scenario {
    /// The name on the command line.
    pub name: &'static str,
    /// What happens, in a line.
    pub summary: &'static str,
    pub(super) build: fn(&mut Random) -> Scene,
    /// The map of its roads, if it has roundabouts.
    pub(super) roads: Option<fn() -> Roadmap>,
}

impl Scenario {
    /// The scene of a seed: vehicles, sizes and speeds differ from seed to seed.
    pub fn scene(&self, seed: u64) -> Scene {
        (self.build)(&mut Random::new(seed))
    }

    /// The map of its roads, if it has roundabouts.
    pub fn roads(&self) -> Option<Roadmap> {
        self.roads.map(|make| make())
    }
}

/// All scenarios.
pub fn all() -> &'static [Scenario] {
    scenes::ALL
}

/// A scenario by its name.
pub fn find(name: &str) -> Option<Scenario> {
    all().iter().find(|scenario| scenario.name == name).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_find_their_scenarios() {
        for scenario in all() {
            assert_eq!(
                find(scenario.name).map(|found| found.name),
                Some(scenario.name)
            );
        }
        assert!(find("nowhere").is_none());
    }

    /// Circles along a road user's length that it fills.
    fn discs(actor: &Actor, seconds: f64) -> (Vec<[f64; 2]>, f64) {
        let ([length_m, width_m, _], moment) = (actor.variant.size_m, actor.path.at(seconds));
        let radius_m = 0.45 * width_m;
        let reach_m = (0.5 * length_m - radius_m).max(0.0);
        let (sine, cosine) = moment.yaw_rad.sin_cos();
        let [x, y] = moment.position_m;
        let steps = (-3..=3).map(|step| reach_m * f64::from(step) / 3.0);
        let discs = steps.map(|along_m| [x + along_m * cosine, y + along_m * sine]);
        (discs.collect(), radius_m)
    }

    #[test]
    fn nobody_runs_into_anybody() {
        let mut crashes = std::collections::BTreeMap::new();
        for scenario in all() {
            for seed in 1..=20 {
                let scene = scenario.scene(seed);
                let ego = Actor {
                    variant: Variant {
                        size_m: [4.5, 1.9, 1.5],
                        ..Variant::car(&mut Random::new(1))
                    },
                    path: scene.ego.clone(),
                };
                let all: Vec<&Actor> = scene.actors.iter().chain([&ego]).collect();
                for tenth in 0..300 {
                    let seconds = f64::from(tenth) * 0.1;
                    for (a, first) in all.iter().enumerate() {
                        let (discs_a, radius_a_m) = discs(first, seconds);
                        for (b, second) in all.iter().enumerate().skip(a + 1) {
                            let (discs_b, radius_b_m) = discs(second, seconds);
                            let apart_m = discs_a
                                .iter()
                                .flat_map(|[x, y]| {
                                    discs_b.iter().map(move |[u, v]| (u - x).hypot(v - y))
                                })
                                .fold(f64::MAX, f64::min);
                            if apart_m <= radius_a_m + radius_b_m {
                                let times = crashes.entry((scenario.name, a, b));
                                times.or_insert_with(Vec::new).push((seed, seconds));
                            }
                        }
                    }
                }
            }
        }
        let found: Vec<_> = crashes
            .iter()
            .map(|(who, when)| (who, when.first(), when.last(), when.len()))
            .collect();
        assert!(found.is_empty(), "{found:#?}");
    }
}
