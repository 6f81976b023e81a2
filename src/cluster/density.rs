//! How densely the returns stand: which of them have so many neighbours close by in their row and
//! their column that they are core points for sure.

use multiversion::multiversion;

use super::ClusterParameters;
use super::rows::{MARGIN, Row, Rows};
use super::window::Windows;
use crate::float::{LANES, each, least};

/// Places before and behind in a row that are looked at. With six half as many again would be open
/// in a street, with four three times as many.
const BESIDE: usize = 8;
/// What is compared with the returns of one register.
const COMPARED: usize = LANES + 2 * BESIDE;
/// No register reaches beyond its row.
const _: () = assert!(MARGIN >= LANES + BESIDE);

/// Counts the neighbours close by of all returns, themselves included: which of them are core points
/// for that, and which are open.
pub(super) fn count(rows: &mut Rows, windows: &Windows, parameters: &ClusterParameters) {
    for row in rows.all_mut() {
        match windows.most_columns() {
            None => count_row::<false>(row, f32::INFINITY, parameters),
            Some(most) => count_row::<true>(row, most as f32, parameters),
        }
        judge_row(row, parameters);
    }
}

/// Counts those of one row, that are not too many columns off, if that is asked for.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn count_row<const IS_CLIPPED: bool>(
    row: &mut Row,
    most_columns: f32,
    parameters: &ClusterParameters,
) {
    for begin in row.places().step_by(LANES) {
        let first = begin - BESIDE;
        let Some(compared) = Compared::of(row, first) else {
            return;
        };
        let own = compared.lanes(BESIDE);
        let mut found = each(|lane| 1.0 + f32::from(row.neighbours_in_column(begin + lane)));
        let needed = each(|lane| parameters.more_than(row.range_m[begin + lane]));
        for apart in 1..=BESIDE {
            let before = own.near::<IS_CLIPPED>(&compared.lanes(BESIDE - apart), most_columns);
            let behind = own.near::<IS_CLIPPED>(&compared.lanes(BESIDE + apart), most_columns);
            found = each(|lane| found[lane] + before[lane] + behind[lane]);
            let mut is_open = false;
            for lane in 0..LANES {
                is_open |= found[lane] <= needed[lane];
            }
            if !is_open {
                break;
            }
        }
        row.found[begin..begin + LANES].copy_from_slice(&found);
    }
}

/// Says which returns of a row are core points for the neighbours that were counted, and which are
/// open.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn judge_row(row: &mut Row, parameters: &ClusterParameters) {
    let places = row.places();
    let (found, range_m) = (&row.found[places.clone()], &row.range_m[places.clone()]);
    let is_core = &mut row.is_core[places.clone()];
    let is_open = &mut row.is_open[places];
    for place in 0..found.len() {
        let suffices = found[place] > parameters.more_than(range_m[place]);
        is_core[place] = suffices;
        is_open[place] = !suffices;
    }
}

/// What stands in a row from a place on.
struct Compared<'a> {
    x_m: &'a [f32; COMPARED],
    y_m: &'a [f32; COMPARED],
    z_m: &'a [f32; COMPARED],
    eps_squared: &'a [f32; COMPARED],
    column: &'a [u16; COMPARED],
}

/// What one register holds of each.
struct Lanes {
    x_m: [f32; LANES],
    y_m: [f32; LANES],
    z_m: [f32; LANES],
    eps_squared: [f32; LANES],
    column: [f32; LANES],
}

impl<'a> Compared<'a> {
    /// `None` if it would reach beyond the row, which has margins for this.
    #[inline(always)]
    fn of(row: &'a Row, first: usize) -> Option<Self> {
        Some(Self {
            x_m: row.x_m[first..].first_chunk()?,
            y_m: row.y_m[first..].first_chunk()?,
            z_m: row.z_m[first..].first_chunk()?,
            eps_squared: row.eps_squared[first..].first_chunk()?,
            column: row.column[first..].first_chunk()?,
        })
    }

    /// From so many places behind the first one on.
    #[inline(always)]
    fn lanes(&self, behind: usize) -> Lanes {
        Lanes {
            x_m: each(|lane| self.x_m[behind + lane]),
            y_m: each(|lane| self.y_m[behind + lane]),
            z_m: each(|lane| self.z_m[behind + lane]),
            eps_squared: each(|lane| self.eps_squared[behind + lane]),
            column: each(|lane| f32::from(self.column[behind + lane])),
        }
    }
}

