//! What stands before something else, or at it, and was not there before: returns in places that were empty are
//! parted from those in places where something was.

use super::placing::{Placed, distance_m};
use crate::beams::Seen;
use crate::cloud::Scan;
use crate::partition::Partition;

/// Parts what is new from what is not. Its buffers are made once.
#[derive(Debug, Clone, Default)]
pub(super) struct Newcomers {
    partition: Partition,
    /// For every return the thing that it belongs to, or [`REST`].
    things: Vec<u32>,
    /// The things, by their numbers.
    counts: Vec<Counts>,
    sorted: Vec<Placed>,
}

/// What is known of a thing.
#[derive(Debug, Clone, Copy, Default)]
struct Counts {
    /// Returns in places that were empty.
    new: usize,
    /// Columns, and those in which it stands on something that was there before.
    columns: usize,
    carried: usize,
}

/// How far apart returns of one thing are at most: as far as pieces of a vehicle, and where rays are farther apart more.
const APART_M: f32 = 1.2;
const APART: f32 = 0.02;
/// Returns of which the place is not known belong to what is new as near as this.
const BESIDE_M: f32 = 0.3;
/// Returns in empty places that make a thing.
const FEWEST: usize = 4;
/// Share of known returns from which on all of them are new.
const WHOLE: f64 = 0.8;
/// What is met above something that was there before, as near to it as this, is a part of it that rays went through: a
/// pane, a hedge, a fence.
const ABOVE_M: f32 = 0.5;
const REST: u32 = u32::MAX;

/// How many returns are in places that were empty, and in which something was.
fn known(placed: &[Placed]) -> [usize; 2] {
    [Seen::Empty, Seen::Occupied].map(|seen| {
        let of = placed.iter().filter(|placed| placed.before == seen);
        of.count()
    })
}

/// What was seen before of most of the places of which it is known.
pub(super) fn most(placed: &[Placed]) -> Seen {
    let [new, old] = known(placed);
    if new > old && new >= FEWEST {
        Seen::Empty
    } else if old > new && old >= FEWEST {
        Seen::Occupied
    } else {
        Seen::Unknown
    }
}

impl Counts {
    fn is_thing(&self) -> bool {
        self.new >= FEWEST && 2 * self.carried < self.columns
    }
}

impl Newcomers {
    /// Sorts the returns of a patch, in the order of the scan, thing by thing, and what is not new last. Gives where each
    /// thing ends; none where there is nothing to part. What is where `is_moving` says that something moves is of that.
    pub(super) fn part(
        &mut self,
        placed: &mut [Placed],
        scan: &Scan,
        is_moving: impl Fn(&Placed) -> bool,
        ends: &mut Vec<usize>,
    ) {
        ends.clear();
        let [new, old] = known(placed);
        if new < FEWEST || new as f64 >= WHOLE * (new + old) as f64 {
            return;
        }
        self.join(placed, scan, is_moving);
        let count = placed.len();
        self.things.clear();
        self.things
            .extend((0..count as u32).map(|number| self.partition.find(number)));
        self.count(placed, scan);
        for thing in &mut self.things {
            if !self.counts[*thing as usize].is_thing() {
                *thing = REST;
            }
        }
        self.sorted.clear();
        for thing in 0..count as u32 {
            if self.counts[thing as usize].is_thing() {
                self.gather(placed, thing);
                ends.push(self.sorted.len());
            }
        }
        if !ends.is_empty() {
            self.gather(placed, REST);
            placed.copy_from_slice(&self.sorted);
        }
    }

    fn gather(&mut self, placed: &[Placed], thing: u32) {
        let own = placed.iter().zip(&self.things);
        let own = own.filter(|(_, own)| **own == thing);
        self.sorted.extend(own.map(|(placed, _)| *placed));
    }

    /// Counts what each thing consists of.
    fn count(&mut self, placed: &[Placed], scan: &Scan) {
        self.counts.clear();
        self.counts.resize(placed.len(), Counts::default());
        let column_of = |placed: &Placed| scan.column(placed.point as usize);
        let (mut below, mut last) = (None::<&Placed>, None);
        for (own, thing) in placed.iter().zip(&self.things) {
            let counts = &mut self.counts[*thing as usize];
            match own.before {
                Seen::Empty => counts.new += 1,
                Seen::Occupied => below = Some(own),
                Seen::Unknown => {}
            }
            if own.before == Seen::Empty && last != Some((column_of(own), *thing)) {
                last = Some((column_of(own), *thing));
                counts.columns += 1;
                let is_carried = below.is_some_and(|below| {
                    column_of(below) == column_of(own) && distance_m(below.at_m, own.at_m) < ABOVE_M
                });
                counts.carried += usize::from(is_carried);
            }
        }
    }

