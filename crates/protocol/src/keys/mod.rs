//! Every key of a protocol: name, meaning, form, range, default. The reader and the JSON Schema follow this table.

mod frame;
mod path;
mod run;
pub(crate) mod schedule;

pub(crate) use frame::{OUTLINE, OUTLINES};
pub(crate) use path::UNITS;
pub(crate) use run::{EVALUATION, ROI};

use skinrig_model::AnalysisSettings;
use skinrig_settings::Settings;

use crate::faults::FAULT;
use crate::retakes::RETAKES;
use crate::shape::{Key, Need, Range, Shape, Table, Word};
use crate::surface::PRESS;
use crate::surface_check::SURFACE_CHECK;
use crate::suspend::SUSPEND;
use frame::{FRAME, SYNC};
use path::{ORDER, ORDER_TABLE, PATH, REPETITIONS};
use run::{CAMERAS, LIMITS, MOTION, TRIGGERS};
use skinrig_settings::Dimension::{Length, Speed, Time};

/// The version of the protocol language that this crate reads.
pub(crate) const VERSION: i64 = 1;
/// The most locations a path may have, and the most repetitions; keeps nonsense from filling memory.
pub(crate) const MOST_POINTS: i64 = 100_000;

pub(crate) const fn required(name: &'static str, shape: Shape, doc: &'static str) -> Key {
    Key {
        name,
        doc,
        shape,
        need: Need::Required,
    }
}
pub(crate) const fn optional(name: &'static str, shape: Shape, doc: &'static str) -> Key {
    Key {
        name,
        doc,
        shape,
        need: Need::Optional,
    }
}
pub(crate) const fn default(
    name: &'static str,
    shape: Shape,
    value: &'static str,
    doc: &'static str,
) -> Key {
    Key {
        name,
        doc,
        shape,
        need: Need::Default(value),
    }
}

/// A coordinate, mm.
static COORDINATE: Shape = Shape::Quantity(&[Length], Range::between(-1000.0, 1000.0));
pub(crate) const POINT: Shape = Shape::Tuple(&COORDINATE, &["x", "y"]);
pub(crate) static POINT_ITEM: Shape = POINT;
const POSITION: Shape = Shape::Tuple(&COORDINATE, &["x", "y", "z"]);
const POSITIVE_LENGTH: Shape = Shape::Quantity(&[Length], Range::above_zero(1000.0));
const LENGTH: Shape = Shape::Quantity(&[Length], Range::from_zero(1000.0));
pub(crate) const DEPTH: Shape = Shape::Quantity(&[Length], Range::above_zero(50.0));
static DEPTH_ITEM: Shape = DEPTH;
const SPEED: Shape = Shape::Quantity(&[Speed], Range::above_zero(1000.0));
const PACE: Shape = Shape::Quantity(&[Speed, Time], Range::above_zero(1000.0));
pub(crate) const SPAN: Shape = Shape::Quantity(&[Time], Range::from_zero(86_400.0));
pub(crate) const POSITIVE_SPAN: Shape = Shape::Quantity(&[Time], Range::above_zero(86_400.0));
pub(crate) const SEED: Shape = Shape::Whole {
    min: 0,
    max: i64::MAX,
};
pub(crate) const fn count(min: i64, max: i64) -> Shape {
    Shape::Whole { min, max }
}

