//! Interval of a root mean square over trials of which some fail and count a stated error.

use super::comparison::Interval;
use super::error::ComparisonError;
use super::question::Settings;
use super::{Sample, estimate};

/// Root mean square over all trials: of `errors` (a sample of kind [`super::Kind::Rms`]) where a trial succeeds, `failed` where it
/// fails. `failures` is the share of failures among the trials, and `failed` at least the root mean square of `errors`.
///
/// The mean square is a function of two numbers, the mean square of the successes and the share of failures. Its limits
/// combine theirs, each times its derivative (MOVER, Zou and Donner 2008). Resampling the trials instead would take the
/// share of failures from the session: with few failures it is hardly known, and with none its spread is 0.
///
/// # Errors
/// [`ComparisonError`] of either sample.
pub fn rms_with_failures(
    errors: &Sample,
    failures: &Sample,
    failed: f64,
    settings: &Settings,
) -> Result<Interval, ComparisonError> {
    let (errors, share) = (estimate(errors, settings)?, estimate(failures, settings)?);
    let (square, penalty) = (errors.value.powi(2), failed.powi(2));
    let (weight, step) = (1.0 - share.value, (penalty - square).max(0.0));
    let value = weight * square + share.value * penalty;
    let side = |sign: f64, errors: Option<f64>, share_end: Option<f64>| {
        let of_errors = weight * (errors?.powi(2) - square);
        let of_share = step * (share_end? - share.value);
        let end = value + sign * libm::hypot(of_errors, of_share);
        Some(end.max(0.0).sqrt())
    };
    Ok(Interval {
        value: value.sqrt(),
        low: side(-1.0, errors.low, share.low),
        high: side(1.0, errors.high, share.high),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_failure_leaves_the_successes_and_what_may_still_fail() {
        let errors = (0..40).map(|i| (i, 1.0 + f64::from(i % 5)));
        let settings = Settings::default();
        let rms = Sample::rms(errors).expect("finite values");
        let none = Sample::share((0..40).map(|i| (i, false)));
        let alone = estimate(&rms, &settings).expect("an interval");
        let found = rms_with_failures(&rms, &none, 30.0, &settings).expect("an interval");
        assert!((found.value - alone.value).abs() < 1e-12);
        let same_low = found.low.zip(alone.low).map(|(a, b)| (a - b).abs());
        assert!(same_low.is_some_and(|d| d < 1e-12), "{found:?} {alone:?}");
        // 0 in 40: up to 9.3 % fail (Wilson at 2.02 standard errors): 11 + 0.0926 * (900 - 11) = 93.3, and its root is 9.66.
        assert!(found.high.is_some_and(|h| h > 9.6 && h < 9.8), "{found:?}");
    }
}
