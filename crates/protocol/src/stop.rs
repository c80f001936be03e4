//! When a campaign ends by itself: its question, and the repetitions after which the data are looked at.

use serde::{Deserialize, Serialize};
use skinrig_model::{PressRole, RepetitionId, StopMetric, StopQuestion};
use skinrig_settings::{Collector, Field, Numbers, Settings};

/// Most declared looks: alpha is split over them.
const MOST_LOOKS: usize = 100;

/// Ends the run once its question is decided. The data are analysed after each repetition listed in `looks`; the error rate
/// holds over all looks together.
#[derive(Settings)]
#[settings(name = "stop", no_default, exactly_one("narrower_than", "target"))]
pub(crate) struct StopKeys {
    /// The metric of the scored presses that is asked about.
    #[setting(default = "rmse")]
    pub metric: StopMetric,
    /// Decided when the interval of the metric is narrower than this.
    #[setting(above = 0.0, max = 1000.0, example = "0.5 mm")]
    pub narrower_than_mm: Option<f64>,
    /// Decided when all of the interval is below or above this.
    #[setting(above = 0.0, max = 1000.0)]
    pub target_mm: Option<f64>,
    /// Probability that the interval of any look misses the true value. Each look spends an equal share.
    #[setting(default = "5 %", min = 0.01, max = 49.0)]
    pub alpha_percent: f64,
    /// The scored repetitions after which to look; each one when absent. Fewer looks have narrower intervals.
    pub looks: Option<Numbers>,
}

/// When a campaign ends by itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stop {
    /// Metric of the scored presses.
    pub metric: StopMetric,
    /// What decides.
    pub question: StopQuestion,
    /// Probability that the interval of any look misses the true value.
    pub alpha: f64,
    /// Number of declared looks.
    pub looks: u32,
}

/// A [`Stop`] with its looks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DeclaredStop {
    /// The rule.
    pub rule: Stop,
    /// A look follows each of these repetitions, in order.
    pub after: Vec<RepetitionId>,
}

impl StopKeys {
    /// The rule for a protocol with these repetitions; findings otherwise.
    pub(crate) fn declare(
        &self,
        roles: &[PressRole],
        field: &Field,
        evaluation: &Field,
        out: &mut Collector,
    ) -> Option<DeclaredStop> {
        let question = match (self.narrower_than_mm, self.target_mm) {
            (Some(mm), None) => StopQuestion::NarrowerThan(mm),
            (None, Some(mm)) => StopQuestion::Target(mm),
            _ => return None, // reported by the reader
        };
        let after = self.after(roles, field, out)?;
        if after.len() > MOST_LOOKS {
            out.error(field.span, field.path.as_str(), "too many looks")
                .expected(format!("at most {MOST_LOOKS} looks"))
                .found(after.len().to_string())
                .help("list the repetitions after which to look in `stop.looks`");
            return None;
        }
        let Some(first) = after.first() else {
            let looks = field.at("looks");
            out.error(looks.span, looks.path.as_str(), "no look is declared")
                .expected("scored repetitions after which to look")
                .found("none")
                .help("remove `looks`: there is one look after each scored repetition");
            return None;
        };
        let late = roles.iter().rposition(|r| *r == PressRole::Calibrate);
        if let Some(late) = late.filter(|late| *late as u32 > first.index()) {
            let calibrate = evaluation.at("calibrate");
            out.error(
                calibrate.span,
                calibrate.path.as_str(),
                "a repetition calibrates after the first look",
            )
            .expected(format!(
                "with `stop`, repetitions before {first}: all looks need the same calibration"
            ))
            .found(format!("repetition {}", late + 1));
            return None;
        }
        let rule = Stop {
            metric: self.metric,
            question,
            alpha: self.alpha_percent / 100.0,
            looks: after.len() as u32,
        };
        Some(DeclaredStop { rule, after })
    }

    fn after(
        &self,
        roles: &[PressRole],
        field: &Field,
        out: &mut Collector,
    ) -> Option<Vec<RepetitionId>> {
        let is_scored = |index: u32| roles.get(index as usize) == Some(&PressRole::Score);
        let Some(looks) = &self.looks else {
            let all = (0..roles.len() as u32).filter(|i| is_scored(*i));
            return Some(all.map(RepetitionId::from_index).collect());
        };
        let path = field.at("looks").path.as_str();
        let mut after: Vec<RepetitionId> = Vec::new();
        for span in &looks.0 {
            for number in span.first..=span.last {
                let id = RepetitionId::from_number(number).filter(|id| is_scored(id.index()));
                let problem = match id {
                    None => "no scored repetition",
                    Some(id) if after.last().is_some_and(|last| *last >= id) => {
                        "the repetitions are not in ascending order"
                    }
                    Some(id) => {
                        after.push(id);
                        continue;
                    }
                };
                out.error(span.span, path, problem)
                    .expected("scored repetitions in ascending order, each once")
                    .found(number.to_string());
                return None;
            }
        }
        Some(after)
    }
}
