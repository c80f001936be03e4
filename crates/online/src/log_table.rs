//! Log likelihood ratios as integers: natural logarithms in 2^-20 nats, of ratios in sixteenths of an octave.

/// Fractional bits of a log likelihood ratio.
const BITS: u32 = 20;
/// Steps of a ratio per octave.
pub(crate) const OCTAVE: i32 = 16;
/// Lowest ratio of the table, steps: an event there is worth 2^-10 of a nat, rounded to nothing below.
const LOWEST: i32 = -10 * OCTAVE;
/// Highest ratio of the table, steps.
const HIGHEST: i32 = 20 * OCTAVE;

/// 2^-20 nats.
pub(crate) fn fixed(nats: f64) -> i64 {
    libm::round(nats * f64::from(1u32 << BITS)) as i64
}

/// Nats.
pub(crate) fn nats(fixed: i64) -> f64 {
    fixed as f64 / f64::from(1u32 << BITS)
}

/// `value` (above 0) in steps of a ratio.
pub(crate) fn steps(value: f64) -> i32 {
    libm::round(f64::from(OCTAVE) * libm::log2(value)) as i32
}

/// Value of a ratio in steps.
pub(crate) fn ratio(steps: i32) -> f64 {
    libm::exp2(f64::from(steps) / f64::from(OCTAVE))
}

/// Logarithms of 1 + ratio.
#[derive(Debug, Clone)]
pub(crate) struct LogTable(Vec<i32>);

impl LogTable {
    pub(crate) fn new() -> Self {
        let entry = |s: i32| fixed(libm::log1p(ratio(s))) as i32;
        Self((LOWEST..=HIGHEST).map(entry).collect())
    }

    /// Logarithm of 1 + ratio, 2^-20 nats; 0 for ratios below the table, that of the highest ratio above it.
    pub(crate) fn at(&self, steps: i32) -> i32 {
        if steps < LOWEST {
            return 0;
        }
        let at = (steps.min(HIGHEST) - LOWEST) as usize;
        self.0[at]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_holds_logarithms_within_half_a_step() {
        let table = LogTable::new();
        for value in [1e-3, 0.02, 0.9, 7.3, 4000.0] {
            let found = nats(i64::from(table.at(steps(value))));
            let half_step = 0.5 * std::f64::consts::LN_2 / f64::from(OCTAVE);
            assert!(
                (found - libm::log1p(value)).abs() <= half_step + 1e-6,
                "{value}"
            );
        }
        assert_eq!(table.at(LOWEST - 1), 0);
        assert_eq!(table.at(HIGHEST + 9), table.at(HIGHEST));
    }
}