/// The whole file.
pub(crate) static PROTOCOL: Table = Table {
    name: "protocol",
    doc: "A skinrig protocol: where, how deep and how often the skin is pressed, and what the presses are for.",
    keys: &[
        required(
            "skinrig",
            count(VERSION, VERSION),
            "Version of the protocol language: 1.",
        ),
        required("name", Shape::Text, "Short name of the experiment."),
        optional(
            "description",
            Shape::Text,
            "What the experiment is for, in a few sentences.",
        ),
        required(
            "operator",
            Shape::Text,
            "Who runs it. Stored with the session.",
        ),
        required(
            "prototype",
            Shape::Map(&PROTOTYPE),
            "Which skin is pressed. Stored with the session.",
        ),
        default(
            "seed",
            SEED,
            "1",
            "Seed of everything random in the run that has no seed of its own. Stored with the session.",
        ),
        required(
            "scene",
            Shape::Map(&SCENE),
            "What a simulated rig must be good for. A real bench ignores it.",
        ),
        default(
            "frame",
            Shape::Map(&FRAME),
            "{}",
            "The skin in its own frame: mm, z out of the surface, z = 0 at the touched surface.",
        ),
        optional(
            "sync",
            Shape::Map(&SYNC),
            "Presses before everything else that let camera clocks be aligned without triggers.",
        ),
        required(
            "path",
            Shape::Map(&PATH),
            "The locations that are pressed: exactly one kind of path.",
        ),
        default(
            "repetitions",
            Shape::Map(&REPETITIONS),
            "{}",
            "How often the whole path is run, and what happens between.",
        ),
        default(
            "order",
            Shape::WordOr(ORDER, &ORDER_TABLE),
            "listed",
            "In which order the presses of a repetition come.",
        ),
        optional(
            "depth",
            DEPTH,
            "Indentation depth of every press, below the touched surface.",
        ),
        optional(
            "depths",
            Shape::List {
                of: &DEPTH_ITEM,
                min: 1,
                max: 1000,
            },
            "Several indentation depths: each repetition runs the whole path once per depth, in this order.",
        ),
        default("motion", Shape::Map(&MOTION), "{}", "How the robot moves."),
        required(
            "limits",
            Shape::Map(&LIMITS),
            "What must never happen. Checked for every segment of motion before a device is opened, and enforced while running.",
        ),
        optional(
            "press",
            Shape::Map(&PRESS),
            "How presses find the surface; absent: as the rig file says, at z = 0 of the frame when it says nothing.",
        ),
        optional(
            "surface_check",
            Shape::Map(&SURFACE_CHECK),
            "Touches the surface at some points before the first press and ends the run when it is not where the frame says; no check when absent.",
        ),
        default(
            "retakes",
            Shape::Map(&RETAKES),
            "{}",
            "How often a press is taken again because its data were lost or it came too late.",
        ),
        default(
            "suspend",
            Shape::Map(&SUSPEND),
            "{}",
            "When the run waits by itself until a disturbance is over.",
        ),
        default(
            "triggers",
            Shape::Map(&TRIGGERS),
            "{}",
            "The trigger line to the cameras.",
        ),
        required(
            "evaluation",
            Shape::Map(&EVALUATION),
            "Which repetitions calibrate the camera geometry and which are scored. Presses that calibrate never score.",
        ),
        default(
            "analysis",
            Shape::Map(AnalysisSettings::TABLE),
            "{}",
            "Settings of the analysis that follows the run.",
        ),
        default(
            "cameras",
            Shape::Map(&CAMERAS),
            "{}",
            "Settings written to the cameras before the run and read back.",
        ),
        optional(
            "faults",
            Shape::List {
                of: &FAULT,
                min: 1,
                max: 100,
            },
            "Faults made on purpose, each KIND@WHEN such as camera1-stalled@hold:3 (docs/faults.md). On the simulated rig only.",
        ),
    ],
    exactly_one: &[&["depth", "depths"]],
};

pub(crate) static PROTOTYPE: Table = Table {
    name: "prototype",
    doc: "Which skin is pressed.",
    keys: &[
        required(
            "id",
            Shape::Text,
            "Identifier of the prototype as written on it.",
        ),
        optional(
            "description",
            Shape::Text,
            "Material, thickness, anything worth keeping.",
        ),
        optional("tip", Shape::Text, "The indenter's tip."),
    ],
    exactly_one: &[],
};

static SCENE: Table = Table {
    name: "scene",
    doc: "What a simulated rig must be good for; give `needs`, `level` or both. The cheapest sufficient level is used.",
    keys: &[
        optional(
            "needs",
            Shape::List {
                of: &Shape::Choice(NEEDS),
                min: 1,
                max: 7,
            },
            "Properties of the session that its user relies on.",
        ),
        optional(
            "level",
            Shape::Choice(LEVELS),
            "The simulation level outright; must be sufficient for `needs`.",
        ),
    ],
    exactly_one: &[],
};

const NEEDS: &[Word] = &[
    ("motion", "trajectories, settling, timing of the presses"),
    ("triggers", "trigger edges and clock fits"),
    (
        "event_rates",
        "data volume and event rates of realistic size and course",
    ),
    ("polarity", "polarity of press and release bursts"),
    ("localisation", "localisation end to end"),
    (
        "optical_error",
        "localisation errors that emerge from optics",
    ),
    (
        "latency",
        "detection latency that emerges from light and pixel thresholds",
    ),
];

const LEVELS: &[Word] = &[
    ("kinematic", "robot and trigger box only, no pixels"),
    (
        "geometric",
        "events around the projected column of the contact",
    ),
    ("optical", "a light-path model of the waveguide"),
];
