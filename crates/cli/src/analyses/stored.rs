//! Reads the results of an analysis back from their file beside the session.

use std::path::Path;

use serde::Deserialize;
use skinrig_analysis::locator::FittedLocator;
use skinrig_analysis::{ANALYSIS_VERSION, Analysis, results_hash};
use skinrig_catalogue::results_digest;

use super::{content_of, results_path};

#[derive(Deserialize)]
struct Document {
    /// Without the bulk data for figures, which results leave out.
    analysis: Analysis,
    provenance: Origin,
}

#[derive(Deserialize)]
struct Origin {
    session_id: String,
    /// Of the seal; `None` without one.
    #[serde(default)]
    content_sha256: Option<String>,
    results_hash: String,
    #[serde(default)]
    variant: Option<VariantName>,
}

#[derive(Deserialize)]
struct VariantName {
    name: String,
}

/// Reads the results of the analysis `name` (`None`: the official one), without the bulk data for figures. Returns `None` if they
/// are missing, belong to another session or analysis or to an earlier content of the session, come from another version of the
/// analysis, or were changed.
pub(crate) fn stored(session: &Path, session_id: &str, name: Option<&str>) -> Option<Analysis> {
    stored_of(
        session,
        (session_id, content_of(session).ok()?.as_deref()),
        name,
    )
}

/// As [`stored`], for a session with this identifier and content that need not be beside its results.
pub(crate) fn stored_of(
    session: &Path,
    (session_id, content): (&str, Option<&str>),
    name: Option<&str>,
) -> Option<Analysis> {
    let text = std::fs::read(results_path(session, name)).ok()?;
    results_digest::check(&text).ok()?;
    // Another version may have other fields, and then does not parse.
    let found: Document = serde_json::from_slice(&text).ok()?;
    let variant = found.provenance.variant.map(|v| v.name);
    let is_own = found.provenance.session_id == session_id && variant.as_deref() == name;
    let is_current = found.analysis.version == ANALYSIS_VERSION
        && found.provenance.content_sha256.as_deref() == content;
    let is_intact = FittedLocator::of(&found.analysis).is_ok()
        && found.provenance.results_hash == results_hash(&found.analysis);
    (is_own && is_current && is_intact).then_some(found.analysis)
}
