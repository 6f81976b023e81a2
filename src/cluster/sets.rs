//! Sets of runs that are known to belong together, and which of them do, too.

use std::ops::Range;

use super::ClusterParameters;
use super::boxes::{Bounds, Boxes};
use super::runs::{Core, Run};
use crate::partition::Partition;

/// The sets of a partition of the runs, in the order in which they begin along x. Its buffers are
/// made once.
#[derive(Debug, Clone, Default)]
pub(super) struct Sets {
    sets: Vec<Set>,
    boxes: Boxes,
    /// The place of each set in the order, by its first run; of other runs it says nothing.
    places: Vec<u32>,
    members: Members,
}

/// Runs that are known to belong together.
#[derive(Debug, Clone)]
struct Set {
    /// Number of its first run.
    first: u32,
    /// Around its runs.
    bounds: Bounds,
    /// Where its runs stand among the members of all sets.
    members: Range<usize>,
}

impl Sets {
    /// Takes over the runs, given the first run of the set of each.
    pub(super) fn gather(&mut self, runs: &[Run], firsts: &[u32], parameters: &ClusterParameters) {
        self.find(runs, firsts);
        self.sort();
        self.members.runs.resize(runs.len(), 0);
        for (first, number) in firsts.iter().zip(0..) {
            let set = &mut self.sets[self.places[*first as usize] as usize];
            self.members.runs[set.members.end] = number;
            set.members.end += 1;
        }
        let members = self.members.runs.iter();
        self.members
            .boxes
            .set(members.map(|run| &runs[*run as usize].bounds), parameters);
        self.boxes
            .set(self.sets.iter().map(|set| &set.bounds), parameters);
    }

    /// Finds the sets, and how many members each has.
    fn find(&mut self, runs: &[Run], firsts: &[u32]) {
        self.sets.clear();
        self.places.clear();
        for ((run, first), number) in runs.iter().zip(firsts).zip(0..) {
            self.places.push(self.sets.len() as u32);
            if *first == number {
                self.sets.push(Set {
                    first: number,
                    bounds: Bounds::NONE,
                    members: 0..0,
                });
            }
            let set = &mut self.sets[self.places[*first as usize] as usize];
            set.bounds.hold_all(&run.bounds);
            set.members.end += 1;
        }
    }

    /// Puts the sets in their order, and says where the members of each begin; there they end, too,
    /// as long as none was put there.
    fn sort(&mut self) {
        self.sets.sort_unstable_by(|a, b| {
            let by_x = a.bounds.low_m[0].total_cmp(&b.bounds.low_m[0]);
            by_x.then(a.first.cmp(&b.first))
        });
        let mut next = 0;
        for (set, place) in self.sets.iter_mut().zip(0..) {
            self.places[set.first as usize] = place;
            let count = set.members.len();
            set.members = next..next;
            next += count;
        }
    }

    /// Joins the sets of which any runs touch each other.
    pub(super) fn join(&mut self, runs: &[Run], partition: &mut Partition, core: &Core<'_>) {
        for (place, set) in self.sets.iter().enumerate() {
            let others = self
                .boxes
                .near_in_order(place + 1, &set.bounds, core.parameters);
            for other in others.map(|other| &self.sets[other]) {
                if partition.find(set.first) != partition.find(other.first)
                    && self.members.touch(set, other, runs, core)
                {
                    partition.join(set.first, other.first);
                }
            }
        }
    }
}

/// The runs of all sets, those of each side by side. Its buffers are made once.
#[derive(Debug, Clone, Default)]
struct Members {
    runs: Vec<u32>,
    boxes: Boxes,
}

impl Members {
    /// Whether any runs of two sets touch each other.
    fn touch(&self, set: &Set, other: &Set, runs: &[Run], core: &Core<'_>) -> bool {
        let run = |member: usize| &runs[self.runs[member] as usize];
        let near = |members: &Range<usize>, bounds| {
            let near = self.boxes.near(members.clone(), bounds, core.parameters);
            near.map(run)
        };
        near(&set.members, &other.bounds).any(|own| {
            let mut others = near(&other.members, &own.bounds);
            others.any(|other| own.touches(other, core))
        })
    }
}
