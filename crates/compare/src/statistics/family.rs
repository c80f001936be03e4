//! Several prototypes: all pairs, or each against a reference, with what their number costs.

use serde::{Deserialize, Serialize};

use super::compare::verdict;
use super::comparison::{Comparison, Interval, Verdict};
use super::question::{Question, Settings};
use super::refusal::Refusal;
use super::sample::Sample;

/// Which pairs are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Against {
    /// Each with each.
    Each,
    /// Each other one with this one, by its index.
    Reference(usize),
}

/// One pair of a family.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    /// Index of A.
    pub a: usize,
    /// Index of B.
    pub b: usize,
    /// The two compared as if alone, or why they cannot be.
    pub alone: Result<Comparison, Refusal>,
    /// The same among the others; `None` without a comparison.
    pub adjusted: Option<Adjusted>,
}

/// A comparison among several: the chance of any false claim in the family stays within alpha.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Adjusted {
    /// Comparisons in the family.
    pub family: u32,
    /// p value of no difference after Holm (1979).
    pub p_difference: f64,
    /// p value of the test of equivalence after Holm.
    pub p_tost: Option<f64>,
    /// The difference with an interval that holds for all pairs at once (Bonferroni: 1 - alpha / family).
    pub simultaneous: Interval,
    /// The verdict by the adjusted p values.
    pub verdict: Verdict,
}

/// Compares several samples of one metric.
///
/// # Errors
/// [`Refusal::Setting`] when the reference is none of them, or there are fewer than two.
pub fn compare_all(
    samples: &[Sample],
    against: Against,
    question: &Question,
    settings: &Settings,
) -> Result<Vec<Pair>, Refusal> {
    let setting = |name, expected, found| Refusal::setting(name, expected, found as f64);
    if samples.len() < 2 {
        return Err(setting("samples", "2 at the least", samples.len()));
    }
    let pairs: Vec<(usize, usize)> = match against {
        Against::Reference(r) if r >= samples.len() => {
            return Err(setting("reference", "the index of a sample", r));
        }
        Against::Reference(r) => (0..samples.len())
            .filter(|b| *b != r)
            .map(|b| (r, b))
            .collect(),
        Against::Each => (0..samples.len())
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
                Some(Adjusted {
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

/// p values after Holm (1979): step down, never decreasing, at most 1.
fn holm(p: &[Option<f64>]) -> Vec<Option<f64>> {
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
