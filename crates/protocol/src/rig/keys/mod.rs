//! Every key of a rig file: name, meaning, form, range, default.

mod devices;

use crate::keys::{count, default, optional, required};
use crate::shape::{Range, Shape, Table, Word};
use devices::{CAMERAS, ROBOT, TRIGGER_BOX};
use skinrig_settings::Dimension::{Angle, Data, DataRate, Force, Length, Mass, Speed, Time};

/// The version of the rig file's language that this crate reads.
pub(crate) const VERSION: i64 = 1;

static COORDINATE: Shape = Shape::Quantity(&[Length], Range::between(-1000.0, 1000.0));
const PLACE: Shape = Shape::Tuple(&COORDINATE, &["x", "y", "z"]);
const POSITIVE_LENGTH: Shape = Shape::Quantity(&[Length], Range::above_zero(1000.0));
const FORCE: Shape = Shape::Quantity(&[Force], Range::above_zero(12.0));
/// What the omega.3's driver drives: set points at 2 kHz, at most 0.1 mm apart even when every other one is missed.
const SPEED: Shape = Shape::Quantity(&[Speed], Range::above_zero(100.0));
const ANGLE: Shape = Shape::Quantity(&[Angle], Range::between(-180.0, 180.0));
/// What the omega.3's driver tells its library to carry: a larger mass would lift the arm.
const MASS: Shape = Shape::Quantity(&[Mass], Range::above_zero(1.0));

const fn time(max_s: f64) -> Shape {
    Shape::Quantity(&[Time], Range::above_zero(max_s))
}

/// The whole file.
pub(crate) static RIG: Table = Table {
    name: "rig",
    doc: "A skinrig rig file: which device plays which role, where the skin lies, and what must never happen on this bench.",
    keys: &[
        required(
            "skinrig_rig",
            count(VERSION, VERSION),
            "Version of the rig file's language: 1.",
        ),
        required(
            "name",
            Shape::Text,
            "Name of the bench. Stored with every session.",
        ),
        required(
            "kind",
            Shape::Choice(KINDS),
            "Whether hardware stands behind the drivers. Stored with every session.",
        ),
        optional(
            "description",
            Shape::Text,
            "Anything worth keeping about the bench.",
        ),
        required(
            "frame",
            Shape::Map(&FRAME),
            "Where the skin lies in the robot's frame: given, or fitted to touched points.",
        ),
        required("tip", Shape::Map(&TIP), "What the robot presses with."),
        required(
            "limits",
            Shape::Map(&LIMITS),
            "What this bench bears, whatever a protocol asks for.",
        ),
        required("robot", Shape::Map(&ROBOT), "The robot that presses."),
        required("cameras", Shape::Map(&CAMERAS), "The two event cameras."),
        optional(
            "trigger_box",
            Shape::Map(&TRIGGER_BOX),
            "The box that pulses the cameras' trigger inputs; absent: none is connected.",
        ),
        default(
            "preflight",
            Shape::Map(&PREFLIGHT),
            "{}",
            "What must hold before anything is armed.",
        ),
        optional(
            "press",
            Shape::Map(&crate::surface::PRESS),
            "How the surface is found, when the protocol does not say; absent: the frame is trusted.",
        ),
        default(
            "hil",
            Shape::Map(&HIL),
            "{}",
            "What a suite of checks may do on this bench.",
        ),
    ],
    exactly_one: &[],
};

const KINDS: &[Word] = &[
    ("bench", "hardware"),
    (
        "emulated",
        "production drivers over stand-ins for the hardware; everything recorded says so",
    ),
];

static HIL: Table = Table {
    name: "hil",
    doc: "What a suite of checks (`skinrig hil run`) may do on this bench.",
    keys: &[
        default(
            "drills",
            Shape::List {
                of: &Shape::Choice(DRILLS),
                min: 0,
                max: 2,
            },
            "[]",
            "Drills that this bench permits. Emulated benches permit all.",
        ),
        optional(
            "light",
            Shape::Map(&LIGHT),
            "Programs that switch the bench's lamps; absent: noise in the dark is not measured.",
        ),
    ],
    exactly_one: &[],
};

const DRILLS: &[Word] = &[
    (
        "watchdog",
        "the program that holds the arm in free air is killed",
    ),
    (
        "stop",
        "the arm is stopped in the middle of a move in free air",
    ),
];

const PROGRAM: Shape = Shape::List {
    of: &Shape::Text,
    min: 1,
    max: 20,
};

static LIGHT: Table = Table {
    name: "light",
    doc: "Programs that switch the lamps. Each is run without a shell, must end with 0 within 10 s, and leaves the lamps as its name says.",
    keys: &[
        required(
            "dark",
            PROGRAM,
            "Switches the lamps off: a program and its arguments; `${NAME}` is looked up in the environment.",
        ),
        required("lit", PROGRAM, "Switches them on."),
    ],
    exactly_one: &[],
};

