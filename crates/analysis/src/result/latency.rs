//! Owns the results of the detection-latency study.

use serde::{Deserialize, Serialize};
use skinrig_model::{LatencySettings, PressId, ThresholdGrid};

use super::Estimate;

/// Timing of the contacts of a session, which limits latencies from contact.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ContactTiming {
    /// True if any contact comes from a schedule instead of a measurement.
    pub scheduled: bool,
    /// RMS interval between the two pose samples around a contact, µs: the contact is interpolated between them. 0 if
    /// unknown.
    pub pose_interval_us: f64,
    /// Largest half width of the interval that certainly contains the instant of a sent trigger mark, µs; 0 without marks.
    pub mark_half_width_us: f64,
    /// RMS standard error of the instant at which the measured pose crossed the surface, µs; 0 if unknown.
    #[serde(default)]
    pub crossing_se_us: f64,
}

/// Detection latency.
///
/// The width, the median and the detected share follow the paper and refer to the *median onset*, because it has no measured
/// contact. They show how much onsets vary, not how late they are; [`Self::from_contact`] shows that.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Latency {
    /// The settings used.
    pub settings: LatencySettings,
    /// Trials: presses in view of both cameras, with background. One without any event is a trial without a detection.
    pub trials: u32,
    /// Presses that are not trials: without usable press or background, not executed as planned, or excluded by hand.
    pub unusable: u32,
    /// Trials shorter than 0.85 s to either side, truncated by a neighbouring press or the end of the kept events.
    pub shortened: u32,
    /// Longest time before and after contact that every trial covers, ms.
    pub covered_ms: (f64, f64),
    /// True if counts are smoothed as if nothing happened beyond the ends of a trial (public code), false if the kernel is
    /// renormalised there.
    pub zero_padded: bool,
    /// Delay of a live detector after the reported onset, ms: it has to wait for the rest of the run of bins and for half
    /// the kernel.
    pub decision_delay_ms: f64,
    /// Detections earlier than this after contact (a negative time) are false alarms, ms: half the kernel plus the 95 %
    /// uncertainty of a measured contact, or the window if not measured.
    #[serde(default)]
    pub earliest_ms: f64,
    /// Background time behind the background rates, s: sum over the trials.
    pub background_s: f64,
    /// Time in which a detection is a false alarm at the chosen threshold, s: from the start of each trial to its contact,
    /// or to the false alarm that ended its search.
    #[serde(default)]
    pub at_risk_s: f64,
    /// Median background rate of both cameras, events per second.
    pub background_rate_per_s: f64,
    /// One row per threshold tried, ascending; empty without trials.
    pub sweep: Vec<ThresholdRow>,
    /// Index of the chosen threshold in `sweep`; `None` if nothing was detected at any.
    pub chosen: Option<u32>,
    /// Share of trials detected within the window around the median onset, at the chosen threshold; a trial with a false
    /// alarm is not detected. For all or none the interval is exact, see [`Estimate`].
    pub detected_rate: Estimate,
    /// Width of the 5-95 % interval of the counting onsets, ms.
    pub width_ms: Estimate,
    /// Median onset after the contact (measured or scheduled), ms.
    pub median_ms: Estimate,
    /// `false_detections` divided by `at_risk_s`, per second; the interval is the exact Poisson interval.
    pub false_alarms_per_s: Estimate,
    /// (press, false alarm in ms after its contact, negative) of the presses whose search ended before contact. They have no
    /// latency.
    #[serde(default)]
    pub false_detections: Vec<(PressId, f64)>,
    /// Onsets against the hardware-timestamped contact; `None` if contact times come from a schedule, or a camera clock was
    /// aligned with the same events whose latency would be measured.
    pub from_contact: Option<ContactLatency>,
    /// The same detector on thinned events.
    pub reduced: Option<ReducedLatency>,
    /// Event rate of both cameras around the contact: percentiles over trials.
    pub course: LatencyCourse,
    /// (press, onset after contact in ms, or `None` if not detected) at the chosen threshold.
    pub onsets: Vec<(PressId, Option<f64>)>,
    /// The time before each contact, at the chosen threshold; in order of the presses, empty without a threshold.
    #[serde(default)]
    pub backgrounds: Vec<TrialBackground>,
}

