//! Settings of an analysis: everything that affects its numbers, each declared once.

use serde::{Deserialize, Serialize};
use skinrig_settings::{Choice, Collector, Field, Setting, Settings, ValueRange};

use crate::id::PressId;
use crate::lens::LensKind;
use crate::remount::RemountSettings;
use crate::selection::{SelectedOut, SelectionReason};

/// Times are kept in whole nanoseconds.
const NANOSECOND_MS: f64 = 1e-6;
/// A window of ten seconds is longer than any press.
const WINDOW_MARGIN_MS: ValueRange = ValueRange::between(0.0, 10_000.0);
const SHARE: ValueRange = ValueRange::between(0.0, 1.0);

/// Clustered events that form the centroid of a press.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum CentroidRule {
    /// The largest cluster, as in the paper.
    #[default]
    LargestCluster,
    /// All events that are not noise, as in the public code.
    AllClusters,
}

/// Method that turns the events of a press in one camera into a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum Estimator {
    /// Mean of the clustered events, as in the paper.
    #[default]
    Dbscan,
    /// Median column of all events.
    ColumnMedian,
    /// Peak of the histogram of columns, smoothed by `eps`, between pixels.
    HistogramPeak,
    /// A running histogram of 40 columns with exponential forgetting, in constant memory.
    Streaming,
}

/// Width of an estimator's floating-point numbers. Estimators that count in whole numbers do not depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum Precision {
    /// 64 bits.
    #[default]
    F64,
    /// 32 bits.
    F32,
}

/// Nested camera model to calibrate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum CalibrationModel {
    /// Use the nominal geometry as it is.
    None,
    /// Both positions: 4 parameters.
    Positions,
    /// Positions and skews: 6 parameters.
    PositionsSkews,
    /// Positions, skews and distortions: the paper's 8.
    Full,
    /// The 8 and a scale of the field of view per camera: 10.
    FullScale,
    /// The smallest of them that no larger one beats at held-out locations by more than noise explains.
    #[default]
    Auto,
}

impl CalibrationModel {
    /// Name for people, in tables and figures.
    #[must_use]
    pub const fn label(self) -> &'static str {
        match self {
            Self::None => "nominal geometry",
            Self::Positions => "positions",
            Self::PositionsSkews => "with skews",
            Self::Full => "with distortions (paper)",
            Self::FullScale => "with scales",
            Self::Auto => "automatic",
        }
    }

    /// Name in settings and messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Positions => "positions",
            Self::PositionsSkews => "positions_skews",
            Self::Full => "full",
            Self::FullScale => "full_scale",
            Self::Auto => "auto",
        }
    }
}

/// What turns the columns of both cameras into a position.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    Default,
    Serialize,
    Deserialize,
    Choice,
)]
#[serde(rename_all = "snake_case")]
pub enum Locator {
    /// The geometry, unless another locates held-out locations better by more than noise explains.
    #[default]
    Auto,
    /// The intersection of the two rays.
    Geometry,
    /// The intersection, corrected by a Gaussian-process field that the calibration presses teach.
    Field,
    /// A Gaussian-process field from columns to positions, without any geometry.
    Direct,
}

impl Locator {
    /// Name in settings and messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Geometry => "geometry",
            Self::Field => "field",
            Self::Direct => "direct",
        }
    }
}

/// Rule for the least number of clustered events of a press.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum ThresholdRule {
    /// Chosen on the calibrating presses alone; never below `min_cluster_events`.
    #[default]
    Calibrated,
    /// `min_cluster_events` as it is.
    Fixed,
}

/// Anchor of a press window.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum WindowAnchor {
    /// From `window_before` before the measured contact to `window_after` after the measured release.
    #[default]
    Touch,
    /// About the middle between contact and release, as in the public code.
    Middle,
}

/// Source of the background rate of the latency detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum Background {
    /// Idle time before the press, as in the paper.
    #[default]
    Before,
    /// 1.5 s to 2.4 s after the middle of the press, as in the public code.
    After,
}

