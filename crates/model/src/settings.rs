//! Settings of an analysis: everything that can change its numbers.

use serde::{Deserialize, Serialize};

use crate::camera::StereoGeometry;
use crate::skin::SkinOutline;

/// Which clustered events make the centroid of a press.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CentroidRule {
    /// The largest cluster, as the paper says.
    #[default]
    LargestCluster,
    /// All events that are not noise, as the public code does.
    AllClusters,
}

/// Which nested camera model is calibrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CalibrationModel {
    /// Use the starting geometry as it is.
    None,
    /// Two positions (4 parameters).
    Positions,
    /// Positions and skews (6).
    PositionsSkews,
    /// Positions, skews and distortions: the paper's eight.
    #[default]
    Full,
}

/// Settings of an analysis. A session recorded before a setting existed gets that setting's default.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct AnalysisSettings {
    /// Rows kept per camera, both ends included (public code: camera 1 185..=360, camera 2 200..=355).
    pub crop_v: [(u16, u16); 2],
    /// The press window begins this long before the measured contact, ms.
    pub window_before_ms: f64,
    /// The press window ends this long after the measured release, ms.
    pub window_after_ms: f64,
    /// DBSCAN neighbourhood radius, px (paper: 10).
    pub eps_px: f64,
    /// DBSCAN core threshold, events (paper: 10).
    pub min_samples: u32,
    /// Which clustered events make the centroid.
    pub centroid: CentroidRule,
    /// A press with fewer clustered events than this in either camera is excluded (0 = rule off).
    pub min_cluster_events: u32,
    /// A press whose events in the window are fewer than the idle rate predicts plus this many standard errors, in
    /// either camera, is excluded: the camera did not see it (0 = rule off).
    pub min_response_sigma: f64,
    /// A press whose rays meet at less than this sine is excluded as nearly parallel.
    pub min_ray_sine: f64,
    /// Leave estimates outside the skin's outline out of the headline metrics (they are always counted).
    pub exclude_outside: bool,
    /// Which parameters are calibrated.
    pub calibration: CalibrationModel,
    /// Resamples of the bootstrap over locations.
    pub bootstrap_resamples: u32,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// Width of the event-rate bins, ms (paper: 10).
    pub rate_bin_ms: f64,
}

impl Default for AnalysisSettings {
    fn default() -> Self {
        Self {
            crop_v: [(185, 360), (200, 355)],
            window_before_ms: 50.0,
            window_after_ms: 50.0,
            eps_px: 10.0,
            min_samples: 10,
            centroid: CentroidRule::LargestCluster,
            min_cluster_events: 20,
            min_response_sigma: 5.0,
            min_ray_sine: 0.05,
            exclude_outside: true,
            calibration: CalibrationModel::Full,
            bootstrap_resamples: 2000,
            seed: 1,
            rate_bin_ms: 10.0,
        }
    }
}

/// What the rig looks like to an analysis: the part of `RunHeader::rig_json` that it needs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RigGeometry {
    /// The skin's outline.
    pub outline: SkinOutline,
    /// The nominal (drawn or measured, not calibrated) camera geometry: where calibration starts.
    pub nominal: StereoGeometry,
    /// The camera trigger channel that carries the marks; `None` when the rig has no trigger line.
    pub trigger_channel: Option<u8>,
}
