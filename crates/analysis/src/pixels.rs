//! A set of pixels, one bit each, that is walked in order and searched along its rows.

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
    pub fn new(height: usize) -> Self {
        Self {
            words: vec![0; height * ROW_WORDS],
        }
    }

    /// Empties the set and gives it `height` rows.
    pub fn reset(&mut self, height: usize) {
        self.words.clear();
        self.words.resize(height * ROW_WORDS, 0);
    }

    /// Adds a pixel of the rows.
    pub fn insert(&mut self, index: usize) {
        self.words[index / BITS] |= 1 << (index % BITS);
    }

    /// True when the pixel is in the set.
    pub fn contains(&self, index: usize) -> bool {
        self.words[index / BITS] >> (index % BITS) & 1 == 1
    }

    /// The indices in the set, ascending: row by row, each from left to right.
    pub fn iter(&self) -> impl Iterator<Item = usize> {
        ones(&self.words)
    }

    /// Appends the indices in the set, ascending, to `out`.
    pub fn append_to(&self, out: &mut Vec<u32>) {
        for (i, &word) in self.words.iter().enumerate() {
            let mut left = word;
            while left != 0 {
                out.push(i as u32 * u64::BITS + left.trailing_zeros());
                left &= left - 1;
            }
        }
    }

    /// The columns in the set of one row, ascending.
    pub fn columns(&self, row: usize) -> impl Iterator<Item = usize> {
        ones(self.row(row))
    }

    /// The column in `row` nearest to `column` and at most `reach` away; the left one of two.
    pub fn nearest(&self, row: usize, column: usize, reach: usize) -> Option<usize> {
        let (left, right) = if reach < BITS {
            self.around(row * WIDTH + column)
        } else {
            let columns = || self.columns(row);
            let left = columns().take_while(|c| *c <= column).last();
            let right = columns().find(|c| *c >= column);
            (
                left.map_or(usize::MAX, |c| column - c),
                right.map_or(usize::MAX, |c| c - column),
            )
        };
        // What lies beyond the ends of the row belongs to the rows above and below.
        let left_counts = left <= reach.min(column);
        let right_counts = right <= reach.min(WIDTH - 1 - column);
        if left_counts && (left <= right || !right_counts) {
            Some(column - left)
        } else {
            right_counts.then(|| column + right)
        }
    }

    /// Distances, in indices, from `index` down and up to the nearest members, 0 for itself; right when less than 64.
    fn around(&self, index: usize) -> (usize, usize) {
        let (at, bit) = (index / BITS, index % BITS);
        let word = |at: usize| u128::from(self.words.get(at).copied().unwrap_or(0));
        let here = word(at);
        let down = (here << BITS | word(at.wrapping_sub(1))) << (BITS - 1 - bit);
        let up = (word(at + 1) << BITS | here) >> bit;
        (down.leading_zeros() as usize, up.trailing_zeros() as usize)
    }

    fn row(&self, row: usize) -> &[u64] {
        &self.words[row * ROW_WORDS..(row + 1) * ROW_WORDS]
    }
}

fn ones(words: &[u64]) -> impl Iterator<Item = usize> {
    words.iter().enumerate().flat_map(|(i, &word)| {
        let mut left = word;
        std::iter::from_fn(move || {
            let bit = left.trailing_zeros() as usize;
            let found = (left != 0).then_some(i * BITS + bit);
            left &= left.wrapping_sub(1);
            found
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::btree_set;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn members_come_in_order_and_the_nearest_is_the_nearest(
            members in btree_set(0usize..2 * WIDTH, 0..40), column in 0usize..WIDTH, reach in 0usize..WIDTH,
        ) {
            let mut set = PixelSet::new(2);
            members.iter().for_each(|m| set.insert(*m));
            prop_assert!(set.iter().eq(members.iter().copied()));
            let mut indices = Vec::new();
            set.append_to(&mut indices);
            prop_assert!(indices.iter().map(|i| *i as usize).eq(members.iter().copied()));
            for row in 0..2 {
                let columns: Vec<usize> =
                    members.iter().filter(|m| *m / WIDTH == row).map(|m| m % WIDTH).collect();
                prop_assert!(set.columns(row).eq(columns.iter().copied()));
                prop_assert_eq!(set.contains(row * WIDTH + column), columns.contains(&column));
                // The first of the least distances is the left one.
                let nearest = columns.iter().copied().min_by_key(|c| c.abs_diff(column));
                let expected = nearest.filter(|c| c.abs_diff(column) <= reach);
                prop_assert_eq!(set.nearest(row, column, reach), expected);
            }
            set.reset(1);
            prop_assert_eq!(set.iter().next(), None);
        }
    }
}
