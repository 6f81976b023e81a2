//! The cheapest pairing of two sets (Kuhn 1955, in the shortest-path form of Jonker, Volgenant
//! 1987).

use crate::partition::Partition;

/// A row and a column that may become a pair.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) row: usize,
    pub(super) column: usize,
    pub(super) cost: f64,
}

/// Pairs rows with columns. Its buffers are made once.
#[derive(Debug, Clone, Default)]
pub(super) struct Assigner {
    pairs: Vec<Option<usize>>,
    is_paired: Vec<bool>,
    /// Which rows, and behind them which columns, candidates connect.
    connected: Partition,
    /// The part that is solved: its rows, its columns, and their costs.
    rows: Vec<usize>,
    columns: Vec<usize>,
    cost: Vec<f64>,
    part: Part,
}

impl Assigner {
    /// Pairs rows with columns so that the sum of costs is least. Other pairs than the candidates
    /// that cost less than `forbidden` are never made, and leaving a row alone costs `forbidden`.
    /// Among equally cheap pairings the one is taken in which lower rows have lower columns.
    /// The candidates are sorted, and those that are none are dropped.
    ///
    /// Rows and columns that no candidates connect do not concern each other: each such part is
    /// solved for itself.
    pub(super) fn assign(
        &mut self,
        (rows, columns): (usize, usize),
        candidates: &mut Vec<Candidate>,
        forbidden: f64,
    ) -> &[Option<usize>] {
        refill(&mut self.pairs, rows, None);
        refill(&mut self.is_paired, columns, false);
        self.connected.reset(rows + columns);
        candidates.retain(|pair| pair.cost < forbidden);
        for pair in candidates.iter() {
            let (row, column) = (pair.row as u32, (rows + pair.column) as u32);
            self.connected.join(row, column);
        }
        self.connected.flatten();
        let part_of = |candidate: &Candidate| self.connected.parents()[candidate.row];
        candidates.sort_unstable_by_key(|pair| (part_of(pair), pair.row, pair.column));
        for part in candidates.chunk_by(|a, b| part_of(a) == part_of(b)) {
            sort_out(&mut self.rows, part.iter().map(|pair| pair.row));
            sort_out(&mut self.columns, part.iter().map(|pair| pair.column));
            let size = (self.rows.len(), self.columns.len());
            refill(&mut self.cost, size.0 * size.1, f64::MAX);
            for candidate in part {
                let row = self.rows.binary_search(&candidate.row);
                let column = self.columns.binary_search(&candidate.column);
                if let (Ok(row), Ok(column)) = (row, column) {
                    self.cost[row * size.1 + column] = candidate.cost;
                }
            }
            let pairs = self.part.solve(size, &self.cost, forbidden);
            for (row, column) in self.rows.iter().zip(pairs) {
                if let Some(column) = column.map(|column| self.columns[column]) {
                    self.pairs[*row] = Some(column);
                    self.is_paired[column] = true;
                }
            }
        }
        &self.pairs
    }

    /// The column of each row, as they were paired last.
    pub(super) fn pairs(&self) -> &[Option<usize>] {
        &self.pairs
    }

    /// Whether a column has a row.
    pub(super) fn is_paired(&self, column: usize) -> bool {
        self.is_paired[column]
    }
}

/// Makes a list of some numbers in order, each once.
fn sort_out(list: &mut Vec<usize>, numbers: impl Iterator<Item = usize>) {
    list.clear();
    list.extend(numbers);
    list.sort_unstable();
    list.dedup();
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

    /// All pairs, row by row, the last one first.
    fn candidates(columns: usize, cost: &[f64]) -> Vec<Candidate> {
        let all = cost.iter().enumerate().rev();
        let pair = |(number, cost): (usize, &f64)| Candidate {
            row: number / columns,
            column: number % columns,
            cost: *cost,
        };
        all.map(pair).collect()
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
            let pairs = assigner.assign((rows, columns), &mut candidates(columns, &cost), 8.0);
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
            let all = 0..columns;
            assert!(
                all.clone()
                    .all(|column| assigner.is_paired(column) == taken.contains(&column))
            );
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
            let by_parts = assigner.assign((rows, columns), &mut candidates(columns, &cost), 8.0);
            let mut all = Part::default();
            assert_eq!(by_parts, all.solve((rows, columns), &cost, 8.0));
        }
    }

    #[test]
    fn the_nearest_is_not_always_the_best() {
        // Row 0 is a little nearer to column 0, row 1 can have nothing else.
        let cost = [1.0, 1.5, 2.0, 100.0];
        let mut assigner = Assigner::default();
        let pairs = assigner.assign((2, 2), &mut candidates(2, &cost), 10.0);
        assert_eq!(pairs, [Some(1), Some(0)]);
    }
}
