//! Keys of the analysis, in protocols and in schedules.

use skinrig_model::range::analysis as limits;

use super::{SEED, count, default, optional};
use crate::shape::{Range, Shape, Table, Word};
use skinrig_settings::Dimension::{Length, Pixels, Time};

pub(crate) const ROW: Shape = Shape::Quantity(&[Pixels], Range::between(0.0, 479.0));
pub(crate) static ROW_ITEM: Shape = ROW;
pub(crate) const ROWS: Shape = Shape::Tuple(&ROW_ITEM, &["first", "last"]);

/// A whole number in a range that the analysis declares.
const fn whole(range: Range) -> Shape {
    count(range.min as i64, range.max as i64)
}

/// A time in a range that the analysis declares in milliseconds.
const fn milliseconds(range: Range) -> Shape {
    Shape::Quantity(&[Time], range.in_units_of(1e3))
}

/// A time in a range that the analysis declares in microseconds.
const fn microseconds(range: Range) -> Shape {
    Shape::Quantity(&[Time], range.in_units_of(1e6))
}

/// A length in a range that the analysis declares.
const fn millimetres(range: Range) -> Shape {
    Shape::Quantity(&[Length], range)
}

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
            milliseconds(limits::WINDOW_MARGIN_MS),
            "50 ms",
            "The press window begins this long before the measured contact.",
        ),
        default(
            "window_after",
            milliseconds(limits::WINDOW_MARGIN_MS),
            "50 ms",
            "The press window ends this long after the measured release.",
        ),
        default(
            "eps",
            Shape::Quantity(&[Pixels], limits::EPS_PX),
            "10 px",
            "Neighbourhood radius of DBSCAN.",
        ),
        default(
            "min_samples",
            whole(limits::MIN_SAMPLES),
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
            "estimator",
            Shape::Choice(ESTIMATORS),
            "dbscan",
            "What turns the events of a press into a column; `skinrig tradeoff` measures what each is worth.",
        ),
        default(
            "precision",
            Shape::Choice(PRECISIONS),
            "f64",
            "Width of the estimator's floating-point numbers; `dbscan` and `column_median` count in whole numbers and know no difference.",
        ),
        default(
            "forget",
            milliseconds(limits::FORGET_MS),
            "100 ms",
            "After this time the streaming estimator has forgotten all but 1/e of an event.",
        ),
        default(
            "thinning",
            whole(limits::THINNING),
            "1",
            "Only one event in this many is used, chosen at random; 1: all.",
        ),
        default(
            "bin",
            Shape::Quantity(&[Pixels], Range::between(1.0, 16.0)),
            "1 px",
            "Side of the square bins of pixels that the estimator sees: 1, 2, 4, 8 or 16 px.",
        ),
        optional(
            "window_after_contact",
            milliseconds(limits::WINDOW_AFTER_CONTACT_MS),
            "The press window ends this long after the measured contact, if it is not over before; when absent only the release ends it.",
        ),
        default(
            "window_anchor",
            Shape::Choice(ANCHORS),
            "touch",
            "Where the press window is anchored.",
        ),
        default(
            "cluster_threshold",
            Shape::Choice(THRESHOLDS),
            "calibrated",
            "How the least number of clustered events of a press is found.",
        ),
        default(
            "min_cluster_events",
            whole(limits::MIN_CLUSTER_EVENTS),
            "20",
            "A press with fewer clustered events than this in either camera is excluded; the least value of a calibrated threshold; 0 turns a fixed rule off.",
        ),
        default(
            "exclude_press_numbers",
            Shape::List {
                of: &PRESS,
                min: 0,
                max: 100_000,
            },
            "[]",
            "Presses left out by hand, by their number in the report and everywhere else (from 1, sync presses counted).",
        ),
        optional(
            "exclude_presses",
            Shape::List {
                of: &PRESS_INDEX,
                min: 0,
                max: 100_000,
            },
            "In recordings of earlier versions only: presses left out by hand, counted from 0. New files use `exclude_press_numbers`.",
        ),
        default(
            "min_response_sigma",
            Shape::Number(limits::MIN_RESPONSE_SIGMA),
            "5",
            "A press with fewer events than the idle rate predicts plus this many standard errors, in either camera, is excluded; 0 turns the rule off.",
        ),
        default(
            "min_ray_sine",
            Shape::Number(limits::MIN_RAY_SINE),
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
            "lens",
            Shape::Choice(LENSES),
            "exponential",
            "The lens that is calibrated: how the distance of a column from the middle becomes an angle.",
        ),
        optional(
            "failure_penalty",
            millimetres(limits::LENGTH_MM),
            "The least that a failed press counts in the RMSE with failures counted; when absent the RMS distance of the scored presses from their mean: the error of an answer that knows nothing. Raised to the RMSE of the presses with an estimate where that is more.",
        ),
        default(
            "within",
            millimetres(limits::LENGTH_MM),
            "5 mm",
            "Error up to which a press counts as within.",
        ),
        default(
            "bits_per_event",
            Shape::Number(limits::BITS_PER_EVENT),
            "21",
            "Bits per event in the data rates; the paper's 21.",
        ),
        default(
            "study_presses",
            whole(limits::STUDY_PRESSES),
            "300",
            "Most scored presses whose events are kept for the studies of data reduction and latency, chosen at random; 0 leaves the studies out.",
        ),
        default(
            "reduction",
            Shape::Map(&REDUCTION),
            "{}",
            "The data-reduction study.",
        ),
        default(
            "latency",
            Shape::Map(&LATENCY),
            "{}",
            "The detection-latency study.",
        ),
        default(
            "cmre",
            Shape::Map(&CMRE),
            "{}",
            "The contact map reconstruction error; none of its values is published.",
        ),
        default(
            "alignment",
            Shape::Map(&ALIGNMENT),
            "{}",
            "Limits of the alignment certificate: a session beyond one of them is invalid.",
        ),
        default(
            "bootstrap_resamples",
            whole(limits::BOOTSTRAP_RESAMPLES),
            "2000",
            "Resamples of the bootstrap over locations; 0: no intervals.",
        ),
        default("seed", SEED, "1", "Seed of the bootstrap."),
        default(
            "rate_bin",
            milliseconds(limits::RATE_BIN_MS),
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

const ESTIMATORS: &[Word] = &[
    ("dbscan", "mean of the clustered events, as the paper says"),
    ("column_median", "median column of all events"),
    (
        "histogram_peak",
        "peak of the histogram of columns, smoothed by `eps`",
    ),
    (
        "streaming",
        "a running histogram of 40 columns that forgets, in constant memory",
    ),
];

const PRECISIONS: &[Word] = &[("f64", "64 bits"), ("f32", "32 bits")];

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
        "the smallest of them that no larger one beats at places left out, by more than noise explains",
    ),
];

