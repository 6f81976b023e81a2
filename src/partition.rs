//! A partition that grows by joining (union-find; Tarjan 1975).

/// Sets of numbers below a bound, each with its smallest member as the representative.
#[derive(Debug, Clone, Default)]
pub(crate) struct Partition {
    parent: Vec<u32>,
}

impl Partition {
    /// Every number below `len` in a set of its own.
    pub(crate) fn reset(&mut self, len: usize) {
        self.parent.clear();
        self.parent.extend(0..len as u32);
    }

    /// Finds the sets of all numbers at once: [`Partition::parents`] are the smallest members, for
    /// now.
    pub(crate) fn flatten(&mut self) {
        for number in 0..self.parent.len() {
            // Parents are smaller, and their own ones are found already.
            self.parent[number] = self.parent[self.parent[number] as usize];
        }
    }

    /// A member of each number's set: the smallest one that was known at some time.
    pub(crate) fn parents(&self) -> &[u32] {
        &self.parent
    }

    /// The smallest member of a number's set.
    pub(crate) fn find(&mut self, mut number: u32) -> u32 {
        while self.parent[number as usize] != number {
            let grandparent = self.parent[self.parent[number as usize] as usize];
            self.parent[number as usize] = grandparent;
            number = grandparent;
        }
        number
    }

    /// Makes one set of two.
    pub(crate) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joined_numbers_share_their_smallest_member() {
        let mut partition = Partition::default();
        partition.reset(6);
        partition.join(5, 4);
        partition.join(4, 2);
        partition.join(0, 3);
        let found: Vec<u32> = (0..6).map(|number| partition.find(number)).collect();
        assert_eq!(found, [0, 1, 2, 0, 2, 2]);
    }
}
