//! Why the results of an analysis beside a session cannot be used.

use std::io;

use crate::results_digest::DigestError;

/// Why the results of an analysis beside a session cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// They belong to another session.
    #[error("the results beside it belong to another session")]
    OtherSession,
    /// The session has other content by now: it was resumed, or sealed.
    #[error("the results beside it are older than the session: analyze it again")]
    OtherContent,
    /// They belong to another analysis.
    #[error(
        "expected the results of this analysis, found those of `{found}`: analyze the session again"
    )]
    OtherAnalysis {
        /// Name of that analysis.
        found: String,
    },
    /// They lack what this version writes.
    #[error("results of another version of skinrig: analyze the session again")]
    OtherVersion(#[source] Option<serde_json::Error>),
    /// Rows that cannot all be true.
    #[error(
        "the results list a press, a clock or a parameter twice, or an unknown cause: analyze the session again"
    )]
    Contradictory,
    /// The file has no digest, or that of another content.
    #[error(transparent)]
    Changed(#[from] DigestError),
    /// The file cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
}
