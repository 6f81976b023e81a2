//! The cheapest pairing of two sets (Kuhn 1955, in the shortest-path form of Jonker, Volgenant
//! 1987).

/// Pairs rows with columns so that the sum of costs is least. Pairs that cost `forbidden` or
/// more are never made, and leaving a row alone costs `forbidden`. Among equally cheap pairings
/// the one is taken in which lower rows have lower columns. `cost` is row by row.
///
/// Rows and columns that no allowed pairs connect do not concern each other: each such part is
/// solved for itself.
pub(super) fn assign(
    rows: usize,
    columns: usize,
    cost: &[f64],
    forbidden: f64,
) -> Vec<Option<usize>> {
    let is_allowed = |row: usize, column: usize| cost[row * columns + column] < forbidden;
    let mut pairs = vec![None; rows];
    let (mut is_row_met, mut is_column_met) = (vec![false; rows], vec![false; columns]);
    let (mut own_rows, mut own_columns, mut own_cost) = (vec![], vec![], vec![]);
    for first in 0..rows {
        if std::mem::replace(&mut is_row_met[first], true) {
            continue;
        }
        own_rows.clear();
        own_columns.clear();
        own_rows.push(first);
        let mut next = 0;
        while let Some(row) = own_rows.get(next).copied() {
            next += 1;
            for (column, is_met) in is_column_met.iter_mut().enumerate() {
                if *is_met || !is_allowed(row, column) {
                    continue;
                }
                *is_met = true;
                own_columns.push(column);
                for (other, is_met) in is_row_met.iter_mut().enumerate() {
                    if !*is_met && is_allowed(other, column) {
                        *is_met = true;
                        own_rows.push(other);
                    }
                }
            }
        }
        own_rows.sort_unstable();
        own_columns.sort_unstable();
        own_cost.clear();
        for row in &own_rows {
            own_cost.extend(
                own_columns
                    .iter()
                    .map(|column| cost[row * columns + column]),
            );
        }
        let own_pairs = assign_all(own_rows.len(), own_columns.len(), &own_cost, forbidden);
        for (row, column) in own_rows.iter().zip(own_pairs) {
            pairs[*row] = column.map(|column| own_columns[column]);
        }
    }
    pairs
}

/// The same, all rows and columns at once.
fn assign_all(rows: usize, columns: usize, cost: &[f64], forbidden: f64) -> Vec<Option<usize>> {
    // A column of its own for every row stands for being left alone.
    let width = columns + rows;
    let price = |row: usize, column: usize| {
        if column < columns {
            cost[row * columns + column].min(2.0 * forbidden)
        } else {
            forbidden
        }
    };
    let mut owner: Vec<Option<usize>> = vec![None; width];
    let (mut row_potential, mut column_potential) = (vec![0.0; rows], vec![0.0; width]);
    for new in 0..rows {
        // Shortest path from the new row to a free column (Dijkstra on reduced costs).
        let mut distance = vec![f64::INFINITY; width];
        let mut from: Vec<Option<usize>> = vec![None; width];
        let mut done = vec![false; width];
        let (mut row, mut reached, mut via) = (new, 0.0, None);
        let free = loop {
            for column in 0..width {
                if done[column] {
                    continue;
                }
                let reduced = price(row, column) - row_potential[row] - column_potential[column];
                if reached + reduced < distance[column] {
                    distance[column] = reached + reduced;
                    from[column] = via;
                }
            }
            let nearest = (0..width)
                .filter(|column| !done[*column])
                .min_by(|a, b| distance[*a].total_cmp(&distance[*b]));
            // There is always a free column: one for every row.
            let Some(column) = nearest else { break None };
            done[column] = true;
            reached = distance[column];
            match owner[column] {
                None => break Some(column),
                Some(next) => (row, via) = (next, Some(column)),
            }
        };
        row_potential[new] += reached;
        for column in 0..width {
            if done[column] {
                if let Some(row) = owner[column] {
                    row_potential[row] += reached - distance[column];
                }
                column_potential[column] -= reached - distance[column];
            }
        }
        let mut column = free;
        while let Some(taken) = column {
            let before = from[taken];
            owner[taken] = match before {
                Some(before) => owner[before],
                None => Some(new),
            };
            column = before;
        }
    }
    let mut pairs = vec![None; rows];
    for (column, row) in owner.iter().enumerate().take(columns) {
        if let Some(row) = row
            && cost[row * columns + column] < forbidden
        {
            pairs[*row] = Some(column);
        }
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// The least sum by trying everything.
    fn least(rows: usize, columns: usize, cost: &[f64], forbidden: f64) -> f64 {
        fn go(
            row: usize,
            rows: usize,
            columns: usize,
            cost: &[f64],
            forbidden: f64,
            taken: u32,
        ) -> f64 {
            if row == rows {
                return 0.0;
            }
            let alone = forbidden + go(row + 1, rows, columns, cost, forbidden, taken);
            (0..columns)
                .filter(|column| {
                    taken & (1 << column) == 0 && cost[row * columns + column] < forbidden
                })
                .map(|column| {
                    cost[row * columns + column]
                        + go(row + 1, rows, columns, cost, forbidden, taken | 1 << column)
                })
                .fold(alone, f64::min)
        }
        go(0, rows, columns, cost, forbidden, 0)
    }

    #[test]
    fn the_sum_is_the_least_there_is() {
        let mut random = Random::new(4);
        for _ in 0..300 {
            let (rows, columns) = (1 + random.below(5), random.below(6));
            let cost: Vec<f64> = (0..rows * columns)
                .map(|_| 12.0 * random.uniform())
                .collect();
            let pairs = assign(rows, columns, &cost, 8.0);
            let sum: f64 = pairs
                .iter()
                .enumerate()
                .map(|(row, pair)| pair.map_or(8.0, |column| cost[row * columns + column]))
                .sum();
            assert!((sum - least(rows, columns, &cost, 8.0)).abs() < 1e-9);
            let mut taken: Vec<usize> = pairs.into_iter().flatten().collect();
            let count = taken.len();
            taken.sort_unstable();
            taken.dedup();
            assert_eq!(taken.len(), count);
        }
    }

    #[test]
    fn parts_that_nothing_connects_are_paired_as_they_are_among_all() {
        let mut random = Random::new(5);
        for _ in 0..50 {
            let (rows, columns) = (20, 25);
            let mut price = || match random.uniform() {
                share if share < 0.08 => 100.0 * share,
                _ => 1e6,
            };
            let cost: Vec<f64> = (0..rows * columns).map(|_| price()).collect();
            let all = assign_all(rows, columns, &cost, 8.0);
            assert_eq!(assign(rows, columns, &cost, 8.0), all);
        }
    }

    #[test]
    fn the_nearest_is_not_always_the_best() {
        // Row 0 is a little nearer to column 0, row 1 can have nothing else.
        let cost = [1.0, 1.5, 2.0, 100.0];
        assert_eq!(assign(2, 2, &cost, 10.0), [Some(1), Some(0)]);
    }
}
