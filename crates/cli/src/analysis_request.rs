//! Owns the request for an analysis: settings and calibration other than the session's own.

use std::path::Path;

/// How to analyse a session.
#[derive(Debug, Clone, Copy, Default)]
pub struct AnalysisRequest<'a> {
    /// Overrides of the session's own settings.
    pub overrides: &'a [String],
    /// Make the choices of the public code first, and evaluate its method too.
    pub reference_code: bool,
    /// Name of the variant.
    pub name: Option<&'a str>,
    /// Take the calibration of this session, and correct it by the calibration presses.
    pub calibration_from: Option<&'a Path>,
}

impl<'a> AnalysisRequest<'a> {
    /// The choices that the stages of an analysis know.
    pub(crate) const fn of_session(&self) -> skinrig_results::AnalysisOptions<'a> {
        skinrig_results::AnalysisOptions {
            overrides: self.overrides,
            reference_code: self.reference_code,
            calibration_from: self.calibration_from,
        }
    }
}
