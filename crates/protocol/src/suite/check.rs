//! A check of a suite: measurement and limits.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;
use skinrig_model::{HostDuration, Limit};
use skinrig_settings::{Collector, Field};

/// Words that answer yes or no, also of YAML 1.1, or stand for nothing.
const NO_REASONS: [&str; 9] = ["false", "no", "off", "n", "true", "yes", "on", "y", "null"];

/// Why a check is skipped. `skip: false` would skip it, too: such words are errors.
pub(super) fn skip_reason(field: &Field, out: &mut Collector) -> Option<String> {
    let text = field.as_text()?;
    let is_reason = text.chars().any(char::is_alphabetic)
        && !NO_REASONS
            .iter()
            .any(|word| text.eq_ignore_ascii_case(word));
    if !is_reason {
        out.error(field.span, field.path.as_str(), "this is not a reason")
            .expected("why the check is skipped")
            .found(format!("`{text}`"))
            .help("write for example `skip: lamp is being repaired`, or remove the line to run the check");
        return None;
    }
    Some(text.to_owned())
}

/// One check of a suite.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// As typed: the key under `checks`.
    pub name: &'static str,
    /// Title for display.
    pub title: &'static str,
    /// Measurement and its parameters.
    pub measure: Measure,
    /// Reason to skip it, if the suite has one.
    pub skip: Option<String>,
    /// Metrics that can have limits, in display order.
    pub metrics: &'static [Metric],
    /// Limits by metric; at least one.
    pub limits: BTreeMap<&'static str, Limit>,
}

/// A metric of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Metric {
    /// As typed: the key of its limit.
    pub name: &'static str,
    /// Title for display.
    pub title: &'static str,
    /// Its unit; empty for counts.
    pub unit: &'static str,
}

/// Whether the bench's lamps are on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Light {
    /// Off.
    Dark,
    /// On.
    Lit,
}

/// Measurement of a check, with its parameters.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Measure {
    /// Identity of each device, against the rig file.
    Identity,
    /// Every setting of the cameras, written and read back.
    Settings,
    /// Coded trains from the trigger box through both cameras.
    TriggerLoopback {
        /// Number of trains sent.
        trains: u32,
    },
    /// The cameras' clocks against the trigger box.
    Clocks {
        /// Duration of the measurement.
        duration: HostDuration,
    },
    /// Data rate and loss with nothing moving.
    Idle {
        /// Duration of the measurement.
        duration: HostDuration,
    },
    /// Noise floor and hot pixels.
    Noise {
        /// Lamps on or off.
        light: Light,
        /// Duration of the measurement.
        duration: HostDuration,
        /// A pixel above this rate is hot, events per second.
        hot_above_ev_s: f64,
    },
    /// Data rate and loss under the cameras' built-in test pattern.
    TestPattern {
        /// Duration of the measurement.
        duration: HostDuration,
        /// Event rate that the pattern is set to, events per second.
        rate_ev_s: f64,
    },
    /// Whether the robot is initialised, powered and without faults.
    RobotState,
    /// Approaches five points in free air repeatedly.
    Repeatability {
        /// Approaches of each point.
        approaches: u32,
        /// mm/s.
        speed_mm_s: f64,
    },
    /// A step in free air.
    StepResponse {
        /// mm.
        distance_mm: f64,
        /// Number of moves.
        steps: u32,
    },
    /// Presses at the points of the touch-off.
    Depth {
        /// mm.
        depth_mm: f64,
        /// Presses at each point.
        presses: u32,
    },
    /// A press that the force limit must stop.
    ForceCeiling {
        /// The force limit that is set, N.
        force_n: f64,
        /// Commanded depth, mm.
        depth_mm: f64,
    },
    /// Writing to the session folder.
    Disk {
        /// Bytes.
        amount_b: f64,
    },
    /// A short campaign on the golden skin.
    Golden {
        /// Its protocol, relative to the suite's folder.
        protocol: PathBuf,
    },
    /// A short campaign that feels its presses.
    Reaction {
        /// Its protocol, relative to the suite's folder.
        protocol: PathBuf,
    },
    /// Kills the program that holds the arm.
    WatchdogDrill,
    /// Stops the arm in the middle of a move.
    StopDrill,
}
