//! A set of pixels, one bit each, with ordered iteration.

use std::ops::Range;

use skinrig_model::SENSOR_WIDTH;

/// Bits of a word.
const BITS: usize = u64::BITS as usize;
/// Pixels of a row.
const WIDTH: usize = SENSOR_WIDTH as usize;
/// Words of a row: the rows of the sensor fill whole words.
const ROW_WORDS: usize = WIDTH / BITS;
const _: () = assert!(WIDTH.is_multiple_of(BITS));

/// Pixels of some rows of the sensor, by index: `row * width + column`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct PixelSet {
    words: Vec<u64>,
}

impl PixelSet {
    /// An empty set over `height` rows.
    pub(crate) fn new(height: usize) -> Self {
        Self {
            words: vec![0; height * ROW_WORDS],
        }
    }

    /// Empties the set and gives it `height` rows.
    pub(crate) fn reset(&mut self, height: usize) {
        self.words.clear();
        self.words.resize(height * ROW_WORDS, 0);
    }

    /// Adds a pixel of the rows.
    pub(crate) fn insert(&mut self, index: usize) {
        self.words[index / BITS] |= 1 << (index % BITS);
    }

    /// True if this pixel is in the set; false beyond the rows.
    pub(crate) fn contains(&self, index: usize) -> bool {
        let word = self.words.get(index / BITS);
        word.is_some_and(|word| word >> (index % BITS) & 1 == 1)
    }

    /// Appends the indices in the set, ascending, to `out`.
    pub(crate) fn append_to(&self, out: &mut Vec<u32>) {
        for (i, &word) in self.words.iter().enumerate() {
            let mut left = word;
            while left != 0 {
                out.push(i as u32 * u64::BITS + left.trailing_zeros());
                left &= left - 1;
            }
        }
    }

    /// Ranges of 64 indices that cover the set, skipping empty ones.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = Range<usize>> {
        let words = self.words.iter().enumerate();
        let occupied = words.filter(|(_, word)| **word != 0);
        occupied.map(|(i, _)| i * BITS..(i + 1) * BITS)
    }

    /// The words of one row.
    pub(crate) fn row(&self, row: usize) -> &[u64] {
        &self.words[row * ROW_WORDS..(row + 1) * ROW_WORDS]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::btree_set;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn members_come_in_order(members in btree_set(0usize..2 * WIDTH, 0..40)) {
            let mut set = PixelSet::new(2);
            members.iter().for_each(|m| set.insert(*m));
            let mut indices = Vec::new();
            set.append_to(&mut indices);
            prop_assert!(indices.iter().map(|i| *i as usize).eq(members.iter().copied()));
            let blocks: Vec<usize> = set.blocks().map(|b| b.start).collect();
            prop_assert!(blocks.is_sorted_by(|a, b| a < b));
            prop_assert!(members.iter().all(|m| blocks.contains(&(m / BITS * BITS))));
            prop_assert!(blocks.len() <= members.len());
            set.reset(1);
            prop_assert_eq!(set.blocks().next(), None);
        }
    }
}
