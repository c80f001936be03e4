//! Settings of an analysis: everything that can change its numbers.

use serde::{Deserialize, Serialize};

use crate::camera::StereoGeometry;
use crate::id::PressId;
use crate::lens::LensKind;
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

/// What turns the events of a press in one camera into a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Estimator {
    /// Mean of clustered events, as the paper says.
    #[default]
    Dbscan,
    /// Median column of all events.
    ColumnMedian,
    /// Peak of the smoothed histogram of columns, between pixels.
    HistogramPeak,
    /// A histogram of 40 columns that forgets, updated event by event in constant memory.
    Streaming,
}

/// Width of the floating-point numbers of an estimator. Estimators that count in whole numbers know no difference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Precision {
    /// 64 bits.
    #[default]
    F64,
    /// 32 bits.
    F32,
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
    Full,
    /// The eight and a scale of the field of view per camera (10).
    FullScale,
    /// The smallest of the models above that no larger one beats at places left out of the fit, by more than noise
    /// explains.
    #[default]
    Auto,
}

/// How the least number of cluster events for a press to count is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ThresholdRule {
    /// Chosen on the calibrating presses alone; never below `min_cluster_events`.
    #[default]
    Calibrated,
    /// `min_cluster_events` as it is.
    Fixed,
}

/// Where a press window is anchored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WindowAnchor {
    /// From `window_before_ms` before the measured contact to `window_after_ms` after the measured release.
    #[default]
    Touch,
    /// From `window_before_ms` before the middle between contact and release to `window_after_ms` after it, as the
    /// public code does.
    Middle,
}

/// Where the background of the latency detector is taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Background {
    /// The idle time before the press, as the paper says.
    #[default]
    Before,
    /// 1.5 s to 2.4 s after the middle of the press, as the public code does.
    After,
}

/// The data-reduction study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ReductionSettings {
    /// Thinning factors 2^0 ..= 2^this (0..=20; the paper: 10).
    pub max_power: u32,
    /// Random seeds per factor and kind of thinning, at least 1.
    pub seeds: u32,
    /// DBSCAN core threshold for all factors; 0: that of the analysis. The public code: 1.
    pub min_samples: u32,
}

impl Default for ReductionSettings {
    fn default() -> Self {
        Self {
            max_power: 12,
            seeds: 10,
            min_samples: 0,
        }
    }
}

/// The detection-latency study: a one-sided CUSUM on binned, smoothed event counts of both cameras.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LatencySettings {
    /// Width of a bin, ms (paper: 0.2).
    pub bin_ms: f64,
    /// Standard deviation of the Gaussian kernel, ms (paper: 0.5).
    pub sigma_ms: f64,
    /// Rate increase that the detector is tuned to (paper: 4).
    pub alpha: f64,
    /// Bins in a row that must be above the threshold (paper: 3).
    pub consecutive: u32,
    /// Thresholds h that are tried, first and last (public code: 17 to 19 at full data; the paper reports 1).
    pub threshold_range: (f64, f64),
    /// How many thresholds, evenly spaced, both ends included.
    pub thresholds: u32,
    /// The threshold chosen has the fewest false alarms among those that detect at least this share (paper: 0.95).
    pub target_rate: f64,
    /// A detection counts when it lies within this of the median onset, ms (paper: 100).
    pub window_ms: f64,
    /// Where the background comes from.
    pub background: Background,
    /// The same study on thinned events.
    pub reduced: ReducedLatencySettings,
}

impl Default for LatencySettings {
    fn default() -> Self {
        Self {
            bin_ms: 0.2,
            sigma_ms: 0.5,
            alpha: 4.0,
            consecutive: 3,
            threshold_range: (1.0, 20.0),
            thresholds: 20,
            target_rate: 0.95,
            window_ms: 100.0,
            background: Background::Before,
            reduced: ReducedLatencySettings::default(),
        }
    }
}

