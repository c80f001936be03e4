//! Verification: recomputes every hash, count and fact that a session stores.

use std::path::Path;

use sha2::{Digest, Sha256};
use skinrig_model::{
    BoxReport, BoxTime, CameraId, ChunkFacts, HostTime, PlannedPress, PressId, PressVerdict,
    RunEnd, RunHeader, StreamFormat, TriggerEdge, press::PressRole,
};

mod chain;
mod gaps;
mod legs;
mod report;
mod seal;

pub use self::report::VerifyReport;
use crate::error::RecorderError;
use crate::hex::hex;
use crate::query::{each_row, sha, text};
use crate::reader::SessionReader;
use crate::rows::{AttemptRow, SessionTotals};

/// Decoder for the bytes of one camera. This crate decodes no events, so the caller supplies one.
pub trait ChunkScanner {
    /// A decoder at the start of a stream of `format`.
    fn new(format: StreamFormat) -> Self;

    /// Decodes the next bytes. Called for every chunk in stream order; state carries over between chunks, because a
    /// word may be split.
    fn scan(&mut self, bytes: &[u8]) -> (ChunkFacts, Vec<TriggerEdge>);

    /// Resets the decoder: the next bytes start a further leg, whose times count from `origin_us`. Called before their
    /// `scan`.
    fn restart(&mut self, origin_us: u64);

    /// Discards state that lost bytes may have changed. Called before the `scan` of the chunk that follows them,
    /// if the session records the time of the loss.
    fn lost(&mut self, bytes: u64);
}

/// Verifies a session: SQLite's integrity and foreign keys, protocol and plan digests, checksum and facts of every
/// chunk, pose blocks, the order of records, the journal and the counts. For a sealed session also the tree hash and
/// the hash of the whole file.
///
/// # Errors
/// [`RecorderError::Missing`] and [`RecorderError::Io`] if there is no readable file, [`RecorderError::Empty`] if it holds no records,
/// [`RecorderError::Unread`] if the system failed to read all of it. Everything wrong inside the file is a problem in the report.
pub fn verify<S: ChunkScanner>(path: impl AsRef<Path>) -> Result<VerifyReport, RecorderError> {
    let path = path.as_ref();
    let mut report = VerifyReport::default();
    let reader = match SessionReader::open(path) {
        Ok(reader) => reader,
        Err(
            e @ (RecorderError::Missing { .. }
            | RecorderError::Io { .. }
            | RecorderError::Empty { .. }),
        ) => return Err(e),
        Err(e) if e.is_system_failure() => return Err(e),
        Err(e) => {
            report.add(e);
            return Ok(report);
        }
    };
    if let Err(e @ RecorderError::Empty { .. }) = reader.session_id() {
        return Err(e);
    }
    check_sqlite(&reader, &mut report);
    let formats = check_header(&reader, &mut report);
    for camera in CameraId::ALL {
        let format = formats.map(|f| f[camera.index()]);
        if let Err(e) = check_chunks::<S>(&reader, camera, format, &mut report) {
            report.add_error(e);
        }
    }
    if let Err(e) = check_poses(&reader, &mut report) {
        report.add_error(e);
    }
    check_journal(&reader, &mut report);
    legs::check(&reader, &mut report);
    report.totals = report.read_totals(&reader);
    seal::check(&reader, &mut report);
    chain::check(&reader, &mut report);
    drop(reader);
    if let Some(problem) = report.system_failure {
        return Err(RecorderError::Unread(problem));
    }
    if report.sealed && report.is_sound() {
        seal::protect(path, &mut report);
    }
    Ok(report)
}

impl VerifyReport {
    fn read_totals(&mut self, reader: &SessionReader) -> Option<SessionTotals> {
        self.ok_or_add(reader.totals())
    }
}

fn check_sqlite(reader: &SessionReader, report: &mut VerifyReport) {
    let messages = reader.query("checking its integrity", async |conn| {
        let messages: Vec<String> = sqlx::query_scalar("PRAGMA integrity_check")
            .fetch_all(&mut *conn)
            .await?;
        let mut problems: Vec<String> = messages.into_iter().filter(|m| m != "ok").collect();
        let orphans = sqlx::query("SELECT \"table\", parent FROM pragma_foreign_key_check");
        each_row(orphans, conn, |row| {
            let (child, parent) = (text(row, "table")?, text(row, "parent")?);
            problems.push(format!(
                "a row of {child} refers to a missing row of {parent}"
            ));
            Ok(())
        })
        .await?;
        Ok(problems)
    });
    for message in report.ok_or_add(messages).unwrap_or_default() {
        report.add(format!("sqlite: {message}"));
    }
}

