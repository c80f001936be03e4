//! Reads the results of an analysis back from their file beside the session.

use std::path::Path;

use serde::Deserialize;
use skinrig_analysis::locator::FittedLocator;
use skinrig_analysis::{ANALYSIS_VERSION, Analysis};

use super::results_path;

#[derive(Deserialize)]
struct Document {
    /// Without the bulk data for figures, which results leave out.
    analysis: Analysis,
    provenance: Origin,
}

#[derive(Deserialize)]
struct Origin {
    session_id: String,
    #[serde(default)]
    variant: Option<VariantName>,
}

#[derive(Deserialize)]
struct VariantName {
    name: String,
}

/// Reads the results of the analysis `name` (`None`: the official one), without the bulk data for figures. Returns `None` if they
/// are missing, belong to another session or analysis, come from another version of the analysis, or hold a locator that was
/// changed.
pub(crate) fn stored(session: &Path, session_id: &str, name: Option<&str>) -> Option<Analysis> {
    let text = std::fs::read(results_path(session, name)).ok()?;
    // Another version may have other fields, and then does not parse.
    let found: Document = serde_json::from_slice(&text).ok()?;
    let variant = found.provenance.variant.map(|v| v.name);
    let is_own = found.provenance.session_id == session_id && variant.as_deref() == name;
    let is_current = found.analysis.version == ANALYSIS_VERSION;
    let has_locator = FittedLocator::of(&found.analysis).is_ok();
    (is_own && is_current && has_locator).then_some(found.analysis)
}
