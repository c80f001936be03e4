//! The result of an analysis: every number that a report shows, with its n.

mod alignment;
mod audit;
mod calibration;
mod coverage;
mod latency;
mod motion;
mod reduction;
mod reference;
mod validity;

pub use alignment::{
    Alignment, AlignmentStatus, ClockMap, ClockResidual, ClockResiduals, Knot, LineCounts, MapName,
    RatesEvidence, RatesSights,
};
pub use audit::{Fault, Finding, Law};
pub use calibration::{CalibrationResult, ModelComparison, ModelTest, ThresholdChoice};
pub use coverage::{Activity, BitRates, Cmre, Coverage, OffSensor};
pub use latency::{
    ContactLatency, ContactTiming, Latency, LatencyCourse, ReducedLatency, ThresholdRow,
    TrialBackground,
};
pub use motion::{Motion, MotionBin, PressMotion, TipSample};
pub use reduction::{Reduction, ReductionCurve, ReductionRow, Thinning};
pub use reference::{ReferenceCode, ReferenceReduction};

use serde::{Deserialize, Serialize};
use skinrig_model::{
    AnalysisSettings, CameraId, LocationId, Point2, PressId, PressRole, PressTiming, RepetitionId,
    RigGeometry, StereoGeometry,
};

/// Version of this layout and of the algorithms behind it; part of every result.
pub const ANALYSIS_VERSION: u32 = 7;

/// The result of analysing one session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Analysis {
    /// [`ANALYSIS_VERSION`].
    pub version: u32,
    /// The settings used.
    pub settings: AnalysisSettings,
    /// The rig as described by the session.
    pub rig: RigGeometry,
    /// The camera geometry that located the presses (calibrated, or the nominal one).
    pub geometry: StereoGeometry,
    /// How the presses ended: planned = valid + missed + invalid + excluded.
    pub counts: PressCounts,
    /// Clock fits, camera 1 and camera 2; `None` where no alignment was possible.
    pub clocks: [Option<ClockFit>; 2],
    /// The clocks of each leg, for a session in several: `clocks` are one line through all of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub legs: Vec<LegClock>,
    /// The alignment certificate: whether the clocks are known well enough for the numbers to be used.
    #[serde(default)]
    pub alignment: Alignment,
    /// How the contacts were timed.
    pub contact_timing: ContactTiming,
    /// The calibration, when there was one.
    pub calibration: Option<CalibrationResult>,
    /// Metrics over the scored presses that are valid and not excluded.
    pub scored: Metrics,
    /// Metrics over all scored presses with an estimate, exclusions ignored.
    pub scored_without_exclusions: Metrics,
    /// RMSE over all attempted scored presses, failed ones included.
    pub penalised: Penalised,
    /// The least number of cluster events, when it was chosen on the calibrating presses.
    pub threshold: Option<ThresholdChoice>,
    /// Areas and taxels.
    pub coverage: Option<Coverage>,
    /// Contact map reconstruction error.
    pub cmre: Option<Cmre>,
    /// Data rates.
    pub bit_rates: Option<BitRates>,
    /// The data-reduction study.
    pub reduction: Option<Reduction>,
    /// The detection-latency study.
    pub latency: Option<Latency>,
    /// The public code's numbers, in reference-code mode only.
    pub reference: Option<ReferenceCode>,
    /// Broken laws; empty for a plausible session.
    pub findings: Vec<Finding>,
    /// Events per pixel over the whole recording, camera 1 and camera 2.
    pub activity: Vec<Activity>,
    /// Events outside the sensor, left out of everything, camera 1 and camera 2.
    #[serde(default)]
    pub off_sensor: [OffSensor; 2],
    /// The RMSE of the scored presses at each depth, shallowest first; empty when one depth was scored.
    pub depths: Vec<DepthResult>,
    /// Event-rate course of each camera over the whole session.
    pub rates: [RateSeries; 2],
    /// One row per planned press, in plan order.
    pub presses: Vec<PressResult>,
    /// Things a reader must know: fallbacks taken, data missing, suspicious residuals.
    pub warnings: Vec<String>,
    /// What the cameras saw of a few scored presses, spread over the session and the skin.
    pub pictures: Vec<PressPicture>,
    /// The event rates around a few scored presses.
    pub zooms: Vec<RateZoom>,
    /// How the robot followed its commands; `None` when no pose was handed over ([`crate::motion`]).
    #[serde(default)]
    pub motion: Option<Motion>,
}

/// How the presses ended. Sync presses are counted apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct PressCounts {
    /// Calibrating and scored presses in the plan.
    pub planned: u32,
    /// Done, recorded, not excluded.
    pub valid: u32,
    /// Never attempted.
    pub missed: u32,
    /// Attempted but not as planned, or with data lost.
    pub invalid: u32,
    /// Done, but left out by a rule.
    pub excluded: u32,
    /// Sync presses in the plan.
    pub sync: u32,
}

impl PressCounts {
    /// True when every planned press is counted exactly once.
    #[must_use]
    pub const fn add_up(&self) -> bool {
        self.planned == self.valid + self.missed + self.invalid + self.excluded
    }
}

