//! Owns the result of an analysis: every number in a report, with its n.

mod alignment;
mod audit;
mod calibration;
mod camera_change;
mod campaign;
mod clock_map;
mod common_exclusion;
mod coverage;
mod evidence;
mod evidence_parts;
#[cfg(test)]
mod evidence_tests;
mod felt;
mod grave;
mod indentation;
mod latency;
mod left_out;
mod locator;
mod motion;
mod other_reading;
mod paired_test;
mod quiet_part;
mod readout_fault;
mod recalibration;
mod reduction;
mod reference;
mod termination;
#[cfg(test)]
mod tests;
mod validity;
mod violation;
mod warning;
mod warning_words;

pub use alignment::{
    Alignment, AlignmentStatus, ClockResidual, ClockResiduals, Knot, LineCounts, RatesDetections,
    RatesEvidence,
};
pub use audit::{Fault, Finding, Law};
pub use calibration::{CalibrationResult, ModelComparison, ThresholdChoice};
pub use camera_change::{CameraChange, Changed};
pub use campaign::CampaignLooks;
pub use clock_map::{ClockMap, MapName};
pub use common_exclusion::CommonExclusion;
pub use coverage::{Activity, BitRates, Cmre, Coverage, OffSensor};
pub use evidence::Evidence;
pub(crate) use evidence::MOST_OF_GUESS;
pub(crate) use evidence_parts::{
    FittingPlan, OnsetHeight, PeakForce, Response, SeenMarks, Silence,
};
pub use felt::{FeltReactions, FeltTouches, Spread};
pub use indentation::{
    Indentation, NoQuantity, PressIndentation, Quantity, QuantityAtDepth, QuantityErrors, Ranged,
    ZeroReturn,
};
pub use latency::{
    ContactLatency, ContactTiming, Latency, LatencyCourse, ReducedLatency, ThresholdRow,
    TrialBackground,
};
pub use locator::{
    CameraField, FieldModel, FieldPoint, LearntPlaces, LocatorComparison, LocatorFallback,
    LocatorModel, LocatorResult, PositionPrior, Region, RegionLevel, ReliabilityRow, Scatter,
    SpreadField,
};
pub use motion::{Motion, MotionBin, PressMotion, TipSample};
pub use other_reading::OtherReading;
pub(crate) use other_reading::{Corner, FrameChange, Origin, OtherPlan, Turn};
pub use paired_test::PairedTest;
pub use quiet_part::QuietPart;
pub use readout_fault::ReadoutFault;
pub use recalibration::{CameraMove, EarlierSession, Move, Recalibration, RemountPart};
pub use reduction::{Reduction, ReductionCurve, ReductionRow, Thinning};
pub use reference::{ReferenceCode, ReferenceReduction};
pub use termination::Termination;
pub use violation::AlignmentViolation;
pub use warning::{Warning, WarningCause};

use serde::{Deserialize, Serialize};
use skinrig_model::{
    AnalysisSettings, CameraId, LocationId, Point2, PressId, PressRole, PressTiming, RepetitionId,
    RigGeometry, StereoGeometry, Verdict,
};

use crate::exclusion::Exclusion;
use crate::rule::Rule;

/// Version of this layout and of the algorithms behind it; part of every result. Results of another version are not read,
/// except their summary. Version 29: positions in another scale are also found about their middle, and unused settings are named. Version 30:
/// so are lists of presses in any other order. Version 31: touches felt while recording have depths. Version 32: parts of the picture without
/// events are named. Version 33: so are cameras that change, and faults of the readout; slow tips and bent skins are no faults. Version 34: results are
/// the same on every processor. Version 35: a clock that drifts for hours does not step.
pub const ANALYSIS_VERSION: u32 = 35;

