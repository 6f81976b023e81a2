//! The array turned: from column by column to layer by layer.

use multiversion::multiversion;

use super::row::Row;
use crate::cloud::{MAX_LAYERS, Scan};

/// Columns that are turned at once, and their points.
const TURNED: usize = 8;
const POINTS: usize = TURNED * MAX_LAYERS;

/// Takes the returns over that are not ground, layer by layer.
pub(super) fn turn(scan: &Scan, ground: &[bool], rows: &mut [Row]) {
    let [x_m, y_m, z_m, range_m] =
        [scan.x_m(), scan.y_m(), scan.z_m(), scan.range_m()].map(Blocks::of);
    let ground = Blocks::of(ground);
    for block in 0..scan.columns().div_ceil(TURNED) {
        let points = [&x_m, &y_m, &z_m, &range_m].map(|blocks| blocks.get(block));
        turn_block(points, ground.get(block), block, rows);
    }
}

/// What is known of all points, in blocks that are turned at once.
struct Blocks<'a, T> {
    whole: &'a [[T; POINTS]],
    /// The last points, filled up with nothing.
    last: [T; POINTS],
}

impl<'a, T: Copy + Default> Blocks<'a, T> {
    fn of(of_points: &'a [T]) -> Self {
        let (whole, rest) = of_points.as_chunks();
        let mut last = [T::default(); POINTS];
        last[..rest.len()].copy_from_slice(rest);
        Self { whole, last }
    }

    fn get(&self, block: usize) -> &[T; POINTS] {
        self.whole.get(block).unwrap_or(&self.last)
    }
}

/// Takes a block of points over; what is no return, or ground, is put at infinity.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn turn_block(
    [x_m, y_m, z_m, range_m]: [&[f32; POINTS]; 4],
    is_ground: &[bool; POINTS],
    block: usize,
    rows: &mut [Row],
) {
    let mut taken_m = [f32::INFINITY; POINTS];
    for point in 0..POINTS {
        let is_taken = (range_m[point] > 0.0) & !is_ground[point];
        let x = x_m[point];
        taken_m[point] = if is_taken { x } else { f32::INFINITY };
    }
    for (layer, row) in rows.iter_mut().enumerate() {
        row.x_m.as_chunks_mut().0[block] = of_layer(&taken_m, layer);
        row.y_m.as_chunks_mut().0[block] = of_layer(y_m, layer);
        row.z_m.as_chunks_mut().0[block] = of_layer(z_m, layer);
        row.range_m.as_chunks_mut().0[block] = of_layer(range_m, layer);
    }
}

/// What a layer has of a block.
#[inline(always)]
fn of_layer(of_points: &[f32; POINTS], layer: usize) -> [f32; TURNED] {
    let columns = of_points.as_chunks::<MAX_LAYERS>().0;
    let mut of_layer = [0.0; TURNED];
    for column in 0..TURNED {
        of_layer[column] = columns[column][layer];
    }
    of_layer
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;

    #[test]
    fn every_return_that_is_no_ground_stands_in_its_row() {
        for columns in [16, 1803] {
            let scan = scan_of(columns, |column, layer| match column % 3 {
                0 => 0,
                _ => (100 + column + 10 * layer) as u16,
            });
            let ground: Vec<bool> = (0..scan.len()).map(|point| point % 5 == 0).collect();
            let mut rows: Vec<Row> = (0..MAX_LAYERS).map(|_| Row::new()).collect();
            turn(&scan, &ground, &mut rows);
            for (point, is_ground) in ground.into_iter().enumerate() {
                let (column, layer) = (scan.column(point), scan.layer(point));
                let row = &rows[layer];
                if scan.has_return(point) && !is_ground {
                    let [x, y, z] = scan.point_m(point);
                    let found = [row.x_m[column], row.y_m[column], row.z_m[column]];
                    assert_eq!(found, [x, y, z]);
                    assert_eq!(row.range_m[column], scan.range_m()[point]);
                } else {
                    assert_eq!(row.x_m[column], f32::INFINITY);
                }
            }
        }
    }
}
