//! Keys of motion, limits, triggers, evaluation, analysis and cameras.

use super::{
    DEPTH, PACE, POSITION, POSITIVE_LENGTH, POSITIVE_SPAN, SEED, SPAN, SPEED, count, default,
    optional, required,
};
use crate::quantity::Dimension::{Force, Length, Pixels, Time};
use crate::shape::{Range, Shape, Table, Word};

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
    ],
    exactly_one: &[],
};

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

pub(crate) const ROW: Shape = Shape::Quantity(&[Pixels], Range::between(0.0, 479.0));
pub(crate) static ROW_ITEM: Shape = ROW;
pub(crate) const ROWS: Shape = Shape::Tuple(&ROW_ITEM, &["first", "last"]);

/// Settings of an analysis, in protocols and in schedules.
pub(crate) static ANALYSIS: Table = Table {
    name: "analysis",
    doc: "Settings of the analysis; every key is optional.",
    keys: &[
        default(
            "crop",
            Shape::Map(&CROP),
            "{}",
            "Rows of each camera that are kept, both ends included.",
        ),
        default(
            "window_before",
            SPAN,
            "50 ms",
            "The press window begins this long before the measured contact.",
        ),
        default(
            "window_after",
            SPAN,
            "50 ms",
            "The press window ends this long after the measured release.",
        ),
        default(
            "eps",
            Shape::Quantity(&[Pixels], Range::above_zero(640.0)),
            "10 px",
            "Neighbourhood radius of DBSCAN.",
        ),
        default(
            "min_samples",
            count(1, 1_000_000),
            "10",
            "Core threshold of DBSCAN, events.",
        ),
        default(
            "centroid",
            Shape::Choice(CENTROIDS),
            "largest_cluster",
            "Which clustered events make the centroid of a press.",
        ),
        default(
            "min_cluster_events",
            count(0, 1_000_000),
            "20",
            "A press with fewer clustered events than this in either camera is excluded; 0 turns the rule off.",
        ),
        default(
            "min_response_sigma",
            Shape::Number(Range::from_zero(1000.0)),
            "5",
            "A press with fewer events than the idle rate predicts plus this many standard errors, in either camera, is excluded; 0 turns the rule off.",
        ),
        default(
            "min_ray_sine",
            Shape::Number(Range::from_zero(1.0)),
            "0.05",
            "A press whose rays meet at less than this sine is excluded as nearly parallel.",
        ),
        default(
            "exclude_outside",
            Shape::Flag,
            "true",
            "Leave estimates outside the outline out of the headline metrics; they are always counted.",
        ),
        default(
            "calibration",
            Shape::Choice(CALIBRATIONS),
            "auto",
            "Which parameters of the camera geometry are calibrated.",
        ),
        default(
            "bootstrap_resamples",
            count(1, 1_000_000),
            "2000",
            "Resamples of the bootstrap over locations.",
        ),
        default("seed", SEED, "1", "Seed of the bootstrap."),
        default(
            "rate_bin",
            Shape::Quantity(&[Time], Range::above_zero(60.0)),
            "10 ms",
            "Width of the event-rate bins.",
        ),
    ],
    exactly_one: &[],
};

pub(crate) static CROP: Table = Table {
    name: "crop",
    doc: "Rows that are kept, both ends included.",
    keys: &[
        default(
            "camera1",
            ROWS,
            "[185 px, 360 px]",
            "First and last row of camera 1.",
        ),
        default(
            "camera2",
            ROWS,
            "[200 px, 355 px]",
            "First and last row of camera 2.",
        ),
    ],
    exactly_one: &[],
};

pub(crate) const CENTROIDS: &[Word] = &[
    ("largest_cluster", "the largest cluster, as the paper says"),
    (
        "all_clusters",
        "all events that are not noise, as the public code does",
    ),
];

pub(crate) const CALIBRATIONS: &[Word] = &[
    ("none", "use the nominal geometry as it is"),
    ("positions", "both positions: 4 parameters"),
    ("positions_skews", "positions and skews: 6 parameters"),
    ("full", "positions, skews and distortions: the paper's 8"),
    (
        "full_scale",
        "the 8 and a scale of the field of view per camera: 10",
    ),
    (
        "auto",
        "the smallest of them whose cross-validated error is within one standard error of the best",
    ),
];

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