/// The detection-latency study on thinned events: what differs from the study on all of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ReducedLatencySettings {
    /// Thinning factor k, at least 1 (paper, "Data Ablation and Latency Distribution Analysis": 1024).
    pub factor: u32,
    /// Thresholds h that are tried, first and last (public code: 3 to 8; the paper reports 3).
    pub threshold_range: (f64, f64),
    /// How many thresholds, evenly spaced, both ends included (public code: 6).
    pub thresholds: u32,
    /// The threshold chosen has the fewest false alarms among those that detect at least this share (public code: 0.85).
    pub target_rate: f64,
}

impl Default for ReducedLatencySettings {
    fn default() -> Self {
        Self {
            factor: 1024,
            threshold_range: (3.0, 8.0),
            thresholds: 6,
            target_rate: 0.85,
        }
    }
}

/// The contact map reconstruction error. None of these values is published: see `docs/paper.md`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CmreSettings {
    /// Side of a square cell, mm (the virtual grid of the skin that defined the measure: 5).
    pub cell_mm: f64,
    /// Standard deviation of the estimate's Gaussian, mm (default of the public code: 1).
    pub sigma_mm: f64,
    /// SR of the public code, a length whose meaning and value are not given, mm; 5 makes the documented scores (one
    /// cell off about 0.02).
    pub sr_mm: f64,
}

impl Default for CmreSettings {
    fn default() -> Self {
        Self {
            cell_mm: 5.0,
            sigma_mm: 1.0,
            sr_mm: 5.0,
        }
    }
}

/// Limits of the alignment certificate: a session beyond one of them is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct AlignmentSettings {
    /// Largest RMS residual of trains about a camera's map, µs. Trigger inputs show whole µs, optocouplers add some: more is
    /// a line that does not carry what the box sends.
    pub max_residual_us: f64,
    /// Largest half width of the 95 % interval of camera over box time at a press, µs: a quarter of the latency study's bin.
    pub max_camera_interval_us: f64,
    /// Largest half width of the certain interval of host over box time at a press, µs: a tenth of the margin of a press
    /// window.
    pub max_host_interval_us: f64,
    /// Largest rate difference between two clocks, ppm: a ceramic resonator's and a crystal's, twice.
    pub max_drift_ppm: f64,
    /// Largest share of lost edges: half as many again as labels and intervals are proven for (20 %).
    pub max_lost: f64,
    /// Largest share of doubled and spurious edges: three times as many as labels and intervals are proven for (5 %).
    pub max_spurious: f64,
    /// Least share of held-out trains in the 95 % interval stated for them.
    pub min_coverage: f64,
    /// A press further than this from the nearest tie of a clock (train or mark that the camera saw, exchange with the box) is
    /// not timed by that clock, µs: beyond it, a rate that changes by 20 ppm, as a cheap crystal's does over tens of kelvins,
    /// moves the clock by more than `max_camera_interval_us`.
    pub max_tie_distance_us: f64,
    /// The robot's poses are stamped late by at most this, µs: one interval of a 1 kHz stream. Stated, not measured.
    pub robot_delay_us: f64,
    /// Least share of the planned presses within a recording that have a burst in the event rates, and of the bursts among the
    /// planned presses that are one of them, where clocks are aligned by event rates: with less, the plan is not what was done.
    pub min_explained: f64,
    /// Least natural logarithm of the odds of an alignment by event rates against all others together. 7: 1100 to 1.
    pub min_log_odds: f64,
}

