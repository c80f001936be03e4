//! Many counters in little memory: events are counted all over them, which is as fast as they stay in the processor's caches.

use std::ops::Range;

/// Counters, a byte each; how often a byte has gone round is counted apart, from the first time on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Counters {
    low: Vec<u8>,
    /// As many as there are counters, or none before any has gone round.
    rounds: Vec<u32>,
}

impl Counters {
    /// Counters that are 0.
    pub fn new(len: usize) -> Self {
        Self {
            low: vec![0; len],
            rounds: Vec::new(),
        }
    }

    /// How many there are.
    pub const fn len(&self) -> usize {
        self.low.len()
    }

    /// Counts one. False when there is no such counter.
    #[inline]
    pub fn add(&mut self, index: usize) -> bool {
        let Some(low) = self.low.get_mut(index) else {
            return false;
        };
        *low = low.wrapping_add(1);
        if *low == 0 {
            self.carry(index, 1);
        }
        true
    }

    /// Counts many. False when there is no such counter.
    pub fn add_many(&mut self, index: usize, n: u32) -> bool {
        let Some(low) = self.low.get_mut(index) else {
            return false;
        };
        let [lowest, ..] = n.to_le_bytes();
        let (sum, carry) = low.overflowing_add(lowest);
        *low = sum;
        let rounds = (n >> u8::BITS) + u32::from(carry);
        if rounds > 0 {
            self.carry(index, rounds);
        }
        true
    }

    /// Stops at the most that can be told, 2^40 - 1 or a little less.
    #[cold]
    fn carry(&mut self, index: usize, n: u32) {
        self.rounds.resize(self.low.len(), 0);
        self.rounds[index] = self.rounds[index].saturating_add(n);
    }

    /// What has been counted.
    #[inline]
    pub fn get(&self, index: usize) -> u64 {
        let rounds = self.rounds.get(index).copied().unwrap_or(0);
        u64::from(rounds) << u8::BITS | u64::from(self.low[index])
    }

    /// Sum of some.
    #[inline]
    pub fn sum(&self, indices: Range<usize>) -> u64 {
        let low: u32 = self.low[indices.clone()]
            .iter()
            .map(|n| u32::from(*n))
            .sum();
        let rounds = self.rounds.get(indices).unwrap_or_default().iter();
        u64::from(low) + (rounds.map(|n| u64::from(*n)).sum::<u64>() << u8::BITS)
    }

    /// Sets some back to 0.
    pub fn clear(&mut self, indices: Range<usize>) {
        self.low[indices.clone()].fill(0);
        if let Some(rounds) = self.rounds.get_mut(indices) {
            rounds.fill(0);
        }
    }

    /// What has been counted, counter by counter.
    pub fn iter(&self) -> impl Iterator<Item = u64> {
        (0..self.len()).map(|index| self.get(index))
    }
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn counts_are_those_of_wide_counters(
            steps in vec((0usize..6, prop_oneof![Just(1u32), 0u32..1000, any::<u32>()]), 0..40),
            cleared in 0usize..5,
        ) {
            let mut counters = Counters::new(5);
            let mut wide = [0u64; 5];
            for (index, n) in steps {
                let counted = if n == 1 { counters.add(index) } else { counters.add_many(index, n) };
                prop_assert_eq!(counted, index < 5);
                if let Some(wide) = wide.get_mut(index) {
                    *wide += u64::from(n);
                }
            }
            prop_assert!(counters.iter().eq(wide));
            prop_assert_eq!(counters.sum(1..4), wide[1..4].iter().sum::<u64>());
            counters.clear(0..cleared);
            wide[..cleared].fill(0);
            prop_assert!(counters.iter().eq(wide));
        }
    }

    #[test]
    fn one_by_one_beyond_a_byte() {
        let mut counters = Counters::new(2);
        (0..70_000).for_each(|_| assert!(counters.add(1)));
        assert_eq!((counters.get(0), counters.get(1)), (0, 70_000));
    }
}