fn check_header(reader: &SessionReader, report: &mut VerifyReport) -> Option<[StreamFormat; 2]> {
    let header = report.ok_or_add(reader.header())?;
    let digest = |text: &str| hex(&Sha256::digest(text.as_bytes()));
    report.expect_equal(
        "protocol_sha256",
        &digest(&header.protocol_text),
        &header.protocol_sha256,
    );
    report.expect_equal(
        "plan_sha256",
        &digest(&header.plan_json),
        &header.plan_sha256,
    );
    check_plan(&header, report);
    for (index, press) in (0u32..).zip(&header.presses) {
        let expected = PressId::from_index(index);
        if press.id != expected {
            report.add(format!("presses: expected {expected}, found {}", press.id));
            break;
        }
    }
    if let Some(devices) = report.ok_or_add(reader.devices())
        && devices.is_empty()
        && header.rig_kind != "imported"
        && matches!(reader.end(), Ok(Some((_, RunEnd::Completed))))
    {
        report.add("device: expected the devices of a completed run, found none");
    }
    Some(header.stream_formats)
}

fn check_chunks<S: ChunkScanner>(
    reader: &SessionReader,
    camera: CameraId,
    format: Option<StreamFormat>,
    report: &mut VerifyReport,
) -> Result<(), RecorderError> {
    let (mut previous, mut host) = (None, HostTime(i64::MIN));
    let mut scanner = format.map(S::new);
    let index = reader.chunk_index(camera)?;
    gaps::check(camera, &index, report);
    for meta in index {
        let place = format!("{camera} chunk {}", meta.seq);
        let expected = previous.map_or(0, |p| p + 1);
        if meta.seq != expected {
            report.add(format!(
                "{camera}: expected chunk {expected}, found chunk {}",
                meta.seq
            ));
        }
        if meta.host_time < host {
            report.add(format!(
                "{place}: expected host time from {host}, found {}",
                meta.host_time
            ));
        }
        (previous, host) = (Some(meta.seq), meta.host_time);
        let sound = reader.query("checking a chunk", async |conn| {
            let row =
                sqlx::query("SELECT stored, stored_sha256 FROM chunk WHERE camera = ? AND seq = ?")
                    .bind(camera.number())
                    .bind(meta.seq as i64)
                    .fetch_one(conn)
                    .await?;
            let stored = crate::query::blob(&row, "stored")?;
            Ok(Sha256::digest(&stored).as_slice() == sha(&row, "stored_sha256")?)
        })?;
        if !sound {
            report.add(format!("{place}: stored bytes do not match stored_sha256"));
        }
        let Some(bytes) = report.ok_or_add(reader.chunk_bytes(camera, meta.seq)) else {
            continue;
        };
        let Some(scanner) = &mut scanner else {
            continue;
        };
        if let Some(origin_us) = meta.restart_us {
            scanner.restart(origin_us);
        }
        if meta.lost_time.is_some() {
            scanner.lost(meta.lost_before);
        }
        let (facts, edges) = scanner.scan(&bytes);
        report.expect_equal(&format!("{place}: facts"), &facts, &meta.facts);
        let recorded = reader.edges(camera, meta.seq as i64, meta.seq as i64)?;
        if edges != recorded {
            report.add(format!(
                "{place}: expected the {} trigger edges in its bytes, found {} different ones in trigger_edge",
                edges.len(),
                recorded.len()
            ));
        }
    }
    Ok(())
}

fn check_poses(reader: &SessionReader, report: &mut VerifyReport) -> Result<(), RecorderError> {
    let (mut after, mut last) = (0, HostTime(i64::MIN));
    while let Some((id, samples)) = reader.pose_block_after(after)? {
        if let (Some(first), Some(end)) = (samples.first(), samples.last()) {
            if first.t < last {
                report.add(format!(
                    "pose block {id}: expected times from {last}, found {}",
                    first.t
                ));
            }
            last = end.t;
        }
        after = id;
    }
    Ok(())
}

