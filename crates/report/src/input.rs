//! Owns the input of a report.

use std::error::Error;

use skinrig_analysis::result::Analysis;
use skinrig_analysis::tradeoff::Tradeoff;

use crate::provenance::Provenance;
use crate::scene_prediction::ScenePrediction;

/// Input of a report.
#[derive(Debug, Clone)]
pub struct ReportInput<'a> {
    /// Results of the analysis.
    pub analysis: &'a Analysis,
    /// Origin of the session.
    pub provenance: Provenance,
    /// Tradeoff measured on this session: its result, or why it cannot be read.
    pub tradeoff: Option<Result<&'a Tradeoff, &'a (dyn Error + Send + Sync)>>,
    /// What the scene predicts of this session, or why it cannot be read.
    pub scene: Option<Result<&'a ScenePrediction, &'a (dyn Error + Send + Sync)>>,
}
