//! Owns the description of a session's origin, as the report shows it.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use skinrig_analysis::result::Estimate;
use skinrig_model::level_bias::{LevelBias, SceneFigure};
use skinrig_model::{InvalidReason, LostTime, PreflightCheck, RunEnd};

/// Origin of the numbers of a report. The report shows empty strings as "not recorded".
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Provenance {
    /// ID of the session; appears in every figure.
    pub session_id: String,
    /// Hash of the session's content, of its seal; `None` without a seal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub content_sha256: Option<String>,
    /// Start, civil time, RFC 3339.
    pub started: String,
    /// Name of the pressed prototype.
    pub prototype: String,
    /// Person who ran the session.
    pub operator: String,
    /// Name of the protocol.
    pub protocol_name: String,
    /// Lower-case hex SHA-256 of the protocol's text.
    pub protocol_sha256: String,
    /// Values overridden on the command line, as `key=value`.
    pub overrides: Vec<String>,
    /// Lower-case hex SHA-256 of the plan.
    pub plan_sha256: String,
    /// Differences from the session's own settings; `None` for the official analysis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variant: Option<Variant>,
    /// What the selection of the variant changes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub selection: Option<SelectionEffect>,
    /// Seed of the run.
    pub seed: u64,
    /// `simulated`, `replayed`, `imported`, `emulated` or `bench`.
    pub rig_kind: String,
    /// Name of the rig, with the level of a simulated one.
    pub rig_name: String,
    /// Measured differences of the simulation level from the optical one, as known when the session was recorded.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub differences_from_optical: BTreeMap<SceneFigure, LevelBias>,
    /// True for a simulated rig, which the report states.
    pub simulated: bool,
    /// True for an emulated bench, which the report states.
    #[serde(default)]
    pub emulated: bool,
    /// Checks made before the robot was powered.
    #[serde(default)]
    pub preflight: Vec<PreflightCheck>,
    /// Devices in order of configuration.
    pub devices: Vec<DeviceRow>,
    /// skinrig version that recorded the session.
    pub software: String,
    /// Host name of the recording machine.
    pub host: String,
    /// The command line of the run.
    pub command_line: String,
    /// SHA-256 of the results, hex.
    pub results_hash: String,
    /// `completed`, `stopped`, `faulted`, or another state of the session (for example `not ended`).
    pub run_end: String,
    /// Why the run ended, unless it completed normally.
    pub run_end_reason: Option<String>,
    /// The end as kinds and fields; `None` before it.
    #[serde(default)]
    pub run_end_cause: Option<RunEnd>,
    /// Legs in order; a single one if the session was never resumed.
    #[serde(default)]
    pub legs: Vec<LegRow>,
    /// Superseded attempts, in plan order.
    #[serde(default)]
    pub retaken: Vec<RetakeRow>,
    /// Pauses, stops, aborts and faults.
    pub interruptions: Vec<InterruptionRow>,
    /// Operator notes.
    pub notes: Vec<NoteRow>,
    /// Bytes known to be lost, camera 1 and camera 2.
    pub lost_bytes: [u64; 2],
    /// Losses in stream order, camera 1 first.
    #[serde(default)]
    pub losses: Vec<LossRow>,
}

/// An analysis with settings other than the session's own.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Variant {
    /// Name; part of its file names.
    pub name: String,
    /// Settings that it overrides, as `key=value`.
    pub changed: Vec<String>,
    /// True if it uses the choices of the public code.
    #[serde(default)]
    pub reference_code: bool,
    /// Session whose calibration it corrects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration_from: Option<PathBuf>,
    /// Selection whose exclusions apply.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub selection: Option<SelectionName>,
}

/// A selection of sessions and presses.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SelectionName {
    /// Its name.
    pub name: String,
    /// Lower-case hex SHA-256 of its text.
    pub sha256: String,
    /// Its file.
    pub file: PathBuf,
}

