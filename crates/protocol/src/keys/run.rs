//! Keys of motion, limits, triggers, evaluation and cameras.

use super::{
    DEPTH, PACE, POSITION, POSITIVE_LENGTH, POSITIVE_SPAN, SPAN, SPEED, count, default, optional,
    required,
};
use crate::shape::{Range, Shape, Table, Word};
use skinrig_settings::Dimension::{Acceleration, Force, Length};

pub(crate) static MOTION: Table = Table {
    name: "motion",
    doc: "How the robot moves. A pace is a speed, or the time that the motion takes.",
    keys: &[
        default(
            "clearance",
            POSITIVE_LENGTH,
            "5 mm",
            "Height above the surface at which lateral motion is allowed.",
        ),
        default(
            "approach",
            PACE,
            "40 mm/s",
            "From clearance height to the surface: speed or time.",
        ),
        default(
            "indent",
            PACE,
            "20 mm/s",
            "From the surface to depth: speed or time.",
        ),
        default("hold", SPAN, "150 ms", "Time at depth after settling."),
        default(
            "retract",
            PACE,
            "20 mm/s",
            "From depth to clearance height: speed or time.",
        ),
        default(
            "travel",
            SPEED,
            "60 mm/s",
            "Lateral motion at clearance height.",
        ),
        optional(
            "period",
            POSITIVE_SPAN,
            "Time from the begin of one press to the begin of the next; as fast as possible when absent. The paper: `868 s / 289`.",
        ),
        default(
            "settle",
            Shape::Map(&SETTLE),
            "{}",
            "When a pose counts as settled.",
        ),
        optional(
            "home",
            POSITION,
            "Where the tip waits before the run; above the centre of the outline at clearance height when absent.",
        ),
    ],
    exactly_one: &[],
};

pub(crate) static SETTLE: Table = Table {
    name: "settle",
    doc: "When a pose counts as settled.",
    keys: &[
        default(
            "tolerance",
            Shape::Quantity(&[Length], Range::above_zero(10.0)),
            "0.05 mm",
            "Largest distance from the target.",
        ),
        default(
            "time",
            SPAN,
            "20 ms",
            "How long the pose must stay that close.",
        ),
    ],
    exactly_one: &[],
};

pub(crate) static LIMITS: Table = Table {
    name: "limits",
    doc: "What must never happen.",
    keys: &[
        required(
            "workspace",
            Shape::Map(&WORKSPACE),
            "The box that the tip never leaves, skin frame.",
        ),
        required("max_depth", DEPTH, "Deepest indentation."),
        required("max_speed", SPEED, "Fastest motion."),
        required(
            "max_force",
            Shape::Quantity(&[Force], Range::above_zero(12.0)),
            "A measured force above this ends the run. At most 12 N, what the Omega.3 can exert.",
        ),
        optional(
            "max_acceleration",
            Shape::Quantity(&[Acceleration], Range::above_zero(10_000.0)),
            "Largest acceleration of the robot's set point; what the robot is set up for when absent.",
        ),
        default(
            "max_consecutive_invalid",
            count(0, 100_000),
            "5",
            "So many invalid presses in a row end the run: something is wrong that more presses do not mend. 0: no limit.",
        ),
        default(
            "on_trip",
            Shape::Choice(ON_TRIP),
            "retract",
            "What the robot does when a measured limit is broken.",
        ),
    ],
    exactly_one: &[],
};

const ON_TRIP: &[Word] = &[
    (
        "retract",
        "hold, rise straight up, disarm; brake at once when the feedback is not to be believed",
    ),
    ("brake", "brake at once, wherever the tip is"),
];

pub(crate) static WORKSPACE: Table = Table {
    name: "workspace",
    doc: "A box in the skin frame.",
    keys: &[
        required("min", POSITION, "Lowest x, y and z."),
        required("max", POSITION, "Highest x, y and z."),
    ],
    exactly_one: &[],
};

pub(crate) static TRIGGERS: Table = Table {
    name: "triggers",
    doc: "The trigger line to the cameras.",
    keys: &[default(
        "marks",
        Shape::List {
            of: &Shape::Choice(MARKS),
            min: 0,
            max: 5,
        },
        "[contact, retract]",
        "Moments of a press that emit a coded pulse.",
    )],
    exactly_one: &[],
};

pub(crate) const MARKS: &[Word] = &[
    ("approach", "the downward motion begins"),
    ("contact", "the tip reaches the surface"),
    ("at_depth", "the tip settled at its depth"),
    ("retract", "the upward motion begins"),
    ("release", "the tip left the surface"),
];

pub(crate) static EVALUATION: Table = Table {
    name: "evaluation",
    doc: "What each repetition is for. Repetitions are counted from 1, as people count; each one stands in exactly one list.",
    keys: &[
        required(
            "calibrate",
            Shape::Numbers,
            "Repetitions whose truth may be used to fit the camera geometry. The first repetition is 1.",
        ),
        required(
            "score",
            Shape::Numbers,
            "Repetitions whose truth is used only to score. The first repetition is 1; `2-10` is a span.",
        ),
    ],
    exactly_one: &[],
};

pub(crate) static CAMERAS: Table = Table {
    name: "cameras",
    doc: "Settings of the two cameras.",
    keys: &[
        optional("camera1", Shape::Map(&CAMERA), "Camera 1."),
        optional("camera2", Shape::Map(&CAMERA), "Camera 2."),
    ],
    exactly_one: &[],
};

pub(crate) static CAMERA: Table = Table {
    name: "camera",
    doc: "Settings of one camera; everything absent keeps the device's default.",
    keys: &[
        optional(
            "biases",
            Shape::Named(&Shape::Whole {
                min: i32::MIN as i64,
                max: i32::MAX as i64,
            }),
            "Bias values by name, in the device's own unit.",
        ),
        optional(
            "roi",
            Shape::Map(&ROI),
            "Pixels that stay on; all when absent.",
        ),
    ],
    exactly_one: &[],
};

pub(crate) static ROI: Table = Table {
    name: "roi",
    doc: "A rectangle of pixels that stay on.",
    keys: &[
        required("x", count(0, 639), "First column."),
        required("y", count(0, 479), "First row."),
        required("width", count(1, 640), "Columns."),
        required("height", count(1, 480), "Rows."),
    ],
    exactly_one: &[],
};
