//! Keys of a schedule: the description of a recording that was made without skinrig.

use skinrig_model::{AnalysisSettings, OUTLINE_SHAPE, Point2, SkinOutline};
use skinrig_settings::{Setting, Settings};

use super::camera::NominalCamera;
use super::evaluation::Evaluation;
use super::path::LengthUnit;
use super::ranges::{DEPTH_MM, MOST_POINTS, POSITIVE_SPAN_S, SPAN_S, VERSION};
use crate::phases::PressPhases;
use crate::protocol::Prototype;

/// A skinrig schedule: when and where a recording that was made without skinrig was pressed.
#[derive(Settings)]
#[settings(name = "schedule", parts = ScheduleParts)]
pub(crate) struct ScheduleKeys {
    /// Version of the schedule language: 1.
    #[setting(min = VERSION, max = VERSION)]
    pub skinrig_schedule: u32,
    /// Short name of the recording.
    pub name: String,
    /// What was recorded, in a few sentences.
    pub description: Option<String>,
    /// Operator of the recording.
    pub operator: String,
    /// Which skin was pressed.
    pub prototype: Prototype,
    /// The sync presses at the start of the recording. Camera clocks are aligned on them.
    pub sync: Option<ScheduledSyncKeys>,
    /// Time from press to press within a repetition. The published recording: `868 s / 289`.
    #[setting(range = POSITIVE_SPAN_S)]
    pub period_s: f64,
    /// Presses recorded in each repetition: the rows of the CSV of positions.
    #[setting(min = 1, max = MOST_POINTS)]
    pub presses_per_repetition: u32,
    /// How many of them are used, from the first; all when absent.
    #[setting(min = 1, max = MOST_POINTS)]
    pub presses_used: Option<u32>,
    /// How many repetitions were recorded.
    #[setting(default = "1", min = 1, max = 10_000)]
    pub repetitions: u32,
    /// Pause between two repetitions, on top of the last press's full period.
    #[setting(default = "0 s", range = SPAN_S)]
    pub pause_between_repetitions_s: f64,
    /// Indentation depth of the presses.
    #[setting(range = DEPTH_MM)]
    pub depth_mm: f64,
    /// The moments of a press, relative to its press time; negative before it.
    pub phases: PressPhases,
    /// How to read the CSV of press positions.
    pub csv: PositionsCsv,
    /// Which presses calibrate and which are scored. Presses that calibrate never score.
    pub evaluation: PressRoleKeys,
    /// The rig: outline and nominal cameras, where calibration starts.
    pub rig: NominalRig,
    /// Settings of the analysis.
    #[setting(default)]
    pub analysis: AnalysisSettings,
}

/// The sync presses at the start of the recording.
#[derive(Settings)]
#[settings(name = "sync")]
pub(crate) struct ScheduledSyncKeys {
    /// How many.
    #[setting(min = 1, max = 1000)]
    pub count: u32,
    /// From one sync press to the next. For the published recording the paper says 1 s, the public code 2 s.
    #[setting(range = POSITIVE_SPAN_S)]
    pub interval_s: f64,
    /// From the last sync press to the first press of the path, press time to press time.
    #[setting(range = SPAN_S)]
    pub pause_after_s: f64,
    /// Where.
    pub at: Point2,
    /// How deep; `depth` when absent.
    #[setting(range = DEPTH_MM)]
    pub depth_mm: Option<f64>,
}

/// How to read the CSV of press positions.
#[derive(Settings)]
#[settings(name = "csv")]
pub(crate) struct PositionsCsv {
    /// Unit of the columns `x` and `y`.
    pub unit: LengthUnit,
    /// Whether blank rows are skipped; otherwise they are errors.
    #[setting(default = "false")]
    pub skip_blank_rows: bool,
}

/// Which presses calibrate and which are scored: by repetition, or alternating within each repetition.
#[derive(Settings)]
#[settings(name = "evaluate", no_default, exactly_one("repetitions", "alternate"))]
pub(crate) struct PressRoleKeys {
    /// By repetition, as in a protocol.
    pub repetitions: Option<Evaluation>,
    /// Within each repetition; for recordings with a single one. Neighbours calibrate each other's surroundings, so this is less
    /// meaningful than repetitions.
    pub alternate: Option<AlternatingPresses>,
}

/// Every n-th press calibrates, all others are scored.
#[derive(Settings)]
#[settings(name = "alternate")]
pub(crate) struct AlternatingPresses {
    /// 2: every second press calibrates.
    #[setting(min = 2, max = 1000)]
    pub calibrate_every: u32,
    /// The first press of a repetition that calibrates, counted from 1; at most `calibrate_every`.
    #[setting(default = "1", min = 1, max = 1000)]
    pub first: u32,
}

/// The rig as drawn or measured, not calibrated.
#[derive(Settings)]
#[settings(name = "rig")]
pub(crate) struct NominalRig {
    /// The skin's outline.
    #[setting(default = "paper", value = SkinOutline::PAPER)]
    #[setting(shape = OUTLINE_SHAPE, read = SkinOutline::read, show = Setting::text)]
    pub outline: SkinOutline,
    /// Camera 1.
    #[setting(example = "{position: [45 mm, -38 mm], half_field_of_view: 60 deg}")]
    pub camera1: NominalCamera,
    /// Camera 2.
    #[setting(example = "{position: [45 mm, 42 mm], half_field_of_view: 60 deg}")]
    pub camera2: NominalCamera,
    /// The trigger channel that carries marks; absent: no trigger line.
    #[setting(max = 31)]
    pub trigger_channel: Option<u8>,
}