/// Checks that the planned presses match the stored plan, if the plan lists any under `presses`.
fn check_plan(header: &RunHeader, report: &mut VerifyReport) {
    #[derive(serde::Deserialize)]
    struct Presses {
        #[serde(default)]
        presses: Vec<PlannedPress>,
    }
    let plan = match serde_json::from_str::<Presses>(&header.plan_json) {
        Ok(plan) => plan,
        Err(e) => return report.add(format!("plan: expected JSON with its presses, found: {e}")),
    };
    if plan.presses.is_empty() {
        return;
    }
    report.expect_equal("press: rows", &plan.presses.len(), &header.presses.len());
    for (planned, row) in plan.presses.iter().zip(&header.presses) {
        if planned != row {
            report.add(format!(
                "{}: expected the press of the stored plan, found a different location, depth or role",
                row.id
            ));
        }
    }
}

/// Checks the journal: phase times in order, consecutive attempt numbers, no open attempt after the run has ended.
fn check_journal(reader: &SessionReader, report: &mut VerifyReport) {
    let ended = report.ok_or_add(reader.end()).flatten().is_some();
    // Another check reports a missing header, and with it missing legs.
    let legs = reader.legs().unwrap_or_default();
    let leg_of = |attempt: &AttemptRow| {
        let intent = attempt.intent?;
        Some(legs.partition_point(|leg| leg.origin <= intent))
    };
    for (planned, attempts) in report.ok_or_add(reader.presses()).unwrap_or_default() {
        for (number, attempt) in (1u32..).zip(&attempts) {
            if attempt.id.number != number {
                report.add(format!("{}: expected attempt {number}", attempt.id));
            }
            let verdict = attempt.outcome.as_ref().map(|o| &o.verdict);
            if let Some(next) = attempts.get(number as usize) {
                match verdict {
                    None => report.add(format!(
                        "{}: expected a verdict for a repeated attempt, found none",
                        attempt.id
                    )),
                    // Every leg repeats the sync presses.
                    Some(PressVerdict::Valid | PressVerdict::Excluded(_))
                        if planned.role != PressRole::Sync || leg_of(attempt) == leg_of(next) =>
                    {
                        report.add(format!(
                            "{}: expected no further attempt, found one after a valid or excluded attempt",
                            attempt.id
                        ));
                    }
                    Some(_) => {}
                }
            }
            if let Some(t) = attempt.outcome.as_ref().and_then(|o| o.timing) {
                let moments = [
                    t.approach, t.contact, t.at_depth, t.retract, t.release, t.clear,
                ];
                if !moments.is_sorted() {
                    report.add(format!(
                        "{}: expected phase times in order, found them out of order",
                        attempt.id
                    ));
                }
            }
        }
        if ended && attempts.last().is_none_or(|a| a.outcome.is_none()) {
            report.add(format!(
                "{}: expected a verdict in an ended run, found none",
                planned.id
            ));
        }
    }
    report.ok_or_add(reader.preflight());
    report.ok_or_add(reader.commands());
    report.ok_or_add(reader.marks_sent());
    check_box_reports(reader, report);
    report.ok_or_add(reader.notes());
    report.ok_or_add(reader.interruptions());
}

/// Checks that the box's clock never goes back without a reset. Answers and events take different paths through the box, so
/// each kind is in order only among its own.
fn check_box_reports(reader: &SessionReader, report: &mut VerifyReport) {
    let mut last = [BoxTime::default(); 3];
    for (taken, said) in report.ok_or_add(reader.box_reports()).unwrap_or_default() {
        let (like, at) = match said {
            BoxReport::Exchange { at, .. } => (0, at),
            BoxReport::Mark { at, .. } | BoxReport::Sync { at, .. } => (1, at),
            BoxReport::Input { at, .. } => (2, at),
            BoxReport::Reset { .. } => {
                last = [BoxTime::default(); 3];
                continue;
            }
        };
        if at < last[like] {
            report.add(format!(
                "box report received at {taken}: expected box times from {} µs without a reset, found {} µs",
                last[like].us, at.us
            ));
        }
        last[like] = at;
    }
}