impl fmt::Display for SelectionName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let short = self.sha256.get(..12).unwrap_or(&self.sha256);
        write!(f, "`{}` (SHA-256 {short})", self.name)
    }
}

/// What a selection changes in a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SelectionEffect {
    /// Number of presses that it excludes.
    pub excluded: u32,
    /// RMSE of the scored presses without the selection, all else equal.
    pub rmse_without_mm: Estimate,
}

impl Variant {
    /// What it changes besides the selection; `None` for nothing.
    #[must_use]
    pub fn changes(&self) -> Option<String> {
        let reference = self.reference_code;
        let reference = reference.then(|| "the choices of the public code".to_owned());
        let earlier = self.calibration_from.as_ref();
        let earlier = earlier.map(|session| format!("the calibration of {}", session.display()));
        let all = reference
            .into_iter()
            .chain(earlier)
            .chain(self.changed.iter().cloned());
        let all = all.collect::<Vec<_>>().join(", ");
        (!all.is_empty()).then_some(all)
    }

    /// Everything that it changes.
    #[must_use]
    pub fn changes_with_selection(&self) -> String {
        let selection = self
            .selection
            .as_ref()
            .map(|s| format!("the selection {s}"));
        let all: Vec<String> = selection.into_iter().chain(self.changes()).collect();
        match &all[..] {
            [] => "no changed settings".to_owned(),
            all => all.join(", "),
        }
    }
}

impl fmt::Display for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = &self.name;
        let changes = self.changes_with_selection();
        write!(
            f,
            "analysis `{name}`, not the session's own settings: {changes}"
        )
    }
}

/// Lost data of a camera.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LossRow {
    /// 1 or 2.
    pub camera: u8,
    /// Bytes known to be lost.
    pub bytes: u64,
    /// Time on the camera's clock.
    pub time: LostTime,
}

impl Provenance {
    /// `simulated` or `emulated` when no hardware was behind the session.
    pub(crate) const fn stand_in(&self) -> Option<&'static str> {
        match (self.simulated, self.emulated) {
            (true, _) => Some("simulated"),
            (false, true) => Some("emulated"),
            (false, false) => None,
        }
    }

    /// The legs, or nothing if there is only one.
    pub(crate) fn several_legs(&self) -> &[LegRow] {
        if self.legs.len() > 1 { &self.legs } else { &[] }
    }
}

/// One device.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct DeviceRow {
    /// Role, for example `camera1`.
    pub role: String,
    /// Maker and model.
    pub model: String,
    /// Serial number.
    pub serial: String,
    /// Firmware or library version.
    pub firmware: String,
}

/// A leg: the recording between two starts of the program.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LegRow {
    /// 1, 2, 3, ...
    pub number: u32,
    /// Start, civil time, RFC 3339.
    pub started: String,
    /// Start on the session's host clock, s.
    pub start_s: f64,
    /// How it ended: `completed`, `cut off`, `stopped: ...`, `faulted: ...` or `under way`.
    pub end: String,
    /// Civil time since the last record of the previous leg, s, accurate to about a second; `None` for the first leg, and if
    /// the rig's clock is not civil time.
    pub apart_s: Option<f64>,
}

/// A superseded attempt at a press.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RetakeRow {
    /// Number of the press, from 1.
    pub press: u32,
    /// Number of the attempt, from 1.
    pub attempt: u32,
    /// Why it was retaken.
    pub reason: String,
    /// The reason as kinds and fields; `None` without an outcome.
    #[serde(default)]
    pub cause: Option<InvalidReason>,
}

/// One interruption.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct InterruptionRow {
    /// Host time, s.
    pub t_s: f64,
    /// `pause`, `resume`, `stop`, `abort` or `fault`.
    pub kind: String,
    /// Reason given.
    pub reason: String,
    /// True if it ended the run.
    #[serde(default)]
    pub ended_run: bool,
}

/// An operator note.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct NoteRow {
    /// Host time, s.
    pub t_s: f64,
    /// Text of the note.
    pub text: String,
}
