//! A look at a campaign, during or after its recording.

use std::path::Path;

use skinrig_model::Look;

use crate::campaign::{Declared, declared};
use crate::error::{LookFault, ResultsError};
use crate::settings::AnalysisOptions;
use crate::stages::analyze;

/// Takes look `number` at the session at `path`, which may still be recorded.
///
/// # Errors
/// [`ResultsError`] if it has no analysis; [`ResultsError::NoLook`] if its numbers must not be used, or are too few.
pub fn take_look(path: &Path, number: u32) -> Result<Look, ResultsError> {
    let analyzed = analyze(path, AnalysisOptions::default())?;
    let no_look = |why: LookFault| ResultsError::NoLook { number, why };
    let analysis = &analyzed.analysis;
    if !analysis.is_valid() {
        return Err(no_look(LookFault::Invalid(
            analysis.invalid_because().join("; "),
        )));
    }
    let Some(plan) = declared(&analyzed.session.header.plan_json)? else {
        return Err(no_look(LookFault::NoneDeclared));
    };
    let mut looks = plan.steps.iter().filter_map(Declared::of);
    let found = looks.find(|look| look.number == number);
    let declared = found.ok_or_else(|| no_look(LookFault::NotInPlan))?;
    let rule = plan.stop.ok_or_else(|| no_look(LookFault::NoRule))?;
    declared.look(analysis, &rule).map_err(no_look)
}