    /// Joins returns in empty places that are near each other, and those of unknown places beside them.
    fn join(&mut self, placed: &[Placed], scan: &Scan, is_moving: impl Fn(&Placed) -> bool) {
        self.partition.reset(placed.len());
        let mut mover = None;
        for (number, one) in placed.iter().enumerate() {
            if is_moving(one) {
                let first = *mover.get_or_insert(number as u32);
                self.partition.join(first, number as u32);
            }
            if one.before == Seen::Occupied {
                continue;
            }
            let column = scan.column(one.point as usize);
            let range_m = scan.range_m()[one.point as usize];
            let apart_m = APART_M + APART * range_m;
            let columns = (f64::from(apart_m / range_m) / scan.step_rad().abs()) as usize + 1;
            for (other_number, other) in placed.iter().enumerate().skip(number + 1) {
                if scan.column(other.point as usize) > column + columns {
                    break;
                }
                let within_m = match (one.before, other.before) {
                    (Seen::Empty, Seen::Empty) => apart_m,
                    (Seen::Empty, Seen::Unknown) | (Seen::Unknown, Seen::Empty) => BESIDE_M,
                    _ => continue,
                };
                if distance_m(one.at_m, other.at_m) < within_m {
                    self.partition.join(number as u32, other_number as u32);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::MAX_LAYERS;
    use crate::cloud::tests::scan_of;

    const COLUMNS: usize = 1800;

    fn at(scan: &Scan, column: usize, layer: usize) -> Placed {
        let point = column * MAX_LAYERS + layer;
        let [x, y, z] = scan.point_m(point);
        Placed {
            at_m: [x, y],
            above_m: z + 1.9,
            point: point as u32,
            is_brought: false,
            before: Seen::Unknown,
        }
    }

    /// Returns of layer 8 in so many columns, and what was seen of their places.
    fn returns(scan: &Scan, columns: usize, before: impl Fn(usize) -> Seen) -> Vec<Placed> {
        let placed = (0..columns).map(|column| Placed {
            before: before(column),
            ..at(scan, column, 8)
        });
        placed.collect()
    }

    fn parted(before: impl Fn(usize) -> Seen) -> (Vec<usize>, Vec<Placed>) {
        // Two people, of six columns each, before a wall of a hundred.
        let scan = scan_of(COLUMNS, |column, _| match column {
            20..26 | 70..76 => 900,
            0..100 => 1000,
            _ => 0,
        });
        let mut placed = returns(&scan, 100, before);
        let mut ends = vec![];
        Newcomers::default().part(&mut placed, &scan, |_| false, &mut ends);
        (ends, placed)
    }

    fn is_person(column: usize) -> bool {
        (20..26).contains(&column) || (70..76).contains(&column)
    }

    #[test]
    fn people_who_came_before_a_wall_are_parted_from_it_and_from_each_other() {
        let seen = |column| {
            if is_person(column) {
                Seen::Empty
            } else {
                Seen::Occupied
            }
        };
        let (ends, placed) = parted(seen);
        assert_eq!(ends, [6, 12]);
        let columns = |placed: &[Placed]| -> Vec<usize> {
            placed
                .iter()
                .map(|placed| placed.point as usize / MAX_LAYERS)
                .collect()
        };
        assert_eq!(columns(&placed[..6]), (20..26).collect::<Vec<_>>());
        assert_eq!(columns(&placed[6..12]), (70..76).collect::<Vec<_>>());
        let rest: Vec<usize> = (0..100).filter(|column| !is_person(*column)).collect();
        assert_eq!(columns(&placed[12..]), rest);
    }

    #[test]
    fn what_is_not_known_beside_what_is_new_belongs_to_it() {
        let (ends, _) = parted(|column| match column {
            20..24 => Seen::Empty,
            24..26 => Seen::Unknown,
            _ => Seen::Occupied,
        });
        assert_eq!(ends, [6]);
    }

    #[test]
    fn what_is_met_above_what_was_there_before_is_a_part_of_it() {
        // A parked car's door of ten columns with panes, through which rays went, and a person who came beside it.
        let scan = scan_of(COLUMNS, |column, _| u16::from(column < 30) * 1000);
        let part = |layers: std::ops::Range<usize>, is_pane: fn(usize, usize) -> bool| {
            let mut placed: Vec<Placed> = (0..30)
                .flat_map(|column| layers.clone().map(move |layer| (column, layer)))
                .map(|(column, layer)| Placed {
                    before: if is_pane(column, layer) {
                        Seen::Empty
                    } else {
                        Seen::Occupied
                    },
                    ..at(&scan, column, layer)
                })
                .collect();
            let mut ends = vec![];
            Newcomers::default().part(&mut placed, &scan, |_| false, &mut ends);
            ends
        };
        assert_eq!(part(4..8, |column, layer| column < 10 && layer > 5), [0; 0]);
        assert_eq!(part(4..8, |column, _| column < 10), [40]);
    }

    #[test]
    fn what_is_within_something_that_moves_is_of_that() {
        let scan = scan_of(COLUMNS, |column, _| u16::from(column < 100) * 1000);
        let is_end = |column: usize| column < 6 || (60..66).contains(&column);
        let seen = |column| {
            if is_end(column) {
                Seen::Empty
            } else {
                Seen::Occupied
            }
        };
        let ends = |is_moving: fn(&Placed) -> bool| {
            let (mut placed, mut ends) = (returns(&scan, 100, seen), vec![]);
            Newcomers::default().part(&mut placed, &scan, is_moving, &mut ends);
            ends
        };
        assert_eq!(ends(|_| false), [6, 12]);
        let is_lorry = |placed: &Placed| (placed.point as usize) < 70 * MAX_LAYERS;
        assert_eq!(ends(is_lorry), [70]);
    }

    #[test]
    fn a_few_returns_make_no_thing_and_nothing_is_parted_of_what_is_new_as_a_whole() {
        let few = |column| {
            if (20..23).contains(&column) {
                Seen::Empty
            } else {
                Seen::Occupied
            }
        };
        assert_eq!(parted(few).0, [0; 0]);
        let most = |column| {
            if column < 90 {
                Seen::Empty
            } else {
                Seen::Occupied
            }
        };
        assert_eq!(parted(most).0, [0; 0]);
    }
}
