//! Compares several prototypes, all pairs or each against a reference, with correction for multiple comparisons.

use serde::{Deserialize, Serialize};

use super::compare::verdict;
use super::comparison::{Comparison, Interval, Verdict};
use super::error::ComparisonError;
use super::question::{ComparisonTarget, Settings};
use super::sample::Sample;

/// Pairs to compare.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PairSelection {
    /// All pairs.
    All,
    /// Each sample against the one with this index.
    Reference(usize),
}

/// One pair of a family.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    /// Index of A.
    pub a: usize,
    /// Index of B.
    pub b: usize,
    /// Uncorrected comparison, or why there is none.
    pub alone: Result<Comparison, ComparisonError>,
    /// Corrected for the size of the family; `None` without a comparison.
    pub adjusted: Option<AdjustedComparison>,
}

/// A comparison corrected for its family: the probability of any false claim in the family is below
/// alpha.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AdjustedComparison {
    /// Number of comparisons in the family.
    pub family: u32,
    /// p value of no difference, Holm-corrected (1979).
    pub p_difference: f64,
    /// p value of the equivalence test, Holm-corrected.
    pub p_tost: Option<f64>,
    /// Difference with a simultaneous interval (Bonferroni: 1 - alpha / family).
    pub simultaneous: Interval,
    /// Verdict by the corrected p values.
    pub verdict: Verdict,
}

/// Compares several samples of one metric.
///
/// # Errors
/// [`ComparisonError::Setting`] for an invalid reference, or fewer than two samples.
pub fn compare_all(
    samples: &[Sample],
    against: PairSelection,
    question: &ComparisonTarget,
    settings: &Settings,
) -> Result<Vec<Pair>, ComparisonError> {
    let setting = |name, expected, found| ComparisonError::setting(name, expected, found as f64);
    if samples.len() < 2 {
        return Err(setting("samples", "at least 2", samples.len()));
    }
    let pairs: Vec<(usize, usize)> = match against {
        PairSelection::Reference(r) if r >= samples.len() => {
            return Err(setting("reference", "the index of a sample", r));
        }
        PairSelection::Reference(r) => (0..samples.len())
            .filter(|b| *b != r)
            .map(|b| (r, b))
            .collect(),
        PairSelection::All => (0..samples.len())
            .flat_map(|b| (0..b).map(move |a| (a, b)))
            .collect(),
    };
    let with = |settings: &Settings, (a, b): (usize, usize)| {
        super::compare(&samples[a], &samples[b], question, settings)
    };
    let alone: Vec<_> = pairs.iter().map(|p| with(settings, *p)).collect();
    let family = alone.iter().filter(|c| c.is_ok()).count();
    let strict = Settings {
        alpha: settings.alpha / family.max(1) as f64,
        ..*settings
    };
    let p_of = |f: &dyn Fn(&Comparison) -> Option<f64>| -> Vec<Option<f64>> {
        holm(
            &alone
                .iter()
                .map(|c| f(c.as_ref().ok()?))
                .collect::<Vec<_>>(),
        )
    };
    let differences = p_of(&|c| Some(c.p_difference));
    let tosts = p_of(&|c| c.tost.map(|t| t.p));
    let rows = pairs.iter().zip(alone).enumerate();
    Ok(rows
        .map(|(i, (&(a, b), alone))| {
            let adjusted = alone.as_ref().ok().and_then(|c| {
                let p_difference = differences[i]?;
                let values = [c.a.value, c.b.value];
                let verdict = verdict(values, p_difference, tosts[i], question, settings);
                Some(AdjustedComparison {
                    family: family as u32,
                    p_difference,
                    p_tost: tosts[i],
                    simultaneous: with(&strict, (a, b)).ok()?.difference,
                    verdict,
                })
            });
            Pair {
                a,
                b,
                alone,
                adjusted,
            }
        })
        .collect())
}

/// Holm (1979) correction of the p values of a family: step down, monotone, at most 1. Those that do not exist do not count.
#[must_use]
pub fn holm(p: &[Option<f64>]) -> Vec<Option<f64>> {
    let mut order: Vec<usize> = (0..p.len()).filter(|i| p[*i].is_some()).collect();
    let value = |i: usize| p[i].unwrap_or(1.0);
    order.sort_by(|a, b| value(*a).total_cmp(&value(*b)));
    let mut adjusted = vec![None; p.len()];
    let mut worst = 0.0f64;
    for (rank, &i) in order.iter().enumerate() {
        worst = worst.max(value(i) * (order.len() - rank) as f64).min(1.0);
        adjusted[i] = Some(worst);
    }
    adjusted
}
