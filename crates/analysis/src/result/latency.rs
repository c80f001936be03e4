//! Owns what the detection-latency study reports.

use serde::{Deserialize, Serialize};
use skinrig_model::{LatencySettings, PressId, ThresholdGrid};

use super::Estimate;

/// How the contacts of a session were timed: what a latency from the contact can be trusted to.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ContactTiming {
    /// True when any contact comes from a schedule instead of a measurement.
    pub scheduled: bool,
    /// RMS interval between the two pose samples around a contact, µs: the contact is interpolated between them. 0 when
    /// not known.
    pub pose_interval_us: f64,
    /// Largest half width of the interval in which the instant of a sent trigger mark certainly lies, µs; 0 without
    /// marks.
    pub mark_half_width_us: f64,
    /// RMS standard error of the instant at which the measured pose crossed the surface, µs; 0 when not known.
    #[serde(default)]
    pub crossing_se_us: f64,
}

/// When the cameras know of a touch.
///
/// The width, the median and the detected share follow the paper and are about the *median onset*: without a measured
/// contact nothing else can be said. They tell how much onsets differ, not how late they are; that is what
/// [`Self::from_contact`] tells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Latency {
    /// The settings used.
    pub settings: LatencySettings,
    /// Trials: presses that both cameras saw, with background. One without any event is a trial without a detection.
    pub trials: u32,
    /// Presses that are no trial: without a usable press or background, not done as planned, or left out by hand.
    pub unusable: u32,
    /// Trials shorter than 0.85 s to either side, because a neighbouring press or the end of what was kept cut them.
    pub shortened: u32,
    /// Longest time before and after the contact that every trial covers, ms.
    pub covered_ms: (f64, f64),
    /// True when counts are smoothed as if nothing happened beyond the ends of a trial (public code), false when the
    /// kernel is renormalised there.
    pub zero_padded: bool,
    /// A detector that runs live knows an onset this much after its reported time, ms: it has to wait for the rest of
    /// the run of bins and for half the kernel.
    pub decision_delay_ms: f64,
    /// A trip earlier than this after the contact (a negative time) is before it, ms: half the kernel and the 95 %
    /// uncertainty of a measured contact, or the window where it was not measured.
    #[serde(default)]
    pub earliest_ms: f64,
    /// Background time that the background rates stand on, s: the sum of the background windows of the trials.
    pub background_s: f64,
    /// Time in which a trip is a false alarm at the chosen threshold, s: from the start of each trial to its contact, or to
    /// the false alarm that ended its search.
    #[serde(default)]
    pub at_risk_s: f64,
    /// Median background rate of both cameras, events per second.
    pub background_rate_per_s: f64,
    /// One row per threshold tried, ascending; empty without trials.
    pub sweep: Vec<ThresholdRow>,
    /// Index of the threshold chosen in `sweep`; `None` when nothing was detected at any.
    pub chosen: Option<u32>,
    /// Share of trials detected within the window of the median onset, at the chosen threshold; a trial that tripped before
    /// its contact is not. Of all or none the interval is exact, see [`Estimate`].
    pub detected_rate: Estimate,
    /// Width of the 5-95 % interval of the onsets that count, ms.
    pub width_ms: Estimate,
    /// Median onset after the contact (measured or scheduled), ms.
    pub median_ms: Estimate,
    /// Trips before the contact, `false_detections`, over `at_risk_s`, per second; the interval is the exact Poisson one.
    pub false_alarms_per_s: Estimate,
    /// (press, trip after its contact in ms, negative) of the presses whose search ended before the contact. They have no
    /// latency.
    #[serde(default)]
    pub false_detections: Vec<(PressId, f64)>,
    /// Onsets against the hardware-timestamped contact; `None` when contact times come from a schedule or a camera's
    /// clock was aligned by the very events whose latency is asked for.
    pub from_contact: Option<ContactLatency>,
    /// The same detector on thinned events.
    pub reduced: Option<ReducedLatency>,
    /// Event rate of both cameras about the contact: percentiles over trials.
    pub course: LatencyCourse,
    /// (press, onset after contact in ms or `None` when not detected) at the chosen threshold.
    pub onsets: Vec<(PressId, Option<f64>)>,
    /// The time before each contact, at the chosen threshold; in order of the presses, empty without one.
    #[serde(default)]
    pub backgrounds: Vec<TrialBackground>,
}