/// Localisation on thinned events.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Settings)]
#[serde(default)]
#[settings(name = "reduction")]
pub struct ReductionSettings {
    /// Thinning factors 1, 2, 4 ... up to 2 to this power; the paper's 10.
    #[setting(default = "12", max = 20)]
    pub max_power: u32,
    /// Random seeds per factor and kind of thinning. More do not narrow the intervals, which come from the presses.
    #[setting(default = "5", min = 1, max = 1000)]
    pub seeds: u32,
    /// Core threshold of DBSCAN at all factors; 0 takes that of the analysis. The public code: 1.
    #[setting(default = "0", max = 1_000_000)]
    pub min_samples: u32,
}

/// A one-sided CUSUM on the binned, smoothed event counts of both cameras.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Settings)]
#[serde(default)]
#[settings(name = "latency")]
pub struct LatencySettings {
    /// Width of a bin; the paper's 0.2 ms.
    #[setting(default = "0.2 ms", min = 0.01, max = 10.0)]
    pub bin_ms: f64,
    /// Standard deviation of the Gaussian kernel; the paper's 0.5 ms.
    #[setting(default = "0.5 ms", max = 50.0)]
    pub sigma_ms: f64,
    /// Rate increase that the detector is tuned to; the paper's 4.
    #[setting(default = "4", min = 1.01, max = 1000.0)]
    pub alpha: f64,
    /// Bins in a row above the threshold; the paper's 3.
    #[setting(default = "3", min = 1, max = 1000)]
    pub consecutive: u32,
    /// The thresholds h to try.
    #[setting(default)]
    pub thresholds: ThresholdGrid,
    /// The threshold with the fewest false alarms is chosen among those that detect at least this share; the paper's 0.95.
    #[setting(default = "0.95", range = SHARE)]
    pub target_rate: f64,
    /// A detection counts when it lies within this of the median onset; the paper's 100 ms.
    #[setting(default = "100 ms", min = NANOSECOND_MS, max = 10_000.0)]
    pub window_ms: f64,
    /// Source of the background rate.
    #[setting(default = "before")]
    pub background: Background,
    /// The same study on thinned events.
    #[setting(default)]
    pub reduced: ReducedLatencySettings,
}

/// Evenly spaced thresholds, both ends included. The public code tries 17 to 19 on all events; the paper reports 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Settings)]
#[serde(default)]
#[settings(name = "thresholds", finish = Self::in_order)]
pub struct ThresholdGrid {
    /// The first.
    #[setting(default = "1", above = 0.0, max = 1e6)]
    pub from: f64,
    /// The last.
    #[setting(default = "20", above = 0.0, max = 1e6)]
    pub to: f64,
    /// How many.
    #[setting(default = "20", min = 1, max = 1000)]
    pub count: u32,
}

/// Differences from the study on all events.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Settings)]
#[serde(default)]
#[settings(name = "reduced")]
pub struct ReducedLatencySettings {
    /// One in this many events of a trial and of its background is used, chosen at random; the paper's 1024
    /// ("Data Ablation and Latency Distribution Analysis").
    #[setting(default = "1024", min = 1, max = 1_048_576)]
    pub factor: u32,
    /// The thresholds h to try.
    #[setting(default)]
    pub thresholds: ReducedThresholdGrid,
    /// The threshold with the fewest false alarms is chosen among those that detect at least this share; the public code's 0.85.
    #[setting(default = "0.85", range = SHARE)]
    pub target_rate: f64,
}

/// Evenly spaced thresholds for thinned events, both ends included; the public code's 3 to 8. The paper reports 3.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Settings)]
#[serde(default)]
#[settings(name = "reduced_thresholds", finish = Self::in_order)]
pub struct ReducedThresholdGrid {
    /// The first.
    #[setting(default = "3", above = 0.0, max = 1e6)]
    pub from: f64,
    /// The last.
    #[setting(default = "8", above = 0.0, max = 1e6)]
    pub to: f64,
    /// How many.
    #[setting(default = "6", min = 1, max = 1000)]
    pub count: u32,
}

