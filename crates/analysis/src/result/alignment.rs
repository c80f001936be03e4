//! Owns the alignment certificate: how well all clocks of a session are laid on one another, and whether that is enough.

use serde::{Deserialize, Serialize};

use super::ClockFit;

/// The verdict on the alignment of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AlignmentStatus {
    /// Every figure is within its limit.
    Valid,
    /// A figure is beyond its limit, or a map is missing: the session is invalid, and its numbers are not to be used.
    Invalid,
    /// The session has no reports of a trigger box (imported, or recorded before there were any): nothing to certify with.
    #[default]
    NotCertified,
}

/// The certificate.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Alignment {
    /// The verdict.
    pub status: AlignmentStatus,
    /// What is beyond its limit, in words; empty unless invalid.
    pub violations: Vec<String>,
    /// What stands on an assumption instead of a measurement, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// The maps between the clocks.
    pub maps: Vec<ClockMap>,
    /// The trigger input of each camera; empty when not certified.
    pub lines: Vec<LineCounts>,
    /// How sure an alignment by event rates is; `None` where no camera was aligned by them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rates: Option<RatesEvidence>,
    /// How often the trigger box lost its clock.
    pub resets: u32,
    /// The map from host to camera time, piecewise affine between these knots, for camera 1 and camera 2.
    pub camera_from_host: [Vec<Knot>; 2],
    /// What each fitted map leaves of its points, for drawing; empty when not certified.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub residuals: Vec<ClockResiduals>,
}

/// How sure an alignment by the presses in the event rates is: against all shifts of the plan over the recordings, both cameras
/// judged together, bursts outside the plan included.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RatesEvidence {
    /// Natural logarithm of the odds of the alignment against all others together, and against the plan being foreign to
    /// the recordings.
    pub log_odds: f64,
    /// How much later the planned presses come in each camera by the likeliest other alignment, s; `None` when none is likelier
    /// than a plan that is foreign to the recordings.
    pub runner_up_s: Option<[f64; 2]>,
    /// Usual time from one planned press to the next, s.
    pub period_s: f64,
    /// What each camera saw of the plan; `None` for one that was not aligned by its event rates.
    pub cameras: [Option<RatesSights>; 2],
}

/// What one camera saw of the planned presses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct RatesSights {
    /// Planned presses within the recording.
    pub expected: u32,
    /// Of them, those with a burst of events.
    pub found: u32,
    /// Bursts that no planned press explains.
    pub unexplained: u32,
    /// Of them, those between the first and the last planned press, but for presses in the plan's rhythm.
    pub strays: u32,
}

impl Alignment {
    /// False when the numbers of the session are not to be used.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        self.status != AlignmentStatus::Invalid
    }
}

impl Alignment {
    /// How far the piecewise map of camera `k` is from one line at a host time, µs; 0 without a map.
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

    /// The largest half width of the 95 % interval of a map at the presses, µs.
    #[must_use]
    pub fn interval_us(&self, name: MapName) -> Option<f64> {
        let map = self.maps.iter().find(|m| m.map == name)?;
        Some(map.interval_us?.1)
    }

    /// The most that comes on top of it, µs.
    #[must_use]
    pub fn bound_us(&self, name: MapName) -> Option<f64> {
        let map = self.maps.iter().find(|m| m.map == name)?;
        Some(map.bound_us?.1)
    }
}

/// Which clock on which.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MapName {
    /// The host's clock over the trigger box's.
    HostFromBox,
    /// Camera 1's clock over the trigger box's.
    Camera1FromBox,
    /// Camera 2's clock over the trigger box's.
    Camera2FromBox,
    /// Camera 2's clock over camera 1's, by the edges that both saw.
    Camera2FromCamera1,
    /// The robot's poses are stamped with the host's clock.
    RobotFromHost,
    /// Camera 1's clock over the host's: both maps above together.
    Camera1FromHost,
    /// Camera 2's clock over the host's.
    Camera2FromHost,
}

