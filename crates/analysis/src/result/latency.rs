//! Owns what the detection-latency study reports.

use serde::{Deserialize, Serialize};
use skinrig_model::{LatencySettings, PressId};

use super::Estimate;

/// When the cameras know of a touch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Latency {
    /// The settings used.
    pub settings: LatencySettings,
    /// Trials: presses with events of both cameras in the trial window.
    pub trials: u32,
    /// Presses in the study without a usable trial or background.
    pub unusable: u32,
    /// Background time looked at, s.
    pub background_s: f64,
    /// Median background rate of both cameras, events per second.
    pub background_rate_per_s: f64,
    /// One row per threshold tried, ascending.
    pub sweep: Vec<ThresholdRow>,
    /// Index of the threshold chosen in `sweep`; `None` when nothing was detected at any.
    pub chosen: Option<u32>,
    /// Share of trials detected within the window of the median onset, at the chosen threshold.
    pub detected_rate: Estimate,
    /// Width of the 5-95 % interval of the onsets that count, ms.
    pub width_ms: Estimate,
    /// Median onset after the measured contact, ms.
    pub median_ms: Estimate,
    /// False alarms per second of background, with a cool-down of one width.
    pub false_alarms_per_s: Estimate,
    /// Onsets against the hardware-timestamped contact; `None` when the contact times come from a schedule.
    pub from_contact: Option<ContactLatency>,
    /// Event rate of both cameras about the contact: percentiles over trials.
    pub course: LatencyCourse,
    /// (press, onset after contact in ms or `None` when not detected) at the chosen threshold.
    pub onsets: Vec<(PressId, Option<f64>)>,
}

/// The detector at one threshold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ThresholdRow {
    /// h.
    pub threshold: f64,
    /// Trials with any onset.
    pub onsets: u32,
    /// Share of trials with an onset within the window of the median onset.
    pub detected_rate: f64,
    /// Median onset after contact, ms.
    pub median_ms: Option<f64>,
    /// 95th minus 5th percentile of the onsets that count, ms.
    pub width_ms: Option<f64>,
    /// False alarms per second.
    pub false_alarms_per_s: f64,
}

/// Latency from the contact that the hardware timestamped.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ContactLatency {
    /// 5th percentile of the onsets at or after contact, ms.
    pub p5_ms: Estimate,
    /// Median, ms.
    pub median_ms: Estimate,
    /// 95th percentile, ms.
    pub p95_ms: Estimate,
    /// Onsets before the contact: false alarms by definition, not part of the percentiles.
    pub before_contact: u32,
    /// Trials never detected: beyond every percentile, not part of them.
    pub missed: u32,
    /// Standard uncertainty of one latency, ms: the parts below in quadrature.
    pub uncertainty_ms: f64,
    /// Width of a bin / sqrt(12), ms.
    pub from_bins_ms: f64,
    /// Residual of the clock fits (the worse camera), ms.
    pub from_clocks_ms: f64,
    /// Resolution of the measured contact: one interval of the pose samples / sqrt(12), ms; 0 when not known.
    pub from_contact_ms: f64,
}

/// Percentiles of the smoothed event rate over trials, contact at 0.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LatencyCourse {
    /// Time of the first bin's left edge after the contact, ms.
    pub start_ms: f64,
    /// Width of a bin, ms (wider than the detector's, for drawing).
    pub bin_ms: f64,
    /// 5th, 50th and 95th percentile of the trials in each bin, events per second of both cameras.
    pub press_per_s: [Vec<f32>; 3],
    /// 5th, 50th and 95th percentile of the background, events per second of both cameras.
    pub background_per_s: [f32; 3],
}