impl ThresholdGrid {
    fn in_order(self, field: &Field, out: &mut Collector) -> Option<Self> {
        if self.from > self.to {
            out.error(field.span, field.path.as_str(), "the thresholds are empty")
                .expected("the first threshold at or below the last")
                .found(format!("{} to {}", self.from, self.to));
            return None;
        }
        Some(self)
    }
}

impl ReducedThresholdGrid {
    fn in_order(self, field: &Field, out: &mut Collector) -> Option<Self> {
        ThresholdGrid::from(self).in_order(field, out).map(|_| self)
    }
}

impl From<ReducedThresholdGrid> for ThresholdGrid {
    fn from(grid: ReducedThresholdGrid) -> Self {
        let ReducedThresholdGrid { from, to, count } = grid;
        Self { from, to, count }
    }
}

/// Parameters of the contact map reconstruction error; none of them is published, see `docs/reference/paper.md`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Settings)]
#[serde(default)]
#[settings(name = "cmre")]
pub struct CmreSettings {
    /// Side of a square cell. The measure is defined on a virtual grid of 5 mm.
    #[setting(default = "5 mm", min = 0.5, max = 100.0)]
    pub cell_mm: f64,
    /// Standard deviation of the estimate's Gaussian; the public code's 1 mm. At least 1 micrometre.
    #[setting(default = "1 mm", min = 0.001, max = 1000.0)]
    pub sigma_mm: f64,
    /// SR of the public code, a length whose meaning and value are not given; 5 mm reproduces the documented scores (one cell off
    /// is about 0.02).
    #[setting(default = "5 mm", min = 0.001, max = 1000.0)]
    pub sr_mm: f64,
}

/// Limits of the alignment certificate (docs/reference/time-base.md); a session beyond one of them is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Settings)]
#[serde(default)]
#[settings(name = "alignment")]
pub struct AlignmentSettings {
    /// Largest RMS residual of sync trains and marks about a camera's clock. Trigger inputs resolve whole microseconds; optocouplers
    /// add some.
    #[setting(default = "10 us", min = 1e-3, max = 1e6)]
    pub max_residual_us: f64,
    /// Largest half width of the 95 % interval of a camera's clock relative to the trigger box's, at a press: a quarter of the latency
    /// study's bin.
    #[setting(default = "50 us", min = 1e-3, max = 1e6)]
    pub max_camera_interval_us: f64,
    /// Largest half width of the certain interval of the host's clock relative to the trigger box's, at a press: a tenth of the
    /// margin of a press window.
    #[setting(default = "5 ms", min = 1e-3, max = 1e6)]
    pub max_host_interval_us: f64,
    /// Largest rate difference between two clocks, parts per million: twice that of a ceramic resonator and a crystal.
    #[setting(
        default = "10000",
        key = "max_drift",
        unit = "",
        above = 0.0,
        max = 1e6
    )]
    pub max_drift_ppm: f64,
    /// Largest share of the sent edges that a camera misses. Labels and intervals are proven for 20 %.
    #[setting(default = "0.3", range = SHARE)]
    pub max_lost: f64,
    /// Largest share, relative to the sent edges, of doubled or spurious edges at a camera. Labels and intervals are proven for
    /// 5 %.
    #[setting(default = "0.15", range = SHARE)]
    pub max_spurious: f64,
    /// Least share of held-out trains within their 95 % interval, by more than chance (3 standard errors).
    #[setting(default = "0.85", range = SHARE)]
    pub min_coverage: f64,
    /// Largest time from a press to the nearest train or mark at a camera, or to the nearest exchange with the trigger box. A press
    /// beyond it is not timed and does not count: a rate that changes by 20 ppm, as a cheap crystal's does over tens of
    /// kelvins, moves the clock by more than `max_camera_interval`.
    #[setting(default = "2.5 s", min = 1e-3, max = 86_400e6)]
    pub max_tie_distance_us: f64,
    /// Largest delay of the robot's pose times: one interval of a 1 kHz stream. Stated, not measured.
    #[setting(default = "1 ms", max = 1e6)]
    pub robot_delay_us: f64,
    /// If clocks are aligned by event rates: least share of the planned presses that are found, and of the bursts among them that
    /// are planned presses.
    #[setting(default = "0.5", range = SHARE)]
    pub min_explained: f64,
    /// Least natural logarithm of the odds of an alignment by event rates against all others together; 7 is 1100 to 1.
    #[setting(default = "7", max = 1000.0)]
    pub min_log_odds: f64,
}

