//! The question of a campaign, as this analysis answers it.

use serde::{Deserialize, Serialize};
use skinrig_model::{Look, StopMetric, StopQuestion};

use super::Estimate;

/// Looks of a campaign that ends by itself. Its presses were counted until the data decided, so an interval at the usual
/// level covers less often than it says; those of the looks hold together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CampaignLooks {
    /// Probability that the interval of any look misses the true value.
    pub alpha: f64,
    /// What decides.
    pub question: StopQuestion,
    /// Number of declared looks.
    pub declared: u32,
    /// Looks at this analysis, of the repetitions that were completed, up to the one that ended the run.
    pub looks: Vec<Look>,
    /// The look that ended the run, as recorded then; `None` if the run ended otherwise.
    pub decided: Option<Look>,
}

impl CampaignLooks {
    /// The look whose interval `metric` has: the last one, if the campaign asks about it and the look is of the presses of `found`.
    #[must_use]
    pub fn look_of(&self, metric: StopMetric, found: &Estimate) -> Option<&Look> {
        let look = self.looks.last()?;
        // After a look that could not be taken, an earlier one stands for fewer presses than were made.
        let is_latest = self.decided.is_some() || look.presses == found.n;
        (look.metric == metric && is_latest).then_some(look)
    }
}