/// The result of analysing one session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Analysis {
    /// [`ANALYSIS_VERSION`].
    pub version: u32,
    /// The settings used.
    pub settings: AnalysisSettings,
    /// The rig as described by the session.
    pub rig: RigGeometry,
    /// Camera geometry that located the presses (calibrated, or nominal).
    pub geometry: StereoGeometry,
    /// Outcomes of the presses: planned = valid + missed + invalid + excluded.
    pub counts: PressCounts,
    /// Clock fits, camera 1 and camera 2; `None` if no alignment was possible.
    pub clocks: [Option<ClockFit>; 2],
    /// Clocks of each leg, if there are several; `clocks` are one line through all of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub legs: Vec<LegClock>,
    /// Alignment certificate: whether the clocks are known well enough.
    #[serde(default)]
    pub alignment: Alignment,
    /// Timing of the contacts.
    pub contact_timing: ContactTiming,
    /// The calibration, if there was one.
    pub calibration: Option<CalibrationResult>,
    /// Origin of the calibration, if it is that of an earlier session.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recalibration: Option<Recalibration>,
    /// The locator that turned columns into positions; `None` in results before version 8: the geometry.
    #[serde(default)]
    pub locator: Option<LocatorResult>,
    /// Depth and force estimated from the events; `None` unless the calibration presses have several depths.
    #[serde(default)]
    pub indentation: Option<Indentation>,
    /// Metrics over the valid, not excluded scored presses.
    /// The interval of the RMSE of a campaign that ends by itself is that of its last look, at the level of that look.
    pub scored: Metrics,
    /// Metrics over all scored presses with an estimate, ignoring exclusions.
    pub scored_without_exclusions: Metrics,
    /// RMSE over all attempted scored presses, including failed ones.
    pub penalised: PenalisedRmse,
    /// Minimum number of cluster events, if chosen on the calibration presses.
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
    /// The public code's numbers, only in reference-code mode.
    pub reference: Option<ReferenceCode>,
    /// Violated laws; empty for a plausible session.
    pub findings: Vec<Finding>,
    /// Events per pixel over the whole recording, camera 1 and camera 2.
    #[serde(default)]
    pub activity: Vec<Activity>,
    /// Ignored events outside the sensor, camera 1 and camera 2.
    #[serde(default)]
    pub off_sensor: [OffSensor; 2],
    /// RMSE of the scored presses at each depth that all of them reached, shallowest first; empty for a single depth.
    pub depths: Vec<DepthResult>,
    /// Event rates of each camera over the whole session.
    #[serde(default)]
    pub rates: [RateSeries; 2],
    /// One row per planned press, in plan order.
    pub presses: Vec<PressResult>,
    /// Warnings for the reader: fallbacks, missing data, suspicious residuals.
    pub warnings: Vec<Warning>,
    /// Events per pixel of a few scored presses, spread over the session and the skin.
    #[serde(default)]
    pub pictures: Vec<PressPicture>,
    /// Event rates around a few scored presses.
    #[serde(default)]
    pub zooms: Vec<RateZoom>,
    /// Looks of a campaign that ends by itself; `None` if the plan declares none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub campaign: Option<CampaignLooks>,
    /// Pixels of each camera that do not count.
    #[serde(default)]
    pub hot_pixels: [HotPixels; 2],
    /// Touches felt while the session was recorded; `None` if none were to be felt.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub felt: Option<FeltTouches>,
    /// How the robot followed its commands; `None` without poses ([`crate::motion`]).
    #[serde(default)]
    pub motion: Option<Motion>,
}

/// Outcomes of the presses. Sync presses are counted separately.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct PressCounts {
    /// Calibration and scored presses in the plan.
    pub planned: u32,
    /// Executed, recorded, not excluded.
    pub valid: u32,
    /// Never attempted.
    pub missed: u32,
    /// Attempted but not as planned, or with lost data.
    pub invalid: u32,
    /// Executed, but excluded by a rule.
    pub excluded: u32,
    /// Sync presses in the plan.
    pub sync: u32,
}

impl PressCounts {
    /// True if every planned press is counted exactly once.
    #[must_use]
    pub const fn add_up(&self) -> bool {
        self.planned == self.valid + self.missed + self.invalid + self.excluded
    }
}

/// `camera_us = offset_us + (1 + drift_ppm * 1e-6) * host_us`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ClockFit {
    /// How the fit was found.
    pub method: ClockMethod,
    /// Camera time at host time 0, µs.
    pub offset_us: f64,
    /// Rate difference, parts per million.
    pub drift_ppm: f64,
    /// Standard error of the drift, ppm: 1.96 of them are half of the 95 % interval, for rates that change evenly or in
    /// small steps. It may be too small for oscillating rates (`docs/reference/time-base.md`).
    pub drift_se_ppm: f64,
    /// Root mean square residual, µs.
    pub residual_rms_us: f64,
    /// Largest absolute residual, µs.
    pub residual_max_us: f64,
    /// Points used.
    pub n: u32,
    /// Points rejected as outliers or strays.
    pub rejected: u32,
}

/// Camera clocks in one leg of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LegClock {
    /// 1, 2, 3, ...
    pub number: u32,
    /// Start on the host clock, s.
    pub start_s: f64,
    /// Fit to this leg alone, camera 1 and camera 2, in the camera times of the whole session; `None` if its own trains or
    /// marks give none.
    pub cameras: [Option<ClockFit>; 2],
}

