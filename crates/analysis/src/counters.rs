//! Owns many counters in little memory, so that random increments stay in the processor's caches.

use std::ops::Range;

/// Counters of one byte each; overflows are counted separately, from the first one on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Counters {
    low: Vec<u8>,
    /// One per counter, or none before the first overflow.
    rounds: Vec<u32>,
}

impl Counters {
    /// Counters that are 0.
    pub(crate) fn new(len: usize) -> Self {
        Self {
            low: vec![0; len],
            rounds: Vec::new(),
        }
    }

    /// Number of counters.
    pub(crate) const fn len(&self) -> usize {
        self.low.len()
    }

    /// Increments one counter. False if it does not exist.
    #[inline]
    pub(crate) fn add(&mut self, index: usize) -> bool {
        let Some(low) = self.low.get_mut(index) else {
            return false;
        };
        *low = low.wrapping_add(1);
        if *low == 0 {
            self.carry(index, 1);
        }
        true
    }

    /// Adds to one counter. False if it does not exist.
    pub(crate) fn add_many(&mut self, index: usize, n: u32) -> bool {
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

    /// Saturates at the maximum, 2^40 - 1 or slightly less.
    #[cold]
    fn carry(&mut self, index: usize, n: u32) {
        self.rounds.resize(self.low.len(), 0);
        self.rounds[index] = self.rounds[index].saturating_add(n);
    }

    /// Value of a counter.
    #[inline]
    pub(crate) fn get(&self, index: usize) -> u64 {
        let rounds = self.rounds.get(index).copied().unwrap_or(0);
        u64::from(rounds) << u8::BITS | u64::from(self.low[index])
    }

    /// Sum of eight counters from an index on, and a bit for each that is above 1.
    #[inline]
    pub(crate) fn eight(&self, first: usize) -> (u64, u64) {
        let word = self.low[first..first + 8]
            .iter()
            .rev()
            .fold(0, |word, n| word << u8::BITS | u64::from(*n));
        let (mut sum, mut bits) = (bytes::sum(word), bytes::nonzero(word & !bytes::ONES));
        if let Some(rounds) = self.rounds.get(first..first + 8) {
            sum += rounds
                .iter()
                .map(|n| u64::from(*n) << u8::BITS)
                .sum::<u64>();
            let above = rounds.iter().map(|n| u64::from(*n > 0)).zip(0..);
            bits = above.fold(bits, |all, (bit, i)| all | bit << i);
        }
        (sum, bits)
    }

    /// Sums of counters that are `N` apart, like the columns of a table.
    pub(crate) fn columns<const N: usize>(&self) -> [u64; N] {
        let mut sums = [0; N];
        // This many bytes fit into 16 bits: add rows side by side.
        for rows in self.low.chunks(256 * N) {
            let mut some = [0u16; N];
            for row in rows.chunks(N) {
                some.iter_mut()
                    .zip(row)
                    .for_each(|(sum, n)| *sum += u16::from(*n));
            }
            sums.iter_mut()
                .zip(some)
                .for_each(|(sum, n)| *sum += u64::from(n));
        }
        for row in self.rounds.chunks(N) {
            sums.iter_mut()
                .zip(row)
                .for_each(|(sum, n)| *sum += u64::from(*n) << u8::BITS);
        }
        sums
    }

    /// Resets a range to 0.
    pub(crate) fn clear(&mut self, indices: Range<usize>) {
        self.low[indices.clone()].fill(0);
        if let Some(rounds) = self.rounds.get_mut(indices) {
            rounds.fill(0);
        }
    }

    /// All values in order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = u64> {
        (0..self.len()).map(|index| self.get(index))
    }
}

/// Eight bytes in a word, the first one lowest.
mod bytes {
    /// A one in each.
    pub(crate) const ONES: u64 = 0x0101_0101_0101_0101;
    const LOW_SEVEN: u64 = 0x7f7f_7f7f_7f7f_7f7f;
    const EVEN: u64 = 0x00ff_00ff_00ff_00ff;

    /// Their sum: in four pairs, then the uppermost 16 bits of the product.
    pub(super) const fn sum(word: u64) -> u64 {
        let pairs = (word & EVEN) + (word >> 8 & EVEN);
        pairs.wrapping_mul(0x0001_0001_0001_0001) >> 48
    }

    /// A bit for each non-zero byte: a carry from the lower bits sets its top bit, which the product moves into the
    /// uppermost byte.
    pub(crate) const fn nonzero(word: u64) -> u64 {
        let uppermost = (((word & LOW_SEVEN) + LOW_SEVEN) | word) & !LOW_SEVEN;
        (uppermost >> 7).wrapping_mul(0x0102_0408_1020_4080) >> 56
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
            steps in vec((0usize..10, prop_oneof![Just(1u32), 0u32..1000, any::<u32>()]), 0..40),
            cleared in 0usize..9,
        ) {
            let mut counters = Counters::new(9);
            let mut wide = [0u64; 9];
            for (index, n) in steps {
                let counted = if n == 1 { counters.add(index) } else { counters.add_many(index, n) };
                prop_assert_eq!(counted, index < 9);
                if let Some(wide) = wide.get_mut(index) {
                    *wide += u64::from(n);
                }
            }
            prop_assert!(counters.iter().eq(wide));
            let above = (0..8).fold(0, |all, i| all | u64::from(wide[1 + i] > 1) << i);
            let columns = [0, 1, 2].map(|k| wide.iter().skip(k).step_by(3).sum::<u64>());
            prop_assert_eq!(counters.columns(), columns);
            prop_assert_eq!(counters.eight(1), (wide[1..].iter().sum(), above));
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

    #[test]
    fn many_full_bytes_side_by_side() {
        let mut counters = Counters::new(1000);
        (0..1000).for_each(|i| assert!(counters.add_many(i, 255)));
        assert_eq!(counters.columns(), [255_000]);
    }
}
