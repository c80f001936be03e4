//! True digits of a result: the log relative error, and how many the condition number allows to ask for.

use crate::problem::Answer;

/// Digits asked of every well-posed result.
const ENOUGH: f64 = 9.0;
/// Digits of a double that are left if the condition number is 1.
const OF_A_DOUBLE: f64 = 14.0;
/// The answers are compared as doubles: more digits than this cannot be told apart.
const MOST: f64 = 15.0;

/// `-log10` of the relative error (of the absolute one if the answer is 0), at most 15; 0 for a result that is not finite.
pub(crate) fn digits(found: f64, answer: &Answer) -> f64 {
    let exact: f64 = answer.value.parse().unwrap();
    let off = (found - exact).abs();
    let error = if exact == 0.0 { off } else { off / exact.abs() };
    if error.is_finite() {
        (-libm::log10(error)).clamp(0.0, MOST) + 0.0
    } else {
        0.0
    }
}

/// Digits that a result must have: 9 up to the condition number 1e5, one less for each further factor of ten.
pub(crate) fn required(answer: &Answer) -> f64 {
    (OF_A_DOUBLE - libm::log10(answer.condition.max(1.0))).clamp(0.0, ENOUGH)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_counted_and_asked_for_by_condition() {
        let answer = |value: &str, condition| Answer {
            quantity: String::new(),
            value: value.to_owned(),
            condition,
        };
        let third = answer("0.333333333333333333333333333333", 1.0);
        assert_eq!(digits(1.0 / 3.0, &third), MOST);
        assert!((digits(0.333_333_333, &third) - 9.0).abs() < 1e-6);
        assert_eq!(digits(f64::NAN, &third), 0.0);
        assert_eq!(digits(-1.0, &third), 0.0);
        assert!((digits(1e-7, &answer("0", 0.0)) - 7.0).abs() < 1e-9);
        for (condition, expected) in [(0.0, 9.0), (1e5, 9.0), (1e7, 7.0), (1e16, 0.0)] {
            assert!((required(&answer("1", condition)) - expected).abs() < 1e-12);
        }
    }
}
