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

/// 2^(63 + (j + 0.5)/16) for j = 0 to 15, rounded up: where the next step of a ratio begins.
const HALF_STEPS: [u64; OCTAVE as usize] = [
    0x82cd_8698_ac2b_a1d8,
    0x8898_0e80_92da_8528,
    0x8ea4_398b_45cd_53c1,
    0x94f4_efa8_fef7_0962,
    0x9b8d_39b9_d54e_5539,
    0xa270_4303_0c49_6819,
    0xa9a1_5ab4_ea7c_0ef9,
    0xb123_f581_d2ac_2590,
    0xb8fb_af47_62fb_9eea,
    0xc12c_4cca_6670_9457,
    0xc9b9_bd86_6e2f_27a3,
    0xd2a8_1d91_f12a_e45b,
    0xdbfb_b797_daf2_3756,
    0xe5b9_06e7_7c83_48a9,
    0xefe4_b99b_dcda_f5cc,
    0xfa83_b2db_722a_033b,
];

/// An integer above 0 in steps of a ratio, without a logarithm.
pub(crate) fn whole_steps(value: u64) -> i32 {
    let octave = value.max(1).ilog2();
    let mantissa = value << (63 - octave);
    let steps: i32 = HALF_STEPS
        .iter()
        .map(|half| i32::from(mantissa >= *half))
        .sum();
    octave as i32 * OCTAVE + steps
}

/// Value of a ratio in steps.
pub(crate) fn ratio(steps: i32) -> f64 {
    libm::exp2(f64::from(steps) / f64::from(OCTAVE))
}

/// Ratios whose logarithms are taken at once, each twice the one before.
pub(crate) const LANES: usize = 8;
/// Numbers in step.
pub(crate) type Lanes<T> = [T; LANES];

/// Entries of a row: whole octaves of the table, and [`LANES`] entries beyond it at both ends.
const ROW: usize = ((HIGHEST - LOWEST) / OCTAVE) as usize + 1 + 2 * LANES;

/// Logarithms of 1 + ratio, one row for each step of an octave, so that those of ratios a whole octave apart lie beside each other.
#[derive(Debug, Clone)]
pub(crate) struct LogTable(Vec<i32>);

impl LogTable {
    pub(crate) fn new() -> Self {
        let entry = |i: usize| {
            let (step, octave) = ((i / ROW) as i32, (i % ROW) as i32 - LANES as i32);
            let steps = LOWEST + step + octave * OCTAVE;
            if steps < LOWEST {
                0
            } else {
                fixed(libm::log1p(ratio(steps.min(HIGHEST)))) as i32
            }
        };
        Self((0..ROW * OCTAVE as usize).map(entry).collect())
    }

    /// Logarithms of 1 + ratio for the ratio of `steps` and those 1, 2, … octaves above, 2^-20 nats; 0 below the table, that of the
    /// highest ratio above it.
    #[inline(always)]
    pub(crate) fn at(&self, steps: i32) -> &Lanes<i32> {
        let from = steps.saturating_sub(LOWEST);
        let octave = from
            .div_euclid(OCTAVE)
            .clamp(-(LANES as i32), (ROW - 2 * LANES) as i32);
        let first = from.rem_euclid(OCTAVE) as usize * ROW + (octave + LANES as i32) as usize;
        self.0[first..].first_chunk().unwrap_or(&[0; LANES])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_holds_logarithms_within_half_a_step() {
        let table = LogTable::new();
        for value in [1e-3, 0.02, 0.9, 7.3, 4000.0] {
            let found = nats(i64::from(table.at(steps(value))[0]));
            let half_step = 0.5 * std::f64::consts::LN_2 / f64::from(OCTAVE);
            assert!(
                (found - libm::log1p(value)).abs() <= half_step + 1e-6,
                "{value}"
            );
        }
        assert_eq!(table.at(LOWEST - 1)[0], 0);
        assert_eq!(table.at(HIGHEST + 9), table.at(HIGHEST));
    }

    #[test]
    fn steps_of_integers_are_those_of_numbers() {
        let mut values: Vec<u64> = (1..5000).collect();
        values.extend((0..2000).map(|i| libm::exp2(f64::from(i) * 0.026 + 10.0) as u64));
        for value in values {
            assert_eq!(whole_steps(value), steps(value as f64), "{value}");
        }
    }

    #[test]
    fn each_lane_holds_the_logarithm_of_a_ratio_one_octave_higher() {
        let table = LogTable::new();
        for steps in LOWEST - 300..HIGHEST + 300 {
            for (lane, logarithm) in table.at(steps).iter().enumerate() {
                let steps = steps + lane as i32 * OCTAVE;
                let expected = match steps {
                    ..LOWEST => 0,
                    _ => fixed(libm::log1p(ratio(steps.min(HIGHEST)))) as i32,
                };
                assert_eq!(*logarithm, expected, "{steps}");
            }
        }
    }
}