pub(crate) static PRESS: Shape = count(1, 10_000_000);
pub(crate) static PRESS_INDEX: Shape = count(0, 10_000_000);

pub(crate) const ANCHORS: &[Word] = &[
    (
        "touch",
        "from before the measured contact to after the measured release",
    ),
    (
        "middle",
        "about the middle between contact and release, as the public code does",
    ),
];

pub(crate) const THRESHOLDS: &[Word] = &[
    ("calibrated", "chosen on the calibrating presses alone"),
    ("fixed", "min_cluster_events as it is"),
];

pub(crate) const LENSES: &[Word] = &[
    (
        "exponential",
        "the paper's: equidistant with an exponential falloff",
    ),
    ("equidistant", "angle proportional to distance (f-theta)"),
    ("rectilinear", "pinhole"),
    (
        "stereographic",
        "tangent of half the angle proportional to distance",
    ),
    (
        "equisolid",
        "sine of half the angle proportional to distance",
    ),
];

pub(crate) static REDUCTION: Table = Table {
    name: "reduction",
    doc: "Localisation on thinned events.",
    keys: &[
        default(
            "max_power",
            whole(limits::REDUCTION_MAX_POWER),
            "12",
            "Thinning factors 1, 2, 4 ... up to 2 to this power; the paper's 10.",
        ),
        default(
            "seeds",
            whole(limits::REDUCTION_SEEDS),
            "10",
            "Random seeds per factor and kind of thinning.",
        ),
        default(
            "min_samples",
            whole(limits::REDUCTION_MIN_SAMPLES),
            "0",
            "Core threshold of DBSCAN at all factors; 0 takes that of the analysis. The public code: 1.",
        ),
    ],
    exactly_one: &[],
};

pub(crate) static LATENCY: Table = Table {
    name: "latency",
    doc: "A one-sided CUSUM on the binned, smoothed event counts of both cameras.",
    keys: &[
        default(
            "bin",
            milliseconds(limits::LATENCY_BIN_MS),
            "0.2 ms",
            "Width of a bin.",
        ),
        default(
            "sigma",
            milliseconds(limits::LATENCY_SIGMA_MS),
            "0.5 ms",
            "Standard deviation of the Gaussian kernel.",
        ),
        default(
            "alpha",
            Shape::Number(limits::LATENCY_ALPHA),
            "4",
            "Rate increase that the detector is tuned to.",
        ),
        default(
            "consecutive",
            whole(limits::LATENCY_COUNT),
            "3",
            "Bins in a row above the threshold.",
        ),
        default(
            "thresholds",
            Shape::Map(&GRID),
            "{}",
            "The thresholds h that are tried.",
        ),
        default(
            "target_rate",
            Shape::Number(limits::SHARE),
            "0.95",
            "The threshold with the fewest false alarms is chosen among those that detect at least this share.",
        ),
        default(
            "window",
            milliseconds(limits::LATENCY_WINDOW_MS),
            "100 ms",
            "A detection counts when it lies within this of the median onset.",
        ),
        default(
            "background",
            Shape::Choice(BACKGROUNDS),
            "before",
            "Where the background rate is taken from.",
        ),
        default(
            "reduced",
            Shape::Map(&REDUCED),
            "{}",
            "The same study on thinned events.",
        ),
    ],
    exactly_one: &[],
};

