//! Sequential stop of a campaign: the interval of each declared look, and whether it answers the question.
//!
//! Every look spends its share of alpha ([`AlphaSpending`]), so the intervals of all looks hold together, whenever the
//! campaign stops and whatever its question is.

use skinrig_model::{StopAnswer, StopMetric, StopQuestion};

use super::comparison::Interval;
use super::error::ComparisonError;
use super::question::Settings;
use super::sample::{Sample, SampleFault};
use super::{AlphaSpending, estimate};

/// When a campaign stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StoppingRule {
    /// What decides.
    pub question: StopQuestion,
    /// Declared looks.
    pub looks: u32,
}

/// One look of a [`StoppingRule`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LookEstimate {
    /// Interval at the level 1 - `alpha`.
    pub interval: Interval,
    /// Alpha spent at this look.
    pub alpha: f64,
    /// The answer; `None` if undecided.
    pub answer: Option<StopAnswer>,
}

impl StoppingRule {
    /// Look `number` (from 1) at the sample. `settings` are those of the whole campaign; `None` beyond the declared looks.
    ///
    /// # Errors
    /// [`ComparisonError`].
    pub fn look(
        &self,
        sample: &Sample,
        number: u32,
        settings: &Settings,
    ) -> Result<Option<LookEstimate>, ComparisonError> {
        let spending = AlphaSpending {
            planned_looks: Some(self.looks),
        };
        let Some(own) = spending.settings(settings, number) else {
            return Ok(None);
        };
        let interval = estimate(sample, &own)?;
        // Equal values have no spread, which says nothing about other presses.
        let is_known = interval.low != interval.high || interval.low.is_none();
        let answer = self.question.answer(interval.low, interval.high);
        Ok(Some(LookEstimate {
            interval,
            alpha: own.alpha,
            answer: answer.filter(|_| is_known),
        }))
    }
}

/// Sample of a metric, from (location, error in mm) of each press.
///
/// # Errors
/// [`SampleFault`].
pub fn stop_sample(
    metric: StopMetric,
    errors_mm: impl IntoIterator<Item = (u32, f64)>,
) -> Result<Sample, SampleFault> {
    match metric {
        StopMetric::Rmse => Sample::rms(errors_mm),
        StopMetric::Median => Sample::median(errors_mm.into_iter().map(|(l, mm)| (l, Some(mm)))),
    }
}
