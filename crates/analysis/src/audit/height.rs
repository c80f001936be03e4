//! Law: events begin when the tip reaches the surface, not above it.

use skinrig_model::PressVerdict;

use super::finding::finding;
use super::statistics::median;
use crate::input::SessionInput;
use crate::onsets::Onset;
use crate::result::{Analysis, ClockMethod, Evidence, Fault, Finding, Law, MapName, OnsetHeight};

/// Minimum number of presses: with fewer, no two of them enclose the median with 95 %.
const MIN_PRESSES: usize = 6;
/// Smaller heights above the surface are not an offset: twice the arrival tolerance of the tip, mm.
const MAX_HEIGHT_MM: f64 = 0.1;
/// Nor are shorter times before contact, beyond the clock uncertainty: two bins of the event rate, ms.
const MAX_BEFORE_MS: f64 = 20.0;

pub(super) fn findings(
    input: &SessionInput,
    analysis: &Analysis,
    onsets: [&[Onset]; 2],
) -> Option<Finding> {
    // A clock fitted to the events themselves cannot show when they began.
    let measured = |c: &_| matches!(c, Some(fit) if is_measured(fit));
    if !analysis.clocks.iter().all(measured) || !analysis.alignment.is_usable() {
        return None;
    }
    let [one, two] = onsets.map(|onsets| OnsetHeight::of(input, onsets));
    let (one, two) = (one?, two?);
    // Late poses shift all contacts alike.
    let bound_us = analysis.alignment.bound_us(MapName::RobotFromHost);
    let most_ms = MAX_BEFORE_MS + 1e-3 * bound_us.unwrap_or(0.0);
    // An offset in a single camera is due to its clock or its noise.
    let early = |h: &OnsetHeight| h.low_mm > MAX_HEIGHT_MM && h.before_ms > most_ms;
    (early(&one) && early(&two)).then(|| {
        let evidence = Evidence::EarlyEvents {
            heights: [one, two],
        };
        finding(Law::AsCommanded, Fault::HeightOff, None, evidence)
    })
}

fn is_measured(fit: &crate::result::ClockFit) -> bool {
    fit.method != ClockMethod::EventRates
}

impl OnsetHeight {
    /// Over the presses that the journal reports as valid.
    fn of(input: &SessionInput, onsets: &[Onset]) -> Option<Self> {
        let valid = |o: &&Onset| {
            let outcome = input.outcomes.get(o.row).and_then(Option::as_ref);
            outcome.is_some_and(|outcome| outcome.verdict == PressVerdict::Valid)
        };
        let onsets: Vec<&Onset> = onsets.iter().filter(valid).collect();
        let mut heights: Vec<f64> = onsets.iter().map(|o| o.height_mm).collect();
        heights.sort_by(f64::total_cmp);
        let n = heights.len();
        let (low, high) = rank_interval(n)?;
        Some(Self {
            n,
            median_mm: median(heights.clone())?,
            low_mm: heights[low],
            high_mm: heights[high],
            before_ms: median(onsets.iter().map(|o| o.before_ms).collect())?,
        })
    }
}

/// 1-based ranks of two of `n` values that enclose the population median with at least 95 % (sign test); `None` for too few
/// values.
fn rank_interval(n: usize) -> Option<(usize, usize)> {
    if n < MIN_PRESSES {
        return None;
    }
    // Probability that exactly k of n are below the median, from k = 0. For large n they underflow and add nothing.
    let mut chance = libm::exp(-(n as f64) * core::f64::consts::LN_2);
    let (mut below, mut low) = (0.0, 0);
    for k in 0..n / 2 {
        below += chance;
        if below > 0.025 {
            break;
        }
        low = k;
        chance *= (n - k) as f64 / (k + 1) as f64;
    }
    Some((low, n - 1 - low))
}

#[cfg(test)]
mod tests {
    use super::rank_interval;

    /// Ranks of the sign test's 95 % interval, 1-based as in tables (Conover, Practical Nonparametric Statistics).
    #[test]
    fn the_interval_of_a_median_is_the_sign_test_s() {
        assert_eq!(rank_interval(5), None);
        for (n, ranks) in [(6, (1, 6)), (10, (2, 9)), (20, (6, 15)), (100, (40, 61))] {
            assert_eq!(rank_interval(n), Some((ranks.0 - 1, ranks.1 - 1)), "{n}");
        }
    }
}
