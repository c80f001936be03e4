//! Where a session's numbers come from, gathered for the report.

use skinrig_analysis::Analysis;
use skinrig_model::{RunEnd, RunHeader};
use skinrig_recorder::{RecorderError, SessionReader};
use skinrig_report::{DeviceRow, InterruptionRow, NoteRow, Provenance};

/// Reads the provenance block of a session.
///
/// # Errors
/// [`RecorderError`] when the session cannot be read.
pub fn provenance(
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
    let (run_end, run_end_reason) = match reader.end()? {
        None => (
            "not ended".to_owned(),
            Some(match skinrig_recorder::writer_of(reader.path()) {
                Some(writer) => format!("the run is under way, {writer} writes it"),
                None => "the run was cut off; `skinrig resume` goes on with it".to_owned(),
            }),
        ),
        Some((_, end)) => {
            let reason = match &end {
                RunEnd::Completed => None,
                RunEnd::Stopped(r) | RunEnd::Faulted(r) => Some(r.clone()),
            };
            (end.name().to_owned(), reason)
        }
    };
    let interruptions = reader
        .interruptions()?
        .into_iter()
        .map(|i| InterruptionRow {
            t_s: i.t.as_secs_f64(),
            kind: i.kind.name().to_owned(),
            reason: i.reason,
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
    for camera in skinrig_model::CameraId::ALL {
        lost_bytes[camera.index()] = reader
            .chunk_index(camera)?
            .iter()
            .map(|c| c.lost_before)
            .sum();
    }
    Ok(Provenance {
        session_id: reader.session_id()?,
        started: header.started_at.clone(),
        prototype: header.prototype.clone(),
        operator: header.operator.clone(),
        protocol_name: header.protocol_name.clone(),
        protocol_sha256: header.protocol_sha256.clone(),
        overrides: header.overrides.clone(),
        plan_sha256: header.plan_sha256.clone(),
        seed: header.seed,
        rig_kind: header.rig_kind.clone(),
        rig_name: header.rig_name.clone(),
        simulated: header.rig_name.contains("simulated"),
        // A replay keeps the name, not the kind.
        emulated: header.rig_kind == "emulated" || header.rig_name.contains("emulated"),
        preflight: reader.preflight()?,
        devices,
        software: header.software.clone(),
        host: header.host.clone(),
        command_line: header.command_line.clone(),
        results_hash: skinrig_analysis::results_hash(analysis),
        run_end,
        run_end_reason,
        interruptions,
        notes,
        lost_bytes,
    })
}
