//! Skins of a selection: their analysis, and the RMSE with and without the selection.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use skinrig_analysis::Analysis;
use skinrig_analysis::result::Estimate;
use skinrig_report::{SelectionEffect, SelectionName};

use crate::analyses;
use crate::analysis_request::AnalysisRequest;
use crate::exit::Failure;
use crate::results::analyze_shown;
use crate::selection::SelectedPresses;

/// What a selection changes in a session.
pub(super) struct SelectedResult {
    pub name: SelectionName,
    session: PathBuf,
    rmse_mm: Estimate,
    effect: SelectionEffect,
}

/// The analysis with the selection: that beside the session, or a new one.
pub(super) fn analysis(
    path: &Path,
    session_id: &str,
    selected: &SelectedPresses,
) -> Result<(Analysis, SelectedResult), Failure> {
    let result = |rmse_mm, effect| SelectedResult {
        name: selected.name.clone(),
        session: path.to_owned(),
        rmse_mm,
        effect,
    };
    let label = selected.label();
    let stored = analyses::stored(path, session_id, Some(&label));
    let stored = stored.filter(|a| a.settings.selected_out == selected.out);
    let summary = analyses::summary(path, session_id, Some(&label)).ok();
    if let (Some(analysis), Some(effect)) = (stored, summary.and_then(|s| s.selection)) {
        let rmse_mm = analysis.scored.rmse_mm;
        return Ok((analysis, result(rmse_mm, effect)));
    }
    let choices = AnalysisRequest {
        selection: Some(selected),
        ..AnalysisRequest::default()
    };
    let found = analyze_shown(path, choices).map_err(|f| without_results(path, f))?;
    let rmse_mm = found.analysis.scored.rmse_mm;
    let effect = found.provenance.selection.unwrap_or(SelectionEffect {
        excluded: 0,
        rmse_without_mm: rmse_mm,
    });
    Ok((found.analysis, result(rmse_mm, effect)))
}

/// An analysis that failed, with its session.
pub(super) fn without_results(path: &Path, failure: Failure) -> Failure {
    Failure {
        message: format!("{}\n  ({}: no results)", failure.message, path.display()),
        ..failure
    }
}

impl SelectedResult {
    /// For programs.
    pub(super) fn document(&self, skin: char) -> Value {
        json!({
            "skin": skin, "session": self.session, "selection": self.name, "rmse_mm": self.rmse_mm,
            "excluded": self.effect.excluded, "rmse_without_mm": self.effect.rmse_without_mm,
        })
    }

    /// The RMSE with and without the selection, in one line.
    pub(super) fn line(&self, skin: char) -> String {
        let mm = |e: &Estimate| {
            e.value
                .map_or_else(|| "none".to_owned(), |v| format!("{v:.2} mm"))
        };
        format!(
            "SELECTION {skin} {} excludes {} press(es) of {}: RMSE {}, without the selection {}",
            self.name,
            self.effect.excluded,
            self.session.display(),
            mm(&self.rmse_mm),
            mm(&self.effect.rmse_without_mm)
        )
    }
}
