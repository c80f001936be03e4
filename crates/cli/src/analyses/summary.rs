//! Owns the summary at the end of a file of results.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use serde::Deserialize;
use skinrig_report::Summary;

use super::results_path;

/// The summary stands so near to the end of a file of results.
const TAIL_BYTES: u64 = 1 << 16;

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
    #[error("results of another session lie beside it")]
    OtherSession,
    /// The results belong to another variant.
    #[error("results of the analysis `{found}` lie in their place: analyze it again")]
    OtherVariant {
        /// Name of that variant.
        found: String,
    },
    /// The results are the official ones.
    #[error("results with the session's own settings lie in their place: analyze it again")]
    Official,
    /// The results have no summary, or one that does not parse.
    #[error("results of an older skinrig: analyze the session again")]
    Older(#[source] Option<serde_json::Error>),
    /// The file cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// What the results of an analysis beside a session say in short, from their last bytes. Those of another session or another analysis
/// in that place are refused.
///
/// # Errors
/// [`SummaryError`] when there are none or they are not its own.
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
    let mut file = File::open(path).map_err(|e| match e.kind() {
        io::ErrorKind::NotFound => SummaryError::NotAnalysed,
        _ => e.into(),
    })?;
    let length = file.metadata()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(TAIL_BYTES)))?;
    let mut tail = Vec::new();
    file.take(TAIL_BYTES).read_to_end(&mut tail)?;
    // A key of the outermost object; within a text of JSON no line ends.
    let key = b"\n  \"summary\": ";
    let at = tail.windows(key.len()).position(|w| w == key);
    let text = &tail[at.ok_or(SummaryError::Older(None))? + key.len()..];
    let mut reader = serde_json::Deserializer::from_slice(text);
    Summary::deserialize(&mut reader).map_err(|e| SummaryError::Older(Some(e)))
}
