//! Helpers of the whole-system tests: run a protocol on any rig into a session file.

use std::error::Error;
use std::path::Path;

use skinrig_controller::{ControlHandle, RecordSink, Run, RunReport, SinkFault};
use skinrig_device::Rig;
use skinrig_model::{CameraId, Record, RunHeader};
use skinrig_protocol::{Plan, Protocol};
use skinrig_recorder::SessionWriter;
use skinrig_results::RigDocument;

/// Error of a helper; tests only display it.
pub type Fault = Box<dyn Error>;

/// Parses a protocol and compiles its plan.
///
/// # Errors
/// All findings, if the text is not a valid protocol.
pub fn planned(text: &str) -> Result<(Protocol, Plan), Fault> {
    let no_files = |path: &Path| Err(std::io::Error::other(path.display().to_string()));
    let protocol = Protocol::parse("test.yaml", text.as_bytes(), &[], &no_files)
        .map_err(|found| found.render(false))?;
    let plan = protocol.compile();
    Ok((protocol, plan))
}

/// Header of a run of `plan` on `rig`.
///
/// # Errors
/// When something cannot be serialised as JSON.
pub fn header(protocol: &Protocol, plan: &Plan, rig: &Rig) -> Result<RunHeader, Fault> {
    let document = RigDocument {
        geometry: rig.geometry,
        analysis: protocol.analysis.clone(),
        rig: serde_json::from_str(&rig.description_json)?,
    };
    Ok(RunHeader {
        protocol_text: protocol.text.clone(),
        protocol_name: protocol.file_name.clone(),
        protocol_sha256: protocol.sha256.clone(),
        overrides: Vec::new(),
        plan_json: serde_json::to_string(plan)?,
        plan_sha256: plan.digest(),
        seed: protocol.seed,
        rig_kind: rig.kind.clone(),
        rig_name: rig.name.clone(),
        rig_json: serde_json::to_string(&document)?,
        robot_from_skin: rig.robot_from_skin,
        stream_formats: CameraId::ALL.map(|c| rig.cameras[c.index()].capabilities().format),
        prototype: protocol.prototype.id.clone(),
        operator: protocol.operator.clone(),
        started_at: "2026-01-01T00:00:00Z".into(),
        host: "test".into(),
        software: "skinrig tests".into(),
        command_line: String::new(),
        presses: plan.presses.clone(),
    })
}

/// Runs `plan` on `rig` into a new session at `path`. `watch` sees each record before it is written, and may stop the run.
///
/// # Errors
/// When the session cannot be created or sealed. The report states how the run ended.
pub fn record(
    protocol: &Protocol,
    plan: &Plan,
    rig: Rig,
    path: &Path,
    watch: impl FnMut(&Record, &ControlHandle),
) -> Result<RunReport, Fault> {
    let header = header(protocol, plan, &rig)?;
    let control = ControlHandle::new();
    let mut sink = ObservedSink {
        writer: SessionWriter::create(path)?,
        control: control.clone(),
        watch,
    };
    let report = Run::new(plan, header, rig, &control, &mut sink).execute();
    sink.writer.finish()?;
    Ok(report)
}

struct ObservedSink<W> {
    writer: SessionWriter,
    control: ControlHandle,
    watch: W,
}

impl<W: FnMut(&Record, &ControlHandle)> RecordSink for ObservedSink<W> {
    fn accept(&mut self, record: Record) -> Result<(), SinkFault> {
        (self.watch)(&record, &self.control);
        self.writer
            .accept(record)
            .map_err(|e| skinrig::sink::fault_of(&e))
    }
}
