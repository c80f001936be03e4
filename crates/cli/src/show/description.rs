//! Description of a session for `skinrig show`; serialized unchanged for `--json`.

use std::path::{Path, PathBuf};

use serde::{Serialize, Serializer};
use skinrig_analysis::result::Estimate;
use skinrig_model::{
    CameraId, InterruptionKind, LocationId, Notification, PlannedPress, PreflightCheck, PressId,
    PressRole, PressVerdict, RepetitionId, RunEnd,
};
use skinrig_recorder::{
    AttemptRow, DeviceRow, LegRow, Loss, RecorderError, SessionReader, SessionTotals,
};

use crate::analyses::AnalysisFile;
use crate::args::ShowArgs;

/// A session.
#[derive(Serialize)]
pub(super) struct Description {
    pub session: PathBuf,
    pub id: String,
    pub sealed: bool,
    /// The process that writes it now.
    pub written_by: Option<String>,
    pub started_at: String,
    pub prototype: String,
    pub operator: String,
    pub protocol: String,
    pub protocol_sha256: String,
    pub overrides: Vec<String>,
    pub plan_sha256: String,
    pub seed: u64,
    pub rig_kind: String,
    pub rig: String,
    pub host: String,
    pub software: String,
    pub command_line: String,
    pub totals: SessionTotals,
    pub legs: Vec<Leg>,
    pub devices: Vec<Device>,
    pub cameras: Vec<Camera>,
    /// Time, s; kind; reason.
    pub interruptions: Vec<(f64, &'static str, String)>,
    /// Time, s; text.
    pub notes: Vec<(f64, String)>,
    /// Messages about the ends of its legs.
    pub notifications: Vec<Notification>,
    /// `completed`, `stopped` or `faulted`; `None` without an end.
    pub end: Option<&'static str>,
    pub end_reason: Option<String>,
    /// The same as kinds and fields.
    #[serde(serialize_with = "end_cause")]
    pub end_cause: Option<RunEnd>,
    pub duration_s: Option<f64>,
    pub preflight: Vec<PreflightCheck>,
    pub analyses: Vec<Analysis>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub protocol_text: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub presses: Option<Vec<Press>>,
}

/// A leg: when it began, by whom, how it ended, and which attempts it cut off.
#[derive(Serialize)]
pub(super) struct Leg {
    pub leg: u32,
    pub started_at: String,
    pub operator: String,
    pub host: String,
    pub software: String,
    pub command_line: String,
    pub from_s: f64,
    pub end: Option<&'static str>,
    pub end_reason: Option<String>,
    #[serde(serialize_with = "end_cause")]
    pub end_cause: Option<RunEnd>,
    pub attempts: usize,
    /// As `press/attempt`.
    pub cut_off: Vec<String>,
}

/// A device with its settings: name, requested value, value read back.
#[derive(Serialize)]
pub(super) struct Device {
    pub role: &'static str,
    pub model: String,
    pub serial: String,
    pub firmware: String,
    pub settings: Vec<(String, String, String)>,
}

/// The stream of a camera.
#[derive(Serialize)]
pub(super) struct Camera {
    pub camera: u8,
    pub format: &'static str,
    pub chunks: usize,
    pub bytes: u64,
    pub stored_bytes: u64,
    pub events: u64,
    pub trigger_edges: u64,
    pub lost_bytes: u64,
    pub losses: Vec<LostBytes>,
}

/// Bytes that a camera lost, and when.
#[derive(Serialize)]
pub(super) struct LostBytes {
    pub chunk: u64,
    pub bytes: u64,
    pub from_us: Option<u64>,
    pub to_us: Option<u64>,
    pub time: String,
}

/// An analysis whose results are beside the session.
#[derive(Serialize)]
pub(super) struct Analysis {
    /// `None`: the official one.
    pub name: Option<String>,
    pub results: PathBuf,
    #[serde(flatten)]
    pub found: AnalysisContent,
}

/// Content of its results file.
#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum AnalysisContent {
    /// Its numbers.
    Summary {
        rmse_mm: Estimate,
        valid: bool,
        faults: Vec<String>,
        analysis_version: u32,
        /// Changes of a variant.
        changes: Option<String>,
    },
    /// Why the numbers cannot be read.
    Trouble { trouble: String },
}

