//! A session as the catalogue has it, read from its file and those beside it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use chrono::DateTime;
use skinrig_recorder::{
    AnnotationNote, AttemptRow, Headline, LegRow, PressTally, RecorderError, SessionReader,
    SessionTotals, annotations,
};

use crate::results::{self, AnalysisEntry};

/// A session as the catalogue has it.
#[derive(Debug)]
pub struct SessionEntry {
    /// Identity.
    pub headline: Headline,
    /// Lower-case hex tree hash of the seal; `None`: not sealed.
    pub content_sha256: Option<String>,
    /// Legs, at least one.
    pub legs: Vec<LegEntry>,
    /// From the start to the end on the host's clock, s; `None` for one that was cut off.
    pub duration_s: Option<f64>,
    /// Calibrating and scored presses.
    pub presses: PressTally,
    /// Sync presses.
    pub sync: PressTally,
    /// Counts of the seal.
    pub totals: Option<SessionTotals>,
    /// Number of invalid presses by kind of fault.
    pub faults: BTreeMap<String, u64>,
    /// Role, model, serial number and firmware of each device.
    pub devices: BTreeSet<[String; 4]>,
    /// Analyses beside it.
    pub analyses: Vec<AnalysisEntry>,
    /// Tags.
    pub tags: BTreeSet<String>,
    /// Notes of the run, then later ones.
    pub notes: Vec<NoteEntry>,
    /// Why tags and later notes are missing.
    pub tags_problem: Option<String>,
}

/// A leg of a session.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LegEntry {
    /// From 1.
    pub number: u32,
    /// Operator.
    pub operator: String,
    /// Civil time, RFC 3339.
    pub started_at: String,
    /// Name of the computer.
    pub host: String,
    /// Version of skinrig.
    pub software: String,
    /// `completed`, `stopped` or `faulted`; `None`: cut off.
    pub ended: Option<String>,
}

/// A note on a session.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NoteEntry {
    /// Civil time and author of a later note; `None` for a note of the run.
    pub later: Option<(String, String)>,
    /// The note.
    pub text: String,
}

impl SessionEntry {
    /// Seconds since 1970 of the start; `None` if it is not RFC 3339.
    #[must_use]
    pub fn started_s(&self) -> Option<i64> {
        seconds(&self.headline.started_at)
    }
}

/// Seconds since 1970; `None` for a time that is not RFC 3339.
pub(crate) fn seconds(rfc3339: &str) -> Option<i64> {
    DateTime::parse_from_rfc3339(rfc3339)
        .ok()
        .map(|t| t.timestamp())
}

/// Reads the session at `path` with its `analyses`, names and results files.
///
/// # Errors
/// If the session cannot be read, or its header is not the sealed one. Results and tags that cannot be read are part of the entry.
pub(crate) fn read(
    path: &Path,
    analyses: &[(String, PathBuf)],
) -> Result<SessionEntry, RecorderError> {
    let reader = SessionReader::open(path)?;
    let headline = reader.headline()?;
    let legs = reader.legs()?;
    let seal = reader.seal()?;
    let (presses, sync) = match &seal {
        Some(seal) => (seal.totals.presses, seal.totals.sync),
        None => reader.tallies()?,
    };
    let id = &headline.session_id;
    let (later, tags_problem) = match annotations(path, id) {
        Ok(found) => (found, None),
        Err(e) => (Default::default(), Some(e.to_string())),
    };
    let analyses = analyses.iter();
    let content = seal.as_ref().map(|seal| seal.content_sha256());
    let read = |(name, file): &(String, PathBuf)| results::read(file, name, id, content.as_deref());
    let analyses = analyses.map(read);
    let own = reader.notes()?.into_iter().map(|note| NoteEntry {
        later: None,
        text: note.text,
    });
    Ok(SessionEntry {
        content_sha256: seal.map(|seal| hex(&seal.tree_sha256)),
        duration_s: legs
            .last()
            .and_then(|leg| Some(leg.end.as_ref()?.0.0 as f64 / 1e9)),
        legs: legs.into_iter().map(LegEntry::from).collect(),
        presses,
        sync,
        totals: seal.map(|seal| seal.totals),
        faults: faults(reader.presses()?.into_iter().map(|(_, attempts)| attempts)),
        devices: devices(&reader)?,
        analyses: analyses.collect(),
        tags: later.tags,
        notes: own
            .chain(later.notes.into_iter().map(NoteEntry::from))
            .collect(),
        tags_problem,
        headline,
    })
}

impl From<LegRow> for LegEntry {
    fn from(leg: LegRow) -> Self {
        Self {
            number: leg.number,
            operator: leg.began.operator,
            started_at: leg.began.started_at,
            host: leg.began.host,
            software: leg.began.software,
            ended: leg.end.map(|(_, end)| end.name().to_owned()),
        }
    }
}

impl From<AnnotationNote> for NoteEntry {
    fn from(note: AnnotationNote) -> Self {
        Self {
            later: Some((note.at, note.by)),
            text: note.text,
        }
    }
}

/// Presses whose last attempt is invalid, by kind of fault.
fn faults(presses: impl Iterator<Item = Vec<AttemptRow>>) -> BTreeMap<String, u64> {
    let mut all = BTreeMap::new();
    for attempts in presses {
        let last = attempts.last().and_then(|a| a.outcome.as_ref());
        let kinds = last.map(|outcome| outcome.verdict.fault_kinds());
        let kinds: BTreeSet<&str> = kinds.iter().flatten().map(|kind| kind.name()).collect();
        for kind in kinds {
            *all.entry(kind.to_owned()).or_default() += 1;
        }
    }
    all
}

fn devices(reader: &SessionReader) -> Result<BTreeSet<[String; 4]>, RecorderError> {
    let rows = reader.devices()?.into_iter();
    let identity = |row: skinrig_recorder::DeviceRow| {
        let is = row.identity;
        [row.role.name().to_owned(), is.model, is.serial, is.firmware]
    };
    Ok(rows.map(identity).collect())
}

/// Lower-case hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