static FRAME: Table = Table {
    name: "rig_frame",
    doc: "Where the skin lies in the robot's frame. Skin: z out of the surface, z = 0 at the surface. Robot: z away from the sample (`robot.axes`).",
    keys: &[
        optional(
            "given",
            Shape::Map(&GIVEN),
            "The skin's place as measured by other means.",
        ),
        optional(
            "touch_off",
            Shape::Map(&TOUCH_OFF),
            "Points that were touched with the tip: `skinrig jog` prints this block.",
        ),
    ],
    exactly_one: &[&["given", "touch_off"]],
};

static GIVEN: Table = Table {
    name: "given_frame",
    doc: "Robot = Rz(yaw) Ry(pitch) Rx(roll) skin + origin.",
    keys: &[
        required("origin", PLACE, "The skin's origin in the robot's frame."),
        default(
            "yaw",
            ANGLE,
            "0 deg",
            "Turn about the robot's z, applied last.",
        ),
        default("pitch", ANGLE, "0 deg", "Turn about y."),
        default("roll", ANGLE, "0 deg", "Turn about x, applied first."),
        required(
            "date",
            Shape::Text,
            "When it was measured: year-month-day, for example `2026-11-20`.",
        ),
    ],
    exactly_one: &[],
};

static TOUCH_OFF: Table = Table {
    name: "touch_off",
    doc: "Points whose skin coordinates are known and whose robot coordinates were measured by touching them.",
    keys: &[
        required(
            "date",
            Shape::Text,
            "When they were touched: year-month-day, for example `2026-11-20`.",
        ),
        required(
            "points",
            Shape::List {
                of: &Shape::Map(&TOUCHED),
                min: 3,
                max: 1000,
            },
            "At least three points that do not lie on one line; four or more show slips better.",
        ),
        default(
            "max_residual",
            Shape::Quantity(&[Length], Range::above_zero(10.0)),
            "0.3 mm",
            "Largest distance of a point from the rigid fit.",
        ),
    ],
    exactly_one: &[],
};

static TOUCHED: Table = Table {
    name: "touched_point",
    doc: "One touched point.",
    keys: &[
        optional("name", Shape::Text, "For messages."),
        required("skin", PLACE, "Where it is on the skin."),
        required("robot", PLACE, "Where the robot's tip was when it touched."),
    ],
    exactly_one: &[],
};

static TIP: Table = Table {
    name: "tip",
    doc: "The indenter's tip.",
    keys: &[
        required(
            "shape",
            Shape::Choice(TIPS),
            "Shape of the end that touches.",
        ),
        optional("side", POSITIVE_LENGTH, "Side of a cube."),
        optional(
            "diameter",
            POSITIVE_LENGTH,
            "Diameter of a sphere or a cylinder.",
        ),
        optional(
            "mass",
            MASS,
            "Mass of the tip and its holder. Kept with the session; the robot is told `robot.effector_mass`.",
        ),
    ],
    exactly_one: &[&["side", "diameter"]],
};

const TIPS: &[Word] = &[
    ("cube", "a flat square end"),
    ("sphere", "a ball"),
    ("cylinder", "a flat round end"),
];

static LIMITS: Table = Table {
    name: "rig_limits",
    doc: "What this bench bears. The tighter of these and of the protocol's holds.",
    keys: &[
        required(
            "workspace",
            Shape::Map(&WORKSPACE),
            "The box that the tip never leaves, robot frame. The robot's true workspace shrinks away from its axes.",
        ),
        required("max_speed", SPEED, "Fastest motion."),
        required(
            "max_force",
            FORCE,
            "A measured force above this ends the run.",
        ),
        default(
            "max_lead",
            Shape::Quantity(&[Length], Range::above_zero(4.0)),
            "2 mm",
            "How far the robot's target may run ahead of where it is: bounds the force that builds up in contact.",
        ),
        required(
            "max_depth",
            Shape::Quantity(&[Length], Range::above_zero(50.0)),
            "Deepest indentation below the surface of the frame.",
        ),
    ],
    exactly_one: &[],
};

static WORKSPACE: Table = Table {
    name: "robot_workspace",
    doc: "A box in the robot's frame.",
    keys: &[
        required("min", PLACE, "Lowest x, y and z."),
        required("max", PLACE, "Highest x, y and z."),
    ],
    exactly_one: &[],
};

static PREFLIGHT: Table = Table {
    name: "preflight",
    doc: "What must hold before anything is armed. A check that fails ends the run before the robot is powered.",
    keys: &[
        default(
            "touch_off_max_age",
            time(31_536_000.0),
            "168 h",
            "A frame measured longer ago than this fails.",
        ),
        default(
            "data_rate",
            Shape::Quantity(&[DataRate], Range::above_zero(1e9)),
            "20 MB/s",
            "Expected bytes of both cameras together: with the plan's length it gives the disk space that a session needs.",
        ),
        default(
            "min_free_disk",
            Shape::Quantity(&[Data], Range::from_zero(1e15)),
            "2 GB",
            "Free space that must be left after the session.",
        ),
        default(
            "loopback_within",
            time(60.0),
            "2 s",
            "A mark sent by the box must be seen by both cameras, under its own name, within this time.",
        ),
        default(
            "clocks_within",
            time(60.0),
            "2 s",
            "Both cameras' clocks must be seen to advance within this time.",
        ),
    ],
    exactly_one: &[],
};
