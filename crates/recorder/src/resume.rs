//! Resuming a session that was interrupted, stopped or faulted: the transaction that begins a further leg.

use std::path::Path;

use skinrig_model::{
    PressFaultKind, PressRole, PressVerdict, ResumeHeader, StreamFormat, UnknownName,
};
use sqlx::sqlite::{SqliteConnection, SqliteRow};
use sqlx::{Connection, Sqlite, Transaction};

use crate::error::RecorderError;
use crate::leg::{LegOffset, next_second};
use crate::lock::WriterLock;
use crate::query::{Fault, blob, int, opt_int, opt_text, schema_version, text};
use crate::reader::SessionReader;
use crate::verify::{ChunkScanner, VerifyReport, verify};
use crate::{cause, chain, schema};

/// Start values for the writer of a new leg.
pub(crate) struct LegStart {
    /// Number of the leg, from 2.
    pub number: u32,
    pub offset: LegOffset,
    pub formats: [StreamFormat; 2],
}

/// Locks a session that can be resumed, and verifies all of it, so that damage is never sealed. Nothing changes.
pub(crate) fn lock_unfinished<S: ChunkScanner>(path: &Path) -> Result<WriterLock, RecorderError> {
    let lock = lock(path)?;
    let completed = SessionReader::open(path).and_then(|reader| is_completed(&reader));
    if let Ok(true) = completed {
        return Err(RecorderError::AlreadyCompleted {
            path: path.to_owned(),
        });
    }
    check::<S>(path)?;
    Ok(lock)
}

/// Whether a session is complete, and no press can be repeated by a rig.
fn is_completed(reader: &SessionReader) -> Result<bool, RecorderError> {
    match reader.end()? {
        Some((_, end)) if end.decision().is_some() => return Ok(true),
        Some((_, end)) if end.is_complete() => {}
        _ => return Ok(false),
    }
    if !reader.header()?.is_of_a_rig() {
        return Ok(true);
    }
    let (presses, known) = (reader.presses()?, reader.history()?);
    let mut all = presses.iter().zip(known);
    Ok(!all.any(|((press, _), known)| press.role != PressRole::Sync && known.given_back))
}

/// Locks a session whose end is recorded but whose seal is missing or incomplete, and verifies all of it. Nothing changes.
pub(crate) fn lock_unsealed<S: ChunkScanner>(path: &Path) -> Result<WriterLock, RecorderError> {
    let lock = lock(path)?;
    let end = SessionReader::open(path).and_then(|reader| reader.end());
    if let Ok(None) = end {
        return Err(RecorderError::NotFound {
            path: path.to_owned(),
            expected: "the end of its run".into(),
        });
    }
    if check::<S>(path)?.sealed {
        return Err(RecorderError::AlreadyCompleted {
            path: path.to_owned(),
        });
    }
    Ok(lock)
}

fn check<S: ChunkScanner>(path: &Path) -> Result<VerifyReport, RecorderError> {
    let report = verify::<S>(path)?;
    if report.is_sound() {
        return Ok(report);
    }
    Err(RecorderError::Unsound {
        path: path.to_owned(),
        problems: report.problems,
        more_problems: report.more_problems,
    })
}

/// Opens an unsealed session for writing.
pub(crate) async fn reopen(path: &Path) -> Result<SqliteConnection, RecorderError> {
    let mut conn = schema::reopen(path).await?;
    let fault = |fault: Fault| fault.at(path, "opening it again");
    clear_seal(&mut conn).await.map_err(fault)?;
    schema::enable_wal(&mut conn).await.map_err(fault)?;
    Ok(conn)
}

/// Removes an incomplete seal.
async fn clear_seal(conn: &mut SqliteConnection) -> Result<(), Fault> {
    let mut all = conn.begin_with("BEGIN IMMEDIATE").await?;
    for delete in ["DELETE FROM seal", "DELETE FROM table_digest"] {
        sqlx::query(delete).execute(&mut *all).await?;
    }
    Ok(all.commit().await?)
}

