//! Owns the warnings of an analysis: what replaces a measurement, what is missing, what is suspicious.

use std::fmt;

use serde::{Deserialize, Serialize};
use skinrig_model::{CalibrationModel, CameraId, Locator, PressId, Reaction, StopQuestion};

use super::camera_change::CameraChange;
use super::common_exclusion::{CommonExclusion, most};
use super::quiet_part::QuietPart;
use super::readout_fault::ReadoutFault;
use super::warning_words::{in_words, listed, share_of_crop};
use super::{Estimate, Fault};
use crate::clock::{MarksError, RatesError};
use crate::locator::FitError;
use crate::with_text::with_text;

/// A warning for the reader. In JSON `kind` and fields of its cause, where it belongs, and `text`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Self")]
pub struct Warning {
    /// Leg concerned, from 1; `None` if it is not about one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leg: Option<u32>,
    /// Camera concerned; `None` if it is not about one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraId>,
    /// The cause.
    #[serde(flatten)]
    pub cause: WarningCause,
}

with_text!(Warning);

impl Warning {
    /// A warning about one camera.
    #[must_use]
    pub(crate) const fn of_camera(camera: CameraId, cause: WarningCause) -> Self {
        Self {
            leg: None,
            camera: Some(camera),
            cause,
        }
    }
}

impl From<WarningCause> for Warning {
    fn from(cause: WarningCause) -> Self {
        Self {
            leg: None,
            camera: None,
            cause,
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.leg, self.camera) {
            (Some(leg), Some(camera)) => write!(f, "leg {leg}, {camera}: ")?,
            (Some(leg), None) => write!(f, "leg {leg}: ")?,
            (None, Some(camera)) => write!(f, "{camera}: ")?,
            (None, None) => {}
        }
        self.cause.fmt(f)
    }
}