pub(crate) static REDUCED: Table = Table {
    name: "reduced",
    doc: "What differs from the study on all events.",
    keys: &[
        default(
            "factor",
            whole(limits::THINNING),
            "1024",
            "Of the events of a trial and of its background one in this many is used, chosen at random; the paper's 1024.",
        ),
        default(
            "thresholds",
            Shape::Map(&REDUCED_GRID),
            "{}",
            "The thresholds h that are tried.",
        ),
        default(
            "target_rate",
            Shape::Number(limits::SHARE),
            "0.85",
            "The threshold with the fewest false alarms is chosen among those that detect at least this share; the public code's 0.85.",
        ),
    ],
    exactly_one: &[],
};

pub(crate) static REDUCED_GRID: Table = Table {
    name: "reduced_thresholds",
    doc: "Evenly spaced thresholds for thinned events, both ends included; the public code's 3 to 8.",
    keys: &[
        default(
            "from",
            Shape::Number(limits::LATENCY_THRESHOLD),
            "3",
            "The first.",
        ),
        default(
            "to",
            Shape::Number(limits::LATENCY_THRESHOLD),
            "8",
            "The last.",
        ),
        default("count", whole(limits::LATENCY_COUNT), "6", "How many."),
    ],
    exactly_one: &[],
};

pub(crate) static GRID: Table = Table {
    name: "thresholds",
    doc: "Evenly spaced thresholds, both ends included.",
    keys: &[
        default(
            "from",
            Shape::Number(limits::LATENCY_THRESHOLD),
            "1",
            "The first.",
        ),
        default(
            "to",
            Shape::Number(limits::LATENCY_THRESHOLD),
            "20",
            "The last.",
        ),
        default("count", whole(limits::LATENCY_COUNT), "20", "How many."),
    ],
    exactly_one: &[],
};

pub(crate) const BACKGROUNDS: &[Word] = &[
    ("before", "idle time before the press, as the paper says"),
    ("after", "after the press, as the public code does"),
];

const SHARE: Shape = Shape::Number(limits::SHARE);

pub(crate) static ALIGNMENT: Table = Table {
    name: "alignment",
    doc: "Limits of the alignment certificate (docs/time-base.md gives the reasons); a session beyond one of them is invalid.",
    keys: &[
        default(
            "max_residual",
            microseconds(limits::ALIGNMENT_TIME_US),
            "10 us",
            "Largest RMS residual of sync trains and marks about a camera's clock.",
        ),
        default(
            "max_camera_interval",
            microseconds(limits::ALIGNMENT_TIME_US),
            "50 us",
            "Largest half width of the 95 % interval of a camera's clock over the trigger box's, at a press.",
        ),
        default(
            "max_host_interval",
            microseconds(limits::ALIGNMENT_TIME_US),
            "5 ms",
            "Largest half width of the certain interval of the host's clock over the trigger box's, at a press.",
        ),
        default(
            "max_drift",
            Shape::Number(limits::DRIFT_PPM),
            "10000",
            "Largest rate difference between two clocks, parts per million.",
        ),
        default(
            "max_lost",
            SHARE,
            "0.3",
            "Largest share of the edges sent that a camera did not see.",
        ),
        default(
            "max_spurious",
            SHARE,
            "0.15",
            "Largest share, of the edges sent, of edges that a camera saw twice or that nobody sent.",
        ),
        default(
            "min_coverage",
            SHARE,
            "0.85",
            "Least share of held-out trains within the 95 % interval stated for them, by more than chance (3 standard errors).",
        ),
        default(
            "max_tie_distance",
            microseconds(limits::TIE_DISTANCE_US),
            "2.5 s",
            "A press further than this from the nearest train or mark that a camera saw, or from the nearest exchange with the trigger box, is not timed and does not count.",
        ),
        default(
            "robot_delay",
            microseconds(limits::ROBOT_DELAY_US),
            "1 ms",
            "The robot's poses are stamped late by at most this; stated, not measured.",
        ),
        default(
            "min_explained",
            SHARE,
            "0.5",
            "Where clocks are aligned by event rates: least share of the planned presses that are found, and of the bursts among them that are planned presses.",
        ),
        default(
            "min_log_odds",
            Shape::Number(limits::LOG_ODDS),
            "7",
            "Least natural logarithm of the odds of an alignment by event rates against all others together; 7 is 1100 to 1.",
        ),
    ],
    exactly_one: &[],
};

pub(crate) static CMRE: Table = Table {
    name: "cmre",
    doc: "Parameters of the contact map reconstruction error; none of them is published.",
    keys: &[
        default(
            "cell",
            millimetres(limits::CMRE_CELL_MM),
            "5 mm",
            "Side of a square cell.",
        ),
        default(
            "sigma",
            millimetres(limits::CMRE_WIDTH_MM),
            "1 mm",
            "Standard deviation of the estimate's Gaussian.",
        ),
        default(
            "sr",
            millimetres(limits::CMRE_WIDTH_MM),
            "5 mm",
            "SR of the public code, a length whose meaning and value are not given; 5 mm makes the documented scores \
             (one cell off about 0.02).",
        ),
    ],
    exactly_one: &[],
};
