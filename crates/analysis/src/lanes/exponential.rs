//! Exponentials of many numbers at once, for the kernels of the fields.
//!
//! `libm::exp` takes one number after the other; this takes [`LANES`] in step, in basic operations that round the same way on every
//! machine. Cody and Waite, Software Manual for the Elementary Functions (1980), chapter 6: exp(x) = 2^k exp(r) with |r| <= ln(2) / 2; the
//! factor exp(r) is its Taylor series to the 13th power, whose rest is below 5e-18.

use super::{Group, LANES};

/// Below this the result is 0: the smallest normal number is exp(-708.4).
const LOWEST: f64 = -708.0;
/// 1.5 * 2^52: a sum with it has no place for a fraction, so that its low bits hold the rounded number.
const ROUNDING: f64 = 6_755_399_441_055_744.0;
/// ln(2) in two parts; the first has zeros at its end, so that its product with k is exact.
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
/// 1 / n! for n = 13 down to 0.
const TAYLOR: [f64; 14] = [
    1.0 / 6_227_020_800.0,
    1.0 / 479_001_600.0,
    1.0 / 39_916_800.0,
    1.0 / 3_628_800.0,
    1.0 / 362_880.0,
    1.0 / 40_320.0,
    1.0 / 5_040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    0.5,
    1.0,
    1.0,
];

/// exp of each number, which must be 0 or negative, to two units in the last place.
///
/// Each step is a loop of its own over all lanes, which the compiler turns into vector instructions.
#[inline(always)]
pub(crate) fn of_negatives(x: &Group) -> Group {
    let (mut r, mut power, mut sum) = ([0.0; LANES], [0.0; LANES], [TAYLOR[0]; LANES]);
    for i in 0..LANES {
        let shifted = x[i] * std::f64::consts::LOG2_E + ROUNDING;
        let k = shifted - ROUNDING;
        r[i] = (x[i] - k * LN_2[0]) - k * LN_2[1];
        power[i] = f64::from_bits((shifted.to_bits() << 52).wrapping_add(1023 << 52));
    }
    for coefficient in &TAYLOR[1..] {
        for i in 0..LANES {
            sum[i] = sum[i] * r[i] + coefficient;
        }
    }
    for i in 0..LANES {
        sum[i] = if x[i] < LOWEST {
            0.0
        } else {
            sum[i] * power[i]
        };
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn agrees_with_the_library(x in prop::array::uniform8(-720.0..=0.0f64)) {
            for (own, x) in of_negatives(&x).into_iter().zip(x) {
                let expected = libm::exp(x);
                match x < LOWEST {
                    true => prop_assert_eq!(own, 0.0),
                    false => prop_assert!((own - expected).abs() <= 2.0 * f64::EPSILON * expected, "{} {} {}", x, own, expected),
                }
            }
        }
    }

    #[test]
    fn ends_are_exact() {
        let found = of_negatives(&[0.0, -0.0, -1e-300, LOWEST, -709.0, -1e9, -f64::MAX, -1.0]);
        assert_eq!(found[..3], [1.0; 3]);
        assert!(found[3] > 0.0 && found[4..7] == [0.0; 3]);
        assert!(of_negatives(&[f64::NAN; LANES]).iter().all(|v| v.is_nan()));
    }
}
