//! Keys of the skin's frame and of the sync presses.

use super::{
    DEPTH, LENGTH, POINT, POINT_ITEM, POSITIVE_LENGTH, POSITIVE_SPAN, SPAN, count, default,
    optional, required,
};
use crate::shape::{Shape, Table, Word};

pub(crate) static FRAME: Table = Table {
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

pub(crate) static KEEP_OUT: Table = Table {
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

pub(crate) static CIRCLE: Table = Table {
    name: "circle",
    doc: "A circle.",
    keys: &[
        required("centre", POINT, "Its centre."),
        required("radius", POSITIVE_LENGTH, "Its radius."),
    ],
    exactly_one: &[],
};

pub(crate) static RECTANGLE: Table = Table {
    name: "rectangle",
    doc: "A rectangle along the axes.",
    keys: &[
        required("min", POINT, "The corner with the smaller x and y."),
        required("max", POINT, "The corner with the larger x and y."),
    ],
    exactly_one: &[],
};

pub(crate) static SYNC: Table = Table {
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
