//! People side by side: a cluster cannot tell their shoulders apart, but shows their heads.

use super::placing::{Bounds, Placed, distance_m};
use crate::cloud::Scan;

/// Heads are higher than this, and what is below it in a car are screens and seats.
const LOWEST_HEAD_M: f32 = 1.5;
/// Nobody is taller.
const TALLEST_M: f32 = 2.1;
/// Widest head, with a hat or a hood.
const WIDEST_HEAD_M: f32 = 0.5;
/// Narrowest gap between two heads.
const LEAST_GAP_M: f32 = 0.12;
/// How far apart the middles of two heads are that walk side by side.
const LEAST_APART_M: f32 = 0.35;
const MOST_APART_M: f32 = 1.0;
/// From column to column of one head; the return of one in between may be missing.
const MISSED: usize = 2;
/// Room that each takes up at most, and how much more all of them together.
const ROOM_M: f32 = 0.75;
const MORE_M: f32 = 0.2;
/// More do not walk side by side.
const MOST_PEOPLE: usize = 4;

/// Neighbouring columns that show a head.
#[derive(Debug, Clone, Copy, Default)]
struct Head {
    first: usize,
    last: usize,
    /// Where it is from above: of its first column and of its last one.
    from_m: [f32; 2],
    to_m: [f32; 2],
}

impl Head {
    fn middle_m(&self) -> [f32; 2] {
        [0, 1].map(|axis| 0.5 * (self.from_m[axis] + self.to_m[axis]))
    }
}

/// Heads from left to right, or from right to left.
#[derive(Debug, Default)]
struct Heads {
    heads: [Head; MOST_PEOPLE],
    count: usize,
}

impl Heads {
    fn all(&self) -> &[Head] {
        &self.heads[..self.count]
    }

    /// Extends the last one by a further return of its layer, or begins another one; whether there is
    /// room for that.
    fn extend(&mut self, column: usize, at_m: [f32; 2]) -> bool {
        if let Some(head) = self.heads[..self.count].last_mut()
            && (distance_m(head.to_m, at_m) < LEAST_GAP_M || column - head.last <= MISSED)
        {
            (head.last, head.to_m) = (column, at_m);
            return true;
        }
        self.add(Head {
            first: column,
            last: column,
            from_m: at_m,
            to_m: at_m,
        })
    }

    /// Adds one in its place; whether there is room for it.
    fn add(&mut self, head: Head) -> bool {
        if self.count == MOST_PEOPLE {
            return false;
        }
        let place = self.all().partition_point(|other| other.first < head.first);
        self.heads.copy_within(place..self.count, place + 1);
        self.heads[place] = head;
        self.count += 1;
        true
    }
}

/// Where the returns of one person end and those of the next one begin, in a patch that shows
/// several heads; nothing in any other. The returns are in the order of the scan.
pub(super) fn cuts(placed: &[Placed], bounds: &Bounds, scan: &Scan, cuts: &mut Vec<usize>) {
    cuts.clear();
    let long_m = distance_m(bounds.low_m, bounds.high_m);
    let may_be_people = (LOWEST_HEAD_M..TALLEST_M).contains(&bounds.top_m)
        && (2.0 * LEAST_APART_M..ROOM_M * MOST_PEOPLE as f32 + MORE_M).contains(&long_m);
    if !may_be_people {
        return;
    }
    let Some(heads) = heads(placed, scan) else {
        return;
    };
    let [first, .., last] = heads.all() else {
        return;
    };
    let is_over_seam = distance_m(last.to_m, first.from_m) < LEAST_GAP_M;
    if is_over_seam || long_m > ROOM_M * heads.count as f32 + MORE_M {
        return;
    }
    for (one, next) in heads.all().iter().zip(&heads.all()[1..]) {
        let apart_m = distance_m(one.middle_m(), next.middle_m());
        if !(LEAST_APART_M..MOST_APART_M).contains(&apart_m) {
            cuts.clear();
            return;
        }
        let middle = (one.last + next.first) / 2;
        cuts.push(placed.partition_point(|placed| scan.column(placed.point as usize) <= middle));
    }
}

