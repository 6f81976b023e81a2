//! The returns that are clustered, layer by layer: those of a layer stand side by side in the order
//! of their columns, whatever the rays between them met.

use std::ops::Range;

use crate::cloud::{MAX_COLUMNS, MAX_LAYERS};
use crate::float::least;

/// The returns of one layer, by their places in the row.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) x_m: [f32; LENGTH],
    pub(super) y_m: [f32; LENGTH],
    pub(super) z_m: [f32; LENGTH],
    pub(super) range_m: [f32; LENGTH],
    /// Square of the distance within which others are neighbours, if they are farther off; negative
    /// for what is not looked at, of which nothing is a neighbour.
    pub(super) eps_squared: [f32; LENGTH],
    pub(super) column: [u16; LENGTH],
    /// Which of the returns directly above and below it in its column are neighbours: [`ABOVE`],
    /// [`BELOW`], or both.
    pub(super) met: [u8; LENGTH],
    /// How many neighbours close by were counted, itself included.
    pub(super) found: [f32; LENGTH],
    /// Whether it is a core point.
    pub(super) is_core: [bool; LENGTH],
    /// Whether that is not known yet.
    pub(super) is_open: [bool; LENGTH],
    /// Behind the last one. The first one stands at [`MARGIN`].
    pub(super) end: usize,
}

/// Places at either end of a row in which nothing stands, so that what is compared with what is near
/// and many at once need not mind where it ends.
pub(super) const MARGIN: usize = 16;
/// Places of a row. An odd number of cache lines: otherwise all rows would share a few of them.
pub(super) const LENGTH: usize = MAX_COLUMNS + 2 * MARGIN;
/// Marks of a return that is a neighbour of that directly above, and below.
pub(super) const ABOVE: u8 = 1;
pub(super) const BELOW: u8 = 2;
/// No square of a distance: nothing is within it.
pub(super) const NOT_TAKEN: f32 = -1.0;

impl Row {
    const EMPTY: Self = Self {
        x_m: [0.0; LENGTH],
        y_m: [0.0; LENGTH],
        z_m: [0.0; LENGTH],
        range_m: [0.0; LENGTH],
        eps_squared: [NOT_TAKEN; LENGTH],
        column: [0; LENGTH],
        met: [0; LENGTH],
        found: [0.0; LENGTH],
        is_core: [false; LENGTH],
        is_open: [false; LENGTH],
        end: MARGIN,
    };

    /// The places at which something stands.
    pub(super) fn places(&self) -> Range<usize> {
        MARGIN..self.end
    }

    /// The column of a place.
    pub(super) fn column(&self, place: usize) -> usize {
        usize::from(self.column[place])
    }

    /// How many of the returns directly above and below one in its column are neighbours.
    #[inline(always)]
    pub(super) fn neighbours_in_column(&self, place: usize) -> u8 {
        self.met[place] % BELOW + self.met[place] / BELOW
    }

    /// Whether that directly above one is.
    pub(super) fn meets_above(&self, place: usize) -> bool {
        self.met[place] & ABOVE > 0
    }

    /// Whether two of its returns are neighbours.
    #[inline(always)]
    pub(super) fn are_neighbours(&self, a: usize, b: usize) -> bool {
        let most = least(self.eps_squared[a], self.eps_squared[b]);
        squared_distance(self.position_m(a), self.position_m(b)) <= most
    }

    /// Where a return is.
    #[inline(always)]
    pub(super) fn position_m(&self, place: usize) -> [f32; 3] {
        [self.x_m[place], self.y_m[place], self.z_m[place]]
    }
}

/// Where a return stands: its layer, and its place in the row of that.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Address {
    pub(super) layer: usize,
    pub(super) place: usize,
}

/// The rows of all layers. Their buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    /// By layer.
    pub(super) rows: Vec<Row>,
    /// Of each column and layer the place of the first return that is not before the column; one
    /// column more than there are.
    pub(super) first: Vec<[u16; MAX_LAYERS]>,
}

impl Rows {
    pub(super) fn new() -> Self {
        Self {
            rows: vec![Row::EMPTY; MAX_LAYERS],
            first: Vec::with_capacity(MAX_COLUMNS + 1),
        }
    }

    /// The row of a layer.
    pub(super) fn of(&self, layer: usize) -> &Row {
        &self.rows[layer]
    }

    /// The row of a layer, to be changed.
    pub(super) fn of_mut(&mut self, layer: usize) -> &mut Row {
        &mut self.rows[layer]
    }

    /// All rows, by layer.
    pub(super) fn all(&self) -> &[Row] {
        &self.rows
    }

    /// All rows, by layer, to be changed.
    pub(super) fn all_mut(&mut self) -> &mut [Row] {
        &mut self.rows
    }

    /// The places of a row in a stretch of columns.
    #[inline(always)]
    pub(super) fn places(&self, layer: usize, columns: &Range<usize>) -> Range<usize> {
        let first = |column: usize| usize::from(self.first[column][layer]);
        first(columns.start)..first(columns.end)
    }

    /// The place of the first return of a layer in the columns behind one.
    pub(super) fn first_behind(&self, layer: usize, column: usize) -> usize {
        usize::from(self.first[column + 1][layer])
    }

    /// How many points the array has.
    pub(super) fn points(&self) -> usize {
        (self.first.len() - 1) * MAX_LAYERS
    }

    /// The point of the array that stands somewhere.
    pub(super) fn point(&self, address: Address) -> usize {
        self.rows[address.layer].column(address.place) * MAX_LAYERS + address.layer
    }
}

