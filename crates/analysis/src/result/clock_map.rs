//! Owns the quality of the map between two clocks.

use serde::{Deserialize, Serialize};

use super::ClockFit;

/// A map between two clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MapName {
    /// The host's clock over the trigger box's.
    HostFromBox,
    /// Camera 1's clock over the trigger box's.
    Camera1FromBox,
    /// Camera 2's clock over the trigger box's.
    Camera2FromBox,
    /// Camera 2's clock over camera 1's, by edges that both saw.
    Camera2FromCamera1,
    /// Robot poses have host clock timestamps.
    RobotFromHost,
    /// Camera 1's clock over the host's: both maps combined.
    Camera1FromHost,
    /// Camera 2's clock over the host's.
    Camera2FromHost,
}

impl MapName {
    /// Name in reports.
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

/// Quality of a map between two clocks. Piecewise affine: the rate may wander.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ClockMap {
    /// The map.
    pub map: MapName,
    /// Number of pieces.
    pub pieces: u32,
    /// Points (exchanges, trains) of the fit; 0 for a map that is not fitted.
    pub n: u32,
    /// Points rejected as outliers.
    pub rejected: u32,
    /// Rate difference over the session, parts per million; `None` if not fitted.
    pub drift_ppm: Option<f64>,
    /// RMS residual, µs.
    pub residual_rms_us: Option<f64>,
    /// Largest absolute residual, µs.
    pub residual_max_us: Option<f64>,
    /// Half width of the 95 % interval at the presses (timed contacts and releases), median and largest, µs: random error.
    /// `None` for a map that is not fitted.
    pub interval_us: Option<(f64, f64)>,
    /// Systematic bound at the presses, median and largest, µs: not reduced by more points. Host over box time: the certain
    /// bound from the exchanges. Camera over box time: the unknown mean delay of an edge, the 1 µs resolution of both
    /// clocks, and possible rate changes before the first train and after the last. Robot poses: the stated delay.
    #[serde(default)]
    pub bound_us: Option<(f64, f64)>,
    /// Share of points within the interval stated for them, each held out of the fit with every second other point.
    pub coverage: Option<f64>,
    /// Number of points behind that share.
    pub coverage_n: u32,
}

impl ClockMap {
    /// Summary of a single line between two clocks.
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