/// The heads in some returns, if nothing that is higher than shoulders is wider. People differ in
/// height, so that each layer may show other ones; what is below a head are shoulders.
fn heads(placed: &[Placed], scan: &Scan) -> Option<Heads> {
    let layer_of = |placed: &Placed| scan.layer(placed.point as usize);
    let highest = placed.iter().map(layer_of).max()?;
    let mut heads = Heads::default();
    for layer in (0..=highest).rev() {
        let mut found = Heads::default();
        for spot in placed.iter().filter(|placed| layer_of(placed) == layer) {
            if spot.above_m < LOWEST_HEAD_M {
                return Some(heads);
            }
            if !found.extend(scan.column(spot.point as usize), spot.at_m) {
                return None;
            }
        }
        for head in found.all() {
            let is_shoulder = |other: &Head| {
                (head.first <= other.last && other.first <= head.last)
                    || distance_m(head.middle_m(), other.middle_m()) < LEAST_APART_M
            };
            if layer < highest && heads.all().iter().any(is_shoulder) {
                continue;
            }
            let is_head = distance_m(head.from_m, head.to_m) < WIDEST_HEAD_M;
            if !is_head || !heads.add(*head) {
                return None;
            }
        }
    }
    Some(heads)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::beams::Seen;
    use crate::cloud::tests::scan_of;
    use crate::track::tests::spots_of;

    /// Where what is 10 m away is cut that reaches up to a layer in each of its columns, of which
    /// one is 3.5 cm wide.
    fn cuts_of(top_layer: impl Fn(usize) -> Option<usize>) -> Vec<usize> {
        let scan = scan_of(1800, |column, layer| {
            let is_met =
                (4..).contains(&layer) && top_layer(column).is_some_and(|top| layer <= top);
            u16::from(is_met) * 1000
        });
        cuts_in(&scan)
    }

    fn cuts_in(scan: &Scan) -> Vec<usize> {
        let placed: Vec<Placed> = spots_of(scan)
            .iter()
            .map(|spot| Placed {
                at_m: spot.at_m,
                above_m: spot.above_m,
                point: spot.point,
                is_brought: false,
                before: Seen::Unknown,
            })
            .collect();
        let mut found = vec![];
        cuts(&placed, &Bounds::of(&placed), scan, &mut found);
        found
    }

    /// Columns of a body up to its shoulders, with a head in the middle.
    fn person(first: usize) -> impl Fn(usize) -> Option<usize> {
        move |column| match column.checked_sub(first)? {
            5..10 => Some(7),
            ..15 => Some(6),
            _ => None,
        }
    }

    #[test]
    fn people_whose_shoulders_touch_are_cut_between_their_heads() {
        let (left, right) = (person(100), person(115));
        let found = cuts_of(|column| left(column).or(right(column)));
        // Fifteen columns of three layers, and five of a fourth one.
        assert_eq!(found, [50]);
        let third = person(130);
        let found = cuts_of(|column| left(column).or(right(column)).or(third(column)));
        assert_eq!(found, [50, 100]);
    }

    #[test]
    fn people_differ_in_height() {
        let (left, right) = (person(100), person(115));
        let tall = |column: usize| left(column).map(|top| if top == 7 { 8 } else { top });
        let found = cuts_of(|column| tall(column).or(right(column)));
        // Fifteen columns of three layers, and five of two more.
        assert_eq!(found, [55]);
        // The shoulders of somebody tall are no heads.
        let broad = |column: usize| match column.checked_sub(100)? {
            8..12 => Some(8),
            ..6 | 14..20 => Some(7),
            _ => Some(6),
        };
        assert!(cuts_of(broad).is_empty());
    }

    #[test]
    fn nobody_is_cut_and_no_car_either() {
        assert!(cuts_of(person(100)).is_empty());
        // A roof that is narrower than the body, and two screens beside each other.
        let roof = |column: usize| match column {
            110..140 => Some(7),
            100..150 => Some(6),
            _ => None,
        };
        assert!(cuts_of(roof).is_empty());
        let screens = |column: usize| match column {
            102..108 | 142..148 => Some(7),
            100..150 => Some(6),
            _ => None,
        };
        assert!(cuts_of(screens).is_empty());
        // Where shoulders would touch, but as wide as a box, or farther apart than people stand.
        let of = |heads: [std::ops::Range<usize>; 2]| {
            move |column: usize| match column {
                _ if heads.iter().any(|head| head.contains(&column)) => Some(7),
                100..132 => Some(6),
                _ => None,
            }
        };
        assert!(!cuts_of(of([102..114, 118..130])).is_empty());
        assert!(cuts_of(of([100..116, 120..132])).is_empty());
        assert!(cuts_of(of([100..101, 131..132])).is_empty());
        // What is lower than a head is no head.
        let low = |column: usize| match column {
            105..110 | 120..125 => Some(5),
            100..130 => Some(4),
            _ => None,
        };
        assert!(cuts_of(low).is_empty());
    }

    #[test]
    fn one_head_is_one_though_a_return_is_missing_or_the_seam_of_the_sweep_parts_it() {
        // At 20 m, where two columns are farther apart than two heads may be.
        let scan = scan_of(1800, |column, layer| match column {
            107 if layer == 7 => 0,
            100..114 if (4..8).contains(&layer) => 2000,
            _ => 0,
        });
        assert!(cuts_in(&scan).is_empty());
        let (left, right) = (person(100), person(115));
        let over_seam = |column: usize| {
            let column = (column + 108) % 1800;
            left(column).or(right(column))
        };
        assert!(cuts_of(over_seam).is_empty());
    }
}
