//! Reads the summary at the end of a results file.

use std::fs;
use std::io;
use std::path::Path;

use serde::Deserialize;
use skinrig_catalogue::{OFFICIAL, ResultsError, results_digest};
use skinrig_recorder::RecorderError;
use skinrig_report::Summary;

use super::{content_of, results_path};

/// Why the results of an analysis beside a session cannot be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum SummaryError {
    /// The session has no official results.
    #[error("not analysed")]
    NotAnalysed,
    /// The session has no variant with the name.
    #[error("no analysis `{name}`")]
    NoVariant {
        /// The name.
        name: String,
    },
    /// The session cannot be read, or was changed after it was sealed.
    #[error(transparent)]
    Session(#[from] RecorderError),
    /// The results are of no use.
    #[error(transparent)]
    Results(#[from] ResultsError),
}

/// Reads the summary of an analysis from the end of its results. Rejects results of another session or analysis.
///
/// # Errors
/// [`SummaryError`] when the results are missing, unreadable, or of another session or analysis.
pub(crate) fn summary(
    session: &Path,
    session_id: &str,
    name: Option<&str>,
) -> Result<Summary, SummaryError> {
    let found = read_summary(&results_path(session, name)).map_err(|e| match (e, name) {
        (SummaryError::NotAnalysed, Some(name)) => SummaryError::NoVariant {
            name: name.to_owned(),
        },
        (e, _) => e,
    })?;
    if found.session_id != session_id {
        return Err(ResultsError::OtherSession.into());
    }
    if content_of(session)? != found.content_sha256 {
        return Err(ResultsError::OtherContent.into());
    }
    let of = found.variant.as_ref().map(|variant| variant.name.as_str());
    if of != name {
        let found = of.unwrap_or(OFFICIAL).to_owned();
        return Err(ResultsError::OtherAnalysis { found }.into());
    }
    Ok(found)
}

fn read_summary(path: &Path) -> Result<Summary, SummaryError> {
    let text = fs::read(path).map_err(|e| match e.kind() {
        io::ErrorKind::NotFound => SummaryError::NotAnalysed,
        _ => ResultsError::Io(e).into(),
    })?;
    results_digest::check(&text).map_err(ResultsError::Changed)?;
    // A key of the outermost object: a JSON string never contains a line break.
    let key = b"\n  \"summary\": ";
    let at = text.windows(key.len()).rposition(|w| w == key);
    let text = &text[at.ok_or(ResultsError::OtherVersion(None))? + key.len()..];
    let mut reader = serde_json::Deserializer::from_slice(text);
    Ok(Summary::deserialize(&mut reader).map_err(|e| ResultsError::OtherVersion(Some(e)))?)
}
