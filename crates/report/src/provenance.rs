//! Owns the plain description of where a session comes from, as the report shows it.

use std::fmt;

use serde::{Deserialize, Serialize};
use skinrig_model::{LostTime, PreflightCheck};

/// Where the numbers of a report come from. Plain strings; empty strings are shown as "not recorded".
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Provenance {
    /// Identifier of the session; appears in every figure.
    pub session_id: String,
    /// Civil time of the start, RFC 3339.
    pub started: String,
    /// Which prototype was pressed.
    pub prototype: String,
    /// Who ran the session.
    pub operator: String,
    /// Name of the protocol.
    pub protocol_name: String,
    /// Lower-case hex SHA-256 of the protocol's text.
    pub protocol_sha256: String,
    /// Values overridden on the command line, as `key=value`.
    pub overrides: Vec<String>,
    /// Lower-case hex SHA-256 of the plan.
    pub plan_sha256: String,
    /// What this analysis changed of the session's own settings; `None` for the official one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variant: Option<Variant>,
    /// The seed of the run.
    pub seed: u64,
    /// `simulated`, `replayed`, `imported`, `emulated` or `bench`.
    pub rig_kind: String,
    /// Name of the rig, with the level of a simulated one.
    pub rig_name: String,
    /// True when the rig was simulated: the report then says so plainly.
    pub simulated: bool,
    /// True when stand-ins stood behind the drivers: the report then says so plainly.
    #[serde(default)]
    pub emulated: bool,
    /// What was checked before the robot was powered.
    #[serde(default)]
    pub preflight: Vec<PreflightCheck>,
    /// The devices, in the order in which they were configured.
    pub devices: Vec<DeviceRow>,
    /// Version of skinrig that recorded the session.
    pub software: String,
    /// Host name of the recording machine.
    pub host: String,
    /// The command line of the run.
    pub command_line: String,
    /// SHA-256 of the results, hex.
    pub results_hash: String,
    /// `completed`, `stopped`, `faulted`, or what the session says instead (for example `not ended`).
    pub run_end: String,
    /// Why the run ended, when it did not simply complete.
    pub run_end_reason: Option<String>,
    /// The legs in order; one alone when the session never went on.
    #[serde(default)]
    pub legs: Vec<LegRow>,
    /// Attempts that another one replaced, in the plan's order.
    #[serde(default)]
    pub retaken: Vec<RetakenRow>,
    /// Everything that broke the normal course.
    pub interruptions: Vec<InterruptionRow>,
    /// Remarks.
    pub notes: Vec<NoteRow>,
    /// Bytes known to be lost, camera 1 and camera 2.
    pub lost_bytes: [u64; 2],
    /// When they were lost, in the order of each stream, camera 1 first.
    #[serde(default)]
    pub losses: Vec<LossRow>,
}

/// An analysis of a session with other settings than its own.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Variant {
    /// Its name; part of the names of its files.
    pub name: String,
    /// Settings that it overrides, as `key=value`.
    pub changed: Vec<String>,
    /// True when it makes the choices of the public code.
    #[serde(default)]
    pub reference_code: bool,
}

impl fmt::Display for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "analysis `{}`, not the session's own settings: ",
            self.name
        )?;
        if self.reference_code {
            f.write_str("the choices of the public code")?;
            if !self.changed.is_empty() {
                f.write_str(", ")?;
            }
        }
        match &self.changed[..] {
            [] if !self.reference_code => f.write_str("a name and nothing else"),
            changed => f.write_str(&changed.join(", ")),
        }
    }
}

/// A loss of a camera.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LossRow {
    /// 1 or 2.
    pub camera: u8,
    /// Bytes known to be lost.
    pub bytes: u64,
    /// When, on the camera's clock.
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

    /// The legs, when there are several.
    pub(crate) fn several_legs(&self) -> &[LegRow] {
        if self.legs.len() > 1 { &self.legs } else { &[] }
    }

    /// True when this interruption is the one that ended the run: both give the same reason.
    pub(crate) fn ended_by(&self, interruption: &InterruptionRow) -> bool {
        self.run_end_reason.as_ref() == Some(&interruption.reason)
    }
}

/// One device.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct DeviceRow {
    /// What it is for, for example `camera1`.
    pub role: String,
    /// Maker and model.
    pub model: String,
    /// Serial number.
    pub serial: String,
    /// Firmware or library version.
    pub firmware: String,
}

/// One leg: one life of the process that recorded the session.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LegRow {
    /// 1, 2, 3, ...
    pub number: u32,
    /// Civil time of its beginning, RFC 3339.
    pub started: String,
    /// Where it begins on the session's host clock, s.
    pub start_s: f64,
    /// How it ended: `completed`, `cut off`, `stopped: ...`, `faulted: ...` or `under way`.
    pub end: String,
    /// Civil time since the last record of the leg before, s, to about a second; `None` for the first leg, and where
    /// the rig's clock is not the civil one.
    pub apart_s: Option<f64>,
}

/// An attempt that another one replaced.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct RetakenRow {
    /// Which press, from 1.
    pub press: u32,
    /// Which attempt, from 1.
    pub attempt: u32,
    /// Why it does not count.
    pub reason: String,
}

/// One interruption.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct InterruptionRow {
    /// Host time, s.
    pub t_s: f64,
    /// `pause`, `resume`, `stop`, `abort` or `fault`.
    pub kind: String,
    /// In words.
    pub reason: String,
}

/// One remark.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct NoteRow {
    /// Host time, s.
    pub t_s: f64,
    /// The remark.
    pub text: String,
}
