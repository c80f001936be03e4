//! Selects the processor's instruction set at run time.
//!
//! The program is built for any x86-64. [`InstructionSet::run`] compiles a loop once for each of three levels of the x86-64 psABI
//! and calls the one that the processor supports. The loops are ordinary code that the compiler vectorises: no operation differs
//! between the levels, so that results are the same to the last bit. Products and sums of floating-point numbers are not
//! fused, because Rust never fuses them by itself.
//!
//! A value exists only for a level that the processor supports, which keeps this code safe.

#[cfg(target_arch = "x86_64")]
use fearless_simd::{
    Level, Simd as _,
    x86::{Avx2, Sse4_2},
};

/// An instruction set that this processor supports.
#[derive(Clone, Copy)]
pub struct InstructionSet(Tier);

#[derive(Clone, Copy)]
enum Tier {
    /// Target of the build.
    Baseline,
    /// x86-64-v2: POPCNT, SSE4.2.
    #[cfg(target_arch = "x86_64")]
    V2(Sse4_2),
    /// x86-64-v3: AVX2, BMI.
    #[cfg(target_arch = "x86_64")]
    V3(Avx2),
}

impl InstructionSet {
    /// Target of the build, supported by every processor.
    const BASELINE: Self = Self(Tier::Baseline);

    /// The best supported set, detected once.
    #[must_use]
    pub fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            let level = Level::new();
            let v3 = level.as_avx2().map(Tier::V3);
            if let Some(tier) = v3.or_else(|| level.as_sse4_2().map(Tier::V2)) {
                return Self(tier);
            }
        }
        Self::BASELINE
    }

    /// All supported sets, baseline first, for tests that compare their results.
    #[must_use]
    pub fn available() -> Vec<Self> {
        let sets = [Self::BASELINE].into_iter();
        #[cfg(target_arch = "x86_64")]
        let sets = {
            let level = Level::new();
            sets.chain(level.as_sse4_2().map(|token| Self(Tier::V2(token))))
                .chain(level.as_avx2().map(|token| Self(Tier::V3(token))))
        };
        sets.collect()
    }

    /// Name of the level.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self.0 {
            Tier::Baseline => "baseline",
            #[cfg(target_arch = "x86_64")]
            Tier::V2(_) => "x86-64-v2",
            #[cfg(target_arch = "x86_64")]
            Tier::V3(_) => "x86-64-v3",
        }
    }

    /// Runs `work` compiled for this set: the closure and everything inlined into it. Mark both `#[inline(always)]`; a
    /// function that is not inlined is compiled for the baseline.
    #[inline(always)]
    pub fn run<R>(self, work: impl FnOnce() -> R) -> R {
        match self.0 {
            Tier::Baseline => work(),
            #[cfg(target_arch = "x86_64")]
            Tier::V2(token) => token.vectorize(work),
            #[cfg(target_arch = "x86_64")]
            Tier::V3(token) => token.vectorize(work),
        }
    }
}

impl std::fmt::Debug for InstructionSet {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_available_set_runs_the_work_once() {
        for set in InstructionSet::available() {
            let mut calls = 0;
            let ones = set.run(
                #[inline(always)]
                || {
                    calls += 1;
                    [u64::MAX, 1, 0].iter().map(|w| w.count_ones()).sum::<u32>()
                },
            );
            assert_eq!((calls, ones), (1, 65), "{set:?}");
        }
    }

    #[test]
    fn the_best_set_is_the_last_available_one() {
        let sets = InstructionSet::available();
        assert_eq!(sets[0].name(), InstructionSet::BASELINE.name());
        let best = InstructionSet::best().name();
        assert_eq!(sets.last().map(|set| set.name()), Some(best));
    }
}
