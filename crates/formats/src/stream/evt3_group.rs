//! Groups of EVT3 words, checked and counted four words at a time: as lanes of a 64-bit number.

/// Words per group, and at least the events of one word.
pub(super) const WORDS: usize = 16;

/// Words side by side in stream order, the first in the lowest bits.
pub(super) struct Group([u64; WORDS / 4]);

/// The same 16 bits in each lane.
const fn lanes(bits: u16) -> u64 {
    bits as u64 * 0x0001_0001_0001_0001
}

/// Lowest bit of each lane.
const ONES: u64 = lanes(1);

impl Group {
    #[inline(always)]
    pub(super) fn new(bytes: &[u8; 2 * WORDS]) -> Self {
        let mut lanes = [0; WORDS / 4];
        for (lanes, bytes) in lanes.iter_mut().zip(bytes.as_chunks().0) {
            *lanes = u64::from_le_bytes(*bytes);
        }
        Self(lanes)
    }

    /// True if it has only single events, rows and low time words, all of them on a sensor of at most 2048 by 2048 pixels. Only then
    /// the other methods are meaningful.
    #[inline(always)]
    pub(super) fn is_single(&self, width: u16, height: u16) -> bool {
        let (to_width, to_height) = (lanes(0x8000 - width), lanes(0x8000 - height));
        let mut foreign = 0;
        for w in self.0 {
            // Kinds 0, 2 and 6: bits 15 and 12 clear, and 14 only beside 13.
            foreign |= w & lanes(0x9000) | w & !(w << 1) & lanes(0x4000);
            // The highest bit of a lane is set from the limit on.
            let number = w & lanes(0x07ff);
            let (column, row) = (number + to_width, number + to_height);
            let (is_row, is_low) = (!w << 2, w << 1);
            foreign |= (column & !is_row | row & is_row) & !is_low & lanes(0x8000);
        }
        foreign == 0
    }

    /// Number of words with a bit.
    #[inline(always)]
    fn count(&self, bit: impl Fn(u64) -> u64) -> usize {
        let sums = self.0.iter().map(|w| bit(*w) & ONES).sum::<u64>();
        (sums.wrapping_mul(ONES) >> 48) as usize
    }

    #[inline(always)]
    pub(super) fn events(&self) -> usize {
        self.count(|w| w >> 13 & !(w >> 14))
    }

    #[inline(always)]
    pub(super) fn on_events(&self) -> usize {
        self.count(|w| w >> 13 & !(w >> 14) & w >> 11)
    }

    #[inline(always)]
    pub(super) fn time_low(&self) -> usize {
        self.count(|w| w >> 14)
    }

    /// Last word with a bit.
    #[inline(always)]
    fn last(&self, bit: impl Fn(u64) -> u64) -> Option<u64> {
        let (mut word, mut found) = (0, 0);
        for w in self.0 {
            let bits = bit(w) & ONES;
            (word, found) = if bits == 0 { (word, found) } else { (w, bits) };
        }
        // The bits of the lane are one above those before it.
        let lane = found.checked_ilog2()?;
        Some(word >> lane & 0xffff)
    }

    #[inline(always)]
    pub(super) fn last_low(&self) -> Option<u64> {
        self.last(|w| w >> 14).map(|w| w & 0x0fff)
    }

    #[inline(always)]
    pub(super) fn last_row(&self) -> Option<u32> {
        self.last(|w| !w >> 13).map(|w| (w & 0x07ff) as u32)
    }
}