fn lock(path: &Path) -> Result<WriterLock, RecorderError> {
    // Roll back before locking: no lock file may be created beside a file that is not a session, and a rollback needs the file
    // unlocked.
    match SessionReader::open(path).and_then(|reader| reader.session_id()) {
        // The following check reports the damage and the next step.
        Ok(_) | Err(RecorderError::Damaged { .. } | RecorderError::Sql { .. }) => {
            WriterLock::take(path)
        }
        Err(e) => Err(e),
    }
}

/// Begins the leg in one transaction: durable on return, or nothing changed.
pub(crate) async fn begin(
    path: &Path,
    header: &ResumeHeader,
) -> Result<(SqliteConnection, LegStart), RecorderError> {
    let mut conn = schema::reopen(path).await?;
    let begun = write(&mut conn, header)
        .await
        .map_err(|fault| fault.at(path, "beginning a further leg"))?;
    schema::enable_wal(&mut conn)
        .await
        .map_err(|fault| fault.at(path, "beginning a further leg"))?;
    Ok((conn, begun))
}

async fn write(conn: &mut SqliteConnection, header: &ResumeHeader) -> Result<LegStart, Fault> {
    // A sealed session is in rollback mode: if the process is killed here, SQLite rolls back to the sealed bytes.
    let mut all = conn.begin_with("BEGIN IMMEDIATE").await?;
    let schema = schema_version(&mut all).await?;
    schema::migrate(&mut all).await?;
    let (offset, formats) = offset(&mut all).await?;
    let number = insert_leg(&mut all, header, &offset).await?;
    chain::archive_seal(&mut all, number, schema).await?;
    let cut_off = PressVerdict::cut_off(number - 1);
    sqlx::query(
        "UPDATE attempt SET verdict = 'invalid', reason = ?, scheduled = 0, faults = ?, cause = ? WHERE verdict IS NULL",
    )
    .bind(cut_off.reason())
    .bind(PressFaultKind::RunEnded.name())
    .bind(cause::json_of("attempt", cut_off.cause())?)
    .execute(&mut *all)
    .await?;
    // The box's clock of this leg does not continue the previous one.
    sqlx::query("INSERT INTO box_report (taken_ns, what, received_ns) VALUES (?1, 'reset', ?1)")
        .bind(offset.origin_ns)
        .execute(&mut *all)
        .await?;
    for delete in [
        "DELETE FROM run_end",
        "DELETE FROM seal",
        "DELETE FROM table_digest",
    ] {
        sqlx::query(delete).execute(&mut *all).await?;
    }
    all.commit().await?;
    Ok(LegStart {
        number,
        offset,
        formats,
    })
}

