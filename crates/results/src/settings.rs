//! Owns the choice of settings for analysing a session.

use std::path::Path;

use skinrig_model::{AnalysisSettings, RunHeader, SelectedOut};
use skinrig_protocol::{Protocol, REFERENCE_CODE, Schedule};

use crate::error::ResultsError;

/// Changes to the recorded settings of a session.
#[derive(Debug, Clone, Copy, Default)]
pub struct AnalysisOptions<'a> {
    /// Overrides, as `analysis.key=value`.
    pub overrides: &'a [String],
    /// First apply the choices of the public code, and also evaluate as it does.
    pub reference_code: bool,
    /// Take the calibration of this session, and correct it by the calibration presses.
    pub calibration_from: Option<&'a Path>,
    /// Presses that a selection excludes.
    pub selected_out: &'a [SelectedOut],
}

impl AnalysisOptions<'_> {
    /// Settings of the session's own protocol or schedule, with the changes applied.
    pub(crate) fn settings(
        &self,
        header: &RunHeader,
        recorded: AnalysisSettings,
    ) -> Result<AnalysisSettings, ResultsError> {
        let is_of_analysis = |o: &&String| o.trim_start().starts_with("analysis.");
        if let Some(given) = self.overrides.iter().find(|o| !is_of_analysis(o)) {
            let given = given.clone();
            return Err(ResultsError::NotOfTheAnalysis { given });
        }
        if self.overrides.is_empty() && !self.reference_code {
            return Ok(recorded);
        }
        let is_old = |o: &&String| {
            let key = o.split('=').next().unwrap_or_default();
            key.trim() == "analysis.exclude_presses"
        };
        if let Some(given) = self.overrides.iter().find(is_old) {
            let given = given.clone();
            return Err(ResultsError::OldKey { given });
        }
        let mut all = header.overrides.clone();
        if self.reference_code {
            all.extend(REFERENCE_CODE.map(str::to_owned));
        }
        all.extend_from_slice(self.overrides);
        let (name, text) = (&header.protocol_name, header.protocol_text.as_bytes());
        let loader = skinrig_formats::regular::read_text;
        if header.rig_kind == "imported" {
            Schedule::parse_recorded(name, text, &all).map(|s| s.analysis)
        } else {
            Protocol::parse_recorded(name, text, &all, &loader).map(|p| p.analysis)
        }
        .map_err(ResultsError::Settings)
    }
}
