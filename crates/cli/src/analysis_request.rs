//! Owns the request for an analysis: settings and calibration other than the session's own.

use std::path::Path;

use skinrig_report::Variant;

use crate::selection::SelectedPresses;

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
    /// The selection that names the session.
    pub selection: Option<&'a SelectedPresses>,
}

impl<'a> AnalysisRequest<'a> {
    /// The analysis of a variant without a selection.
    pub(crate) fn of_variant(variant: &'a Variant) -> Self {
        Self {
            overrides: &variant.changed,
            reference_code: variant.reference_code,
            name: Some(&variant.name),
            calibration_from: variant.calibration_from.as_deref(),
            selection: None,
        }
    }

    /// The options of the stages of an analysis.
    pub(crate) fn of_session(&self) -> skinrig_results::AnalysisOptions<'a> {
        skinrig_results::AnalysisOptions {
            overrides: self.overrides,
            reference_code: self.reference_code,
            calibration_from: self.calibration_from,
            selected_out: self.selection.map_or(&[], |s| &s.out),
        }
    }
}
