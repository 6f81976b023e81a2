//! Counters by name: nothing is lost silently.

use std::collections::BTreeMap;
use std::fmt;

/// How often each kind of fault occurred, in the order of their names.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tally {
    counts: BTreeMap<&'static str, u64>,
}

impl Tally {
    /// Counts one more.
    pub fn count(&mut self, name: &'static str) {
        self.count_many(name, 1);
    }

    /// Counts several more.
    pub fn count_many(&mut self, name: &'static str, more: u64) {
        if more > 0 {
            *self.counts.entry(name).or_default() += more;
        }
    }

    /// How often `name` was counted.
    pub fn get(&self, name: &str) -> u64 {
        self.counts.get(name).copied().unwrap_or(0)
    }

    /// All counts together.
    pub fn total(&self) -> u64 {
        self.counts.values().sum()
    }

    /// Names and counts.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, u64)> {
        self.counts.iter().map(|(name, count)| (*name, *count))
    }

    /// Adds another tally to this one.
    pub fn add(&mut self, other: &Self) {
        for (name, count) in other.iter() {
            self.count_many(name, count);
        }
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (name, count)) in self.iter().enumerate() {
            let gap = if index == 0 { "" } else { " " };
            write!(f, "{gap}{name}={count}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_printed_in_the_order_of_their_names() {
        let mut tally = Tally::default();
        for name in ["zero_layers", "bad_magic", "zero_layers"] {
            tally.count(name);
        }
        let mut sum = tally.clone();
        sum.add(&tally);
        assert_eq!(tally.to_string(), "bad_magic=1 zero_layers=2");
        assert_eq!((sum.get("zero_layers"), sum.total()), (4, 6));
    }
}
