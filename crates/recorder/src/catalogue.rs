//! What a folder of sessions holds, from the head of each file: neither plans nor camera bytes are read.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::beside::SESSION_SUFFIX;
use crate::error::RecorderError;
use crate::reader::SessionReader;
use crate::rows::{PressTally, SessionTotals};
use crate::tags::{Sayings, sayings};

/// One session file of a folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SessionSummary {
    /// The file.
    pub path: PathBuf,
    /// Its size in bytes, without a log beside it.
    pub size_bytes: u64,
    /// What is in it.
    pub state: SessionState,
}

/// What is in a session file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "state", rename_all = "snake_case")]
#[expect(
    clippy::large_enum_variant,
    reason = "nearly all are readable, and a folder holds hundreds"
)]
pub enum SessionState {
    /// It can be read.
    #[serde(rename_all = "snake_case")]
    Readable {
        /// Names the session whatever its file is called.
        session_id: String,
        /// Civil time of the start, RFC 3339.
        started_at: String,
        /// Which prototype was pressed.
        prototype: String,
        /// Who ran it.
        operator: String,
        /// Where the protocol came from.
        protocol_name: String,
        /// `simulated`, `replayed`, `imported`, `emulated` or `bench`.
        rig_kind: String,
        /// Name of the rig.
        rig_name: String,
        /// `completed`, `stopped` or `faulted`; `None` for a run under way or cut off.
        end: Option<String>,
        /// Whether it is sealed.
        sealed: bool,
        /// How its calibrating and scored presses ended so far.
        presses: PressTally,
        /// How its sync presses ended so far.
        sync: PressTally,
        /// What was said of it later: tags and remarks.
        #[serde(flatten)]
        sayings: Sayings,
        /// Why the log of tags beside it cannot be read, if so; then there are no tags here.
        tags_problem: Option<String>,
        /// The counts of its seal; `None` for one that is not sealed, of which the whole file would have to be read.
        totals: Option<Box<SessionTotals>>,
    },
    /// It has no record at all: its run ended before it wrote the header, or something emptied the file.
    Empty,
    /// It cannot.
    Broken {
        /// Why.
        reason: String,
    },
}

/// The session files of `folder` (names that end in [`SESSION_SUFFIX`]), oldest start first, empty and broken ones last;
/// by name where that is equal.
///
/// # Errors
/// [`RecorderError::Io`] when the folder cannot be read. A broken file is an entry, not an error.
pub fn list(folder: impl AsRef<Path>) -> Result<Vec<SessionSummary>, RecorderError> {
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
            let size_bytes = std::fs::metadata(&path).map_or(0, |m| m.len());
            let state = summarise(&path).unwrap_or_else(|e| match e {
                RecorderError::Empty { .. } => SessionState::Empty,
                e => SessionState::Broken {
                    reason: e.to_string(),
                },
            });
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
    /// Which prototype was pressed; `None` of a broken file.
    #[must_use]
    pub fn prototype(&self) -> Option<&str> {
        match &self.state {
            SessionState::Readable { prototype, .. } => Some(prototype),
            SessionState::Empty | SessionState::Broken { .. } => None,
        }
    }

    /// Whether somebody gave it this tag.
    #[must_use]
    pub fn has_tag(&self, tag: &str) -> bool {
        matches!(&self.state, SessionState::Readable { sayings, .. } if sayings.tags.contains(tag))
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
    let brief = reader.brief()?;
    let seal = reader.seal()?;
    let totals = seal.map(|seal| Box::new(seal.totals));
    let (presses, sync) = match &totals {
        Some(totals) => (totals.presses, totals.sync),
        None => reader.tallies()?,
    };
    let (sayings, tags_problem) = match sayings(path, &brief.session_id) {
        Ok(sayings) => (sayings, None),
        Err(e) => (Sayings::default(), Some(e.to_string())),
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
        sayings,
        tags_problem,
        totals,
    })
}
