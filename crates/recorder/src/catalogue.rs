//! Catalogue of a folder of sessions, read from the head of each file without plans or camera bytes.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::error::RecorderError;
use crate::object::session_bytes;
use crate::reader::SessionReader;
use crate::rows::{PressTally, SessionTotals};
use crate::sidecar::SESSION_SUFFIX;
use crate::tags::{Annotations, annotations};

/// Summary of one session file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SessionSummary {
    /// The file.
    pub path: PathBuf,
    /// Size in bytes, without its log.
    pub size_bytes: u64,
    /// Content of the file.
    pub state: SessionState,
}

/// Content of a session file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "state", rename_all = "snake_case")]
#[expect(
    clippy::large_enum_variant,
    reason = "nearly all are readable, and a folder holds hundreds"
)]
pub enum SessionState {
    /// A readable session.
    #[serde(rename_all = "snake_case")]
    Readable {
        /// Identifier of the session, independent of the file's name.
        session_id: String,
        /// Civil time of the start, RFC 3339.
        started_at: String,
        /// Name of the pressed prototype.
        prototype: String,
        /// Name of the operator.
        operator: String,
        /// Name of the protocol file.
        protocol_name: String,
        /// `simulated`, `replayed`, `imported`, `emulated` or `bench`.
        rig_kind: String,
        /// Name of the rig.
        rig_name: String,
        /// `completed`, `stopped` or `faulted`; `None` for a run in progress or a crashed one.
        end: Option<String>,
        /// Whether it is sealed.
        sealed: bool,
        /// Verdict counts of calibrating and scored presses so far.
        presses: PressTally,
        /// Verdict counts of sync presses so far.
        sync: PressTally,
        /// Tags and remarks added later.
        #[serde(flatten)]
        annotations: Annotations,
        /// Error of reading the tag log; then the tags are missing here.
        tags_problem: Option<String>,
        /// Counts of the seal; `None` without one, since computing them would read the whole file.
        totals: Option<Box<SessionTotals>>,
    },
    /// No records: its run ended before it wrote the header, or the file was emptied.
    Empty,
    /// An unreadable file.
    Broken {
        /// Error of reading it.
        reason: String,
    },
}

/// Summaries of the session files in `folder` (names ending in [`SESSION_SUFFIX`]), by start time, then by name. Empty and
/// broken ones come last.
///
/// # Errors
/// [`RecorderError::Io`] when the folder cannot be read. A broken file is an entry, not an error.
pub fn list(folder: impl AsRef<Path>) -> Result<Vec<SessionSummary>, RecorderError> {
    list_with(folder, |_| None)
}

/// As [`list`], without opening the files whose content is `known`.
///
/// # Errors
/// As [`list`].
pub fn list_with(
    folder: impl AsRef<Path>,
    known: impl Fn(&Path) -> Option<SessionState>,
) -> Result<Vec<SessionSummary>, RecorderError> {
    let folder = folder.as_ref();
    let io = |source| RecorderError::Io {
        path: folder.to_owned(),
        doing: "listing it",
        source,
    };
    let mut sessions = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let named = path
            .file_name()
            .is_some_and(|n| n.to_string_lossy().ends_with(SESSION_SUFFIX));
        if named {
            let size_bytes = session_bytes(&path);
            let read = || {
                summarise(&path).unwrap_or_else(|e| match e {
                    RecorderError::Empty { .. } => SessionState::Empty,
                    e => SessionState::Broken {
                        reason: e.to_string(),
                    },
                })
            };
            let state = known(&path).unwrap_or_else(read);
            sessions.push(SessionSummary {
                path,
                size_bytes,
                state,
            });
        }
    }
    sessions.sort_by(|a, b| key(a).cmp(&key(b)));
    Ok(sessions)
}

impl SessionSummary {
    /// Name of the pressed prototype; `None` for an unreadable file.
    #[must_use]
    pub fn prototype(&self) -> Option<&str> {
        match &self.state {
            SessionState::Readable { prototype, .. } => Some(prototype),
            SessionState::Empty | SessionState::Broken { .. } => None,
        }
    }

    /// Whether the session has this tag.
    #[must_use]
    pub fn has_tag(&self, tag: &str) -> bool {
        matches!(&self.state, SessionState::Readable { annotations, .. } if annotations.tags.contains(tag))
    }
}

fn key(summary: &SessionSummary) -> (bool, &str, &Path) {
    match &summary.state {
        SessionState::Readable { started_at, .. } => (false, started_at, &summary.path),
        SessionState::Empty | SessionState::Broken { .. } => (true, "", &summary.path),
    }
}

fn summarise(path: &Path) -> Result<SessionState, RecorderError> {
    let reader = SessionReader::open(path)?;
    let brief = reader.header_texts()?;
    let seal = reader.seal()?;
    let totals = seal.map(|seal| Box::new(seal.totals));
    let (presses, sync) = match &totals {
        Some(totals) => (totals.presses, totals.sync),
        None => reader.tallies()?,
    };
    let (annotations, tags_problem) = match annotations(path, &brief.session_id) {
        Ok(annotations) => (annotations, None),
        Err(e) => (Annotations::default(), Some(e.to_string())),
    };
    Ok(SessionState::Readable {
        session_id: brief.session_id,
        started_at: brief.started_at,
        prototype: brief.prototype,
        operator: brief.operator,
        protocol_name: brief.protocol_name,
        rig_kind: brief.rig_kind,
        rig_name: brief.rig_name,
        end: reader.end()?.map(|(_, end)| end.name().to_owned()),
        sealed: totals.is_some(),
        presses,
        sync,
        annotations,
        tags_problem,
        totals,
    })
}
