//! Touches felt while the session was recorded, beside what was measured.

use serde::{Deserialize, Serialize};
use skinrig_model::{PressId, Reaction};

/// Distribution of a figure over presses.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Spread {
    /// Number of presses.
    pub n: u32,
    /// Median.
    pub median: Option<f64>,
    /// 99th percentile.
    pub p99: Option<f64>,
}

/// How scored presses were felt. Times are those at which the run had an estimate, on its own clock.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FeltTouches {
    /// Time from which touches were felt, s of the session.
    pub from_s: f64,
    /// Scored presses of the first leg from then on that were carried out and follow another one, excluded or not.
    pub presses: u32,
    /// Those before it, or in further legs, in which nothing is felt.
    pub outside: u32,
    /// Presses that were felt.
    pub felt: u32,
    /// Presses that were not.
    pub missed: u32,
    /// Presses that came while a false alarm lasted.
    pub alarmed: u32,
    /// From measured contact to the run knowing of it, ms.
    pub delay_ms: Spread,
    /// From the last event in an estimate to the run having it, ms.
    pub lag_ms: Spread,
    /// Onsets between presses, until 1 ms before a contact.
    pub false_alarms: u64,
    /// Time in which an onset is a false alarm, s.
    pub at_risk_s: f64,
    /// Error of the last position before each release, mm.
    pub error_mm: Spread,
    /// Longer semi-axis of its region, mm.
    pub region_mm: Spread,
    /// Touches with regions,
    pub with_regions: u32,
    /// and those whose regions hold the measured position at every instant (at least 95 % are stated).
    pub held: u32,
    /// Error of the last depth before each release, mm,
    pub depth_error_mm: Spread,
    /// and how far its interval reaches to each side, mm.
    pub depth_within_mm: Spread,
    /// Touches with depths,
    pub with_depths: u32,
    /// and those whose intervals hold the measured depth at every instant (95 % are stated).
    pub depths_held: u32,
    /// How presses reacted; `None` if none did.
    pub reactions: Option<FeltReactions>,
    /// Times at which bytes were skipped because the estimator could not keep up.
    pub skipped: u32,
}

/// How presses reacted to being felt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FeltReactions {
    /// What they did.
    pub reaction: Reaction,
    /// From measured contact to the robot having accepted the new set point, ms.
    pub reaction_ms: Spread,
    /// From the last event in the estimate to that, ms.
    pub since_event_ms: Spread,
    /// Measured depth of these presses, mm.
    pub depth_mm: Spread,
    /// Presses that reacted before their measured contact: false alarms.
    pub early: Vec<PressId>,
    /// Reactions with a region, and those whose region holds the measured position.
    pub regions: (u32, u32),
}
