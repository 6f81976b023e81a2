//! People side by side: a cluster cannot tell their shoulders apart, but shows their heads, if the
//! same layer meets all of them.

use super::placing::{Bounds, Placed};
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
#[derive(Debug, Clone, Copy)]
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

/// Where the returns of one person end and those of the next one begin, in a patch that shows
/// several heads in its topmost layer; nothing in any other. The returns are in the order of the
/// scan.
pub(super) fn cuts(placed: &[Placed], bounds: &Bounds, scan: &Scan, cuts: &mut Vec<usize>) {
    cuts.clear();
    let long_m = distance_m(bounds.low_m, bounds.high_m);
    let may_be_people = (LOWEST_HEAD_M..TALLEST_M).contains(&bounds.top_m)
        && (2.0 * LEAST_APART_M..ROOM_M * MOST_PEOPLE as f32 + MORE_M).contains(&long_m);
    if !may_be_people {
        return;
    }
    let column_of = |placed: &Placed| scan.column(placed.point as usize);
    let layer_of = |placed: &Placed| scan.layer(placed.point as usize);
    let highest = placed.iter().map(layer_of).max().unwrap_or(0);
    let mut heads = [None::<Head>; MOST_PEOPLE];
    let mut count = 0;
    let tops = placed.iter().filter(|placed| layer_of(placed) == highest);
    for top in tops {
        let (column, at_m) = (column_of(top), top.at_m);
        match heads[count.max(1) - 1].as_mut() {
            Some(head)
                if distance_m(head.to_m, at_m) < LEAST_GAP_M || column - head.last <= MISSED =>
            {
                (head.last, head.to_m) = (column, at_m);
            }
            _ if count == MOST_PEOPLE || top.above_m < LOWEST_HEAD_M => return,
            _ => {
                heads[count] = Some(Head {
                    first: column,
                    last: column,
                    from_m: at_m,
                    to_m: at_m,
                });
                count += 1;
            }
        }
    }
    let heads = || heads.iter().flatten();
    let are_heads = heads().all(|head| distance_m(head.from_m, head.to_m) < WIDEST_HEAD_M);
    if count < 2 || !are_heads || long_m > ROOM_M * count as f32 + MORE_M {
        return;
    }
    let is_over_seam =
        |first: &Head, last: &Head| distance_m(last.to_m, first.from_m) < LEAST_GAP_M;
    if let (Some(first), Some(last)) = (heads().next(), heads().next_back())
        && is_over_seam(first, last)
    {
        return;
    }
    for (one, next) in heads().zip(heads().skip(1)) {
        let apart_m = distance_m(one.middle_m(), next.middle_m());
        if !(LEAST_APART_M..MOST_APART_M).contains(&apart_m) {
            cuts.clear();
            return;
        }
        let middle = (one.last + next.first) / 2;
        cuts.push(placed.partition_point(|placed| column_of(placed) <= middle));
    }
}

fn distance_m(from_m: [f32; 2], to_m: [f32; 2]) -> f32 {
    let [x, y] = [0, 1].map(|axis| to_m[axis] - from_m[axis]);
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
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
