//! Verification: recomputes every hash, count and fact that a session stores.

use std::path::Path;
use std::thread::ScopedJoinHandle;

use sha2::{Digest, Sha256};
use skinrig_model::{
    BoxReport, BoxTime, CameraId, ChunkFacts, HostTime, PlannedPress, PressId, PressVerdict,
    RunEnd, RunHeader, StreamFormat, TriggerEdge, press::PressRole,
};

mod chain;
mod edges;
mod gaps;
mod legs;
mod report;
mod seal;
mod sqlite;
mod stream;
mod truth;

pub use self::report::VerifyReport;
use self::stream::Stream;
use crate::error::RecorderError;
use crate::hex::hex;
use crate::problem::Problem;
use crate::reader::SessionReader;
use crate::rows::AttemptRow;

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
    let reader = match SessionReader::open(path) {
        Ok(reader) => reader,
        Err(
            e @ (RecorderError::Missing { .. }
            | RecorderError::Io { .. }
            | RecorderError::Empty { .. }),
        ) => return Err(e),
        Err(e) if e.is_system_failure() => return Err(e),
        Err(e) => {
            let mut report = VerifyReport::default();
            report.add(Problem::from(e));
            return Ok(report);
        }
    };
    if let Err(e @ RecorderError::Empty { .. }) = reader.session_id() {
        return Err(e);
    }
    let mut report = check_all::<S>(&reader);
    drop(reader);
    if let Some(failure) = report.system_failure {
        return Err(RecorderError::Unread(failure));
    }
    if report.sealed && report.is_sound() {
        seal::protect(path, &mut report);
    }
    Ok(report)
}

/// Compares the rows of a session that nothing seals with each other: header, journal, measured values.
///
/// # Errors
/// [`RecorderError::Contradictory`], [`RecorderError::Unread`].
pub(crate) fn check_unsealed(reader: &SessionReader) -> Result<(), RecorderError> {
    let mut report = VerifyReport::default();
    check_header(reader, &mut report);
    check_journal(reader, &mut report);
    truth::check_truth(reader, &mut report);
    if let Some(failure) = report.system_failure {
        return Err(RecorderError::Unread(failure));
    }
    let Some(first) = report.problems.first().cloned() else {
        return Ok(());
    };
    Err(RecorderError::Contradictory {
        path: reader.path().to_owned(),
        first: Box::new(first),
        problems: report.problems.len() as u64 + report.more_problems,
    })
}

/// Makes all checks, some in threads with a connection each. The order of problems does not depend on the threads.
fn check_all<S: ChunkScanner>(reader: &SessionReader) -> VerifyReport {
    let (header, formats) = section(|report| check_header(reader, report));
    // Before the edges: a session that is being written then has those of all these chunks.
    let streams = CameraId::ALL.map(|camera| {
        section(|report| Stream {
            camera,
            format: formats.map(|f| f[camera.index()]),
            index: report
                .ok_or_add(reader.chunk_index(camera))
                .unwrap_or_default(),
        })
    });
    let (sender, digest) = std::sync::mpsc::channel();
    std::thread::scope(|scope| {
        let edges = scope.spawn(move || edges::read(reader, &sender));
        let cameras = streams.each_ref().map(|(_, stream)| {
            scope.spawn(|| in_thread(reader, |reader, report| stream.check::<S>(reader, report)))
        });
        let seal = scope.spawn(move || {
            in_thread(reader, |reader, report| {
                seal::check(reader, &digest, report)
            })
        });
        let (mut report, ()) = section(|report| sqlite::check(reader, report));
        report.append(header);
        let (others, ()) = section(|report| {
            let poses = check_poses(reader, report);
            report.ok_or_add(poses);
            check_journal(reader, report);
            truth::check_truth(reader, report);
            legs::check(reader, report);
        });
        let (chain, ()) = section(|report| chain::check(reader, report));
        let edges = join(edges);
        for ((index, stream), camera) in streams.iter().zip(cameras) {
            let (mut found, decoded) = join(camera);
            if !edges.contain(stream.camera, &decoded) {
                // The edges of a chunk differ or cannot be read: find out which.
                (found, ()) = section(|report| stream.check_with_edges::<S>(reader, report));
            }
            report.append(index.clone());
            report.append(found);
        }
        for found in [others, join(seal).0, chain] {
            report.append(found);
        }
        report
    })
}

/// Runs a check with a report of its own.
fn section<T>(check: impl FnOnce(&mut VerifyReport) -> T) -> (VerifyReport, T) {
    let mut report = VerifyReport::default();
    let value = check(&mut report);
    (report, value)
}

/// Like [`section`], with a connection of its own.
fn in_thread<T: Default>(
    reader: &SessionReader,
    check: impl FnOnce(&SessionReader, &mut VerifyReport) -> T,
) -> (VerifyReport, T) {
    section(|report| {
        let reader = report.ok_or_add(reader.reopen());
        reader
            .map(|reader| check(&reader, report))
            .unwrap_or_default()
    })
}

