//! A suite of checks for a bench: what is measured every night, and the limits that were stated before.

mod build;
pub(crate) mod keys;
mod limits;

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;
use skinrig_model::{HostDuration, Limit};

use skinrig_settings::Diagnostics;

/// A suite that was read and checked.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Suite {
    /// The file's name as given to [`Suite::parse`].
    pub file_name: String,
    /// The text as the user wrote it, byte for byte.
    pub text: String,
    /// Lower-case hex SHA-256 of the text.
    pub sha256: String,
    /// Its name. Stands in every result.
    pub name: String,
    /// Anything worth keeping.
    pub description: Option<String>,
    /// How long the whole suite may take, repeats included.
    pub budget: HostDuration,
    /// What is done again.
    pub repeats: Repeats,
    /// The checks, in the order in which they are made.
    pub checks: Vec<Check>,
}

/// When a check is made again. Every attempt stays in the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Repeats {
    /// How often a check that did not pass is made again.
    pub at_most: u32,
    /// How many attempts must pass before the check counts as passed after a failure; otherwise the failure stays.
    pub must_pass: u32,
}

/// One check of a suite.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// As typed: the key under `checks`.
    pub name: &'static str,
    /// What it is, for people.
    pub title: &'static str,
    /// What is measured, and how.
    pub measure: Measure,
    /// Why it is not made, when the suite says so.
    pub skip: Option<String>,
    /// What may be measured by it, in the order in which people should meet it.
    pub metrics: &'static [Metric],
    /// Limits by metric; at least one.
    pub limits: BTreeMap<&'static str, Limit>,
}

/// Something that a check measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Metric {
    /// As typed: the key of its limit.
    pub name: &'static str,
    /// What it is, for people.
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

/// What a check measures, with what it needs to know.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Measure {
    /// Who each device is, against the rig file.
    Identity,
    /// Every setting of the cameras, written and read back.
    Settings,
    /// Coded trains from the trigger box through both cameras.
    TriggerLoopback {
        /// How many trains.
        trains: u32,
    },
    /// The cameras' clocks against the trigger box.
    Clocks {
        /// For how long.
        duration: HostDuration,
    },
    /// Data rate and loss with nothing moving.
    Idle {
        /// For how long.
        duration: HostDuration,
    },
    /// Noise floor and hot pixels.
    Noise {
        /// In which light.
        light: Light,
        /// For how long.
        duration: HostDuration,
        /// A pixel above this rate is hot, events per second.
        hot_above_ev_s: f64,
    },
    /// Data rate and loss under the cameras' built-in test pattern.
    TestPattern {
        /// For how long.
        duration: HostDuration,
        /// Which rate the pattern is set to, events per second.
        rate_ev_s: f64,
    },
    /// Whether the robot is initialised, powered and without faults.
    RobotState,
    /// Five points in free air, approached again and again.
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
        /// How often.
        steps: u32,
    },
    /// Presses at the points of the touch-off.
    Depth {
        /// mm.
        depth_mm: f64,
        /// How often each point is pressed.
        presses: u32,
    },
    /// A press that the limit of the force must stop.
    ForceCeiling {
        /// The limit that is set, N.
        force_n: f64,
        /// How deep the tip is sent, mm.
        depth_mm: f64,
    },
    /// Writing where sessions go.
    Disk {
        /// Bytes.
        amount_b: f64,
    },
    /// A short campaign on the golden skin.
    Golden {
        /// Its protocol, relative to the suite's folder.
        protocol: PathBuf,
    },
    /// The program that holds the arm is killed.
    WatchdogDrill,
    /// The arm is stopped in the middle of a move.
    StopDrill,
}

impl Suite {
    /// Reads a suite from the bytes of a file named `name`. Paths in it are relative to its folder.
    ///
    /// # Errors
    /// [`Diagnostics`] with every finding at once.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Self, Diagnostics> {
        build::suite(name, bytes)
    }
}
