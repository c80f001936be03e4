//! Why a session has no analysis.

use std::path::PathBuf;

use skinrig_analysis::AnalysisError;
use skinrig_protocol::Diagnostics;
use skinrig_recorder::RecorderError;

/// Why a session has no analysis.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// The file cannot be read.
    #[error(transparent)]
    Session(#[from] RecorderError),
    /// The description of the rig in the session cannot be read.
    #[error(
        "{}: expected the description of the rig in the session, found: {source}\n  \
         next: `skinrig verify` says whether the file is damaged",
        path.display()
    )]
    Rig {
        /// The session.
        path: PathBuf,
        /// What is wrong with it.
        source: serde_json::Error,
    },
    /// An override of something that a recorded session cannot change.
    #[error(
        "--set {given}: expected a key below `analysis.`; a recorded session's other values cannot change"
    )]
    NotOfTheAnalysis {
        /// The override.
        given: String,
    },
    /// An override of a key that only recordings of earlier versions may hold.
    #[error(
        "--set {given}: expected `analysis.exclude_press_numbers`, which counts presses from 1, found the key of earlier versions, \
         which counts from 0"
    )]
    OldKey {
        /// The override.
        given: String,
    },
    /// The session's protocol or schedule with the overrides does not parse.
    #[error("{0}")]
    Settings(Diagnostics),
    /// The analysis rejects its input.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
}
