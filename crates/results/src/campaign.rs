//! Looks at the data of a campaign, as an analysis answers them.

use std::collections::BTreeMap;

use serde::Deserialize;
use skinrig_analysis::Analysis;
use skinrig_analysis::result::{CampaignLooks, LEAST_LOCATED, PressResult};
use skinrig_model::{Look, PressRole, RepetitionId, RunEnd, Verdict};
use skinrig_protocol::{Plan, Step, Stop};
use skinrig_statistics::{Settings, StoppingRule, stop_sample};

use crate::error::{LookFault, ResultsError};

/// The part of a plan, in every version, that shows whether it declares looks.
#[derive(Deserialize)]
struct DeclaresLooks {
    stop: Option<serde::de::IgnoredAny>,
}

/// The looks at `analysis` that the plan declares; `None` if it declares none.
///
/// # Errors
/// [`ResultsError::Plan`] for a plan that cannot be read.
pub(crate) fn looks(
    analysis: &Analysis,
    plan_json: &str,
    end: Option<&RunEnd>,
) -> Result<Option<CampaignLooks>, ResultsError> {
    let Some((plan, rule)) = declared(plan_json)?.and_then(|p| p.stop.map(|stop| (p, stop))) else {
        return Ok(None);
    };
    let decided = end.and_then(RunEnd::decision).copied();
    let is_before_the_end =
        |look: &Declared| decided.is_none_or(|decided| look.number <= decided.number);
    let complete = Completed::of(&analysis.presses);
    let looks = plan.steps.iter().filter_map(Declared::of);
    let looks = looks
        .filter(|look| is_before_the_end(look) && complete.has_up_to(look.repetition))
        .filter_map(|look| look.look(analysis, &rule).ok());
    Ok(Some(CampaignLooks {
        alpha: rule.alpha,
        question: rule.question,
        declared: rule.looks,
        looks: looks.collect(),
        decided,
    }))
}

/// The plan of a session, if it declares looks. A plan that is no JSON object declares none; `verify` reports it.
pub(crate) fn declared(plan_json: &str) -> Result<Option<Plan>, ResultsError> {
    let declares: Option<DeclaresLooks> = serde_json::from_str(plan_json).ok();
    if declares.and_then(|d| d.stop).is_none() {
        return Ok(None);
    }
    Ok(Some(
        serde_json::from_str(plan_json).map_err(ResultsError::Plan)?,
    ))
}

/// A look of the plan.
#[derive(Clone, Copy)]
pub(crate) struct Declared {
    pub number: u32,
    repetition: RepetitionId,
}

impl Declared {
    pub(crate) fn of(step: &Step) -> Option<Self> {
        match step {
            Step::Look { number, repetition } => Some(Self {
                number: *number,
                repetition: *repetition,
            }),
            _ => None,
        }
    }

    /// This look at the scored presses up to its repetition.
    pub(crate) fn look(self, analysis: &Analysis, rule: &Stop) -> Result<Look, LookFault> {
        let scored = |p: &&PressResult| {
            p.role == PressRole::Score
                && p.verdict != Verdict::Missed
                && p.repetition <= self.repetition
        };
        let scored: Vec<&PressResult> = analysis.presses.iter().filter(scored).collect();
        let counting = scored.iter().filter(|p| p.verdict == Verdict::Valid);
        let errors: Vec<(u32, f64)> = counting
            .filter_map(|p| {
                let (x, y) = p.error_mm()?;
                Some((p.location.index(), libm::hypot(x, y)))
            })
            .collect();
        if (errors.len() as f64) < LEAST_LOCATED * scored.len() as f64 {
            return Err(LookFault::FewLocated {
                located: errors.len(),
                attempted: scored.len(),
            });
        }
        let sample = stop_sample(rule.metric, errors.iter().copied())?;
        let stopping = StoppingRule {
            question: rule.question,
            looks: rule.looks,
        };
        let settings = Settings {
            alpha: rule.alpha,
            resamples: analysis.settings.bootstrap_resamples,
            seed: analysis.settings.seed,
            ..Settings::default()
        };
        let found = stopping.look(&sample, self.number, &settings)?;
        let found = found.ok_or(LookFault::Beyond)?;
        Ok(Look {
            number: self.number,
            declared: rule.looks,
            repetition: self.repetition,
            presses: errors.len() as u32,
            attempted: Some(scored.len() as u32),
            metric: rule.metric,
            question: rule.question,
            alpha: found.alpha,
            value_mm: found.interval.value,
            low_mm: found.interval.low,
            high_mm: found.interval.high,
            answer: found.answer,
        })
    }
}

/// Whether all scored presses of each repetition were attempted.
struct Completed(BTreeMap<RepetitionId, bool>);

impl Completed {
    fn of(presses: &[PressResult]) -> Self {
        let mut whole = BTreeMap::new();
        for press in presses.iter().filter(|p| p.role == PressRole::Score) {
            *whole.entry(press.repetition).or_insert(true) &= press.verdict != Verdict::Missed;
        }
        Self(whole)
    }

    fn has_up_to(&self, repetition: RepetitionId) -> bool {
        self.0.range(..=repetition).all(|(_, whole)| *whole)
    }
}