impl Default for AlignmentSettings {
    fn default() -> Self {
        Self {
            max_residual_us: 10.0,
            max_camera_interval_us: 50.0,
            max_host_interval_us: 5_000.0,
            max_drift_ppm: 10_000.0,
            max_lost: 0.3,
            max_spurious: 0.15,
            min_coverage: 0.85,
            max_tie_distance_us: 2_500_000.0,
            robot_delay_us: 1_000.0,
            min_explained: 0.5,
            min_log_odds: 7.0,
        }
    }
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
    /// What turns the events of a press into a column.
    pub estimator: Estimator,
    /// Width of the estimator's floating-point numbers.
    pub precision: Precision,
    /// After this time the streaming estimator has forgotten all but 1/e of an event, ms.
    pub forget_ms: f64,
    /// Only one event in this many is used, chosen at random (1: all).
    pub thinning: u32,
    /// Side of the square bins of pixels that the estimator sees, px: 1, 2, 4, 8 or 16.
    pub bin_px: u16,
    /// The press window ends this long after the measured contact, ms, if it is not over before; `None`: only the
    /// release and `window_after_ms` end it.
    pub window_after_contact_ms: Option<f64>,
    /// Where the press window is anchored.
    pub window_anchor: WindowAnchor,
    /// How the least number of clustered events is found.
    pub cluster_threshold: ThresholdRule,
    /// A press with fewer clustered events than this in either camera is excluded (0 = rule off); the least value
    /// when the threshold is calibrated.
    pub min_cluster_events: u32,
    /// A press whose events in the window are fewer than the idle rate predicts plus this many standard errors, in
    /// either camera, is excluded: the camera did not see it (0 = rule off).
    pub min_response_sigma: f64,
    /// A press whose rays meet at less than this sine is excluded as nearly parallel.
    pub min_ray_sine: f64,
    /// Leave estimates outside the skin's outline out of the headline metrics (they are always counted).
    pub exclude_outside: bool,
    /// Presses left out by hand, sync presses counted.
    pub exclude_press_numbers: Vec<PressId>,
    /// Which parameters are calibrated.
    pub calibration: CalibrationModel,
    /// The lens that is calibrated.
    pub lens: LensKind,
    /// The least that a failed press counts in the RMSE with failures counted, mm; `None`: the RMS distance of the scored
    /// presses from their mean, the error of an answer that knows nothing.
    pub failure_penalty_mm: Option<f64>,
    /// A press is "within" when its error is at most this, mm.
    pub within_mm: f64,
    /// Bits per event in the bit rates (paper: 21).
    pub bits_per_event: f64,
    /// Most scored presses whose events are kept for the studies of data reduction and latency, spread evenly over
    /// the session (0: no studies).
    pub study_presses: u32,
    /// The data-reduction study.
    pub reduction: ReductionSettings,
    /// The detection-latency study.
    pub latency: LatencySettings,
    /// The contact map reconstruction error.
    pub cmre: CmreSettings,
    /// Limits of the alignment certificate.
    pub alignment: AlignmentSettings,
    /// Resamples of the bootstrap over locations.
    pub bootstrap_resamples: u32,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// Width of the event-rate bins, ms (paper: 10).
    pub rate_bin_ms: f64,
}

impl AnalysisSettings {
    /// True for a press that is left out by hand.
    #[must_use]
    pub fn excludes(&self, press: PressId) -> bool {
        self.exclude_press_numbers.contains(&press)
    }
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
            estimator: Estimator::Dbscan,
            precision: Precision::F64,
            forget_ms: 100.0,
            thinning: 1,
            bin_px: 1,
            window_after_contact_ms: None,
            window_anchor: WindowAnchor::Touch,
            cluster_threshold: ThresholdRule::Calibrated,
            min_cluster_events: 20,
            min_response_sigma: 5.0,
            min_ray_sine: 0.05,
            exclude_outside: true,
            exclude_press_numbers: Vec::new(),
            calibration: CalibrationModel::Auto,
            lens: LensKind::Exponential,
            failure_penalty_mm: None,
            within_mm: 5.0,
            bits_per_event: 21.0,
            study_presses: 300,
            reduction: ReductionSettings::default(),
            latency: LatencySettings::default(),
            cmre: CmreSettings::default(),
            alignment: AlignmentSettings::default(),
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
    /// For each camera, how long after an edge at its trigger input it stamps it, whole µs; 0 where nobody measured it.
    #[serde(default)]
    pub trigger_delay_us: [u16; 2],
}
