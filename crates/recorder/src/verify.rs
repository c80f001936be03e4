//! Recomputes everything that a session claims about itself.

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

/// Decodes camera bytes for the check. This crate knows no event encoding, so the caller brings one.
pub trait ChunkScanner {
    /// What the next bytes of `camera` hold. Called for every chunk, per camera in stream order; state carries
    /// over from chunk to chunk (a word may be split).
    fn scan(
        &mut self,
        camera: CameraId,
        format: StreamFormat,
        bytes: &[u8],
    ) -> (ChunkFacts, Vec<TriggerEdge>);

    /// The next bytes of `camera` are the first of a further leg: nothing carries over from those before, and times count from
    /// `origin_us`. Called before their `scan`.
    fn restart(&mut self, camera: CameraId, format: StreamFormat, origin_us: u64);

    /// Bytes were lost between the previous chunk of `camera` and the next one: nothing that they may have changed carries over.
    /// Called before its `scan`, where the session tells the time that was lost.
    fn lost(&mut self, camera: CameraId, format: StreamFormat, bytes: u64);
}

/// Checks a session: SQLite's own integrity, foreign keys, protocol and plan digests, every chunk's checksum
/// and facts, every pose block, the order of everything, the journal, the counts, and of a sealed session the
/// tree hash and the hash of the whole file.
///
/// # Errors
/// [`RecorderError::Missing`] and [`RecorderError::Io`] when there is no file to read, [`RecorderError::Empty`] when nothing was ever
/// recorded in it, [`RecorderError::Unread`] when the machine could not read all of it. Everything that is wrong inside the file is a problem in the report.
pub fn verify(
    path: impl AsRef<Path>,
    scanner: &mut dyn ChunkScanner,
) -> Result<VerifyReport, RecorderError> {
    let path = path.as_ref();
    let mut report = VerifyReport::default();
    let reader = match SessionReader::open(path) {
        Ok(reader) => reader,
        Err(
            e @ (RecorderError::Missing { .. }
            | RecorderError::Io { .. }
            | RecorderError::Empty { .. }),
        ) => return Err(e),
        Err(e) if e.is_of_the_machine() => return Err(e),
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
        if let Err(e) = check_chunks(&reader, camera, format, scanner, &mut report) {
            report.add_error(e);
        }
    }
    if let Err(e) = check_poses(&reader, &mut report) {
        report.add_error(e);
    }
    check_journal(&reader, &mut report);
    legs::check(&reader, &mut report);
    report.totals = report.take_totals(&reader);
    seal::check(&reader, &mut report);
    chain::check(&reader, &mut report);
    drop(reader);
    if let Some(problem) = report.unread {
        return Err(RecorderError::Unread(problem));
    }
    if report.sealed && report.is_sound() {
        seal::protect(path, &mut report);
    }
    Ok(report)
}

impl VerifyReport {
    fn take_totals(&mut self, reader: &SessionReader) -> Option<SessionTotals> {
        self.take(reader.totals())
    }
}

fn check_sqlite(reader: &SessionReader, report: &mut VerifyReport) {
    let messages = reader.ask("checking its integrity", async |conn| {
        let messages: Vec<String> = sqlx::query_scalar("PRAGMA integrity_check")
            .fetch_all(&mut *conn)
            .await?;
        let mut problems: Vec<String> = messages.into_iter().filter(|m| m != "ok").collect();
        let orphans = sqlx::query("SELECT \"table\", parent FROM pragma_foreign_key_check");
        each_row(orphans, conn, |row| {
            let (child, parent) = (text(row, "table")?, text(row, "parent")?);
            problems.push(format!(
                "a row of {child} names a row of {parent} that is not there"
            ));
            Ok(())
        })
        .await?;
        Ok(problems)
    });
    for message in report.take(messages).unwrap_or_default() {
        report.add(format!("sqlite: {message}"));
    }
}

