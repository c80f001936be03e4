//! Causes of verdicts, interruptions and ends of runs: JSON in columns of the session.

use serde::Serialize;
use serde::de::DeserializeOwned;
use skinrig_model::{
    InterruptionKind, InterruptionReason, PressFaultKind, PressVerdict, ReasonRef, RunEnd,
};
use sqlx::sqlite::SqliteRow;

use crate::legacy_text;
use crate::query::{Fault, enum_value, opt_text, text, text_if_present};

/// JSON of a cause.
pub(crate) fn json(place: &str, cause: &impl Serialize) -> Result<String, Fault> {
    serde_json::to_string(cause).map_err(|e| Fault::bad(place, "a cause that JSON can hold", e))
}

/// JSON of the reason of a verdict or of an end; `None` for a valid attempt and for a completed run.
pub(crate) fn json_of(place: &str, reason: Option<ReasonRef<'_>>) -> Result<Option<String>, Fault> {
    reason.map(|reason| json(place, &reason)).transpose()
}

/// The cause in a column; `None` in sessions of an older schema.
pub(crate) fn cause_from<T: DeserializeOwned>(
    row: &SqliteRow,
    column: &str,
) -> Result<Option<T>, Fault> {
    let Some(json) = text_if_present(row, column)? else {
        return Ok(None);
    };
    let read = serde_json::from_str(&json);
    read.map(Some)
        .map_err(|e| Fault::bad(column, "a cause of a kind that this version has", e))
}

/// Refuses a row that states why it is not what it says.
fn without_cause(
    row: &SqliteRow,
    columns: [&'static str; 2],
    expected: &'static str,
) -> Result<(), Fault> {
    for column in columns {
        if let Some(found) = text_if_present(row, column)? {
            return Err(Fault::bad(column, expected, format!("`{found}`")));
        }
    }
    Ok(())
}

/// Verdict on an attempt; `None` while it is open.
pub(crate) fn verdict_from(
    row: &SqliteRow,
    kinds: Vec<PressFaultKind>,
) -> Result<Option<PressVerdict>, Fault> {
    const CAUSE: &str = "cause";
    let recorded = || opt_text(row, "reason").map(Option::unwrap_or_default);
    Ok(Some(match opt_text(row, "verdict")?.as_deref() {
        None => return Ok(None),
        Some("valid") => {
            without_cause(row, ["reason", CAUSE], "no cause of a valid attempt")?;
            PressVerdict::Valid
        }
        Some("missed") => PressVerdict::Missed(match cause_from(row, CAUSE)? {
            Some(reason) => reason,
            None => legacy_text::missed(recorded()?),
        }),
        Some("invalid") => PressVerdict::Invalid(match cause_from(row, CAUSE)? {
            Some(reason) => reason,
            None => legacy_text::invalid(recorded()?, kinds),
        }),
        Some("excluded") => PressVerdict::Excluded(match cause_from(row, CAUSE)? {
            Some(reason) => reason,
            None => legacy_text::excluded(recorded()?),
        }),
        Some(other) => return Err(Fault::bad("attempt", "a verdict", format!("`{other}`"))),
    }))
}

/// Columns that describe an end of a run.
pub(crate) struct EndColumns {
    pub status: &'static str,
    pub reason: &'static str,
    pub cause: &'static str,
}

/// End of a run, from these columns.
pub(crate) fn end_from(row: &SqliteRow, columns: &EndColumns) -> Result<RunEnd, Fault> {
    let recorded = || opt_text(row, columns.reason).map(Option::unwrap_or_default);
    Ok(match text(row, columns.status)?.as_str() {
        "completed" => {
            let columns = [columns.reason, columns.cause];
            without_cause(row, columns, "no cause of the end of a completed run")?;
            RunEnd::Completed
        }
        "stopped" => RunEnd::Stopped(match cause_from(row, columns.cause)? {
            Some(reason) => reason,
            None => legacy_text::stopped(recorded()?),
        }),
        "faulted" => match cause_from(row, columns.cause)? {
            Some(causes) => RunEnd::Faulted(causes),
            None => legacy_text::faulted(recorded()?),
        },
        other => {
            return Err(Fault::bad(
                columns.status,
                "completed, stopped or faulted",
                other,
            ));
        }
    })
}

/// Kind and reason of an interruption.
pub(crate) fn interruption_from(
    row: &SqliteRow,
) -> Result<(InterruptionKind, InterruptionReason), Fault> {
    let kind = enum_value(row, "kind", &InterruptionKind::ALL, InterruptionKind::name)?;
    let reason = match cause_from(row, "cause")? {
        Some(reason) => reason,
        None => legacy_text::interruption(kind, text(row, "reason")?),
    };
    Ok((kind, reason))
}
