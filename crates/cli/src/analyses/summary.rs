//! Reads the summary at the end of a results file.

use std::fs;
use std::io;
use std::path::Path;

use serde::Deserialize;
use skinrig_catalogue::results_digest::{self, DigestError};
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
    /// The results belong to another session.
    #[error("the results beside it belong to another session")]
    OtherSession,
    /// The session has other content by now: it was resumed, or sealed.
    #[error("the results beside it are older than the session: analyze it again")]
    OtherContent,
    /// The results belong to another variant.
    #[error(
        "expected the results of this analysis, found those of `{found}`: analyze the session again"
    )]
    OtherVariant {
        /// Name of that variant.
        found: String,
    },
    /// The results are the official ones.
    #[error(
        "expected the results of this analysis, found the official ones: analyze the session again"
    )]
    Official,
    /// The results have no summary, or one that does not parse.
    #[error("results of an older skinrig: analyze the session again")]
    Older(#[source] Option<serde_json::Error>),
    /// The file has no digest, or that of another content.
    #[error(transparent)]
    Changed(#[from] DigestError),
    /// The session cannot be read, or was changed after it was sealed.
    #[error(transparent)]
    Session(#[from] RecorderError),
    /// The file cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
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
        return Err(SummaryError::OtherSession);
    }
    if content_of(session)? != found.content_sha256 {
        return Err(SummaryError::OtherContent);
    }
    match (&found.variant, name) {
        (None, None) => Ok(found),
        (Some(variant), Some(name)) if variant.name == name => Ok(found),
        (Some(variant), _) => Err(SummaryError::OtherVariant {
            found: variant.name.clone(),
        }),
        (None, Some(_)) => Err(SummaryError::Official),
    }
}

fn read_summary(path: &Path) -> Result<Summary, SummaryError> {
    let text = fs::read(path).map_err(|e| match e.kind() {
        io::ErrorKind::NotFound => SummaryError::NotAnalysed,
        _ => e.into(),
    })?;
    results_digest::check(&text)?;
    // A key of the outermost object: a JSON string never contains a line break.
    let key = b"\n  \"summary\": ";
    let at = text.windows(key.len()).rposition(|w| w == key);
    let text = &text[at.ok_or(SummaryError::Older(None))? + key.len()..];
    let mut reader = serde_json::Deserializer::from_slice(text);
    Summary::deserialize(&mut reader).map_err(|e| SummaryError::Older(Some(e)))
}