/// Settings of the analysis; every key is optional. Sessions recorded before a setting existed use its default.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Settings)]
#[serde(default)]
#[settings(name = "analysis", finish = Self::finish)]
pub struct AnalysisSettings {
    /// Rows of each camera that are used, both ends included; the public code's 185 to 360 and 200 to 355.
    #[setting(key = "crop", default = "{}", value = Crop::default().rows_of_both(), shape = Crop::SHAPE, read = Crop::read, show = Crop::show)]
    pub crop_v: [(u16, u16); 2],
    /// The press window begins this long before the measured contact.
    #[setting(default = "50 ms", range = WINDOW_MARGIN_MS)]
    pub window_before_ms: f64,
    /// The press window ends this long after the measured release.
    #[setting(default = "50 ms", range = WINDOW_MARGIN_MS)]
    pub window_after_ms: f64,
    /// Neighbourhood radius of DBSCAN; the paper's 10 px. The neighbourhood search supports up to 50 px.
    #[setting(default = "10 px", above = 0.0, max = 50.0)]
    pub eps_px: f64,
    /// Core threshold of DBSCAN, events; the paper's 10.
    #[setting(default = "10", min = 1, max = 1_000_000)]
    pub min_samples: u32,
    /// Keeps the background out of clusters: the core threshold is at least the events that the idle rate puts within eps of a
    /// pixel during the window, plus this many of their standard deviations (Poisson). 0: `min_samples` alone, as in the paper.
    #[setting(default = "4", max = 100.0)]
    pub background_margin: f64,
    /// A pixel that fires in idle time at this many times the median rate of the crop, again and again and no more during presses, is
    /// hot: its events do not count. 0: all pixels count, as in the paper.
    #[setting(default = "10", max = 1e6)]
    pub hot_pixel_ratio: f64,
    /// Clustered events that form the centroid of a press.
    #[setting(default = "largest_cluster")]
    pub centroid: CentroidRule,
    /// Method that turns the events of a press into a column; `skinrig tradeoff` compares them.
    #[setting(default = "dbscan")]
    pub estimator: Estimator,
    /// Width of the estimator's floating-point numbers; `dbscan` and `column_median` count in whole numbers and do not depend on it.
    #[setting(default = "f64")]
    pub precision: Precision,
    /// Time constant of the streaming estimator: the weight of an event falls to 1/e.
    #[setting(default = "100 ms", min = 0.1, max = 60_000.0)]
    pub forget_ms: f64,
    /// One in this many events is used, chosen at random; 1: all.
    #[setting(default = "1", min = 1, max = 1_048_576)]
    pub thinning: u32,
    /// Side of the square pixel bins of the estimator: 1, 2, 4, 8 or 16 px.
    #[setting(default = "1 px", min = 1, max = 16)]
    pub bin_px: u16,
    /// The press window ends at most this long after the measured contact; absent: the release or `window_after_depth` ends it.
    #[setting(min = NANOSECOND_MS, max = 60_000.0)]
    pub window_after_contact_ms: Option<f64>,
    /// The press window ends at most this long after the tip reached its depth: the rest of a long hold adds only noise. It does not
    /// apply to windows about the middle of the press.
    #[setting(default = "1 s", min = NANOSECOND_MS, max = 60_000.0)]
    pub window_after_depth_ms: f64,
    /// Anchor of the press window.
    #[setting(default = "touch")]
    pub window_anchor: WindowAnchor,
    /// Rule for the least number of clustered events of a press.
    #[setting(default = "calibrated")]
    pub cluster_threshold: ThresholdRule,
    /// A press with fewer clustered events in either camera is excluded; a calibrated threshold is never lower. 0
    /// turns a fixed rule off.
    #[setting(default = "20", max = 1_000_000)]
    pub min_cluster_events: u32,
    /// Presses excluded by hand, by their number in the report (from 1, sync presses counted).
    #[setting(default = "[]")]
    pub exclude_press_numbers: Vec<PressId>,
    /// Presses excluded by a selection, each at most once.
    #[setting(skip)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub selected_out: Vec<SelectedOut>,
    /// In recordings of earlier versions only: presses excluded by hand, counted from 0. New files use `exclude_press_numbers`.
    #[doc(hidden)]
    #[serde(skip)]
    #[setting(max = 10_000_000)]
    pub exclude_presses: Option<Vec<u32>>,
    /// A press with fewer events than the idle rate predicts plus this many standard errors, in either camera, is excluded; 0 turns
    /// the rule off.
    #[setting(default = "5", max = 1000.0)]
    pub min_response_sigma: f64,
    /// A press whose rays meet at less than this sine is excluded as nearly parallel. A sine of 1 would exclude every press.
    #[setting(default = "0.05", max = 0.999)]
    pub min_ray_sine: f64,
    /// Excludes estimates outside the outline from the headline metrics; they are always counted.
    #[setting(default = "true")]
    pub exclude_outside: bool,
    /// Parameters of the camera geometry to calibrate.
    #[setting(default = "auto")]
    pub calibration: CalibrationModel,
    /// The lens to calibrate: how a column's distance from the middle becomes an angle.
    #[setting(default = "exponential")]
    pub lens: LensKind,
    /// What turns the columns of both cameras into a position; learnt from the calibration presses alone.
    #[setting(default = "auto")]
    pub locator: Locator,
    /// How far the skin is expected to have moved since an earlier calibration (`skinrig analyze --calibration-from`).
    #[setting(default)]
    pub remount: RemountSettings,
    /// Least error of a failed press in the RMSE with failures counted; absent: the RMS distance of the scored presses
    /// from their mean, the error of a constant estimate. Raised to the RMSE of the presses with an estimate if that is
    /// larger.
    #[setting(above = 0.0, max = 1000.0)]
    pub failure_penalty_mm: Option<f64>,
    /// Error up to which a press counts as within.
    #[setting(default = "5 mm", above = 0.0, max = 1000.0)]
    pub within_mm: f64,
    /// Bits per event in the data rates; the paper's 21.
    #[setting(default = "21", above = 0.0, max = 1024.0)]
    pub bits_per_event: f64,
    /// Most scored presses whose events are kept for the studies of data reduction and latency, chosen at random; 0 omits the
    /// studies.
    #[setting(default = "300", max = 100_000)]
    pub study_presses: u32,
    /// The data-reduction study.
    #[setting(default)]
    pub reduction: ReductionSettings,
    /// The detection-latency study.
    #[setting(default)]
    pub latency: LatencySettings,
    /// The contact map reconstruction error; none of its values is published.
    #[setting(default)]
    pub cmre: CmreSettings,
    /// Limits of the alignment certificate: a session beyond one of them is invalid.
    #[setting(default)]
    pub alignment: AlignmentSettings,
    /// Resamples of the bootstrap over locations; below 39: no intervals.
    #[setting(default = "2000", max = 1_000_000)]
    pub bootstrap_resamples: u32,
    /// Seed of the bootstrap.
    #[setting(default = "1")]
    pub seed: u64,
    /// Width of the event-rate bins; the paper's 10 ms.
    #[setting(default = "10 ms", min = 0.1, max = 10_000.0)]
    pub rate_bin_ms: f64,
}