/// Source of a clock fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClockMethod {
    /// Trigger box reports and the coded edges that the cameras saw.
    TimeBase,
    /// Coded marks on the trigger line.
    TriggerMarks,
    /// Presses found in the event rates.
    EventRates,
}

/// A number with its 95 % interval and its n. Intervals are over locations, as in comparisons of skins: studentised for means
/// and mean squares (Student's t below 8 locations), score limits for shares, ranks for percentiles. A share of 0 or 1 has
/// the exact binomial interval with the number of locations for n (0: up to 1 - 0.025^(1 / n); 1: from 0.025^(1 / n)), and a
/// count over a time the exact Poisson interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Value; `None` if n is too small.
    pub value: Option<f64>,
    /// Lower end of the 95 % interval.
    pub low: Option<f64>,
    /// Upper end.
    pub high: Option<f64>,
    /// Number of presses (for the std between repetitions, of locations at one depth).
    pub n: u32,
}

impl Estimate {
    /// A value from `n` presses and the ends of its interval; a value that does not exist has none.
    pub(crate) fn new(value: Option<f64>, ends: Option<(f64, f64)>, n: usize) -> Self {
        let ends = ends.filter(|_| value.is_some());
        Self {
            value,
            low: ends.map(|e| e.0),
            high: ends.map(|e| e.1),
            n: n as u32,
        }
    }
}

/// Error at one depth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DepthResult {
    /// Planned depth, mm.
    pub depth_mm: f64,
    /// Root mean square Euclidean error of the counting presses at this depth.
    pub rmse_mm: Estimate,
}

/// Localisation metrics, mm.
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
    /// Mean over locations and depths of the std between repetitions (Euclidean, sample std with n - 1).
    pub repeat_std_mm: Estimate,
    /// Share of the attempted scored presses, including invalid ones, with a counting estimate.
    pub located_rate: Estimate,
    /// Share of the attempted scored presses with a counting estimate and an error of at most `within_mm`.
    pub within_rate: Estimate,
    /// RMSE as a share of the skin's diagonal, percent.
    pub rmse_diagonal_percent: Option<f64>,
}

/// Smallest share of the scored presses whose error may rank a skin, meet a limit or end a campaign: the error of fewer
/// is that of the easy ones.
pub const LEAST_LOCATED: f64 = 0.5;

/// RMSE with failures counted. Never below that of the counting presses, nor below that of all presses with an estimate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PenalisedRmse {
    /// Minimum error of a failed press, mm. One with an estimate and a larger error counts its own error.
    pub penalty_mm: f64,
    /// True if the penalty was derived from the probed locations, false if set in the settings.
    pub derived: bool,
    /// True if the penalty was raised to the RMSE of the presses with an estimate.
    #[serde(default)]
    pub raised: bool,
    /// Failed presses: attempted, but without a counting estimate.
    pub failures: u32,
    /// Failed presses that count their own error above the penalty.
    #[serde(default)]
    pub beyond_penalty: u32,
    /// The RMSE, mm.
    pub rmse_mm: Estimate,
}

/// Event rates over time.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RateSeries {
    /// Host time of the first bin's left edge, s (camera time without a clock fit). Only events in the rows of the crop are
    /// counted.
    pub start_s: f64,
    /// Width of a bin, s. Grows for long sessions, to limit a series to a few thousand bins.
    pub bin_s: f64,
    /// Mean rate in each bin, events per second.
    pub mean_per_s: Vec<f32>,
    /// Highest rate among the fine bins (`rate_bin_ms`) within each bin, events per second.
    pub peak_per_s: Vec<f32>,
}

/// Result of one press.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PressResult {
    /// Press.
    pub press: PressId,
    /// Role of the press.
    pub role: PressRole,
    /// Repetition.
    pub repetition: RepetitionId,
    /// Location.
    pub location: LocationId,
    /// Planned position.
    pub planned: Point2,
    /// Planned depth, mm.
    pub depth_mm: f64,
    /// Measured position, which is the ground truth.
    pub truth: Option<Point2>,
    /// Verdict on the press.
    pub verdict: Verdict,
    /// Why it does not count; `None` if valid. In JSON also its texts: `reason` with this press's numbers, and `rule` without.
    #[serde(flatten, with = "crate::exclusion")]
    pub cause: Option<Exclusion>,
    /// Measured times, host clock.
    pub timing: Option<PressTiming>,
    /// View of each camera.
    pub views: [Option<PressView>; 2],
    /// Location estimate from the cameras.
    pub location_outcome: LocationOutcome,
    /// 95 % region of the estimate; `None` without an estimate, or if too few calibration presses determine it.
    #[serde(default)]
    pub region: Option<Region>,
    /// True if the columns are beyond those that taught the locator.
    #[serde(default)]
    pub extrapolated: bool,
}