/// `camera_us = offset_us + (1 + drift_ppm * 1e-6) * host_us`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ClockFit {
    /// How it was found.
    pub method: ClockMethod,
    /// Camera time at host time 0, µs.
    pub offset_us: f64,
    /// Rate difference, parts per million.
    pub drift_ppm: f64,
    /// Standard error of the drift, ppm: 1.96 of it are half of the 95 % interval, for rates that change evenly or in small steps. Of
    /// rates that swing it may be too small (`docs/reference/time-base.md`).
    pub drift_se_ppm: f64,
    /// Root mean square residual, µs.
    pub residual_rms_us: f64,
    /// Largest absolute residual, µs.
    pub residual_max_us: f64,
    /// Points used.
    pub n: u32,
    /// Points left out as outliers or strays.
    pub rejected: u32,
}

/// The cameras' clocks in one leg of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LegClock {
    /// 1, 2, 3, ...
    pub number: u32,
    /// Where it begins on the host's clock, s.
    pub start_s: f64,
    /// The fit to this leg alone, camera 1 and camera 2, in the camera times of the whole session; `None` where its own trains or
    /// marks give none.
    pub cameras: [Option<ClockFit>; 2],
}

/// How a clock fit was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClockMethod {
    /// From the reports of the trigger box and the coded edges that the cameras saw of it.
    TimeBase,
    /// From coded marks on the trigger line.
    TriggerMarks,
    /// From the presses found in the event rates.
    EventRates,
}

/// A number with its 95 % interval and the n behind it. Intervals come from a bootstrap, which sees no spread in what
/// never or always happened: those of a share of 0 or 1 are exact binomial ones with the number of locations for n
/// (0: up to 1 - 0.025^(1 / n); 1: from 0.025^(1 / n)). That of a count over a time is the exact Poisson one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The value; `None` when n is too small for it.
    pub value: Option<f64>,
    /// Lower end of the 95 % interval.
    pub low: Option<f64>,
    /// Upper end.
    pub high: Option<f64>,
    /// How many presses (or, for the std between repetitions, locations at one depth) it stands on.
    pub n: u32,
}

/// The error at one depth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DepthResult {
    /// Planned depth, mm.
    pub depth_mm: f64,
    /// Root mean square Euclidean error of the presses that count at this depth.
    pub rmse_mm: Estimate,
}

/// Localisation metrics, mm. Intervals come from a bootstrap that resamples locations; shares of 0 and 1 as in
/// [`Estimate`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// Root mean square Euclidean error.
    pub rmse_mm: Estimate,
    /// Root mean square error along x.
    pub rmse_x_mm: Estimate,
    /// Root mean square error along y.
    pub rmse_y_mm: Estimate,
    /// Mean error along x (bias).
    pub bias_x_mm: Estimate,
    /// Mean error along y (bias).
    pub bias_y_mm: Estimate,
    /// Median Euclidean error.
    pub median_mm: Estimate,
    /// 95th percentile of the Euclidean error.
    pub p95_mm: Estimate,
    /// Mean over locations and depths of the std between repetitions (Euclid, sample std with n-1).
    pub repeat_std_mm: Estimate,
    /// Share of the attempted scored presses, invalid ones included, that got an estimate which counts here.
    pub located_rate: Estimate,
    /// Share of the attempted scored presses that got an estimate which counts here and errs by at most
    /// `within_mm`.
    pub within_rate: Estimate,
    /// RMSE as a share of the skin's diagonal, percent.
    pub rmse_diagonal_percent: Option<f64>,
}

/// The RMSE with failures counted. Its value is never below that of the presses that count, nor below that of all presses
/// with an estimate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Penalised {
    /// What a failed press counts at least, mm. One with an estimate that errs by more counts its own error.
    pub penalty_mm: f64,
    /// True when the penalty was derived from the probed locations, false when the settings name it.
    pub derived: bool,
    /// True when that was below the RMSE of the presses with an estimate, and the penalty was raised to it.
    #[serde(default)]
    pub raised: bool,
    /// Failed presses: attempted, and without an estimate that counts.
    pub failures: u32,
    /// How many of them count an error of their own above the penalty.
    #[serde(default)]
    pub beyond_penalty: u32,
    /// The RMSE, mm.
    pub rmse_mm: Estimate,
}

/// An event-rate course.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RateSeries {
    /// Host time of the first bin's left edge, s (camera time when there is no clock fit). Only events in
    /// the rows of the crop are counted.
    pub start_s: f64,
    /// Width of a bin, s. Grows for long sessions so that a series stays below a few thousand bins.
    pub bin_s: f64,
    /// Mean rate in each bin, events per second.
    pub mean_per_s: Vec<f32>,
    /// Highest rate among the fine bins (`rate_bin_ms`) within each bin, events per second.
    pub peak_per_s: Vec<f32>,
}