/// Rows that are used, both ends included.
#[derive(Settings)]
#[settings(name = "crop")]
struct Crop {
    /// First and last row of camera 1.
    #[setting(default = "[185 px, 360 px]", value = [185, 360], names("first", "last"), max = 479)]
    camera1_px: [u16; 2],
    /// First and last row of camera 2.
    #[setting(default = "[200 px, 355 px]", value = [200, 355], names("first", "last"), max = 479)]
    camera2_px: [u16; 2],
}

impl Crop {
    fn rows_of_both(&self) -> [(u16, u16); 2] {
        [self.camera1_px, self.camera2_px].map(|[first, last]| (first, last))
    }

    fn read(field: &Field, out: &mut Collector) -> Option<[(u16, u16); 2]> {
        let crop = Self::from_mapping(field, out)?;
        for (key, [first, last]) in [("camera1", crop.camera1_px), ("camera2", crop.camera2_px)] {
            if first > last {
                let at = field.at(key);
                out.error(at.span, at.path.as_str(), "the range of rows is empty")
                    .expected("the first row at or above the last")
                    .found(format!("{first} px to {last} px"));
                return None;
            }
        }
        Some(crop.rows_of_both())
    }

    fn show([one, two]: &[(u16, u16); 2]) -> String {
        let rows = |(first, last): &(u16, u16)| format!("[{first} px, {last} px]");
        format!("{{camera1: {}, camera2: {}}}", rows(one), rows(two))
    }
}

