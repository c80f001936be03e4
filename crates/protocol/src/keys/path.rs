//! Keys of the path, the repetitions and the order.

use super::{
    LENGTH, MOST_POINTS, POINT, POINT_ITEM, POSITIVE_LENGTH, SEED, SPAN, count, default, optional,
    required,
};
use crate::shape::{Range, Shape, Table, Word};
use skinrig_settings::Dimension::Angle;

pub(crate) static PATH: Table = Table {
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

pub(crate) static MEANDER: Table = Table {
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

pub(crate) const AXES: &[Word] = &[
    (
        "x",
        "lines run along x; the next line is one pitch further in y",
    ),
    (
        "y",
        "lines run along y; the next line is one pitch further in x",
    ),
];

pub(crate) static CIRCLES: Table = Table {
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

pub(crate) static RING: Table = Table {
    name: "ring",
    doc: "One ring of presses at equal angles.",
    keys: &[
        required("radius", POSITIVE_LENGTH, "Its radius."),
        required("presses", count(1, 10_000), "How many presses."),
    ],
    exactly_one: &[],
};

pub(crate) static CSV: Table = Table {
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

pub(crate) static RANDOM: Table = Table {
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

pub(crate) static REPETITIONS: Table = Table {
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

pub(crate) static BETWEEN: Table = Table {
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

pub(crate) const ORDER: &[Word] = &[("listed", "the order of the path")];

pub(crate) static ORDER_TABLE: Table = Table {
    name: "order",
    doc: "A shuffled order.",
    keys: &[required(
        "shuffled",
        Shape::Map(&SHUFFLED),
        "Each repetition runs its presses (all locations at all depths) in its own random order.",
    )],
    exactly_one: &[],
};

pub(crate) static SHUFFLED: Table = Table {
    name: "shuffled",
    doc: "A random order.",
    keys: &[optional(
        "seed",
        SEED,
        "Seed of the order; the run's seed when absent.",
    )],
    exactly_one: &[],
};
