//! The question of a campaign, a look at its answer, and the decision that ends a run.

use std::fmt;

use serde::{Deserialize, Serialize};
use skinrig_settings::Choice;

use crate::id::RepetitionId;

/// A metric of the scored presses that a campaign may ask about, in mm. Intervals of the 95th percentile from few locations
/// cover too little for looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum StopMetric {
    /// Root mean square error.
    #[default]
    Rmse,
    /// Median error.
    Median,
}

impl StopMetric {
    /// Name in a sentence.
    #[must_use]
    pub const fn label(self) -> &'static str {
        match self {
            Self::Rmse => "RMSE",
            Self::Median => "median error",
        }
    }
}

/// What decides a campaign: an interval of the metric.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StopQuestion {
    /// It is narrower than this, mm.
    NarrowerThan(f64),
    /// It lies entirely below or entirely above this, mm.
    Target(f64),
}

/// An answer to a [`StopQuestion`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StopAnswer {
    /// The interval is narrow enough.
    Narrow,
    /// All of the interval is below the target.
    Below,
    /// All of the interval is above the target.
    Above,
}

impl StopQuestion {
    /// The answer of an interval from `low` to `high`, each `None` if open; `None` if undecided.
    #[must_use]
    pub fn answer(self, low: Option<f64>, high: Option<f64>) -> Option<StopAnswer> {
        match self {
            Self::NarrowerThan(width_mm) => (high? - low? < width_mm).then_some(StopAnswer::Narrow),
            Self::Target(mm) if high.is_some_and(|high| high < mm) => Some(StopAnswer::Below),
            Self::Target(mm) if low.is_some_and(|low| low > mm) => Some(StopAnswer::Above),
            Self::Target(_) => None,
        }
    }
}

impl fmt::Display for StopQuestion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NarrowerThan(mm) => write!(f, "an interval narrower than {mm} mm"),
            Self::Target(mm) => write!(f, "an interval below or above {mm} mm"),
        }
    }
}

/// One look at a campaign's data: all presses up to the end of a repetition.
///
/// The intervals of all looks hold together with probability 1 - alpha of the campaign, whenever it stops.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Look {
    /// Number of the look, from 1.
    pub number: u32,
    /// Number of declared looks.
    pub declared: u32,
    /// The repetition that ended before it.
    pub repetition: RepetitionId,
    /// Scored presses that count.
    pub presses: u32,
    /// Scored presses attempted; `None` in looks of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attempted: Option<u32>,
    /// Metric.
    pub metric: StopMetric,
    /// Question.
    pub question: StopQuestion,
    /// Alpha spent at this look: the interval has the level 1 - alpha.
    pub alpha: f64,
    /// Value of the metric, mm.
    pub value_mm: f64,
    /// Lower end of its interval, mm; `None` if open.
    pub low_mm: Option<f64>,
    /// Upper end of its interval, mm; `None` if open.
    pub high_mm: Option<f64>,
    /// The answer; `None` if undecided.
    pub answer: Option<StopAnswer>,
}

impl Look {
    /// Level of the interval in percent.
    #[must_use]
    pub fn level_percent(&self) -> f64 {
        100.0 * (1.0 - self.alpha)
    }

    /// Number of presses that count, and of how many if some do not.
    #[must_use]
    pub fn extent(&self) -> String {
        match self.attempted {
            Some(of) if of != self.presses => format!("n {} of {of}", self.presses),
            _ => format!("n {}", self.presses),
        }
    }

    /// The metric with its interval and level.
    #[must_use]
    pub fn figure(&self) -> String {
        let end = |mm: Option<f64>| mm.map_or_else(|| "open".to_owned(), |mm| format!("{mm:.3}"));
        format!(
            "{} {:.3} mm, {:.2} % interval {} to {} mm",
            self.metric.label(),
            self.value_mm,
            self.level_percent(),
            end(self.low_mm),
            end(self.high_mm)
        )
    }
}

impl fmt::Display for Look {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            number, declared, ..
        } = self;
        let (figure, extent) = (self.figure(), self.extent());
        write!(f, "look {number} of {declared}: {figure}, {extent}; ")?;
        match (self.answer, self.question) {
            (None, question) => write!(f, "undecided, the question is {question}"),
            (Some(StopAnswer::Narrow), StopQuestion::NarrowerThan(mm)) => {
                write!(f, "narrower than {mm} mm")
            }
            (Some(StopAnswer::Below), StopQuestion::Target(mm)) => write!(f, "below {mm} mm"),
            (Some(StopAnswer::Above), StopQuestion::Target(mm)) => write!(f, "above {mm} mm"),
            (Some(answer), question) => write!(f, "{answer:?} of {question}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_answers_its_question() {
        use StopAnswer as A;
        let narrow = StopQuestion::NarrowerThan(0.5);
        assert_eq!(narrow.answer(Some(1.0), Some(1.4)), Some(A::Narrow));
        assert_eq!(narrow.answer(Some(1.0), Some(1.5)), None);
        assert_eq!(narrow.answer(Some(1.0), None), None);
        let target = StopQuestion::Target(1.0);
        assert_eq!(target.answer(Some(0.2), Some(0.9)), Some(A::Below));
        assert_eq!(target.answer(Some(1.1), None), Some(A::Above));
        assert_eq!(target.answer(Some(0.9), Some(1.0)), None);
        assert_eq!(target.answer(None, None), None);
    }
}