fn join<T>(thread: ScopedJoinHandle<'_, T>) -> T {
    let result = thread.join();
    result.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

fn check_header(reader: &SessionReader, report: &mut VerifyReport) -> Option<[StreamFormat; 2]> {
    let header = report.ok_or_add(reader.header_as_it_is())?;
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
            report.mismatch("presses", expected, press.id);
            break;
        }
    }
    if let Some(devices) = report.ok_or_add(reader.devices())
        && devices.is_empty()
        && header.rig_kind != "imported"
        && matches!(reader.end(), Ok(Some((_, end))) if end.is_complete())
    {
        report.mismatch("device", "the devices of a completed run", "none");
    }
    Some(header.stream_formats)
}

fn check_poses(reader: &SessionReader, report: &mut VerifyReport) -> Result<(), RecorderError> {
    let (mut after, mut last) = (0, HostTime(i64::MIN));
    while let Some((id, samples)) = reader.pose_block_after(after)? {
        if let (Some(first), Some(end)) = (samples.first(), samples.last()) {
            if first.t < last {
                let place = format!("pose block {id}");
                report.mismatch(place, format!("times from {last}"), first.t);
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
        Err(e) => return report.mismatch("plan", "JSON with its presses", e),
    };
    if plan.presses.is_empty() {
        return;
    }
    report.expect_equal("press: rows", &plan.presses.len(), &header.presses.len());
    for (planned, row) in plan.presses.iter().zip(&header.presses) {
        if planned != row {
            report.mismatch(
                row.id,
                "the press of the stored plan",
                "a different location, depth or role",
            );
        }
    }
}

/// Checks the journal: phase times in order, consecutive attempt numbers, no open attempt after the run has ended.
fn check_journal(reader: &SessionReader, report: &mut VerifyReport) {
    let end = report.ok_or_add(reader.end()).flatten().map(|(_, end)| end);
    let (ended, completed) = (end.is_some(), end == Some(RunEnd::Completed));
    // Another check reports a missing header, and with it missing legs.
    let legs = reader.legs().unwrap_or_default();
    let leg_of = |attempt: &AttemptRow| {
        let intent = attempt.intent?;
        Some(legs.partition_point(|leg| leg.origin <= intent))
    };
    for (planned, attempts) in report.ok_or_add(reader.presses()).unwrap_or_default() {
        for (number, attempt) in (1u32..).zip(&attempts) {
            if attempt.id.number != number {
                report.mismatch(
                    planned.id,
                    format!("attempt {number}"),
                    format!("attempt {}", attempt.id.number),
                );
            }
            let verdict = attempt.outcome.as_ref().map(|o| &o.verdict);
            if matches!(verdict, Some(PressVerdict::Missed(_))) && attempt.intent.is_some() {
                report.mismatch(
                    attempt.id,
                    "no start of a press that was never attempted",
                    "one",
                );
            }
            if let Some(next) = attempts.get(number as usize) {
                match verdict {
                    None => {
                        report.mismatch(attempt.id, "a verdict for a repeated attempt", "none");
                    }
                    // Every leg repeats the sync presses.
                    Some(PressVerdict::Valid | PressVerdict::Excluded(_))
                        if planned.role != PressRole::Sync || leg_of(attempt) == leg_of(next) =>
                    {
                        report.mismatch(
                            attempt.id,
                            "no further attempt",
                            "one after a valid or excluded attempt",
                        );
                    }
                    Some(_) => {}
                }
            }
            if let Some(t) = attempt.outcome.as_ref().and_then(|o| o.timing) {
                let moments = [
                    t.approach, t.contact, t.at_depth, t.retract, t.release, t.clear,
                ];
                if !moments.is_sorted() {
                    report.mismatch(attempt.id, "phase times in order", "them out of order");
                }
            }
        }
        let last = attempts.last().and_then(|a| a.outcome.as_ref());
        if completed && last.is_some_and(|o| matches!(o.verdict, PressVerdict::Missed(_))) {
            report.mismatch(
                planned.id,
                "an attempt in a completed run",
                "a missed press",
            );
        }
        if ended && attempts.last().is_none_or(|a| a.outcome.is_none()) {
            report.mismatch(planned.id, "a verdict in an ended run", "none");
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
    for (taken, box_report) in report.ok_or_add(reader.box_reports()).unwrap_or_default() {
        let (like, at) = match box_report {
            BoxReport::Exchange { at, .. } => (0, at),
            BoxReport::Mark { at, .. } | BoxReport::Sync { at, .. } => (1, at),
            BoxReport::Input { at, .. } => (2, at),
            BoxReport::Reset { .. } => {
                last = [BoxTime::default(); 3];
                continue;
            }
        };
        if at < last[like] {
            report.mismatch(
                format!("box report received at {taken}"),
                format!("box times from {} µs without a reset", last[like].us),
                format!("{} µs", at.us),
            );
        }
        last[like] = at;
    }
}