impl MapName {
    /// As it is written in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::HostFromBox => "host from box",
            Self::Camera1FromBox => "camera 1 from box",
            Self::Camera2FromBox => "camera 2 from box",
            Self::Camera2FromCamera1 => "camera 2 from camera 1",
            Self::RobotFromHost => "robot from host",
            Self::Camera1FromHost => "camera 1 from host",
            Self::Camera2FromHost => "camera 2 from host",
        }
    }
}

/// How well one clock is known from another. Piecewise affine: the rate may wander.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ClockMap {
    /// Which.
    pub map: MapName,
    /// Pieces.
    pub pieces: u32,
    /// Points (exchanges, trains) that it stands on; 0 for a map that is not fitted.
    pub n: u32,
    /// Points left out as outliers.
    pub rejected: u32,
    /// Rate difference over the session, parts per million; `None` where none is fitted.
    pub drift_ppm: Option<f64>,
    /// RMS residual, µs.
    pub residual_rms_us: Option<f64>,
    /// Largest absolute residual, µs.
    pub residual_max_us: Option<f64>,
    /// Half width of the 95 % interval at the presses (contacts and releases that are timed), median and largest, µs: what the noise
    /// of its points leaves open. `None` for a map that is not fitted.
    pub interval_us: Option<(f64, f64)>,
    /// What comes on top at the presses, at most, median and largest, µs: what no number of points averages out. Of host over box
    /// time it is the bound that the exchanges give for certain; of camera over box time the unknown mean delay of an edge, the whole
    /// µs of both clocks and what a rate may change by before the first train and after the last; of robot poses the stated delay.
    #[serde(default)]
    pub bound_us: Option<(f64, f64)>,
    /// Share of points, each held out of the fit with every second other, that lie in the interval stated for them.
    pub coverage: Option<f64>,
    /// Points behind that share.
    pub coverage_n: u32,
}

impl ClockMap {
    /// What one line through two clocks says.
    #[must_use]
    pub(crate) const fn of_line(map: MapName, fit: &ClockFit) -> Self {
        Self {
            map,
            pieces: 1,
            n: fit.n,
            rejected: fit.rejected,
            drift_ppm: Some(fit.drift_ppm),
            residual_rms_us: Some(fit.residual_rms_us),
            residual_max_us: Some(fit.residual_max_us),
            interval_us: None,
            bound_us: None,
            coverage: None,
            coverage_n: 0,
        }
    }
}

/// What one map leaves of the points that it is fitted to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ClockResiduals {
    /// Which map.
    pub map: MapName,
    /// Points of the map, left-out ones included.
    pub n: u32,
    /// In order of time. Of more than a few hundred every n-th, with the largest of those used; left-out ones are thinned apart.
    pub points: Vec<ClockResidual>,
}

/// One point of a map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ClockResidual {
    /// When, on the host's clock, s.
    pub host_s: f64,
    /// Observed minus mapped time, µs.
    pub residual_us: f64,
    /// False for one that the fit left out.
    pub used: bool,
}

/// Edges on the trigger input of one camera: of all trains that the box sent while the camera was recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LineCounts {
    /// Trains that the box sent.
    pub trains_sent: u32,
    /// Trains of which enough was seen to time them.
    pub trains_seen: u32,
    /// Further trains, sent while this camera was not recording: neither seen nor lost.
    #[serde(default)]
    pub trains_unrecorded: u32,
    /// Edges that the box sent.
    pub sent: u64,
    /// Edges seen where the box sent them.
    pub seen: u64,
    /// Edges sent and not seen.
    pub lost: u64,
    /// Edges seen again within 20 µs.
    pub doubled: u64,
    /// Edges that nobody sent.
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

/// A point of a piecewise-affine map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Knot {
    /// Host time, µs.
    pub host_us: f64,
    /// Camera time, µs.
    pub camera_us: f64,
}