impl PressResult {
    /// Why it does not count, with this press's numbers; `None` if valid.
    #[must_use]
    pub fn reason(&self) -> Option<String> {
        self.cause.as_ref().map(Exclusion::to_string)
    }

    /// The rule behind the reason; `None` if valid.
    #[must_use]
    pub fn rule(&self) -> Option<Rule> {
        self.cause.as_ref().map(Exclusion::rule)
    }

    /// The estimate, if there is one.
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

    /// True for a press of the headline: scored, valid, with truth and estimate.
    #[must_use]
    pub fn is_in_headline(&self) -> bool {
        let is_scored = self.role == PressRole::Score && self.verdict == Verdict::Valid;
        is_scored && self.error_mm().is_some()
    }
}

/// Pixels of the crop that fire in idle time again and again, and no more during presses. Their events do not count.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct HotPixels {
    /// Column and row of each.
    pub pixels: Vec<(u16, u16)>,
    /// Pixels of the crop.
    pub of: u32,
    /// Highest idle rate among them, events/s.
    pub highest_per_s: f64,
    /// Share of the idle events of the crop that comes from them.
    pub idle_share: f64,
}

/// View of a press by one camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PressView {
    /// Events in the window and crop.
    pub events: u32,
    /// ON events among them.
    pub on_events: u32,
    /// Clusters found.
    pub clusters: u32,
    /// Events in the cluster(s) behind the centroid.
    pub cluster_events: u32,
    /// Mean column of these events, px; `None` without a cluster.
    pub centroid_u: Option<f64>,
    /// Mean row of these events, px.
    pub centroid_v: Option<f64>,
    /// Events per second in the window.
    pub rate_per_s: f64,
    /// Events per second in the idle time before the press; 0 when `idle_s` is 0.
    pub idle_rate_per_s: f64,
    /// Length of the idle time behind the idle rate, s; 0 if there is none.
    pub idle_s: f64,
    /// Standard deviation of the columns of the events in the cluster(s) behind the centroid, px; `None` without clusters.
    #[serde(default)]
    pub spread_u: Option<f64>,
    /// The same of their rows, px; `None` also in results before version 9.
    #[serde(default)]
    pub spread_v: Option<f64>,
    /// Width of the narrowest range of columns with half of the events that the press added to the idle rate, px; `None` if
    /// it added too few.
    #[serde(default)]
    pub width_u: Option<f64>,
    /// Core threshold of DBSCAN for this window, events: `min_samples`, or more where the background asks for it; `None` for
    /// estimators that do not cluster, and in results before version 17.
    #[serde(default)]
    pub core_threshold: Option<u32>,
}

/// Events of one press in one camera, counted per pixel: all columns, rows of the crop.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PressPicture {
    /// Press.
    pub press: PressId,
    /// Camera.
    pub camera: CameraId,
    /// First and last row of the crop, inclusive.
    pub rows: (u16, u16),
    /// Pixels with events, row by row.
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
    /// True if the pixel belongs to the cluster(s) behind the centroid.
    pub clustered: bool,
}

/// Event rate of one camera around one press, in fine bins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RateZoom {
    /// Press.
    pub press: PressId,
    /// Camera.
    pub camera: CameraId,
    /// Left edge of the first bin after measured contact, s (negative: before it).
    pub start_s: f64,
    /// Width of a bin, s.
    pub bin_s: f64,
    /// ON events per second in each bin, rows of the crop only.
    pub on_per_s: Vec<f32>,
    /// OFF events per second in each bin.
    pub off_per_s: Vec<f32>,
    /// Measured release after measured contact, s.
    pub release_s: f64,
}

/// Result of intersecting the two rays.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum LocationOutcome {
    /// Inside the outline.
    Located {
        /// Position, mm.
        at: Point2,
        /// Sine of the angle between the rays.
        sine: f64,
    },
    /// The rays meet outside the outline.
    Outside {
        /// Position, mm.
        at: Point2,
        /// Sine of the angle between the rays.
        sine: f64,
    },
    /// The rays are parallel, or nearly so.
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
    /// Sine of the angle between the rays; `None` without two columns.
    #[must_use]
    pub const fn sine(&self) -> Option<f64> {
        match *self {
            Self::Located { sine, .. }
            | Self::Outside { sine, .. }
            | Self::Parallel { sine }
            | Self::Behind { sine } => Some(sine),
            Self::Missing => None,
        }
    }

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
