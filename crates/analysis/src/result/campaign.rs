//! The question of a campaign, as this analysis answers it.

use serde::{Deserialize, Serialize};
use skinrig_model::{Look, StopMetric, StopQuestion};

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
    /// The look whose interval the RMSE has, if the campaign asks about it.
    #[must_use]
    pub fn of_rmse(&self) -> Option<&Look> {
        self.looks.last().filter(|l| l.metric == StopMetric::Rmse)
    }
}
