//! A check of a suite: what it measures, and its limits.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;
use skinrig_model::{HostDuration, Limit};

/// One check of a suite.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// As typed: the key under `checks`.
    pub name: &'static str,
    /// What it is, for people.
    pub title: &'static str,
    /// What is measured, and how.
    pub measure: Measure,
    /// Why it does not run for now, when the suite says so.
    pub skip: Option<String>,
    /// The metrics that it can have limits for, in the order in which people should see them.
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

/// What a check measures, with its parameters.
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
        /// How long the check measures.
        duration: HostDuration,
    },
    /// Data rate and loss with nothing moving.
    Idle {
        /// How long the check measures.
        duration: HostDuration,
    },
    /// Noise floor and hot pixels.
    Noise {
        /// Lamps on or off.
        light: Light,
        /// How long the check measures.
        duration: HostDuration,
        /// A pixel above this rate is hot, events per second.
        hot_above_ev_s: f64,
    },
    /// Data rate and loss under the cameras' built-in test pattern.
    TestPattern {
        /// How long the check measures.
        duration: HostDuration,
        /// Event rate that the pattern is set to, events per second.
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
    /// A press that the limit of the force must stop.
    ForceCeiling {
        /// The force limit that is set, N.
        force_n: f64,
        /// Commanded depth, mm.
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
