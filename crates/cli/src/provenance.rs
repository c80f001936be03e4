//! Reads the provenance of a session's numbers for the report.

use crate::rig::bench::TOLERATED;
use chrono::DateTime;
use skinrig_analysis::Analysis;
use skinrig_model::{HostTime, InterruptionReason, PressVerdict, RunHeader, Setting};
use skinrig_recorder::{RecorderError, SessionReader};
use skinrig_report::{DeviceRow, InterruptionRow, LegRow, LossRow, NoteRow, Provenance, RetakeRow};
use skinrig_results::{Origin, differences_from_optical};

/// What the data of a session come from: `simulated, optical`.
pub(crate) fn origin_in_words(header: &RunHeader) -> String {
    let kind = Origin::of(header).map_or("of unknown origin", Origin::name);
    if header.rig_name.starts_with(kind) {
        header.rig_name.clone()
    } else {
        format!("{kind}, {}", header.rig_name)
    }
}

/// Reads the provenance block of a session.
///
/// # Errors
/// [`RecorderError`] when the session cannot be read.
pub(crate) fn provenance(
    reader: &SessionReader,
    header: &RunHeader,
    analysis: &Analysis,
) -> Result<Provenance, RecorderError> {
    let devices = reader
        .devices()?
        .into_iter()
        .map(|d| DeviceRow {
            role: d.role.name().to_owned(),
            model: d.identity.model,
            serial: d.identity.serial,
            firmware: d.identity.firmware,
        })
        .collect();
    let end = reader.end()?.map(|(_, end)| end);
    let (run_end, run_end_reason) = match &end {
        None => (
            "not ended".to_owned(),
            Some(match skinrig_recorder::writer_of(reader.path()) {
                Some(writer) => format!("the run is under way, {writer} writes it"),
                None => "the run was cut off; `skinrig resume` continues it".to_owned(),
            }),
        ),
        Some(end) => (end.name().to_owned(), end.reason()),
    };
    let ended_run = |reason: &InterruptionReason| match (reason, &end) {
        (InterruptionReason::End(reason), Some(end)) => reason == end,
        _ => false,
    };
    let interruptions = reader
        .interruptions()?
        .into_iter()
        .map(|i| InterruptionRow {
            t_s: i.t.as_secs_f64(),
            kind: i.kind.name().to_owned(),
            reason: i.reason.to_string(),
            ended_run: ended_run(&i.reason),
        })
        .collect();
    let notes = reader
        .notes()?
        .into_iter()
        .map(|n| NoteRow {
            t_s: n.t.as_secs_f64(),
            text: n.text,
        })
        .collect();
    let mut lost_bytes = [0; 2];
    let mut losses = Vec::new();
    for camera in skinrig_model::CameraId::ALL {
        lost_bytes[camera.index()] = reader
            .chunk_index(camera)?
            .iter()
            .map(|c| c.lost_before)
            .sum();
        losses.extend(reader.losses(camera)?.iter().map(|loss| LossRow {
            camera: camera.number(),
            bytes: loss.bytes,
            time: loss.time,
        }));
    }
    let origin = Origin::of(header);
    Ok(Provenance {
        session_id: reader.session_id()?,
        content_sha256: reader.seal()?.map(|seal| seal.content_sha256()),
        started: header.started_at.clone(),
        prototype: header.prototype.clone(),
        operator: header.operator.clone(),
        protocol_name: header.protocol_name.clone(),
        protocol_sha256: header.protocol_sha256.clone(),
        overrides: header.overrides.clone(),
        variant: None,
        selection: None,
        plan_sha256: header.plan_sha256.clone(),
        seed: header.seed,
        rig_kind: header.rig_kind.clone(),
        rig_name: rig_name(reader, header)?,
        differences_from_optical: differences_from_optical(header),
        simulated: origin == Some(Origin::Simulated),
        emulated: origin == Some(Origin::Emulated),
        preflight: reader.preflight()?,
        devices,
        software: header.software.clone(),
        host: header.host.clone(),
        command_line: header.command_line.clone(),
        results_hash: skinrig_analysis::results_hash(analysis),
        run_end,
        run_end_reason,
        run_end_cause: end,
        legs: legs(reader, header)?,
        retaken: retaken(reader)?,
        interruptions,
        notes,
        lost_bytes,
        losses,
    })
}