/// Square of the distance of two points.
#[inline(always)]
pub(super) fn squared_distance(a_m: [f32; 3], b_m: [f32; 3]) -> f32 {
    let [dx, dy, dz] = [0, 1, 2].map(|axis: usize| a_m[axis] - b_m[axis]);
    dx * dx + dy * dy + dz * dz
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::cloud::Scan;
    use crate::cloud::tests::scan_of;
    use crate::cluster::ClusterParameters;
    use crate::parameter::Profile;

    /// The rows of a scan without ground.
    pub(in super::super) fn rows_of(scan: &Scan, parameters: &ClusterParameters) -> Rows {
        let mut rows = Rows::new();
        let (ground, heights_m) = (vec![false; scan.len()], vec![0.0; scan.len()]);
        rows.fill(scan, (&ground, &heights_m), parameters);
        rows
    }

    #[test]
    fn rows_hold_what_is_taken_in_the_order_of_columns_and_nothing_of_a_larger_revolution() {
        let parameters = ClusterParameters::profile(Profile::Default);
        let all = scan_of(2000, |_, _| 1000);
        let mut rows = rows_of(&all, &parameters);
        assert_eq!(rows.of(15).places().len(), 2000);
        // More columns than are taken over together, and no whole number of blocks.
        let scan = scan_of(70, |column, layer| match (column % 3, layer) {
            (_, 9) => 0,
            (0, _) => 300,
            _ => 500,
        });
        let points = |chosen: fn(usize, usize) -> bool| -> Vec<bool> {
            let is_chosen = |point| chosen(point / MAX_LAYERS, point % MAX_LAYERS);
            (0..scan.len()).map(is_chosen).collect()
        };
        let ground = points(|_, layer| layer < 2);
        let high = points(|column, layer| column > 60 && layer > 12);
        let heights_m: Vec<f32> = high.iter().map(|high| f32::from(*high) * 4.6).collect();
        rows.fill(&scan, (&ground, &heights_m), &parameters);
        for (layer, row) in rows.all().iter().enumerate() {
            let taken = |column: &usize| {
                let point = scan.index(*column, layer);
                scan.has_return(point) && !ground[point] && !high[point]
            };
            let columns: Vec<usize> = (0..70).filter(taken).collect();
            let found: Vec<usize> = row.places().map(|place| row.column(place)).collect();
            assert_eq!(found, columns, "{layer}");
            assert!(row.eps_squared[row.places().end..][..MARGIN] == [NOT_TAKEN; MARGIN]);
            for place in row.places() {
                let point = rows.point(Address { layer, place });
                assert_eq!(row.position_m(place), scan.point_m(point));
                assert_eq!(row.range_m[place], scan.range_m()[point]);
                let eps_m = parameters.eps_m(row.range_m[place]);
                assert_eq!(row.eps_squared[place], eps_m * eps_m);
            }
            let few = rows.places(layer, &(33..36));
            assert_eq!(few.len(), (33..36).filter(taken).count());
            assert!(
                few.clone()
                    .all(|place| (33..36).contains(&row.column(place)))
            );
            assert_eq!(rows.first_behind(layer, 35), few.end);
        }
        assert_eq!(rows.points(), 70 * MAX_LAYERS);
    }

    #[test]
    fn returns_meet_those_directly_above_that_are_taken_and_near() {
        let parameters = ClusterParameters::profile(Profile::Default);
        // Layers are 2 degrees apart: 0.35 m at 10 m, where neighbours are within 0.72 m.
        let scan = scan_of(40, |column, layer| match (column, layer) {
            (35, 3..6) => 1000,
            (35, 6) => 1200,
            (35, 8 | 10 | 15) => 1000,
            (36, 0) => 1000,
            _ => 0,
        });
        let rows = rows_of(&scan, &parameters);
        let meets = |layer: usize| {
            let row = rows.of(layer);
            let place = row.places().find(|place| row.column(*place) == 35).unwrap();
            (row.neighbours_in_column(place), row.meets_above(place))
        };
        assert_eq!(
            [3, 4, 5, 6].map(meets),
            [(1, true), (2, true), (1, false), (0, false)]
        );
        assert_eq!([8, 10, 15].map(meets), [(0, false); 3]);
    }

    #[test]
    fn of_two_returns_the_nearer_one_says_how_far_neighbours_are() {
        let parameters = ClusterParameters::profile(Profile::Default);
        // Neighbours are within 0.720 m at 10 m, and within 0.734 m at 10.63 m.
        let scan = scan_of(2000, |column, layer| match (column, layer) {
            (100, 3) | (200, 3) => 1000,
            (100, 4) => 1063,
            (216, 3) => 1051,
            _ => 0,
        });
        let rows = rows_of(&scan, &parameters);
        let (row, above) = (rows.of(3), rows.of(4));
        let [low, before, behind] = [0, 1, 2].map(|nth| MARGIN + nth);
        for (apart_squared, far, near) in [
            (
                squared_distance(row.position_m(low), above.position_m(MARGIN)),
                above,
                row,
            ),
            (
                squared_distance(row.position_m(before), row.position_m(behind)),
                row,
                row,
            ),
        ] {
            let eps = [near.eps_squared[low], far.eps_squared[far.places().end - 1]];
            assert!(
                eps[0] < apart_squared && apart_squared < eps[1],
                "{apart_squared} {eps:?}"
            );
        }
        assert!(!row.meets_above(low));
        assert!(!row.are_neighbours(before, behind));
    }
}