/// What came out for one press.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PressResult {
    /// Which press.
    pub press: PressId,
    /// What for.
    pub role: PressRole,
    /// Repetition.
    pub repetition: RepetitionId,
    /// Location.
    pub location: LocationId,
    /// Planned position.
    pub planned: Point2,
    /// Planned depth, mm.
    pub depth_mm: f64,
    /// Measured position: the truth.
    pub truth: Option<Point2>,
    /// `valid`, `missed`, `invalid` or `excluded`.
    pub verdict: String,
    /// The reason in full, with this press's numbers, for everything but valid.
    pub reason: Option<String>,
    /// The rule behind the reason: a short name without this press's numbers, so that presses can be grouped.
    pub rule: Option<String>,
    /// Measured moments, host clock.
    pub timing: Option<PressTiming>,
    /// What each camera saw.
    pub views: [Option<PressView>; 2],
    /// Where the skin says it was touched.
    pub location_outcome: LocationOutcome,
}

impl PressResult {
    /// The estimate, when there is one.
    #[must_use]
    pub const fn estimate(&self) -> Option<Point2> {
        self.location_outcome.estimate()
    }

    /// Error vector (estimate - truth), mm.
    #[must_use]
    pub fn error_mm(&self) -> Option<(f64, f64)> {
        let (e, t) = (self.estimate()?, self.truth?);
        Some((e.x_mm - t.x_mm, e.y_mm - t.y_mm))
    }
}

/// What one camera saw of one press.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PressView {
    /// Events in the window and crop.
    pub events: u32,
    /// How many of them ON.
    pub on_events: u32,
    /// Clusters found.
    pub clusters: u32,
    /// Events in the cluster(s) that make the centroid.
    pub cluster_events: u32,
    /// Their mean column, px; `None` without a cluster.
    pub centroid_u: Option<f64>,
    /// Their mean row, px.
    pub centroid_v: Option<f64>,
    /// Events per second in the window.
    pub rate_per_s: f64,
    /// Events per second in the idle time before the press; 0 when `idle_s` is 0.
    pub idle_rate_per_s: f64,
    /// Length of the idle time that the idle rate stands on, s; 0 when the presses leave none.
    pub idle_s: f64,
    /// Standard deviation of the columns of the events in the cluster(s) that make the centroid, px; `None` without
    /// clusters.
    #[serde(default)]
    pub spread_u: Option<f64>,
    /// Columns of the narrowest stretch that holds half of the events that the press added to the idle rate, px; `None`
    /// when it added too few to tell.
    #[serde(default)]
    pub width_u: Option<f64>,
}

/// The events of one press in one camera, counted per pixel: columns all, rows of the crop.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PressPicture {
    /// Which press.
    pub press: PressId,
    /// Which camera.
    pub camera: CameraId,
    /// First and last row of the crop, both included.
    pub rows: (u16, u16),
    /// The pixels with events, row by row.
    pub pixels: Vec<PicturePixel>,
}

/// One pixel of a [`PressPicture`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct PicturePixel {
    /// Column, 0..640.
    pub u: u16,
    /// Row on the sensor, 0..480.
    pub v: u16,
    /// ON events.
    pub on: u32,
    /// OFF events.
    pub off: u32,
    /// True when the pixel belongs to the cluster(s) that make the centroid.
    pub clustered: bool,
}

/// The event rate of one camera around one press, in fine bins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RateZoom {
    /// Which press.
    pub press: PressId,
    /// Which camera.
    pub camera: CameraId,
    /// Time of the first bin's left edge after the measured contact, s (negative: before it).
    pub start_s: f64,
    /// Width of a bin, s.
    pub bin_s: f64,
    /// ON events per second in each bin, rows of the crop only.
    pub on_per_s: Vec<f32>,
    /// OFF events per second in each bin.
    pub off_per_s: Vec<f32>,
    /// The measured release after the measured contact, s.
    pub release_s: f64,
}

/// The result of intersecting the two rays.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum LocationOutcome {
    /// Inside the outline.
    Located {
        /// Where, mm.
        at: Point2,
        /// Sine of the angle between the rays.
        sine: f64,
    },
    /// The rays meet outside the outline.
    Outside {
        /// Where, mm.
        at: Point2,
        /// Sine of the angle between the rays.
        sine: f64,
    },
    /// The rays are parallel, or too nearly so.
    Parallel {
        /// Sine of the angle between the rays.
        sine: f64,
    },
    /// The lines meet behind a camera.
    Behind {
        /// Sine of the angle between the rays.
        sine: f64,
    },
    /// A view has no centroid.
    Missing,
}

impl LocationOutcome {
    /// The estimate of `Located` and `Outside`.
    #[must_use]
    pub const fn estimate(&self) -> Option<Point2> {
        match self {
            Self::Located { at, .. } | Self::Outside { at, .. } => Some(*at),
            _ => None,
        }
    }

    /// `located`, `outside`, `parallel`, `behind` or `missing`.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Located { .. } => "located",
            Self::Outside { .. } => "outside",
            Self::Parallel { .. } => "parallel",
            Self::Behind { .. } => "behind",
            Self::Missing => "missing",
        }
    }
}
