//! Owns the answer with the robot's path in an interval of session time.

use serde::Deserialize;
use serde_json::{Value, json};
use skinrig_model::{HostTime, PoseSample};

use crate::events::check_interval;
use crate::open_session::OpenSession;
use crate::problem::Problem;

/// Longest interval, s.
const LONGEST_S: f64 = 120.0;
/// Most samples of one answer; beyond, every n-th.
const MOST_SAMPLES: usize = 2_000;

/// An interval of session time.
#[derive(Debug, Clone, Copy, Deserialize)]
pub(crate) struct Interval {
    /// Start, s.
    pub from_s: f64,
    /// End, s; included.
    pub to_s: f64,
}

/// Measured poses: `every` n-th sample as time (s), x, y, z (mm, skin frame) and force (N).
pub(crate) fn document(opened: &OpenSession, interval: Interval) -> Result<Value, Problem> {
    let samples = read(opened, interval)?;
    let every = samples.len().div_ceil(MOST_SAMPLES).max(1);
    let row = |s: &PoseSample| {
        let m = s.measured;
        json!([s.t.as_secs_f64(), m.x_mm, m.y_mm, m.z_mm, s.force_n])
    };
    // The last one is where the tip is.
    let skipped = samples.len().saturating_sub(1) % every;
    let rows: Vec<Value> = samples
        .iter()
        .skip(skipped)
        .step_by(every)
        .map(row)
        .collect();
    Ok(json!({ "every": every, "samples": samples.len(), "poses": rows }))
}

/// All samples of the interval.
pub(crate) fn read(opened: &OpenSession, interval: Interval) -> Result<Vec<PoseSample>, Problem> {
    check_interval(interval.from_s, interval.to_s, LONGEST_S)?;
    let at = HostTime::from_secs_f64;
    Ok(opened
        .reader
        .poses(at(interval.from_s), at(interval.to_s))?)
}