impl Lanes {
    /// 1 for those that are neighbours of others, lane by lane, and not too many columns off, if that
    /// is asked for.
    #[inline(always)]
    fn near<const IS_CLIPPED: bool>(&self, other: &Self, most_columns: f32) -> [f32; LANES] {
        let mut near = [0.0; LANES];
        for (lane, near) in near.iter_mut().enumerate() {
            let dx = self.x_m[lane] - other.x_m[lane];
            let dy = self.y_m[lane] - other.y_m[lane];
            let dz = self.z_m[lane] - other.z_m[lane];
            let squared = dx * dx + dy * dy + dz * dz;
            let is_near = squared <= least(self.eps_squared[lane], other.eps_squared[lane]);
            let columns = (self.column[lane] - other.column[lane]).abs();
            *near = f32::from(is_near & (!IS_CLIPPED | (columns <= most_columns)));
        }
        near
    }
}

/// Looks at core points alone from here on.
pub(super) fn keep_core(rows: &mut Rows) {
    for row in rows.all_mut() {
        keep_core_of(row);
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn keep_core_of(row: &mut Row) {
    let places = row.places();
    let is_core = &row.is_core[places.clone()];
    for (eps_squared, is_core) in row.eps_squared[places].iter_mut().zip(is_core) {
        // Only the sign changes: a choice between what is there and another value would be a
        // masked store.
        let sign = u32::from(!is_core) << (u32::BITS - 1);
        *eps_squared = f32::from_bits(eps_squared.to_bits() | sign);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::cluster::WindowSetting;
    use crate::cluster::rows::tests::rows_of;
    use crate::parameter::Profile;

    #[test]
    fn a_surface_is_dense_and_what_stands_alone_or_at_its_corner_is_open() {
        let wall = 20..60;
        let scan = scan_of(90, |column, layer| match (column, layer) {
            (80, 3) => 2000,
            (_, 4..12) if wall.contains(&column) => 100,
            _ => 0,
        });
        let mut parameters = ClusterParameters::profile(Profile::Default);
        parameters.eps_per_m = 0.0;
        // One column along the wall is 0.07 m, and a layer 0.035 m.
        parameters.eps_m = 0.29;
        let mut windows = Windows::new(&parameters);
        windows.prepare(&scan);
        let mut rows = rows_of(&scan, &parameters);
        count(&mut rows, &windows, &parameters);
        for (layer, row) in rows.all().iter().enumerate() {
            for place in row.places() {
                assert_ne!(row.is_open[place], row.is_core[place]);
                let is_inside = (24..56).contains(&row.column(place)) && (4..12).contains(&layer);
                assert!(row.is_core[place] || !is_inside);
            }
            assert!(!row.is_core[row.places().end]);
        }
        assert!(rows.of(3).is_open[rows.places(3, &(80..81)).start]);
        let corner = rows.places(4, &(20..21)).start;
        assert!(rows.of(4).is_open[corner]);
        keep_core(&mut rows);
        assert!(rows.of(4).eps_squared[corner] < 0.0);
        assert_eq!(rows.of(4).eps_squared[corner + 10], 0.29 * 0.29);
    }

    #[test]
    fn what_is_too_many_columns_off_is_not_counted_where_that_is_asked_for() {
        // Every third column returns, half a metre from the last one.
        let scan = scan_of(90, |column, _| if column % 3 == 0 { 200 } else { 0 });
        let mut parameters = ClusterParameters::profile(Profile::Default);
        parameters.window = WindowSetting::Columns;
        for (columns, is_dense) in [(2, false), (12, true)] {
            (parameters.eps_m, parameters.window_columns) = (3.0, columns);
            let mut windows = Windows::new(&parameters);
            windows.prepare(&scan);
            let mut rows = rows_of(&scan, &parameters);
            count(&mut rows, &windows, &parameters);
            let middle = rows.places(0, &(45..46)).start;
            assert_eq!(rows.of(0).is_core[middle], is_dense, "{columns}");
        }
    }

    #[test]
    fn of_two_returns_the_nearer_one_says_how_far_neighbours_are() {
        // 0.725 m apart: more than the distance of neighbours at 10 m, and less than that at 10.51 m.
        let scan = scan_of(2000, |column, layer| match (column, layer) {
            (200, 3) => 1000,
            (216, 3) => 1051,
            _ => 0,
        });
        let parameters = ClusterParameters::profile(Profile::Default);
        let mut windows = Windows::new(&parameters);
        windows.prepare(&scan);
        let mut rows = rows_of(&scan, &parameters);
        count(&mut rows, &windows, &parameters);
        assert_eq!(rows.of(3).found[MARGIN..MARGIN + 2], [1.0; 2]);
    }
}
