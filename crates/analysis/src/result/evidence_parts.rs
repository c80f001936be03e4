//! Owns the parts of [`super::Evidence`]: groups of numbers that belong together.

use std::fmt;

use serde::{Deserialize, Serialize};
use skinrig_model::CameraId;

use super::other_reading::OtherPlan;

/// Marks that one camera saw.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct SeenMarks {
    /// The camera.
    pub camera: CameraId,
    /// Edges on the trigger channel.
    pub edges: usize,
    /// Marks that its clock uses.
    pub usable_marks: u32,
}

impl fmt::Display for SeenMarks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (edges, used) = (self.edges, self.usable_marks);
        write!(f, "{edges} edges and {used} usable marks ({})", self.camera)
    }
}

/// A period without events.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Silence {
    /// Start on the host clock, s; `None`: from the start of the recording on.
    pub from_s: Option<f64>,
    /// End, s; `None`: to the end of the recording.
    pub to_s: Option<f64>,
}

impl fmt::Display for Silence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.from_s, self.to_s) {
            (None, Some(to)) => write!(f, "before {to:.1} s"),
            (Some(from), None) => write!(f, "from {from:.1} s on"),
            (Some(from), Some(to)) => write!(f, "from {from:.1} s to {to:.1} s"),
            (None, None) => f.write_str("at all"),
        }
    }
}

/// A plan that matches the measured positions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FittingPlan {
    /// Median distance from it, mm.
    pub off_mm: f64,
    /// The plan.
    pub plan: OtherPlan,
}

/// Height above the surface at which the events of a camera begin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OnsetHeight {
    /// Presses.
    pub n: usize,
    /// Median, mm.
    pub median_mm: f64,
    /// 95 % interval of the median, lower end, mm.
    pub low_mm: f64,
    /// Upper end, mm.
    pub high_mm: f64,
    /// Median time before contact, ms.
    pub before_ms: f64,
}

impl fmt::Display for OnsetHeight {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:.2} mm (95 %: {:.2} to {:.2}), {:.0} ms before the contact, n {}",
            self.median_mm, self.low_mm, self.high_mm, self.before_ms, self.n
        )
    }
}

/// Response of a camera to presses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Response {
    /// Median rise above the idle rate, in standard errors.
    pub sigmas: f64,
    /// Presses.
    pub presses: usize,
}

/// Largest force of a press.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PeakForce {
    /// Median, N.
    pub median_n: f64,
    /// Presses.
    pub presses: usize,
}

pub(super) fn joined<T: fmt::Display>(items: &[T], by: &str) -> String {
    let texts: Vec<String> = items.iter().map(T::to_string).collect();
    texts.join(by)
}

pub(super) fn times(all_s: &[f64]) -> String {
    let texts: Vec<String> = all_s.iter().map(|at| format!("{at:+.1}")).collect();
    texts.join(", ")
}

pub(super) fn zoomed(percent: Option<f64>) -> String {
    percent.map_or_else(String::new, |percent| {
        format!(" at an edge, by a zoom of {percent:+.1} %")
    })
}

pub(super) fn noise(per_s: Option<[f64; 2]>) -> String {
    per_s.map_or_else(String::new, |[one, two]| {
        format!("; both cameras send noise ({one:.0} and {two:.0} events/s)")
    })
}

pub(super) fn in_degrees(off_deg: &[Option<f64>; 2]) -> String {
    let [one, two] =
        off_deg.map(|off| off.map_or_else(|| "-".to_owned(), |off| format!("{off:.1}")));
    format!("{one} and {two} degrees (cameras 1 and 2)")
}
