//! State of a session, from its file and from the run itself.

use std::path::{Path, PathBuf};

use serde::{Serialize, Serializer};
use skinrig_model::{PressId, PressVerdict, RunEnd};
use skinrig_recorder::{InterruptionRow, NoteRow, RecorderError, SessionReader, SessionTotals};

use crate::remote::RunSnapshot;

/// Number of latest outcomes, interruptions and notes shown.
const SHOWN: usize = 5;

/// State of a session; serialized unchanged for `--json`.
#[derive(Serialize)]
pub(super) struct Status {
    pub session: PathBuf,
    /// The process that writes it now.
    pub writer: Option<String>,
    /// The run as it describes itself.
    pub live: Option<Box<RunSnapshot>>,
    /// Why a running program does not describe its run.
    pub silence: Option<String>,
    pub disk_free_bytes: Option<u64>,
    /// `None` until the first records of a run are on the disk.
    #[serde(flatten)]
    pub stored: Option<Stored>,
}

/// Contents of the session file.
#[derive(Serialize)]
pub(super) struct Stored {
    pub id: String,
    pub sealed: bool,
    pub started_at: String,
    pub prototype: String,
    pub operator: String,
    pub protocol: String,
    pub rig: String,
    pub rig_kind: String,
    pub legs: usize,
    #[serde(flatten)]
    pub end: End,
    pub totals: SessionTotals,
    pub last_outcomes: Vec<LastOutcome>,
    pub interruption_count: usize,
    #[serde(serialize_with = "interruptions")]
    pub last_interruptions: Vec<InterruptionRow>,
    #[serde(serialize_with = "notes")]
    pub last_notes: Vec<NoteRow>,
}

/// End of the last leg; `None` while it runs, and if it was cut off.
pub(super) struct End(pub Option<RunEnd>);

impl Serialize for End {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeMap as _;
        let end = self.0.as_ref();
        let mut map = serializer.serialize_map(Some(3))?;
        map.serialize_entry("end", &end.map(RunEnd::name))?;
        map.serialize_entry("end_reason", &end.and_then(RunEnd::reason))?;
        map.serialize_entry("end_cause", &end.and_then(RunEnd::cause))?;
        map.end()
    }
}

/// Outcome of an attempt.
pub(super) struct LastOutcome {
    pub press: PressId,
    pub attempt: u32,
    pub verdict: PressVerdict,
}

impl Serialize for LastOutcome {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeMap as _;
        let mut map = serializer.serialize_map(Some(5))?;
        map.serialize_entry("press", &self.press)?;
        map.serialize_entry("attempt", &self.attempt)?;
        map.serialize_entry("verdict", self.verdict.name())?;
        map.serialize_entry("reason", &self.verdict.reason())?;
        map.serialize_entry("cause", &self.verdict.cause())?;
        map.end()
    }
}

/// Rows of time in s, kind and reason.
fn interruptions<S: Serializer>(
    rows: &[InterruptionRow],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(
        rows.iter()
            .map(|row| (row.t.as_secs_f64(), row.kind.name(), row.reason.to_string())),
    )
}

/// Rows of time in s and text.
fn notes<S: Serializer>(rows: &[NoteRow], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(rows.iter().map(|row| (row.t.as_secs_f64(), &row.text)))
}

/// State of the session according to its file, as far as it is on the disk.
pub(super) fn stored(session: &Path) -> Result<Stored, RecorderError> {
    let reader = SessionReader::open_unchanged(session)?;
    let header = reader.header()?;
    let mut outcomes: Vec<_> = reader
        .presses()?
        .into_iter()
        .flat_map(|(_, attempts)| attempts)
        .filter_map(|a| a.outcome)
        .filter(|o| !matches!(o.verdict, PressVerdict::Missed(_)))
        .collect();
    // A press that a further leg repeated precedes later ones in the plan.
    outcomes.sort_by_key(|o| o.timing.map(|t| t.release));
    let outcomes = last(outcomes).into_iter().map(|o| LastOutcome {
        press: o.attempt.press,
        attempt: o.attempt.number,
        verdict: o.verdict,
    });
    let interruptions = reader.interruptions()?;
    Ok(Stored {
        id: reader.session_id()?,
        sealed: reader.seal()?.is_some(),
        started_at: header.started_at,
        prototype: header.prototype,
        operator: header.operator,
        protocol: header.protocol_name,
        rig: header.rig_name,
        rig_kind: header.rig_kind,
        legs: reader.legs()?.len(),
        end: End(reader.end()?.map(|(_, end)| end)),
        totals: reader.totals()?,
        last_outcomes: outcomes.collect(),
        interruption_count: interruptions.len(),
        last_interruptions: last(interruptions),
        last_notes: last(reader.notes()?),
    })
}

/// The last [`SHOWN`] rows.
fn last<T>(mut rows: Vec<T>) -> Vec<T> {
    rows.drain(..rows.len().saturating_sub(SHOWN));
    rows
}