/// A press with the result of its last attempt.
#[derive(Serialize)]
pub(super) struct Press {
    pub press: PressId,
    pub role: PressRole,
    pub repetition: RepetitionId,
    pub location: LocationId,
    pub x_mm: f64,
    pub y_mm: f64,
    pub depth_mm: f64,
    pub attempts: usize,
    /// Number, verdict and reason of each earlier attempt.
    pub earlier: Vec<(u32, &'static str, Option<String>)>,
    pub verdict: &'static str,
    pub reason: Option<String>,
    /// The reason as kinds and fields.
    #[serde(serialize_with = "verdict_cause")]
    pub cause: Option<PressVerdict>,
    pub contact_s: Option<f64>,
    pub measured_depth_mm: Option<f64>,
    pub touched_mm: Option<f64>,
}

fn end_cause<S: Serializer>(end: &Option<RunEnd>, to: S) -> Result<S::Ok, S::Error> {
    end.as_ref().and_then(RunEnd::cause).serialize(to)
}

fn verdict_cause<S: Serializer>(verdict: &Option<PressVerdict>, to: S) -> Result<S::Ok, S::Error> {
    verdict.as_ref().and_then(PressVerdict::cause).serialize(to)
}

/// The verdict of an attempt without an outcome.
const OPEN: &str = "open";

impl Description {
    pub(super) fn read(args: &ShowArgs) -> Result<Self, RecorderError> {
        let reader = SessionReader::open_unchanged(&args.session)?;
        let header = reader.header()?;
        let id = reader.session_id()?;
        let end = reader.end()?;
        let rows = reader.presses()?;
        let camera = |camera| {
            Camera::read(
                &reader,
                camera,
                header.stream_formats[camera.index()].name(),
            )
        };
        let interruptions = reader.interruptions()?.into_iter();
        let notes = reader.notes()?.into_iter();
        Ok(Self {
            notifications: reader.notifications()?,
            sealed: reader.seal()?.is_some(),
            written_by: skinrig_recorder::writer_of(&args.session),
            totals: reader.totals()?,
            legs: legs(&reader.legs()?, &rows),
            devices: reader.devices()?.into_iter().map(Device::from).collect(),
            cameras: CameraId::ALL
                .into_iter()
                .map(camera)
                .collect::<Result<_, _>>()?,
            interruptions: interruptions
                .map(|i| {
                    (
                        i.t.as_secs_f64(),
                        InterruptionKind::name(i.kind),
                        i.reason.to_string(),
                    )
                })
                .collect(),
            notes: notes.map(|n| (n.t.as_secs_f64(), n.text)).collect(),
            end: end.as_ref().map(|(_, end)| end.name()),
            end_reason: end.as_ref().and_then(|(_, end)| end.reason()),
            end_cause: end.as_ref().map(|(_, end)| end.clone()),
            duration_s: end.as_ref().map(|(t, _)| t.as_secs_f64()),
            preflight: reader.preflight()?,
            analyses: analyses(&args.session, &id),
            presses: args.presses.then(|| rows.iter().map(Press::of).collect()),
            protocol_text: args.protocol.then_some(header.protocol_text),
            session: args.session.clone(),
            id,
            started_at: header.started_at,
            prototype: header.prototype,
            operator: header.operator,
            protocol: header.protocol_name,
            protocol_sha256: header.protocol_sha256,
            overrides: header.overrides,
            plan_sha256: header.plan_sha256,
            seed: header.seed,
            rig_kind: header.rig_kind,
            rig: header.rig_name,
            host: header.host,
            software: header.software,
            command_line: header.command_line,
        })
    }
}

fn legs(legs: &[LegRow], presses: &[(PlannedPress, Vec<AttemptRow>)]) -> Vec<Leg> {
    let row = |(i, leg): (usize, &LegRow)| {
        let next = legs.get(i + 1).map(|next| next.origin);
        let within = |a: &&AttemptRow| {
            a.intent
                .is_some_and(|t| t >= leg.origin && next.is_none_or(|next| t < next))
        };
        let attempts = presses.iter().flat_map(|(_, attempts)| attempts);
        let own: Vec<&AttemptRow> = attempts.filter(within).collect();
        let cut_off = |a: &&&AttemptRow| a.outcome.as_ref().is_none_or(|o| o.verdict.is_cut_off());
        let end = leg.end.as_ref().map(|(_, end)| end);
        Leg {
            leg: leg.number,
            started_at: leg.began.started_at.clone(),
            operator: leg.began.operator.clone(),
            host: leg.began.host.clone(),
            software: leg.began.software.clone(),
            command_line: leg.began.command_line.clone(),
            from_s: leg.origin.as_secs_f64(),
            end: end.map(|end| end.name()),
            end_reason: end.and_then(|end| end.reason()),
            end_cause: end.cloned(),
            attempts: own.len(),
            cut_off: own
                .iter()
                .filter(cut_off)
                .map(|a| a.id.to_string())
                .collect(),
        }
    };
    legs.iter().enumerate().map(row).collect()
}

impl From<DeviceRow> for Device {
    fn from(row: DeviceRow) -> Self {
        let settings = row.settings.into_iter();
        Self {
            role: row.role.name(),
            model: row.identity.model,
            serial: row.identity.serial,
            firmware: row.identity.firmware,
            settings: settings
                .map(|s| (s.name, s.requested, s.read_back))
                .collect(),
        }
    }
}

impl Camera {
    fn read(
        reader: &SessionReader,
        camera: CameraId,
        format: &'static str,
    ) -> Result<Self, RecorderError> {
        let chunks = reader.chunk_index(camera)?;
        let losses = reader.losses(camera)?;
        Ok(Self {
            camera: camera.number(),
            format,
            chunks: chunks.len(),
            bytes: chunks.iter().map(|c| c.raw_bytes).sum(),
            stored_bytes: chunks.iter().map(|c| c.stored_bytes).sum(),
            events: chunks.iter().map(|c| c.facts.cd_events).sum(),
            trigger_edges: chunks.iter().map(|c| c.facts.trigger_edges).sum(),
            lost_bytes: chunks.iter().map(|c| c.lost_before).sum(),
            losses: losses.iter().map(LostBytes::of).collect(),
        })
    }
}

impl LostBytes {
    fn of(loss: &Loss) -> Self {
        Self {
            chunk: loss.seq,
            bytes: loss.bytes,
            from_us: loss.time.from_us,
            to_us: loss.time.to_us,
            time: loss.time.to_string(),
        }
    }
}

/// The analyses beside a session: the official one first, then the variants with what they change.
fn analyses(session: &Path, id: &str) -> Vec<Analysis> {
    let row = |listed: AnalysisFile| Analysis {
        name: listed.name,
        results: listed.results,
        found: match listed.summary {
            Ok(summary) => AnalysisContent::Summary {
                rmse_mm: summary.rmse_mm,
                valid: summary.valid,
                faults: summary.faults,
                analysis_version: summary.analysis_version,
                changes: summary.variant.map(|v| v.to_string()),
            },
            Err(why) => AnalysisContent::Trouble {
                trouble: why.to_string(),
            },
        },
    };
    crate::analyses::all(session, id)
        .into_iter()
        .map(row)
        .collect()
}

impl Press {
    fn of((planned, attempts): &(PlannedPress, Vec<AttemptRow>)) -> Self {
        let verdict = |attempt: &AttemptRow| {
            let verdict = attempt.outcome.as_ref().map(|o| &o.verdict);
            let reason = verdict.and_then(|v| v.reason());
            (verdict.map_or(OPEN, |v| v.name()), reason)
        };
        let earlier = attempts
            .split_last()
            .map_or(&[][..], |(_, earlier)| earlier);
        let outcome = attempts.last().and_then(|a| a.outcome.as_ref());
        let (last, reason) = attempts.last().map_or((OPEN, None), verdict);
        Self {
            press: planned.id,
            role: planned.role,
            repetition: planned.repetition,
            location: planned.location,
            x_mm: planned.at.x_mm,
            y_mm: planned.at.y_mm,
            depth_mm: planned.depth_mm,
            attempts: attempts.len(),
            earlier: earlier
                .iter()
                .map(|attempt| {
                    let (verdict, reason) = verdict(attempt);
                    (attempt.id.number, verdict, reason)
                })
                .collect(),
            verdict: last,
            reason,
            cause: outcome.map(|o| o.verdict.clone()),
            contact_s: outcome
                .and_then(|o| o.timing)
                .map(|t| t.contact.as_secs_f64()),
            measured_depth_mm: outcome.and_then(|o| o.measured_depth_mm),
            touched_mm: outcome.and_then(|o| o.touched_mm),
        }
    }
}
