//! Converts the wrapping time base of a stream to a continuous camera time.

use super::stats::Discontinuity;

/// Meaning of a new time base word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    /// Progress, or the first word.
    Forward,
    /// A wrap of the counter.
    Wrap,
    /// A discontinuity.
    Jump(Discontinuity),
}

/// State before a word that may be damaged.
#[derive(Debug, Clone, Copy)]
struct Doubtful {
    high: u32,
    epoch_us: u64,
    /// Value of the word.
    found: u32,
}

/// A counter of `BITS` bits whose unit is `2^SHIFT` µs, unwrapped.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TimeBase<const BITS: u32, const SHIFT: u32> {
    high: u32,
    epoch_us: u64,
    known: bool,
    /// Before the last word, if that was no progress; and its value.
    doubtful: Option<Doubtful>,
    /// Words were lost: the counter continues, but its value is unknown until the next time base word.
    stale: bool,
}

impl<const BITS: u32, const SHIFT: u32> TimeBase<BITS, SHIFT> {
    /// Half of the range: the largest step that is accepted as progress.
    pub(crate) const HALF: u32 = 1 << (BITS - 1);
    const RANGE_US: u64 = 1 << (BITS + SHIFT);

    /// A counter before the first word; its times count from `origin_us`.
    pub(crate) const fn starting_at(origin_us: u64) -> Self {
        Self {
            high: 0,
            epoch_us: origin_us,
            known: false,
            doubtful: None,
            stale: false,
        }
    }

    /// True if a time base word has been received since the start or the last loss.
    pub(super) const fn known(&self) -> bool {
        self.known && !self.stale
    }

    /// Words were lost.
    pub(super) const fn lost(&mut self) {
        self.stale = true;
    }

    /// The current base, µs.
    pub(super) const fn base_us(&self) -> u64 {
        self.epoch_us + ((self.high as u64) << SHIFT)
    }

    /// Origin plus all completed ranges, µs.
    pub(crate) const fn epoch_us(&self) -> u64 {
        self.epoch_us
    }

    /// The last counter value.
    pub(super) const fn high(&self) -> u32 {
        self.high
    }

    /// Advances to `high`; the caller has checked that it is ordinary progress.
    pub(super) const fn advance(&mut self, high: u32) {
        self.high = high;
    }

    const fn is_progress(from: u32, to: u32) -> bool {
        to >= from && to - from <= Self::HALF
    }

    /// Processes the next counter value (below `2^BITS`).
    pub(super) fn set(&mut self, high: u32) -> Step {
        let from_us = self.base_us();
        let previous = self.high;
        self.high = high;
        self.stale = false;
        if !self.known {
            self.known = true;
            return Step::Forward;
        }
        if Self::is_progress(previous, high) {
            return Step::Forward;
        }
        let before = Doubtful {
            high: previous,
            epoch_us: self.epoch_us,
            found: high,
        };
        // The counter goes on where it was before the last word: that one was damaged, and no range was completed.
        if let Some(last) = self.doubtful.replace(before)
            && last.found == previous
            && Self::is_progress(last.high, high)
        {
            (self.epoch_us, self.doubtful) = (last.epoch_us, None);
            return Step::Jump(Discontinuity {
                from_us,
                to_us: self.base_us(),
            });
        }
        if high < previous && previous - high > Self::HALF {
            self.epoch_us = self.epoch_us.wrapping_add(Self::RANGE_US);
            return Step::Wrap;
        }
        Step::Jump(Discontinuity {
            from_us,
            to_us: self.base_us(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_distinguished() {
        let mut base = TimeBase::<12, 12>::default();
        assert_eq!(base.set(4000), Step::Forward);
        assert_eq!(base.set(4000), Step::Forward);
        assert_eq!(base.set(1), Step::Wrap);
        assert_eq!(base.base_us(), (4096 + 1) << 12);
        assert_eq!(base.set(2049), Step::Forward);
        let Step::Jump(back) = base.set(2048) else {
            panic!("a small step back is a discontinuity");
        };
        assert_eq!(back.from_us - back.to_us, 4096);
        assert_eq!(
            base.set(0),
            Step::Jump(Discontinuity {
                from_us: 6144 << 12,
                to_us: 4096 << 12
            })
        );
        assert!(matches!(base.set(2049), Step::Jump(_)));
        assert_eq!(base.set(0), Step::Wrap);
    }

    #[test]
    fn a_damaged_word_does_not_move_the_rest() {
        for damaged in [3, 900, 2000, 3500] {
            let mut base = TimeBase::<12, 12>::default();
            for high in [2900, 2901, damaged, 2902, 2903, 4095] {
                base.set(high);
            }
            assert_eq!(base.base_us(), 4095 << 12, "{damaged}");
            assert_eq!(base.set(0), Step::Wrap);
        }
    }
}