/// What a detector did before one contact, where nothing touched.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrialBackground {
    /// Which trial.
    pub press: PressId,
    /// False alarms: 0, or 1, which ended the search.
    pub alarms: u32,
    /// How long it looked, s: to the contact, or to the false alarm.
    pub length_s: f64,
}

/// The detector at one threshold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ThresholdRow {
    /// h.
    pub threshold: f64,
    /// Trials that tripped, and not before their contact.
    pub onsets: u32,
    /// Share of trials with an onset within the window of the median onset.
    pub detected_rate: f64,
    /// Median onset after contact, ms.
    pub median_ms: Option<f64>,
    /// 95th minus 5th percentile of the onsets that count, ms.
    pub width_ms: Option<f64>,
    /// Trials that tripped before their contact.
    #[serde(default)]
    pub false_alarms: u32,
    /// Time in which a trip is a false alarm, s.
    #[serde(default)]
    pub at_risk_s: f64,
    /// The one over the other; 0 without time at risk.
    pub false_alarms_per_s: f64,
}

/// Latency from the contact that the hardware timestamped.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ContactLatency {
    /// 5th percentile of the onsets, none of which is before the contact, ms.
    pub p5_ms: Estimate,
    /// Median, ms.
    pub median_ms: Estimate,
    /// 95th percentile, ms.
    pub p95_ms: Estimate,
    /// Trials that tripped before their contact: [`Latency::false_detections`], not part of the percentiles.
    pub before_contact: u32,
    /// Trials never detected: beyond every percentile, not part of them.
    pub missed: u32,
    /// Standard uncertainty of one latency, ms: the parts below in quadrature. Not in it: where the surface is, which
    /// shifts all contacts alike (by its error over the speed of the tip).
    pub uncertainty_ms: f64,
    /// Width of a bin / sqrt(12), ms.
    pub from_bins_ms: f64,
    /// Clocks, ms: the half widths of the alignment certificate at the presses, camera over box (the worse one) / 1.96 and
    /// host over box / sqrt(3), in quadrature; without a certificate the RMS residual of the clock fits (the worse camera)
    /// and the half width of the marks / sqrt(3).
    pub from_clocks_ms: f64,
    /// Resolution of the measured contact, ms: one interval of the pose samples / sqrt(12), the stated delay of its stamps
    /// / sqrt(12), and the standard error of the instant at which the pose crossed the surface, in quadrature; 0 when not
    /// known.
    pub from_contact_ms: f64,
}

/// Detection on thinned events, with thresholds and a target of its own.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReducedLatency {
    /// k: of the n events of a trial, and of a background, round(n / k) are kept (public code).
    pub factor: u32,
    /// Thresholds tried: first, last and how many.
    pub thresholds: ThresholdGrid,
    /// Share of trials that the threshold chosen should detect.
    pub target_rate: f64,
    /// The threshold chosen; `None` when nothing was detected at any.
    pub threshold: Option<f64>,
    /// Share of trials detected within the window of the median onset.
    pub detected_rate: Estimate,
    /// Width of the 5-95 % interval of the onsets that count, ms.
    pub width_ms: Estimate,
    /// Trips before the contact over the time at risk, per second; the interval is the exact Poisson one.
    pub false_alarms_per_s: Estimate,
}

/// Percentiles of the smoothed event rate over trials, contact at 0.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LatencyCourse {
    /// Time of the first bin's left edge after the contact, ms.
    pub start_ms: f64,
    /// Width of a bin, ms (wider than the detector's, for drawing).
    pub bin_ms: f64,
    /// 5th, 50th and 95th percentile of the trials in each bin, events per second of both cameras. Bins that less than
    /// half of the trials cover are left out.
    pub press_per_s: [Vec<f32>; 3],
    /// 5th, 50th and 95th percentile of the background over all its bins, events per second of both cameras.
    pub background_per_s: [f32; 3],
}
