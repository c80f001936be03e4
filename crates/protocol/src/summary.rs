//! Summary of a plan: presses, path, duration, expected data.

use std::fmt;

use serde::Serialize;
use sha2::{Digest, Sha256};
use skinrig_model::{Point2, PressRole};

use crate::plan::{Plan, Step};
use crate::timing;

/// Events per second of both cameras together while the skin is pressed (published recording: 75 kB/s at 21 bit).
pub(crate) const PRESS_EVENTS_PER_S: f64 = 28_570.0;
/// Events per second of both cameras together otherwise (published recording: 24 kB/s at 21 bit).
pub(crate) const IDLE_EVENTS_PER_S: f64 = 9_140.0;
/// Bytes of an event in EVT2.
pub const BYTES_PER_EVENT: f64 = 4.0;
/// Time between two TIME_HIGH words of an EVT2 stream, µs, as the vendor's encoder writes them. The cadence of the
/// camera itself is not documented.
pub(crate) const TIME_HIGH_PERIOD_US: f64 = 16.0;

/// Summary of a plan. Durations and data volumes are estimates.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlanSummary {
    /// Name of the protocol.
    pub name: String,
    /// Lower-case hex SHA-256 of the plan.
    pub digest: String,
    /// Sync presses.
    pub sync: u32,
    /// Presses that calibrate.
    pub calibrate: u32,
    /// Presses that score.
    pub score: u32,
    /// Distinct locations.
    pub locations: u32,
    /// Repetitions.
    pub repetitions: u32,
    /// Smallest and largest depth, mm.
    pub depth_mm: [f64; 2],
    /// Length of all lateral motion between presses, mm.
    pub path_length_mm: f64,
    /// Estimated duration on a real rig, s.
    pub duration_s: f64,
    /// Time in contact with the skin, s.
    pub contact_s: f64,
    /// Events of both cameras together, at the published rates.
    pub expected_events: f64,
    /// Bytes of both cameras together as EVT2, time base included.
    pub expected_bytes: f64,
}

impl Plan {
    /// The plan's identity: lower-case hex SHA-256 of its canonical JSON (keys in the order of declaration, no
    /// spaces, shortest form of every number that reads back as itself).
    #[must_use]
    pub fn digest(&self) -> String {
        crate::file::hex(&Sha256::digest(self.to_json().as_bytes()))
    }

    /// The plan as canonical JSON, as stored in a session.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Plain data without maps cannot fail to serialise.
        serde_json::to_string(self).unwrap_or_default()
    }

    /// The plan in a few lines.
    #[must_use]
    pub fn summary(&self) -> PlanSummary {
        let of = |role| self.presses.iter().filter(|p| p.role == role).count() as u32;
        let path = self.presses.iter().filter(|p| p.role != PressRole::Sync);
        let depths = || path.clone().map(|p| p.depth_mm);
        let (duration_s, contact_s) = timing::duration_s(self);
        let mut position: Option<Point2> = None;
        let mut path_length_mm = 0.0;
        for step in &self.steps {
            if let Step::Travel { to, .. } = step {
                path_length_mm += position.map_or(0.0, |p| p.distance_mm(to.plane()));
                position = Some(to.plane());
            }
        }
        let expected_events =
            contact_s * PRESS_EVENTS_PER_S + (duration_s - contact_s) * IDLE_EVENTS_PER_S;
        let time_words = 2.0 * duration_s * 1e6 / TIME_HIGH_PERIOD_US;
        PlanSummary {
            name: self.name.clone(),
            digest: self.digest(),
            sync: of(PressRole::Sync),
            calibrate: of(PressRole::Calibrate),
            score: of(PressRole::Score),
            locations: path.clone().map(|p| p.location.number()).max().unwrap_or(0),
            repetitions: path
                .clone()
                .map(|p| p.repetition.number())
                .max()
                .unwrap_or(0),
            depth_mm: [
                depths().fold(f64::INFINITY, f64::min),
                depths().fold(0.0, f64::max),
            ],
            path_length_mm,
            duration_s,
            contact_s,
            expected_events,
            expected_bytes: (expected_events + time_words) * BYTES_PER_EVENT,
        }
    }
}

impl fmt::Display for PlanSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = self.depth_mm;
        let depth = if low == high {
            format!("{low} mm")
        } else {
            format!("{low} to {high} mm")
        };
        let presses = self.sync + self.calibrate + self.score;
        writeln!(
            f,
            "plan      {} ({})",
            self.name,
            self.digest.get(..12).unwrap_or("")
        )?;
        writeln!(
            f,
            "presses   {presses}: {} calibrate, {} score, {} sync; {}, {}, depth {depth}",
            self.calibrate,
            self.score,
            self.sync,
            counted(self.locations, "location"),
            counted(self.repetitions, "repetition")
        )?;
        writeln!(f, "path      {:.0} mm", self.path_length_mm)?;
        writeln!(
            f,
            "duration  {} on a real rig, {:.0} s of it in contact",
            clock(self.duration_s),
            self.contact_s
        )?;
        write!(
            f,
            "expected  about {} events, {}B from both cameras (published event rates, EVT2)",
            scaled(self.expected_events),
            scaled(self.expected_bytes)
        )
    }
}

/// `1 repetition`, `2 repetitions`.
pub(crate) fn counted(n: u32, what: &str) -> String {
    let plural = if n == 1 { "" } else { "s" };
    format!("{n} {what}{plural}")
}

/// `2 h 05 min 40 s`.
fn clock(seconds: f64) -> String {
    let s = seconds.round() as u64;
    match (s / 3600, s / 60 % 60, s % 60) {
        (0, 0, _) => format!("{seconds:.1} s"),
        (0, m, s) => format!("{m} min {s:02} s"),
        (h, m, s) => format!("{h} h {m:02} min {s:02} s"),
    }
}

/// `1.2 M`.
fn scaled(n: f64) -> String {
    for (size, prefix) in [(1e12, "T"), (1e9, "G"), (1e6, "M"), (1e3, "k")] {
        if n >= size {
            return format!("{:.1} {prefix}", n / size);
        }
    }
    format!("{n:.0} ")
}
