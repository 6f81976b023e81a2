//! What of a row is near a point.

use std::ops::Range;

use super::ClusterParameters;
use super::rows::{Address, NOT_TAKEN, Row, Rows};
use crate::float::{LANES, each, least, least_each, least_of};

/// No limit for what stands before an end, and that of nothing behind it.
const BEFORE_END: [f32; 2 * LANES] = {
    let mut limits = [f32::INFINITY; 2 * LANES];
    let mut lane = LANES;
    while lane < 2 * LANES {
        limits[lane] = NOT_TAKEN;
        lane += 1;
    }
    limits
};

/// A return with all that its neighbourhood depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Centre {
    pub(super) address: Address,
    pub(super) column: usize,
    pub(super) position_m: [f32; 3],
    pub(super) range_m: f32,
    pub(super) eps_m: f32,
}

impl Centre {
    /// A return, with the distance within which others are its neighbours.
    pub(super) fn of(rows: &Rows, address: Address, parameters: &ClusterParameters) -> Self {
        let row = rows.of(address.layer);
        let range_m = row.range_m[address.place];
        Self {
            address,
            column: row.column(address.place),
            position_m: row.position_m(address.place),
            range_m,
            eps_m: parameters.eps_m(range_m),
        }
    }

    /// How many of some places of a row are its neighbours.
    #[inline(always)]
    pub(super) fn count(&self, row: &Row, places: Range<usize>) -> u32 {
        // Counted in floats: sums of integers would be reordered, and what stands in one place of
        // many registers put into another one.
        let mut found = 0.0;
        for begin in places.clone().step_by(LANES) {
            let (squared, most) = self.compared(row, begin, places.end);
            let mut near = 0u32;
            for lane in 0..LANES {
                near += u32::from(squared[lane] <= most[lane]);
            }
            found += near as f32;
        }
        found as u32
    }

    /// Squared distance to the nearest neighbour at some places of a row; infinity if there is none.
    #[inline(always)]
    pub(super) fn squared_to_nearest(&self, row: &Row, places: Range<usize>) -> f32 {
        let mut nearest = [f32::INFINITY; LANES];
        for begin in places.clone().step_by(LANES) {
            let (squared, most) = self.compared(row, begin, places.end);
            let near = each(|lane| {
                if squared[lane] <= most[lane] {
                    squared[lane]
                } else {
                    f32::INFINITY
                }
            });
            nearest = least_each(nearest, near);
        }
        least_of(nearest)
    }

    /// The first of some places of a row at which there is a neighbour at a squared distance.
    #[inline(always)]
    pub(super) fn first_at(&self, wanted: f32, row: &Row, places: Range<usize>) -> Option<usize> {
        for begin in places.clone().step_by(LANES) {
            let (squared, most) = self.compared(row, begin, places.end);
            let mut is_there = false;
            for lane in 0..LANES {
                is_there |= (squared[lane] == wanted) & (wanted <= most[lane]);
            }
            if is_there {
                let is_it = |lane: &usize| squared[*lane] == wanted && wanted <= most[*lane];
                return (0..LANES).find(is_it).map(|lane| begin + lane);
            }
        }
        None
    }

    /// Squared distances to what stands from a place on, and those up to which it is a neighbour;
    /// behind an end nothing is.
    #[inline(always)]
    fn compared(&self, row: &Row, begin: usize, end: usize) -> ([f32; LANES], [f32; LANES]) {
        let places = begin..begin + LANES;
        let (x_m, y_m) = (&row.x_m[places.clone()], &row.y_m[places.clone()]);
        let (z_m, eps_squared) = (&row.z_m[places.clone()], &row.eps_squared[places]);
        let [x, y, z] = self.position_m;
        let own = self.eps_m * self.eps_m;
        let before_end = &BEFORE_END[LANES - (end - begin).min(LANES)..][..LANES];
        let (mut squared, mut most) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let (dx, dy, dz) = (x_m[lane] - x, y_m[lane] - y, z_m[lane] - z);
            squared[lane] = dx * dx + dy * dy + dz * dz;
            most[lane] = least(least(own, before_end[lane]), eps_squared[lane]);
        }
        (squared, most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::cluster::rows::squared_distance;
    use crate::cluster::rows::tests::rows_of;
    use crate::parameter::Profile;
    use crate::random::Random;

    #[test]
    fn all_of_some_places_are_compared_and_none_behind_them() {
        let parameters = ClusterParameters::profile(Profile::Default);
        let mut random = Random::new(3);
        let ranges: Vec<u16> = (0..60).map(|_| 900 + random.below(200) as u16).collect();
        let scan = scan_of(600, |column, _| ranges.get(column).copied().unwrap_or(0));
        let rows = rows_of(&scan, &parameters);
        let layer = 7;
        let (row, middle) = (rows.of(layer), rows.places(layer, &(30..31)).start);
        let centre = Centre::of(
            &rows,
            Address {
                layer,
                place: middle,
            },
            &parameters,
        );
        let squared_to =
            |place: &usize| squared_distance(centre.position_m, row.position_m(*place));
        let is_near = |place: &usize| {
            let own = centre.eps_m * centre.eps_m;
            squared_to(place) <= least(own, row.eps_squared[*place])
        };
        for (before, behind) in [
            (0, 1),
            (0, 8),
            (3, 4),
            (9, 20),
            (20, -12),
            (-2, 9),
            (25, 25),
        ] {
            let place = |apart: isize| middle.strict_add_signed(apart);
            let places = place(-before)..place(behind);
            let near = places.clone().filter(is_near);
            assert_eq!(
                centre.count(row, places.clone()),
                near.clone().count() as u32
            );
            let nearest = near.min_by(|a, b| squared_to(a).total_cmp(&squared_to(b)));
            let squared = nearest.as_ref().map_or(f32::INFINITY, squared_to);
            assert_eq!(centre.squared_to_nearest(row, places.clone()), squared);
            if nearest.is_some() {
                assert_eq!(centre.first_at(squared, row, places), nearest);
            }
        }
    }
}