/// Name of the rig in the first leg, marked if mismatches were tolerated only in a later one.
fn rig_name(reader: &SessionReader, header: &RunHeader) -> Result<String, RecorderError> {
    let mut name = header.rig_name.clone();
    let devices = reader.devices()?;
    let legs = reader.legs()?;
    let first_leg = legs.get(1).map_or(devices.len(), |leg| leg.devices_before);
    let (first, later) = devices.split_at(first_leg.min(devices.len()));
    let tolerated = |devices: &[skinrig_recorder::DeviceRow]| {
        let mut settings = devices.iter().flat_map(|d| &d.settings);
        settings.any(|s| s.requested == Setting::TOLERATED)
    };
    if tolerated(later) && !tolerated(first) {
        name.push_str(TOLERATED);
        name.push_str(" in a later leg");
    }
    Ok(name)
}

/// Assumed pause between the end of a leg that was cut off and the next one's origin, s: the recorder leaves one to two seconds.
const PAUSE_S: f64 = 1.5;

/// The legs, for the report.
fn legs(reader: &SessionReader, header: &RunHeader) -> Result<Vec<LegRow>, RecorderError> {
    let rows = reader.legs()?;
    let civil = |text: &str| DateTime::parse_from_rfc3339(text).ok();
    // A simulated rig's clock runs as fast as it can be computed.
    let is_civil = header.rig_kind != "simulated";
    let apart_s = |i: usize| {
        let (before, leg) = (rows.get(i.checked_sub(1)?)?, &rows[i]);
        let apart = civil(&leg.began.started_at)? - civil(&before.began.started_at)?;
        let last: HostTime = before.end.as_ref().map_or(leg.origin, |(t, _)| *t);
        let pause_s = if before.end.is_some() { 0.0 } else { PAUSE_S };
        let ran_s = last.as_secs_f64() - before.origin.as_secs_f64() - pause_s;
        Some(apart.as_seconds_f64() - ran_s)
    };
    let end = |i: usize| match &rows[i].end {
        Some((_, end)) => match end.reason() {
            None => end.name().to_owned(),
            Some(why) => format!("{}: {why}", end.name()),
        },
        None if i + 1 == rows.len() && skinrig_recorder::writer_of(reader.path()).is_some() => {
            "under way".to_owned()
        }
        None => "cut off".to_owned(),
    };
    let leg_rows = rows.iter().enumerate().map(|(i, leg)| LegRow {
        number: leg.number,
        started: leg.began.started_at.clone(),
        start_s: leg.origin.as_secs_f64(),
        end: end(i),
        apart_s: apart_s(i).filter(|_| is_civil),
    });
    Ok(leg_rows.collect())
}

/// Attempts that failed and were replaced. Sync presses that a further leg repeats do not count.
fn retaken(reader: &SessionReader) -> Result<Vec<RetakeRow>, RecorderError> {
    let mut rows = Vec::new();
    for (planned, attempts) in reader.presses()? {
        let replaced = attempts
            .split_last()
            .map_or(&[][..], |(_, earlier)| earlier);
        for attempt in replaced.iter().filter(|a| a.intent.is_some()) {
            let verdict = attempt.outcome.as_ref().map(|o| &o.verdict);
            if verdict == Some(&PressVerdict::Valid) {
                continue;
            }
            let reason = verdict.and_then(PressVerdict::reason);
            rows.push(RetakeRow {
                press: planned.id.number(),
                attempt: attempt.id.number,
                reason: reason.unwrap_or_else(|| "no outcome".to_owned()),
                cause: match verdict {
                    Some(PressVerdict::Invalid(reason)) => Some(reason.clone()),
                    _ => None,
                },
            });
        }
    }
    Ok(rows)
}
