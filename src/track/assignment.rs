//! The cheapest pairing of two sets (Kuhn 1955, in the shortest-path form of Jonker, Volgenant
//! 1987).

/// Pairs rows with columns. Its buffers are made once.
#[derive(Debug, Clone, Default)]
pub(super) struct Assigner {
    pairs: Vec<Option<usize>>,
    is_row_met: Vec<bool>,
    is_column_met: Vec<bool>,
    /// The part that is solved: its rows, its columns, and their costs.
    rows: Vec<usize>,
    columns: Vec<usize>,
    cost: Vec<f64>,
    part: Part,
}

impl Assigner {
    /// Pairs rows with columns so that the sum of costs is least. Pairs that cost `forbidden` or
    /// more are never made, and leaving a row alone costs `forbidden`. Among equally cheap
    /// pairings the one is taken in which lower rows have lower columns. `cost` is row by row.
    ///
    /// Rows and columns that no allowed pairs connect do not concern each other: each such part
    /// is solved for itself.
    pub(super) fn assign(
        &mut self,
        rows: usize,
        columns: usize,
        cost: &[f64],
        forbidden: f64,
    ) -> &[Option<usize>] {
        refill(&mut self.pairs, rows, None);
        refill(&mut self.is_row_met, rows, false);
        refill(&mut self.is_column_met, columns, false);
        for first in 0..rows {
            if std::mem::replace(&mut self.is_row_met[first], true) {
                continue;
            }
            self.connect(first, columns, cost, forbidden);
            self.cost.clear();
            for row in &self.rows {
                let own = self.columns.iter();
                self.cost
                    .extend(own.map(|column| cost[row * columns + column]));
            }
            let size = (self.rows.len(), self.columns.len());
            let pairs = self.part.solve(size, &self.cost, forbidden);
            for (row, column) in self.rows.iter().zip(pairs) {
                self.pairs[*row] = column.map(|column| self.columns[column]);
            }
        }
        &self.pairs
    }

    /// The column of each row, as they were paired last.
    pub(super) fn pairs(&self) -> &[Option<usize>] {
        &self.pairs
    }

    /// Finds the rows and columns that allowed pairs connect with a row.
    fn connect(&mut self, first: usize, columns: usize, cost: &[f64], forbidden: f64) {
        let is_allowed = |row: usize, column: usize| cost[row * columns + column] < forbidden;
        self.rows.clear();
        self.columns.clear();
        self.rows.push(first);
        let mut next = 0;
        while let Some(row) = self.rows.get(next).copied() {
            next += 1;
            for (column, is_met) in self.is_column_met.iter_mut().enumerate() {
                if *is_met || !is_allowed(row, column) {
                    continue;
                }
                *is_met = true;
                self.columns.push(column);
                for (other, is_met) in self.is_row_met.iter_mut().enumerate() {
                    if !*is_met && is_allowed(other, column) {
                        *is_met = true;
                        self.rows.push(other);
                    }
                }
            }
        }
        self.rows.sort_unstable();
        self.columns.sort_unstable();
    }
}

/// Makes a list of so many times the same.
fn refill<T: Clone>(list: &mut Vec<T>, count: usize, value: T) {
    list.clear();
    list.resize(count, value);
}

/// All rows and columns at once.
#[derive(Debug, Clone, Default)]
struct Part {
    owner: Vec<Option<usize>>,
    row_potential: Vec<f64>,
    column_potential: Vec<f64>,
    distance: Vec<f64>,
    from: Vec<Option<usize>>,
    done: Vec<bool>,
    pairs: Vec<Option<usize>>,
}

impl Part {
    fn solve(
        &mut self,
        (rows, columns): (usize, usize),
        cost: &[f64],
        forbidden: f64,
    ) -> &[Option<usize>] {
        // A column of its own for every row stands for being left alone.
        let width = columns + rows;
        let price = |row: usize, column: usize| {
            if column < columns {
                cost[row * columns + column].min(2.0 * forbidden)
            } else {
                forbidden
            }
        };
        let Self {
            owner,
            row_potential,
            column_potential,
            distance,
            from,
            done,
            pairs,
        } = self;
        refill(owner, width, None);
        refill(row_potential, rows, 0.0);
        refill(column_potential, width, 0.0);
        for new in 0..rows {
            // Shortest path from the new row to a free column (Dijkstra on reduced costs).
            refill(distance, width, f64::INFINITY);
            refill(from, width, None);
            refill(done, width, false);
            let (mut row, mut reached, mut via) = (new, 0.0, None);
            let free = loop {
                for column in 0..width {
                    if done[column] {
                        continue;
                    }
                    let reduced =
                        price(row, column) - row_potential[row] - column_potential[column];
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
        refill(pairs, rows, None);
        for (column, row) in owner.iter().enumerate().take(columns) {
            if let Some(row) = row
                && cost[row * columns + column] < forbidden
            {
                pairs[*row] = Some(column);
            }
        }
        pairs
    }
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
            let mut assigner = Assigner::default();
            let pairs = assigner.assign(rows, columns, &cost, 8.0);
            let sum: f64 = pairs
                .iter()
                .enumerate()
                .map(|(row, pair)| pair.map_or(8.0, |column| cost[row * columns + column]))
                .sum();
            assert!((sum - least(rows, columns, &cost, 8.0)).abs() < 1e-9);
            let mut taken: Vec<usize> = pairs.iter().flatten().copied().collect();
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
            let mut assigner = Assigner::default();
            let by_parts = assigner.assign(rows, columns, &cost, 8.0);
            let mut all = Part::default();
            assert_eq!(by_parts, all.solve((rows, columns), &cost, 8.0));
        }
    }

    #[test]
    fn the_nearest_is_not_always_the_best() {
        // Row 0 is a little nearer to column 0, row 1 can have nothing else.
        let cost = [1.0, 1.5, 2.0, 100.0];
        let mut assigner = Assigner::default();
        assert_eq!(assigner.assign(2, 2, &cost, 10.0), [Some(1), Some(0)]);
    }
}