/// Detector result before one contact, where nothing touched the skin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrialBackground {
    /// Press of the trial.
    pub press: PressId,
    /// False alarms: 0, or 1, which ended the search.
    pub alarms: u32,
    /// Search time, s: to the contact, or to the false alarm.
    pub length_s: f64,
}

/// The detector at one threshold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ThresholdRow {
    /// Threshold h.
    pub threshold: f64,
    /// Trials detected at or after contact.
    pub onsets: u32,
    /// Share of trials with an onset within the window of the median onset.
    pub detected_rate: f64,
    /// Median onset after contact, ms.
    pub median_ms: Option<f64>,
    /// 95th minus 5th percentile of the counting onsets, ms.
    pub width_ms: Option<f64>,
    /// Trials with a false alarm before contact.
    #[serde(default)]
    pub false_alarms: u32,
    /// Time in which a detection is a false alarm, s.
    #[serde(default)]
    pub at_risk_s: f64,
    /// False alarms divided by the time at risk; 0 without time at risk.
    pub false_alarms_per_s: f64,
}

/// Latency from the hardware-timestamped contact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ContactLatency {
    /// 5th percentile of the onsets, which exclude onsets before contact, ms.
    pub p5_ms: Estimate,
    /// Median, ms.
    pub median_ms: Estimate,
    /// 95th percentile, ms.
    pub p95_ms: Estimate,
    /// Trials with a false alarm before contact: [`Latency::false_detections`], excluded from the percentiles.
    pub before_contact: u32,
    /// Trials never detected: beyond every percentile, excluded from them.
    pub missed: u32,
    /// Standard uncertainty of one latency, ms: the parts below in quadrature. Excludes the height of the surface, which
    /// shifts all contacts alike (by its error divided by the speed of the tip).
    pub uncertainty_ms: f64,
    /// Width of a bin / sqrt(12), ms.
    pub from_bins_ms: f64,
    /// Clocks, ms: half widths of the alignment certificate at the presses, camera over box (the worse one) / 1.96 and host
    /// over box / sqrt(3), in quadrature; without a certificate the RMS residual of the clock fits (the worse camera) and
    /// the half width of the marks / sqrt(3).
    pub from_clocks_ms: f64,
    /// Resolution of the measured contact, ms: one interval of the pose samples / sqrt(12), the stated delay of its stamps
    /// / sqrt(12), and the standard error of the instant at which the pose crossed the surface, in quadrature; 0 when not
    /// known.
    pub from_contact_ms: f64,
}

/// Detection on thinned events, with its own thresholds and target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReducedLatency {
    /// k: round(n / k) of the n events of a trial, or of a background, are kept (public code).
    pub factor: u32,
    /// Candidate thresholds: first, last and number.
    pub thresholds: ThresholdGrid,
    /// Target share of detected trials.
    pub target_rate: f64,
    /// Chosen threshold; `None` if nothing was detected at any.
    pub threshold: Option<f64>,
    /// Share of trials detected within the window around the median onset.
    pub detected_rate: Estimate,
    /// Width of the 5-95 % interval of the counting onsets, ms.
    pub width_ms: Estimate,
    /// False alarms divided by the time at risk, per second; the interval is the exact Poisson interval.
    pub false_alarms_per_s: Estimate,
}

/// Percentiles of the smoothed event rate over trials, contact at 0.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LatencyCourse {
    /// Left edge of the first bin after contact, ms.
    pub start_ms: f64,
    /// Width of a bin, ms (wider than the detector's, for drawing).
    pub bin_ms: f64,
    /// 5th, 50th and 95th percentile of the trials in each bin, events per second of both cameras. Excludes bins that less
    /// than half of the trials cover.
    pub press_per_s: [Vec<f32>; 3],
    /// 5th, 50th and 95th percentile of the background over all its bins, events per second of both cameras.
    pub background_per_s: [f32; 3],
}
