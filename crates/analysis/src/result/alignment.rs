//! Owns the alignment certificate: how well all clocks of a session are aligned, and whether that suffices.

use serde::{Deserialize, Serialize};

use super::{AlignmentViolation, ClockFit, ClockMap, MapName, Warning};

/// Verdict on the alignment of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AlignmentStatus {
    /// Every value is within its limit.
    Valid,
    /// A value exceeds its limit, or a map is missing: the session is invalid, and its numbers must not be used.
    Invalid,
    /// The session has no trigger box reports (imported, or recorded by an old version), so nothing can be certified.
    #[default]
    NotCertified,
}

/// The certificate.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Alignment {
    /// The verdict.
    pub status: AlignmentStatus,
    /// Why it cannot be used; empty unless invalid.
    pub violations: Vec<AlignmentViolation>,
    /// Assumptions that replace measurements.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<Warning>,
    /// The maps between the clocks.
    pub maps: Vec<ClockMap>,
    /// The trigger input of each camera; empty when not certified.
    pub lines: Vec<LineCounts>,
    /// Certainty of an alignment by event rates; `None` if no camera was aligned by them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rates: Option<RatesEvidence>,
    /// Number of times that the trigger box lost its clock.
    pub resets: u32,
    /// The map from host to camera time, piecewise affine between these knots, for camera 1 and camera 2.
    pub camera_from_host: [Vec<Knot>; 2],
    /// Residuals of each fitted map, for drawing; empty if not certified.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub residuals: Vec<ClockResiduals>,
}

/// Certainty of an alignment by the presses in the event rates: against all shifts of the plan over the recordings, both
/// cameras together, including bursts outside the plan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RatesEvidence {
    /// Log odds (natural) of the alignment against all others together, and against a plan unrelated to the recordings.
    pub log_odds: f64,
    /// Delay of the planned presses in each camera in the likeliest other alignment, s; `None` if none is likelier than a
    /// plan unrelated to the recordings.
    pub runner_up_s: Option<[f64; 2]>,
    /// Median time from one planned press to the next, s.
    pub period_s: f64,
    /// Presses that each camera saw; `None` if it was not aligned by event rates.
    pub cameras: [Option<RatesDetections>; 2],
}

/// Presses that one camera saw.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct RatesDetections {
    /// Planned presses within the recording.
    pub expected: u32,
    /// Planned presses with a burst of events.
    pub found: u32,
    /// Bursts that no planned press explains.
    pub unexplained: u32,
    /// Unexplained bursts between the first and the last planned press, without presses in the plan's rhythm.
    pub strays: u32,
}

impl Alignment {
    /// False if the numbers of the session must not be used.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        self.status != AlignmentStatus::Invalid
    }
}

impl Alignment {
    /// Distance of the piecewise map of camera `k` from one line at a host time, µs; 0 without a map.
    #[must_use]
    pub(crate) fn off_line_us(&self, k: usize, line: &ClockFit, host_us: f64) -> f64 {
        let knots = &self.camera_from_host[k];
        if knots.len() < 2 {
            return 0.0;
        }
        let at = knots[1..knots.len() - 1].partition_point(|knot| knot.host_us <= host_us);
        let (a, b) = (knots[at], knots[at + 1]);
        let off = |knot: Knot| knot.camera_us - line.camera_us(knot.host_us);
        let share = (host_us - a.host_us) / (b.host_us - a.host_us);
        off(a) + share * (off(b) - off(a))
    }

    /// Largest half width of the 95 % interval of a map at the presses, µs.
    #[must_use]
    pub fn interval_us(&self, name: MapName) -> Option<f64> {
        let map = self.maps.iter().find(|m| m.map == name)?;
        Some(map.interval_us?.1)
    }

    /// Largest systematic bound of a map at the presses, µs.
    #[must_use]
    pub fn bound_us(&self, name: MapName) -> Option<f64> {
        let map = self.maps.iter().find(|m| m.map == name)?;
        Some(map.bound_us?.1)
    }
}

/// Residuals of one map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ClockResiduals {
    /// The map.
    pub map: MapName,
    /// Points of the map, including rejected ones.
    pub n: u32,
    /// In time order. Above a few hundred, every n-th and the largest of the used ones; rejected ones are thinned
    /// separately.
    pub points: Vec<ClockResidual>,
}

/// One point of a map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ClockResidual {
    /// Time on the host clock, s.
    pub host_s: f64,
    /// Observed minus mapped time, µs.
    pub residual_us: f64,
    /// False if the fit rejected it.
    pub used: bool,
}

/// Edges on the trigger input of one camera, for all trains that the box sent while the camera was recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LineCounts {
    /// Trains that the box sent.
    pub trains_sent: u32,
    /// Trains with enough edges to time them.
    pub trains_seen: u32,
    /// Further trains, sent while this camera was not recording: neither seen nor lost.
    #[serde(default)]
    pub trains_unrecorded: u32,
    /// Edges that the box sent.
    pub sent: u64,
    /// Edges seen at the expected time.
    pub seen: u64,
    /// Edges sent but not seen.
    pub lost: u64,
    /// Edges seen again within 20 µs.
    pub doubled: u64,
    /// Edges that were never sent.
    pub spurious: u64,
}

impl LineCounts {
    /// `n` as a share of the edges sent; 0 without any.
    #[must_use]
    pub fn share(&self, n: u64) -> f64 {
        if self.sent == 0 {
            0.0
        } else {
            n as f64 / self.sent as f64
        }
    }
}

/// A knot of a piecewise affine map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Knot {
    /// Host time, µs.
    pub host_us: f64,
    /// Camera time, µs.
    pub camera_us: f64,
}