impl AnalysisSettings {
    /// Documentation of the setting in the field at this path, such as `latency.bin_ms`; `None` for another path.
    #[must_use]
    pub fn doc_of_field(path: &str) -> Option<&'static str> {
        Self::TABLE.doc_of_field(path)
    }

    /// Sides of the bins of pixels that divide both sides of the sensor, px.
    pub const BIN_SIDES_PX: [u16; 5] = [1, 2, 4, 8, 16];

    /// True for a press that is excluded by hand, without a selection.
    #[must_use]
    pub fn excludes(&self, press: PressId) -> bool {
        self.exclude_press_numbers.contains(&press)
    }

    /// Why a selection excludes the press; `None` if it does not.
    #[must_use]
    pub fn selected_out(&self, press: PressId) -> Option<&SelectionReason> {
        let found = self.selected_out.iter().find(|s| s.press == press);
        found.map(|s| &s.why)
    }

    fn finish(mut self, field: &Field, out: &mut Collector) -> Option<Self> {
        if !Self::BIN_SIDES_PX.contains(&self.bin_px) {
            let at = field.at("bin");
            out.error(
                at.span,
                at.path.as_str(),
                "the bins do not divide the sensor",
            )
            .expected("1, 2, 4, 8 or 16 px")
            .found(format!("{} px", self.bin_px));
            return None;
        }
        let Some(indices) = self.exclude_presses.take() else {
            return Some(self);
        };
        let presses: Vec<PressId> = indices.into_iter().map(PressId::from_index).collect();
        if !out.recorded {
            let numbers: Vec<String> = presses.iter().map(|p| p.number().to_string()).collect();
            let at = field.at("exclude_presses");
            out.error(at.span, at.path.as_str(), "this key counts presses from 0")
                .expected("`exclude_press_numbers`, which counts them from 1")
                .found("`exclude_presses` of earlier versions")
                .help(format!(
                    "write `exclude_press_numbers: [{}]`",
                    numbers.join(", ")
                ));
            return None;
        }
        self.exclude_press_numbers.extend(presses);
        Some(self)
    }
}
