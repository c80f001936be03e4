//! The analysis of a session with a selection, and the RMSE with and without it.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use skinrig_analysis::Analysis;
use skinrig_analysis::result::Estimate;
use skinrig_report::{SelectionEffect, SelectionName, Variant};

use crate::analyses;
use crate::analysis_request::AnalysisRequest;
use crate::exit::Failure;
use crate::results::{Results, analyze_shown};
use crate::selection::SelectedPresses;

/// Effect of a selection on a session.
pub(crate) struct SelectedResult {
    pub name: SelectionName,
    session: PathBuf,
    rmse_mm: Estimate,
    effect: SelectionEffect,
}

/// The analysis with the selection, also of a variant of its analyses: that beside the session, or a new one.
pub(crate) fn analysis(
    path: &Path,
    session_id: &str,
    selected: &SelectedPresses,
    variant: Option<&Variant>,
) -> Result<(Analysis, SelectedResult), Failure> {
    let result = |rmse_mm, effect| SelectedResult::new(path, selected, rmse_mm, effect);
    if let Some(variant) = variant {
        of_selection(variant, selected)?;
    }
    let label = variant.map_or_else(|| selected.label(), |v| v.name.clone());
    let stored = analyses::stored(path, session_id, Some(&label));
    let stored = stored.filter(|a| a.settings.selected_out == selected.out);
    let summary = analyses::summary(path, session_id, Some(&label)).ok();
    if let (Some(analysis), Some(effect)) = (stored, summary.and_then(|s| s.selection)) {
        let rmse_mm = analysis.scored.rmse_mm;
        return Ok((analysis, result(rmse_mm, effect)));
    }
    let choices = AnalysisRequest {
        selection: Some(selected),
        ..variant.map_or_else(AnalysisRequest::default, AnalysisRequest::of_variant)
    };
    let found = analyze_shown(path, choices).map_err(|f| without_results(path, f))?;
    let stated = SelectedResult::of(&found, selected);
    Ok((found.analysis, stated))
}

/// Rejects a variant of the whole session or of another selection.
fn of_selection(variant: &Variant, selected: &SelectedPresses) -> Result<(), Failure> {
    let found = match &variant.selection {
        Some(name) if name.sha256 == selected.name.sha256 => return Ok(()),
        Some(name) => format!("one of {name}"),
        None => "one of the whole session".to_owned(),
    };
    Err(Failure::input(format!(
        "analysis `{name}`: expected a variant of {selection}, found {found}\n  next: make it with `skinrig analyze {file} --name NAME` \
         and the settings that differ, or leave --analysis out",
        name = variant.name,
        selection = selected.name,
        file = crate::paths::shell_path(&selected.name.file),
    )))
}

/// An analysis that failed, with its session.
pub(crate) fn without_results(path: &Path, failure: Failure) -> Failure {
    Failure {
        message: format!("{}\n  ({}: no results)", failure.message, path.display()),
        ..failure
    }
}

impl SelectedResult {
    /// Of an analysis of the session at `path`.
    pub(crate) fn new(
        path: &Path,
        selected: &SelectedPresses,
        rmse_mm: Estimate,
        effect: SelectionEffect,
    ) -> Self {
        Self {
            name: selected.name.clone(),
            session: path.to_owned(),
            rmse_mm,
            effect,
        }
    }

    /// Of new results.
    pub(crate) fn of(found: &Results, selected: &SelectedPresses) -> Self {
        let rmse_mm = found.analysis.scored.rmse_mm;
        let effect = found
            .provenance
            .selection
            .clone()
            .unwrap_or(SelectionEffect {
                excluded: 0,
                rmse_without_mm: rmse_mm,
            });
        Self::new(&found.session, selected, rmse_mm, effect)
    }

    /// For programs.
    pub(crate) fn document(&self) -> Value {
        json!({
            "session": self.session, "selection": self.name, "rmse_mm": self.rmse_mm,
            "excluded": self.effect.excluded, "rmse_without_mm": self.effect.rmse_without_mm,
        })
    }

    /// The RMSE with and without the selection, in one line.
    pub(crate) fn line(&self) -> String {
        let mm = |e: &Estimate| {
            e.value
                .map_or_else(|| "none".to_owned(), |v| format!("{v:.2} mm"))
        };
        format!(
            "{} excludes {} press(es) of {}: RMSE {}, without the selection {}",
            self.name,
            self.effect.excluded,
            self.session.display(),
            mm(&self.rmse_mm),
            mm(&self.effect.rmse_without_mm)
        )
    }
}
