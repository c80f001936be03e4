//! Every key of a protocol: name, meaning, form, range, default. The reader and the JSON Schema follow this table.

use crate::quantity::Dimension::{Angle, Force, Length, Pixels, Speed, Time};
use crate::shape::{Key, Need, Range, Shape, Table, Word};

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
static POINT_ITEM: Shape = POINT;
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
            Shape::Map(&ANALYSIS),
            "{}",
            "Settings of the analysis that follows the run.",
        ),
        default(
            "cameras",
            Shape::Map(&CAMERAS),
            "{}",
            "Settings written to the cameras before the run and read back.",
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

static FRAME: Table = Table {
    name: "frame",
    doc: "The skin's outline and what must not be touched.",
    keys: &[
        default(
            "outline",
            Shape::WordOr(OUTLINES, &OUTLINE),
            "paper",
            "The skin's outline.",
        ),
        default(
            "margin",
            LENGTH,
            "0 mm",
            "Every press stays at least this far inside the outline: half the width of the tip, and some.",
        ),
        optional(
            "keep_outs",
            Shape::List {
                of: &Shape::Map(&KEEP_OUT),
                min: 0,
                max: 1000,
            },
            "Areas that the tip must not enter.",
        ),
    ],
    exactly_one: &[],
};

pub(crate) const OUTLINES: &[Word] = &[(
    "paper",
    "the published skin: 100 x 100 mm about (10, 2) mm, right corners chamfered by 20 mm, left corners rounded with 25 mm",
)];

pub(crate) static OUTLINE: Table = Table {
    name: "outline",
    doc: "A rectangle whose right corners (larger x) are chamfered and whose left corners are rounded.",
    keys: &[
        required("centre", POINT, "Middle of the rectangle."),
        required("width", POSITIVE_LENGTH, "Full extent along x."),
        required("height", POSITIVE_LENGTH, "Full extent along y."),
        default(
            "chamfer",
            LENGTH,
            "0 mm",
            "Length cut from each side at the two right corners.",
        ),
        default("radius", LENGTH, "0 mm", "Radius of the two left corners."),
    ],
    exactly_one: &[],
};

static KEEP_OUT: Table = Table {
    name: "keep_out",
    doc: "An area that the tip must not enter: a circle, a rectangle or a polygon.",
    keys: &[
        optional("circle", Shape::Map(&CIRCLE), "A circle."),
        optional(
            "rectangle",
            Shape::Map(&RECTANGLE),
            "A rectangle along the axes.",
        ),
        optional(
            "polygon",
            Shape::List {
                of: &POINT_ITEM,
                min: 3,
                max: 1000,
            },
            "A polygon by its corners, in order around it.",
        ),
        default(
            "margin",
            LENGTH,
            "0 mm",
            "The tip stays at least this far away from the area.",
        ),
        optional(
            "height",
            LENGTH,
            "Height of the obstacle above the surface; travel at or above it may pass over. Without it nothing passes over.",
        ),
        optional(
            "name",
            Shape::Text,
            "What stands there, for messages and pictures.",
        ),
    ],
    exactly_one: &[&["circle", "rectangle", "polygon"]],
};

static CIRCLE: Table = Table {
    name: "circle",
    doc: "A circle.",
    keys: &[
        required("centre", POINT, "Its centre."),
        required("radius", POSITIVE_LENGTH, "Its radius."),
    ],
    exactly_one: &[],
};

static RECTANGLE: Table = Table {
    name: "rectangle",
    doc: "A rectangle along the axes.",
    keys: &[
        required("min", POINT, "The corner with the smaller x and y."),
        required("max", POINT, "The corner with the larger x and y."),
    ],
    exactly_one: &[],
};

static SYNC: Table = Table {
    name: "sync",
    doc: "Presses before everything else. The paper: 3 presses 1 s apart at the centre, then 3 s.",
    keys: &[
        required("count", count(1, 1000), "How many presses."),
        required(
            "interval",
            POSITIVE_SPAN,
            "Time from the begin of one sync press to the begin of the next.",
        ),
        optional("at", POINT, "Where; the centre of the outline when absent."),
        default(
            "pause_after",
            SPAN,
            "0 s",
            "Pause after the last sync press, counted from its end.",
        ),
        optional(
            "depth",
            DEPTH,
            "How deep; the first depth of the path when absent.",
        ),
    ],
    exactly_one: &[],
};

static PATH: Table = Table {
    name: "path",
    doc: "The locations that are pressed: exactly one kind.",
    keys: &[
        optional(
            "meander",
            Shape::Map(&MEANDER),
            "A grid, line by line, every second line backwards.",
        ),
        optional(
            "circles",
            Shape::Map(&CIRCLES),
            "Rings of presses, counter-clockwise.",
        ),
        optional(
            "points",
            Shape::List {
                of: &POINT_ITEM,
                min: 1,
                max: MOST_POINTS as usize,
            },
            "Explicit locations.",
        ),
        optional(
            "csv",
            Shape::Map(&CSV),
            "Locations from a CSV file with the columns `x` and `y`.",
        ),
        optional(
            "random",
            Shape::Map(&RANDOM),
            "Random locations inside the outline, with a least distance between any two.",
        ),
    ],
    exactly_one: &[&["meander", "circles", "points", "csv", "random"]],
};

static MEANDER: Table = Table {
    name: "meander",
    doc: "A grid, line by line, every second line backwards.",
    keys: &[
        required(
            "origin",
            POINT,
            "The first location: the grid's corner with the smallest x and y.",
        ),
        required(
            "pitch",
            POSITIVE_LENGTH,
            "Distance of neighbours along x and along y.",
        ),
        required("columns", count(1, 10_000), "Locations along x."),
        required("rows", count(1, 10_000), "Locations along y."),
        required(
            "line_direction",
            Shape::Choice(AXES),
            "The axis along which a line runs.",
        ),
        optional(
            "count",
            count(1, MOST_POINTS),
            "How many locations are used, from the first; all when absent.",
        ),
    ],
    exactly_one: &[],
};

const AXES: &[Word] = &[
    (
        "x",
        "lines run along x; the next line is one pitch further in y",
    ),
    (
        "y",
        "lines run along y; the next line is one pitch further in x",
    ),
];

static CIRCLES: Table = Table {
    name: "circles",
    doc: "Rings of presses about one centre, each counter-clockwise, in the order given.",
    keys: &[
        required("centre", POINT, "Centre of all rings."),
        required(
            "rings",
            Shape::List {
                of: &Shape::Map(&RING),
                min: 1,
                max: 1000,
            },
            "The rings.",
        ),
        default(
            "start_angle",
            Shape::Quantity(&[Angle], Range::between(-360.0, 360.0)),
            "0 deg",
            "Direction of each ring's first press from the centre, counter-clockwise from the x axis.",
        ),
    ],
    exactly_one: &[],
};

static RING: Table = Table {
    name: "ring",
    doc: "One ring of presses at equal angles.",
    keys: &[
        required("radius", POSITIVE_LENGTH, "Its radius."),
        required("presses", count(1, 10_000), "How many presses."),
    ],
    exactly_one: &[],
};

static CSV: Table = Table {
    name: "csv",
    doc: "Locations from a CSV file with a header; the columns `x` and `y` are used.",
    keys: &[
        required(
            "file",
            Shape::Text,
            "The file, relative to the protocol's own folder.",
        ),
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
        optional(
            "count",
            count(1, MOST_POINTS),
            "How many locations are used, from the first; all when absent.",
        ),
    ],
    exactly_one: &[],
};

pub(crate) const UNITS: &[Word] = &[
    ("mm", "millimetres"),
    ("cm", "centimetres"),
    ("m", "metres"),
];

static RANDOM: Table = Table {
    name: "random",
    doc: "Random locations: uniform inside the outline, thrown until each is far enough from all others.",
    keys: &[
        required("count", count(1, 10_000), "How many locations."),
        required("spacing", LENGTH, "Least distance of any two locations."),
        default(
            "margin",
            LENGTH,
            "0 mm",
            "Least distance from the outline, beyond `frame.margin`.",
        ),
        optional(
            "seed",
            SEED,
            "Seed of the locations; the run's seed when absent.",
        ),
    ],
    exactly_one: &[],
};

static REPETITIONS: Table = Table {
    name: "repetitions",
    doc: "How often the whole path is run.",
    keys: &[
        default(
            "count",
            count(1, 10_000),
            "1",
            "How often the whole path is run.",
        ),
        default(
            "between",
            Shape::Map(&BETWEEN),
            "{}",
            "What happens between two repetitions.",
        ),
    ],
    exactly_one: &[],
};

static BETWEEN: Table = Table {
    name: "between",
    doc: "What happens between two repetitions.",
    keys: &[
        default(
            "return_to_start",
            Shape::Flag,
            "true",
            "Go back above the first location before the pause; otherwise after it.",
        ),
        default("pause", SPAN, "0 s", "How long to wait."),
    ],
    exactly_one: &[],
};

const ORDER: &[Word] = &[("listed", "the order of the path")];

static ORDER_TABLE: Table = Table {
    name: "order",
    doc: "A shuffled order.",
    keys: &[required(
        "shuffled",
        Shape::Map(&SHUFFLED),
        "Each repetition runs its presses (all locations at all depths) in its own random order.",
    )],
    exactly_one: &[],
};

static SHUFFLED: Table = Table {
    name: "shuffled",
    doc: "A random order.",
    keys: &[optional(
        "seed",
        SEED,
        "Seed of the order; the run's seed when absent.",
    )],
    exactly_one: &[],
};

static MOTION: Table = Table {
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

static SETTLE: Table = Table {
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

static LIMITS: Table = Table {
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

static WORKSPACE: Table = Table {
    name: "workspace",
    doc: "A box in the skin frame.",
    keys: &[
        required("min", POSITION, "Lowest x, y and z."),
        required("max", POSITION, "Highest x, y and z."),
    ],
    exactly_one: &[],
};

static TRIGGERS: Table = Table {
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

const MARKS: &[Word] = &[
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

const ROW: Shape = Shape::Quantity(&[Pixels], Range::between(0.0, 479.0));
static ROW_ITEM: Shape = ROW;
const ROWS: Shape = Shape::Tuple(&ROW_ITEM, &["first", "last"]);

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
            "full",
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

static CROP: Table = Table {
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

const CENTROIDS: &[Word] = &[
    ("largest_cluster", "the largest cluster, as the paper says"),
    (
        "all_clusters",
        "all events that are not noise, as the public code does",
    ),
];

const CALIBRATIONS: &[Word] = &[
    ("none", "use the nominal geometry as it is"),
    ("positions", "both positions: 4 parameters"),
    ("positions_skews", "positions and skews: 6 parameters"),
    ("full", "positions, skews and distortions: the paper's 8"),
];

static CAMERAS: Table = Table {
    name: "cameras",
    doc: "Settings of the two cameras.",
    keys: &[
        optional("camera1", Shape::Map(&CAMERA), "Camera 1."),
        optional("camera2", Shape::Map(&CAMERA), "Camera 2."),
    ],
    exactly_one: &[],
};

static CAMERA: Table = Table {
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

static ROI: Table = Table {
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
