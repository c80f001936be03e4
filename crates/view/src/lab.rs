//! Owns the interface to everything about a lab that is not in a session file.

use std::path::Path;

use serde::Serialize;
use serde_json::Value;
use skinrig_analysis::Analysis;
use skinrig_recorder::SessionSummary;

/// Why the lab cannot answer, as a complete message with a next step.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{0}")]
pub struct LabError(pub String);

/// State that a run reports of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct RunState {
    /// Name of the controller's state, such as `running`.
    pub state: String,
    /// True once the run has ended and its session is being sealed.
    pub is_over: bool,
    /// Bytes of each camera known to be lost in this leg.
    pub lost_bytes: [u64; 2],
    /// The whole report, as `live` in `skinrig watch --json`.
    pub report: Value,
}

/// Newest bytes of a camera of a running session.
#[derive(Debug, Clone, PartialEq)]
pub struct NewestBytes {
    /// Whole words of its stream, the newest last; the first ones may depend on words that are missing.
    pub bytes: Vec<u8>,
    /// When the run took them from the camera, s since 1970; 0 for none yet.
    pub unix_s: f64,
}

/// An analysis whose results are beside a session.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AnalysisEntry {
    /// Name of the variant; `None` for the official analysis.
    pub name: Option<String>,
    /// RMSE with its 95 % interval, mm.
    pub rmse_mm: Option<[Option<f64>; 3]>,
    /// False if its numbers must not be used.
    pub is_valid: bool,
    /// Changes of a variant, as `analysis.key=value`.
    pub changes: Vec<String>,
    /// Why the results cannot be used.
    pub trouble: Option<String>,
}

/// A session of a folder.
#[derive(Debug, Clone, PartialEq)]
pub struct ShelfSession {
    /// The session.
    pub summary: SessionSummary,
    /// Its analyses, the official one first; none of an unreadable file.
    pub analyses: Vec<AnalysisEntry>,
}

/// A setting in which two analyses differ.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SettingDifference {
    /// Its label.
    pub label: String,
    /// Its key; the path of the fact.
    pub key: String,
    /// Value of each side.
    #[serde(flatten)]
    pub values: SettingValues,
    /// Consequence for a comparison: `blocking`, `confounding` or `harmless`.
    pub severity: &'static str,
    /// Why.
    pub reason: String,
}

/// Values of a setting on both sides.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SettingValues {
    /// Of the first.
    pub a: String,
    /// Of the second.
    pub b: String,
}

/// Services that the server needs from its program. Calls may block; none comes from an async task.
pub trait Lab: Send + Sync + 'static {
    /// State of the run that writes `session`; `None` if none answers.
    fn run(&self, session: &Path) -> Option<RunState>;

    /// Newest bytes of camera 1 and camera 2 of the run that writes `session`, with those that are not in the file yet; `None` if none answers.
    fn newest(&self, session: &Path) -> Option<[NewestBytes; 2]>;

    /// Sends a request (`pause`, `pause_now`, `resume`, `stop`, `abort` or `halt`) to the run that writes `session`, and returns the run's
    /// state after its acknowledgement.
    ///
    /// # Errors
    /// [`LabError`] for an unknown request, or if no run acknowledges it.
    fn request(&self, session: &Path, request: &str) -> Result<String, LabError>;

    /// Adds a note to the run that writes `session`, and waits until it is stored.
    ///
    /// # Errors
    /// [`LabError`] for a note that is too long, or if no run stores it.
    fn note(&self, session: &Path, by: &str, text: &str) -> Result<(), LabError>;

    /// Stored results of this version of the analysis beside `session`; `None` for `name` is the official one. `None` if there are none.
    fn analysis(&self, session: &Path, session_id: &str, name: Option<&str>) -> Option<Analysis>;

    /// All analyses beside `session`, the official one first.
    fn analyses(&self, session: &Path, session_id: &str) -> Vec<AnalysisEntry>;

    /// The sessions of a folder with all of their analyses, oldest first.
    ///
    /// # Errors
    /// [`LabError`] if the folder cannot be read.
    fn shelf(&self, folder: &Path) -> Result<Vec<ShelfSession>, LabError>;

    /// Settings in which two sessions differ, most severe first, and the number of settings. Each session comes with the name of a variant;
    /// `None` is the official analysis. Settings of the analysis are left out unless both are analysed.
    ///
    /// # Errors
    /// [`LabError`] if a session cannot be read.
    fn differences(
        &self,
        sides: [(&Path, Option<&str>); 2],
    ) -> Result<(Vec<SettingDifference>, usize), LabError>;

    /// Prototypes of a folder with their series, as `skinrig prototypes --json`.
    ///
    /// # Errors
    /// [`LabError`] if the folder cannot be read.
    fn prototypes(&self, folder: &Path) -> Result<Value, LabError>;

    /// Nights whose history is beside the sessions, newest first; none without a history.
    ///
    /// # Errors
    /// [`LabError`] if there is a history that cannot be read.
    fn nights(&self, folder: &Path) -> Result<Vec<Value>, LabError>;

    /// Free bytes where `session` is; `None` if unknown.
    fn free_bytes(&self, session: &Path) -> Option<u64>;
}