async fn offset(
    conn: &mut Transaction<'_, Sqlite>,
) -> Result<(LegOffset, [StreamFormat; 2]), Fault> {
    let row = sqlx::query(
        "SELECT (SELECT coalesce(max(t), 0) FROM (
             SELECT max(intent_ns) AS t FROM attempt UNION ALL SELECT max(clear_ns) FROM attempt
             UNION ALL SELECT max(t_ns) FROM command UNION ALL SELECT max(last_ns) FROM pose_block
             UNION ALL SELECT max(t_ns) FROM mark UNION ALL SELECT max(taken_ns) FROM box_report
             UNION ALL SELECT max(received_ns) FROM box_report UNION ALL SELECT max(host_ns) FROM chunk
             UNION ALL SELECT max(t_ns) FROM interruption UNION ALL SELECT max(t_ns) FROM note
             UNION ALL SELECT max(t_ns) FROM run_end UNION ALL SELECT max(origin_ns) FROM leg)) AS host_ns,
           (SELECT max(last_us) FROM chunk WHERE camera = 1) AS camera1_us,
           (SELECT max(last_us) FROM chunk WHERE camera = 2) AS camera2_us,
           (SELECT coalesce(max(seq) + 1, 0) FROM chunk WHERE camera = 1) AS seq1,
           (SELECT coalesce(max(seq) + 1, 0) FROM chunk WHERE camera = 2) AS seq2,
           stream_format_1, stream_format_2
         FROM session",
    )
    .fetch_one(&mut **conn)
    .await?;
    let origin = |column: &str, per_second: i64| {
        let last = opt_int(&row, column)?;
        next_second(last, per_second).ok_or_else(|| {
            Fault::bad(
                "recorded times",
                "times below half of the range",
                format!("{last:?}"),
            )
        })
    };
    let unsigned =
        |value: i64| u64::try_from(value).map_err(|_| Fault::bad("leg", "a number from 0", value));
    let format = |column: &str| -> Result<StreamFormat, Fault> {
        text(&row, column)?
            .parse()
            .map_err(|e: UnknownName| Fault::bad(column, "a stream format", e))
    };
    let offset = LegOffset {
        origin_ns: origin("host_ns", 1_000_000_000)?,
        camera_origin_us: [
            unsigned(origin("camera1_us", 1_000_000)?)?,
            unsigned(origin("camera2_us", 1_000_000)?)?,
        ],
        first_seq: [unsigned(int(&row, "seq1")?)?, unsigned(int(&row, "seq2")?)?],
    };
    Ok((
        offset,
        [format("stream_format_1")?, format("stream_format_2")?],
    ))
}

/// Writes the row of the leg; returns its number.
async fn insert_leg(
    conn: &mut Transaction<'_, Sqlite>,
    header: &ResumeHeader,
    offset: &LegOffset,
) -> Result<u32, Fault> {
    let one = |sql: &'static str| sqlx::query(sql);
    let counts = one(
        "SELECT (SELECT coalesce(max(number), 1) + 1 FROM leg) AS number,
           (SELECT count(*) FROM device) AS devices, (SELECT count(*) FROM preflight) AS preflight",
    )
    .fetch_one(&mut **conn)
    .await?;
    let end: Option<SqliteRow> = one("SELECT t_ns, status, reason, cause FROM run_end")
        .fetch_optional(&mut **conn)
        .await?;
    let seal: Option<SqliteRow> = one("SELECT tree_sha256 FROM seal")
        .fetch_optional(&mut **conn)
        .await?;
    let number: u32 = crate::query::num(&counts, "number")?;
    let signed = |value: u64| value as i64; // they come from this file
    let mut insert = sqlx::query(
        "INSERT INTO leg (number, operator, started_at, host, software, command_line, origin_ns, camera1_origin_us,
           camera2_origin_us, first_seq_1, first_seq_2, devices_before, preflight_before, previous_status,
           previous_reason, previous_cause, previous_end_ns, previous_tree_sha256)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(number)
    .bind(&header.operator)
    .bind(&header.started_at)
    .bind(&header.host)
    .bind(&header.software)
    .bind(&header.command_line)
    .bind(offset.origin_ns);
    for value in offset.camera_origin_us.into_iter().chain(offset.first_seq) {
        insert = insert.bind(signed(value));
    }
    insert = insert
        .bind(int(&counts, "devices")?)
        .bind(int(&counts, "preflight")?);
    insert = match &end {
        Some(end) => insert
            .bind(text(end, "status")?)
            .bind(opt_text(end, "reason")?)
            .bind(opt_text(end, "cause")?)
            .bind(int(end, "t_ns")?),
        None => insert
            .bind(None::<String>)
            .bind(None::<String>)
            .bind(None::<String>)
            .bind(None::<i64>),
    };
    let tree = seal.map(|row| blob(&row, "tree_sha256")).transpose()?;
    insert.bind(tree).execute(&mut **conn).await?;
    Ok(number)
}