/// What a warning is about.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum WarningCause {
    /// Presses far from all trigger marks.
    #[error(
        "{presses} presses are not timed: they are more than {limit_s} s from the nearest trigger mark seen"
    )]
    PressesFarFromMarks {
        /// Presses.
        presses: usize,
        /// Maximum distance, s.
        limit_s: f64,
    },
    /// Contacts and releases far from all trains seen or exchanges with the box.
    #[error(
        "{instants} of {of} contacts and releases are more than {limit_s} s from the nearest train seen or the \
         nearest exchange with the box; their presses are not timed"
    )]
    PressesFarFromTies {
        /// Contacts and releases beyond the limit.
        instants: usize,
        /// All contacts and releases.
        of: usize,
        /// Maximum distance, s.
        limit_s: f64,
    },
    /// Nothing but the nominal start places a leg's camera clock among the others.
    #[error(
        "expected trains or marks to fit its clock, found too few: it is aligned to the other legs by its nominal \
         start alone"
    )]
    NominalStart,
    /// Large residuals of the trigger marks.
    #[error(
        "trigger marks fit the clock only to {rms_us:.0} µs rms (expected a few µs); check the trigger line"
    )]
    MarksScatter {
        /// RMS residual, µs.
        rms_us: f64,
    },
    /// Trigger marks off the clock's line.
    #[error("{rejected} of {of} trigger marks do not fit the clock and were rejected")]
    MarksRejected {
        /// Rejected marks.
        rejected: u32,
        /// Marks seen.
        of: usize,
    },
    /// Trigger marks that the camera did not see.
    #[error("{unseen} of {of} trigger marks were not seen")]
    MarksUnseen {
        /// Marks not seen.
        unseen: usize,
        /// Marks sent.
        of: usize,
    },
    /// Edges that are part of no mark.
    #[error("{edges} edges on trigger channel {channel} do not belong to a complete mark")]
    StrayEdges {
        /// Edges.
        edges: u64,
        /// Trigger channel.
        channel: u8,
    },
    /// The trigger marks give no clock.
    #[error(
        "no clock from trigger marks ({sent} sent, {edges} edges seen): {why}; using event rates instead"
    )]
    NoMarksClock {
        /// Marks sent.
        sent: usize,
        /// Edges seen, all channels.
        edges: usize,
        /// Why not.
        why: MarksError,
    },
    /// The event rates give no clock.
    #[error("no clock alignment: {why}")]
    NoRatesClock {
        /// Why not.
        why: RatesError,
    },
    /// The session is too short for a drift from event rates.
    #[error(
        "the session is too short to find the clock drift from event rates ({drift_ppm:.0} ± {standard_error_ppm:.0} ppm): \
         assuming 0"
    )]
    DriftUnknown {
        /// Estimate, ppm.
        drift_ppm: f64,
        /// Its standard error, ppm.
        standard_error_ppm: f64,
    },
    /// Large residuals of the presses found in the event rates.
    #[error("presses found in the event rates scatter by {rms_ms:.0} ms rms about the clock fit")]
    PressesScatter {
        /// RMS residual, ms.
        rms_ms: f64,
    },
    /// Windows of two presses overlap.
    #[error("press windows overlap: events in the overlap count in both presses")]
    WindowsOverlap,
    /// Events too late for their window.
    #[error("{events} events are more than {limit_ms} ms out of order; presses may miss them")]
    EventsOutOfOrder {
        /// Events.
        events: u64,
        /// Maximum delay, ms.
        limit_ms: u64,
    },
    /// Events at impossible times.
    #[error(
        "{events} events have timestamps days away from all others and are not in the event rates"
    )]
    EventsDaysAway {
        /// Events.
        events: u64,
    },
    /// Events outside the sensor.
    #[error(
        "{events} of {of} events are outside the sensor and ignored: the recording may be damaged, or from another sensor"
    )]
    EventsOffSensor {
        /// Events outside.
        events: u64,
        /// All events.
        of: u64,
    },
    /// The background alone makes clusters.
    #[error(
        "noise joins the clusters; `--set analysis.min_samples={advised_min_samples}` prevents this: in a press window the background \
         alone puts {neighbours:.1} events within eps ({eps_px} px) of an event, and {min_samples} make a cluster"
    )]
    DenseBackground {
        /// Events of the background expected in a neighbourhood.
        neighbours: f64,
        /// Radius of a neighbourhood, px.
        eps_px: f64,
        /// The setting.
        min_samples: u32,
        /// A setting beyond the background.
        advised_min_samples: f64,
    },
    /// Hot pixels are left out.
    #[error(
        "{pixels} hot pixels are left out{}: they fire without presses, up to {highest_per_s:.0} times a second, \
         {:.0} % of the idle events; look for reflections and flickering lamps",
        share_of_crop(*.pixels, *.of), 100.0 * .idle_share
    )]
    HotPixels {
        /// Hot pixels.
        pixels: u32,
        /// Pixels of the crop.
        of: u32,
        /// Highest rate among them, events/s.
        highest_per_s: f64,
        /// Their share of the idle events.
        idle_share: f64,
    },
    /// The audit found a fault that disappears with the windows and clusters of the recording, or the default ones.
    #[error(
        "the analysis settings do not suit this recording: with them it looks faulty ({}), with the usual windows and clusters it \
         does not",
        .fault.name()
    )]
    UnsuitableSettings {
        /// The first of its findings.
        fault: Fault,
    },
    /// A setting that another makes useless.
    #[error("{key} changes no estimate: {because} does not use it")]
    UnusedSetting {
        /// The setting.
        key: String,
        /// The other one, and its value.
        because: String,
    },
    /// No metrics.
    #[error("no scored press was attempted, so there are no metrics")]
    NoScoredPress,
    /// No press gives a number, which makes the session INVALID.
    #[error(
        "expected at least one of {planned} presses to count, found none: {missed} missed, {invalid} invalid, {excluded} excluded"
    )]
    NothingCounts {
        /// Scored presses of the plan; of a plan without, those that calibrate.
        planned: u32,
        /// Of these, presses never attempted.
        missed: u32,
        /// Of these, presses not done as planned.
        invalid: u32,
        /// Of these, presses that a rule excludes.
        excluded: u32,
    },
    /// Nothing seals the session.
    #[error(
        "not sealed: the run was cut off, or the seal removed, and not every changed row would show; `skinrig resume` continues it"
    )]
    NotSealed,
    /// The data decided when to stop.
    #[error(
        "the looks decided when to end: 95 % intervals do not allow for that, those of the looks do ({looks} of {declared} taken)"
    )]
    SequentialLooks {
        /// Looks taken.
        looks: usize,
        /// Looks declared.
        declared: u32,
    },
    /// All that was to be recorded did not answer the question.
    #[error(
        "no look found {question} ({looks} of {declared} taken): the question of this campaign is open"
    )]
    UndecidedLooks {
        /// Looks taken.
        looks: usize,
        /// Looks declared.
        declared: u32,
        /// What decides.
        question: StopQuestion,
    },
    /// Presses did not go to their planned depth.
    #[error(
        "{presses} scored presses stopped when they were felt, at {depth_mm:.2} mm in the median: the planned depth was not reached"
    )]
    StoppedWhenFelt {
        /// Number of them.
        presses: u32,
        /// Median measured depth, mm.
        depth_mm: f64,
    },
    /// Times and positions that nobody measured.
    #[error("press times and positions come from a schedule, not from a measurement")]
    Scheduled,
    /// The studies use fewer presses than planned.
    #[error(
        "{left_out} of {chosen} presses chosen for the studies did not fit into memory; the studies use only the first {used}"
    )]
    StudyPressesLeftOut {
        /// Presses left out.
        left_out: u32,
        /// Presses chosen.
        chosen: usize,
        /// Presses used.
        used: usize,
    },
    /// The exclusions change the RMSE.
    #[error(
        "the RMSE depends on the exclusions: excluding {excluded} of {located} located presses{} changes it from \
         {rmse_of_all_mm:.2} mm to {}{}",
        most(.most_common.as_ref()),
        .rmse_mm.map_or_else(|| "nothing".to_owned(), |rmse| format!("{rmse:.2} mm")),
        if *.beyond_interval { ", more than its 95 % interval" } else { "" }
    )]
    ExclusionsMatter {
        /// Excluded presses with a position.
        excluded: u32,
        /// Presses with a position.
        located: u32,
        /// The most common rule.
        most_common: Option<CommonExclusion>,
        /// RMSE of all presses with a position, mm.
        rmse_of_all_mm: f64,
        /// RMSE of those that count, mm; `None` if none does.
        rmse_mm: Option<f64>,
        /// True if the RMSE of all is outside the 95 % interval of the RMSE.
        beyond_interval: bool,
    },
    /// No press calibrates.
    #[error("no usable calibration press: using the nominal camera geometry")]
    NoCalibrationPress,
    /// Too few locations for the calibration in the settings.
    #[error(
        "the calibration presses cover too few locations for the calibration `{}`: using `{}`",
        .wanted.name(), .used.name()
    )]
    FewLocationsForModel {
        /// In the settings.
        wanted: CalibrationModel,
        /// In use.
        used: CalibrationModel,
    },
    /// Too few locations to compare calibrations.
    #[error(
        "too few calibration locations ({locations}) to compare calibrations by cross-validation: using `{}`, the \
         largest that they determine",
        .used.name()
    )]
    FewLocationsToCompare {
        /// Distinct calibration locations.
        locations: usize,
        /// In use.
        used: CalibrationModel,
    },
    /// The fit of a calibration failed.
    #[error(
        "the fit of the calibration `{}` found no plausible geometry: using `{}`, the next smaller one that fits",
        .wanted.name(), .used.name()
    )]
    ImplausibleModel {
        /// The model that did not fit.
        wanted: CalibrationModel,
        /// In use.
        used: CalibrationModel,
    },
    /// Too few locations for any calibration.
    #[error(
        "{locations} calibration locations are too few for any calibration: using the nominal camera geometry"
    )]
    FewLocationsForAny {
        /// Distinct calibration locations.
        locations: usize,
    },
    /// No calibration is determined.
    #[error("the calibration presses determine no calibration: using the nominal camera geometry")]
    Undetermined,
    /// No calibration fits.
    #[error("no calibration found a plausible geometry: using the nominal camera geometry")]
    NoPlausibleGeometry,
    /// The calibration in the settings is worse than another.
    #[error(
        "the calibration `{}` is significantly worse than `{}`: {rmse_mm:.2} mm against {better_rmse_mm:.2} mm at \
         held-out locations (errors bounded at {bound_mm:.1} mm), a paired difference of {difference_mm:.2} ± \
         {standard_error_mm:.2} mm (standard error)",
        .used.name(), .better.name()
    )]
    WorseModel {
        /// In use.
        used: CalibrationModel,
        /// The best.
        better: CalibrationModel,
        /// Bounded error of the one in use at held-out locations, mm.
        rmse_mm: f64,
        /// The same of the best, mm.
        better_rmse_mm: f64,
        /// Bound on errors, mm.
        bound_mm: f64,
        /// Paired difference, mm.
        difference_mm: f64,
        /// Its standard error, mm.
        standard_error_mm: f64,
    },
    /// Parameters of the calibration that the data do not determine.
    #[error(
        "the calibration presses determine {determined} of the {parameters} parameters of the calibration `{}`: the \
         values of {} are one of many equally good solutions; calibrate at more locations, spread over the skin",
        .model.name(), .open.join(", ")
    )]
    OpenParameters {
        /// Determined directions in parameter space.
        determined: u32,
        /// Number of parameters.
        parameters: usize,
        /// In use.
        model: CalibrationModel,
        /// Names of the parameters without a determined value.
        open: Vec<String>,
    },
    /// The calibration does not lower the error.
    #[error(
        "the calibration does not lower the error of its own presses ({before_mm:.2} mm before, {after_mm:.2} mm \
         after); check for outliers"
    )]
    NoImprovement {
        /// RMSE before, mm.
        before_mm: f64,
        /// RMSE after, mm.
        after_mm: f64,
    },
    /// The calibration locates no better than a guess.
    #[error(
        "the calibrated geometry locates its own presses no better than their mean position would ({rmse_mm:.2} mm \
         against {spread_mm:.2} mm); check for swapped cameras, a wrong unit or a shifted order of presses"
    )]
    NoBetterThanMean {
        /// RMSE of the calibration presses, mm.
        rmse_mm: f64,
        /// Their RMS distance from their mean position, mm.
        spread_mm: f64,
    },
    /// The presses fit the earlier calibration badly.
    #[error(
        "the presses fit the calibration of the earlier session badly: {:.1} % of remounts disagree as much; calibrate in full \
         if the numbers matter",
        100.0 * .chance
    )]
    RemountUnusual {
        /// Probability of such a disagreement.
        chance: f64,
    },
    /// Outliers among the presses that correct an earlier calibration.
    #[error(
        "{} of {of} presses that correct the earlier calibration are outliers and count less: {}",
        .presses.len(),
        listed(.presses)
    )]
    RemountOutliers {
        /// The outliers.
        presses: Vec<PressId>,
        /// Presses that correct.
        of: u32,
    },
    /// The protocol asks for reactions, and presses had none.
    #[error(
        "the protocol asks presses to {} when they are felt: {reacted} of {presses} valid scored presses did, and the numbers \
         include all of them; the run's notes (`skinrig show`) may say why",
        .wanted.verb()
    )]
    WithoutReaction {
        /// In the protocol.
        wanted: Reaction,
        /// Valid scored presses that reacted,
        reacted: u32,
        /// and all.
        presses: u32,
    },
    /// The locator in the settings cannot learn.
    #[error("the locator `{}` cannot learn: {why}; using `geometry`", .wanted.name())]
    LocatorUnfit {
        /// In the settings.
        wanted: Locator,
        /// Why not.
        why: FitError,
    },
    /// Scored presses and held-out calibration locations have different errors.
    #[error(
        "the RMSE of the scored presses, {}, and that of held-out calibration locations, {}, disagree: a few presses \
         dominate one of them, or the rig changed in between",
        in_words(.scored_rmse_mm), in_words(.held_out_rmse_mm)
    )]
    CalibrationDisagrees {
        /// RMSE of the scored presses, mm.
        scored_rmse_mm: Estimate,
        /// RMSE at held-out calibration locations, mm.
        held_out_rmse_mm: Estimate,
    },
    /// Presses with far more events than others.
    #[error(
        "event storm in {}: up to {times:.0} times the events of other presses at that depth, which hide the touch; find what flickers, \
         leave the press out with `skinrig select`, and set `suspend.event_rate` in the protocol",
        listed(.presses)
    )]
    EventStorms {
        /// The presses.
        presses: Vec<PressId>,
        /// Most events, relative to the busiest tenth of the other presses.
        times: f64,
    },
    /// Fewer events locate better than all.
    #[error(
        "a random 1/{factor} of the events locates better than all of them: RMSE {} against {}; the clustering \
         settings do not suit these event rates",
        in_words(.rmse_mm), in_words(.rmse_of_all_mm)
    )]
    FewerEventsBetter {
        /// One in so many events is kept.
        factor: u32,
        /// RMSE with these events, mm.
        rmse_mm: Estimate,
        /// RMSE with all events, mm.
        rmse_of_all_mm: Estimate,
    },
    /// Presses in a row with one recorded position, while the others have their own.
    #[error(
        "{first} to {last} have the same recorded position to the last digit, unlike the others: if missing rows of a table were filled in, \
         their errors say nothing about the skin; leave these presses out with `skinrig select`"
    )]
    RepeatedPositions {
        /// The first of them.
        first: PressId,
        /// The last of them.
        last: PressId,
    },
    /// A few presses decide it.
    #[error(
        "few presses decide the RMSE: it is {rmse_mm:.2} mm, {without_mm:.2} mm without {}, off by more than {limit_mm:.0} mm; look \
         whether their rows of the press list are right, and at their events", listed(.presses)
    )]
    FewDecide {
        /// The presses, at most a tenth of all.
        presses: Vec<PressId>,
        /// Their errors are larger than this, mm.
        limit_mm: f64,
        /// RMSE of all scored presses, mm.
        rmse_mm: f64,
        /// RMSE without these presses, mm.
        without_mm: f64,
    },
    /// A part of the picture is quiet.
    #[error("{0}")]
    QuietPart(QuietPart),
    /// A camera gives something else from some press on.
    #[error("{0}")]
    CameraChanged(CameraChange),
    /// Readout, driver or converter.
    #[error("{0}")]
    Readout(ReadoutFault),
    /// The RMSE where no press calibrated has an interval wider than the pressed area.
    #[error(
        "the RMSE where no press calibrated, {}, is unknown: its interval is wider than the pressed area ({extent_mm:.0} mm); rays that \
         are nearly parallel there send some estimates far off",
        in_words(.rmse_mm)
    )]
    LeftOutUnknown {
        /// That RMSE, mm.
        rmse_mm: Estimate,
        /// Diagonal of the smallest rectangle around the measured positions, mm.
        extent_mm: f64,
    },
}
