//! Every key of a schedule: the description of a recording that was made without skinrig.

use skinrig_model::AnalysisSettings;
use skinrig_settings::Settings;

use crate::keys::{
    DEPTH, EVALUATION, MOST_POINTS, OUTLINE, OUTLINES, POINT, POSITIVE_SPAN, PROTOTYPE, SPAN,
    UNITS, VERSION, count, default, optional, required,
};
use crate::shape::{Range, Shape, Table};
use skinrig_settings::Dimension::{Angle, Time};

/// A moment relative to the press time; may be before it.
const MOMENT: Shape = Shape::Quantity(&[Time], Range::between(-3600.0, 3600.0));

/// The whole file.
pub(crate) static SCHEDULE: Table = Table {
    name: "schedule",
    doc: "A skinrig schedule: when and where a recording that was made without skinrig was pressed.",
    keys: &[
        required(
            "skinrig_schedule",
            count(VERSION, VERSION),
            "Version of the schedule language: 1.",
        ),
        required("name", Shape::Text, "Short name of the recording."),
        optional(
            "description",
            Shape::Text,
            "What was recorded, in a few sentences.",
        ),
        required("operator", Shape::Text, "Who recorded it."),
        required(
            "prototype",
            Shape::Map(&PROTOTYPE),
            "Which skin was pressed.",
        ),
        optional(
            "sync",
            Shape::Map(&SYNC),
            "The sync presses at the start of the recording. Camera clocks are aligned on them.",
        ),
        required(
            "period",
            POSITIVE_SPAN,
            "Time from press to press within a repetition. The published recording: `868 s / 289`.",
        ),
        required(
            "presses_per_repetition",
            count(1, MOST_POINTS),
            "Presses recorded in each repetition: the rows of the CSV of positions.",
        ),
        optional(
            "presses_used",
            count(1, MOST_POINTS),
            "How many of them are used, from the first; all when absent.",
        ),
        default(
            "repetitions",
            count(1, 10_000),
            "1",
            "How many repetitions were recorded.",
        ),
        default(
            "pause_between_repetitions",
            SPAN,
            "0 s",
            "Pause between two repetitions, on top of the last press's full period.",
        ),
        required("depth", DEPTH, "Indentation depth of the presses."),
        required(
            "phases",
            Shape::Map(&PHASES),
            "The moments of a press, relative to its press time; negative before it.",
        ),
        required(
            "csv",
            Shape::Map(&CSV),
            "How to read the CSV of press positions.",
        ),
        required(
            "evaluation",
            Shape::Map(&EVALUATE),
            "Which presses calibrate and which are scored. Presses that calibrate never score.",
        ),
        required(
            "rig",
            Shape::Map(&RIG),
            "The rig: outline and nominal cameras, where calibration starts.",
        ),
        default(
            "analysis",
            Shape::Map(AnalysisSettings::TABLE),
            "{}",
            "Settings of the analysis.",
        ),
    ],
    exactly_one: &[],
};

static SYNC: Table = Table {
    name: "sync",
    doc: "The sync presses at the start of the recording.",
    keys: &[
        required("count", count(1, 1000), "How many."),
        required(
            "interval",
            POSITIVE_SPAN,
            "From one sync press to the next. For the published recording the paper says 1 s, the public code 2 s.",
        ),
        required(
            "pause_after",
            SPAN,
            "From the last sync press to the first press of the path, press time to press time.",
        ),
        required("at", POINT, "Where."),
        optional("depth", DEPTH, "How deep; `depth` when absent."),
    ],
    exactly_one: &[],
};

static PHASES: Table = Table {
    name: "phases",
    doc: "The moments of a press relative to its press time, in this order.",
    keys: &[
        required("approach", MOMENT, "The downward motion begins."),
        required("contact", MOMENT, "The tip reaches the surface."),
        required("at_depth", MOMENT, "The tip settled at its depth."),
        required("retract", MOMENT, "The upward motion begins."),
        required("release", MOMENT, "The tip leaves the surface."),
        required("clear", MOMENT, "The tip is back at clearance height."),
    ],
    exactly_one: &[],
};

static CSV: Table = Table {
    name: "csv",
    doc: "How to read the CSV of press positions.",
    keys: &[
        required(
            "unit",
            Shape::Choice(UNITS),
            "Unit of the columns `x` and `y`.",
        ),
        default(
            "skip_blank_rows",
            Shape::Flag,
            "false",
            "Whether rows with nothing but blanks are skipped; otherwise they are errors.",
        ),
    ],
    exactly_one: &[],
};

static EVALUATE: Table = Table {
    name: "evaluate",
    doc: "Which presses calibrate and which are scored: by repetition, or alternating within each repetition.",
    keys: &[
        optional(
            "repetitions",
            Shape::Map(&EVALUATION),
            "By repetition, as in a protocol.",
        ),
        optional(
            "alternate",
            Shape::Map(&ALTERNATE),
            "Within each repetition; for recordings with a single one. Neighbours calibrate each other's surroundings, so this says less than repetitions do.",
        ),
    ],
    exactly_one: &[&["repetitions", "alternate"]],
};

static ALTERNATE: Table = Table {
    name: "alternate",
    doc: "Every n-th press calibrates, all others are scored.",
    keys: &[
        required(
            "calibrate_every",
            count(2, 1000),
            "2: every second press calibrates.",
        ),
        default(
            "first",
            count(1, 1000),
            "1",
            "The first press of a repetition that calibrates, counted from 1; at most `calibrate_every`.",
        ),
    ],
    exactly_one: &[],
};

static RIG: Table = Table {
    name: "rig",
    doc: "The rig as drawn or measured, not calibrated.",
    keys: &[
        default(
            "outline",
            Shape::WordOr(OUTLINES, &OUTLINE),
            "paper",
            "The skin's outline.",
        ),
        required("camera1", Shape::Map(&CAMERA), "Camera 1."),
        required("camera2", Shape::Map(&CAMERA), "Camera 2."),
        optional(
            "trigger_channel",
            count(0, 31),
            "The trigger channel that carries marks; absent: no trigger line.",
        ),
    ],
    exactly_one: &[],
};

pub(crate) static CAMERA: Table = Table {
    name: "nominal_camera",
    doc: "A camera as drawn or measured.",
    keys: &[
        required("position", POINT, "Its optical centre."),
        optional(
            "aim",
            POINT,
            "Where its axis points; the centre of the outline when absent.",
        ),
        default(
            "skew",
            Shape::Quantity(&[Angle], Range::between(-90.0, 90.0)),
            "0 deg",
            "Turn of the axis away from the aim, clockwise.",
        ),
        required(
            "half_field_of_view",
            Shape::Quantity(&[Angle], Range::above_zero(90.0)),
            "Half of the horizontal field of view.",
        ),
        default(
            "distortion",
            Shape::Number(Range::between(-1.0, 1.0)),
            "0",
            "Distortion W of the lens.",
        ),
    ],
    exactly_one: &[],
};