fn check_header(reader: &SessionReader, report: &mut VerifyReport) -> Option<[StreamFormat; 2]> {
    let header = report.take(reader.header())?;
    let digest = |text: &str| hex(&Sha256::digest(text.as_bytes()));
    report.equal(
        "protocol_sha256",
        &digest(&header.protocol_text),
        &header.protocol_sha256,
    );
    report.equal(
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
    if let Some(devices) = report.take(reader.devices())
        && devices.is_empty()
        && header.rig_kind != "imported"
        && matches!(reader.end(), Ok(Some((_, RunEnd::Completed))))
    {
        report.add("device: expected the devices of a completed run, found none");
    }
    Some(header.stream_formats)
}

fn check_chunks(
    reader: &SessionReader,
    camera: CameraId,
    format: Option<StreamFormat>,
    scanner: &mut dyn ChunkScanner,
    report: &mut VerifyReport,
) -> Result<(), RecorderError> {
    let (mut previous, mut host) = (None, HostTime(i64::MIN));
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
        let sound = reader.ask("checking a chunk", async |conn| {
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
            report.add(format!(
                "{place}: stored bytes are not those of stored_sha256"
            ));
        }
        let Some(bytes) = report.take(reader.chunk_bytes(camera, meta.seq)) else {
            continue;
        };
        let Some(format) = format else { continue };
        if let Some(origin_us) = meta.restart_us {
            scanner.restart(camera, format, origin_us);
        }
        if meta.lost_time.is_some() {
            scanner.lost(camera, format, meta.lost_before);
        }
        let (facts, edges) = scanner.scan(camera, format, &bytes);
        report.equal(&format!("{place}: facts"), &facts, &meta.facts);
        let recorded = reader.edges(camera, meta.seq as i64, meta.seq as i64)?;
        if edges != recorded {
            report.add(format!(
                "{place}: expected the {} trigger edges in its bytes, found {} others in trigger_edge",
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

/// The planned presses of the table are those of the stored plan, where the plan lists any under `presses`.
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
    report.equal("press: rows", &plan.presses.len(), &header.presses.len());
    for (planned, row) in plan.presses.iter().zip(&header.presses) {
        if planned != row {
            report.add(format!(
                "{}: expected what the stored plan says, found another place, depth or role",
                row.id
            ));
        }
    }
}

/// The journal: moments in order, lineage without holes, no open attempt once the run has ended.
fn check_journal(reader: &SessionReader, report: &mut VerifyReport) {
    let ended = report.take(reader.end()).flatten().is_some();
    // A missing header, and with it no legs, is told elsewhere.
    let legs = reader.legs().unwrap_or_default();
    let leg_of = |attempt: &AttemptRow| {
        let intent = attempt.intent?;
        Some(legs.partition_point(|leg| leg.origin <= intent))
    };
    for (planned, attempts) in report.take(reader.presses()).unwrap_or_default() {
        for (number, attempt) in (1u32..).zip(&attempts) {
            if attempt.id.number != number {
                report.add(format!("{}: expected attempt {number}", attempt.id));
            }
            let verdict = attempt.outcome.as_ref().map(|o| &o.verdict);
            if let Some(next) = attempts.get(number as usize) {
                match verdict {
                    None => report.add(format!(
                        "{}: expected a verdict of an attempt that was repeated, found none",
                        attempt.id
                    )),
                    // Sync presses are made again in every leg.
                    Some(PressVerdict::Valid | PressVerdict::Excluded(_))
                        if planned.role != PressRole::Sync || leg_of(attempt) == leg_of(next) =>
                    {
                        report.add(format!(
                            "{}: expected no further attempt, found the press made twice",
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
                        "{}: expected its moments in order, found others",
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
    report.take(reader.preflight());
    report.take(reader.commands());
    report.take(reader.marks_sent());
    check_box_reports(reader, report);
    report.take(reader.notes());
    report.take(reader.interruptions());
}

/// The box's clock never goes back but by a reset. Answers and events take different ways through the box, so each is
/// in order only among its like.
fn check_box_reports(reader: &SessionReader, report: &mut VerifyReport) {
    let mut last = [BoxTime::default(); 3];
    for (taken, said) in report.take(reader.box_reports()).unwrap_or_default() {
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
                "box report taken at {taken}: expected box times from {} µs without a reset, found {} µs",
                last[like].us, at.us
            ));
        }
        last[like] = at;
    }
}
