//! Keys of the robot, the cameras and the trigger box.

use super::{ANGLE, MASS};
use crate::keys::NOMINAL_CAMERA;
use crate::keys::{ROI, count, default, optional, required};
use crate::shape::{Range, Shape, Table, Word};
use skinrig_settings::Dimension::{Acceleration, EventRate, Force, Jerk, Time};

pub(super) static ROBOT: Table = Table {
    name: "robot",
    doc: "An omega.3 behind the vendor's library.",
    keys: &[
        default("model", Shape::Choice(ROBOTS), "omega3", "Which robot."),
        required(
            "serial",
            count(0, 65_535),
            "Its serial number, as `skinrig devices` shows it; 65535, which the library reports of a robot that does not tell it, takes the only robot that is connected.",
        ),
        optional(
            "firmware",
            Shape::Text,
            "Expected firmware version; another one fails the preflight.",
        ),
        optional(
            "library",
            Shape::Text,
            "Path of the vendor's libdrd, relative to this file; `${NAME}` stands for an environment variable. Absent: the usual places.",
        ),
        optional(
            "library_version",
            Shape::Text,
            "Expected version of the library; another one fails the preflight.",
        ),
        default(
            "device_angle",
            ANGLE,
            "0 deg",
            "How the base is mounted: 0 deg upright, 90 deg lying flat. Wrong values push the arm off.",
        ),
        default(
            "axes",
            Shape::Tuple(&AXIS, &["x", "y", "z"]),
            "[+x, +y, +z]",
            "Which axes of the device the robot frame's x, y and z are: z points away from the sample. Right-handed.",
        ),
        optional(
            "effector_mass",
            MASS,
            "Mass that gravity compensation carries; absent: what the device says of itself.",
        ),
        default(
            "watchdog",
            Shape::Quantity(&[Time], Range::between(0.000_125, 0.031_875)),
            "10 ms",
            "The controller drops forces when no command came for so long; counted in steps of 125 us.",
        ),
        optional(
            "velocity_threshold",
            count(1, u32::MAX as i64),
            "Expected velocity threshold in the device's own unit. Never written; another one fails the preflight.",
        ),
        default(
            "auto_init",
            Shape::Flag,
            "false",
            "Whether skinrig may let the arm initialise itself. The arm then moves on its own: needs `sample_is_off`.",
        ),
        default(
            "sample_is_off",
            Shape::Flag,
            "false",
            "Your word that sample, hands and tools are out of the arm's whole reach.",
        ),
        default(
            "redundant_encoders",
            Shape::Choice(REDUNDANT_ENCODERS),
            "reported",
            "What the robot must report of redundant encoders: the library says 0 when their check failed and also when there are none.",
        ),
        default(
            "motor_force",
            Shape::Map(&MOTOR_FORCE),
            "{}",
            "How a cap on the motors' torque bounds the force at the tip; settle it with a scale.",
        ),
        default(
            "integral_gain",
            Shape::Number(Range::from_zero(10.0)),
            "0",
            "Integral gain of the regulation; 0: forces do not build up while the tip rests on something.",
        ),
        optional(
            "proportional_gain",
            Shape::Number(Range::from_zero(100.0)),
            "Proportional gain; absent: the library's.",
        ),
        optional(
            "derivative_gain",
            Shape::Number(Range::from_zero(100.0)),
            "Derivative gain; absent: the library's.",
        ),
        default(
            "acceleration",
            Shape::Quantity(&[Acceleration], Range::above_zero(10_000.0)),
            "200 mm/s2",
            "Largest acceleration of moves.",
        ),
        default(
            "jerk",
            Shape::Quantity(&[Jerk], Range::above_zero(1e6)),
            "4000 mm/s3",
            "Largest jerk of moves.",
        ),
        default(
            "supervisor",
            Shape::Flag,
            "true",
            "Whether a second process brakes the arm when this one dies.",
        ),
    ],
    exactly_one: &[],
};

const ROBOTS: &[Word] = &[("omega3", "Force Dimension omega.3")];

const REDUNDANT_ENCODERS: &[Word] = &[
    ("reported", "anything; it is recorded, and 0 is remarked"),
    (
        "required",
        "that they agree (1): for a robot that is known to have them",
    ),
];

static MOTOR_FORCE: Table = Table {
    name: "motor_force",
    doc: "Force at the tip = per_ratio (ratio - gravity_ratio), with ratio the share of the motors' torque that may be used.",
    keys: &[
        default(
            "per_ratio",
            Shape::Quantity(&[Force], Range::above_zero(50.0)),
            "12 N",
            "Largest force over all poses that was measured on a scale, by ratio. The default is the device's nominal force; the true one depends on the pose.",
        ),
        default(
            "gravity_ratio",
            Shape::Number(Range::between(0.0, 0.9)),
            "0",
            "Share that carries the arm itself.",
        ),
        default(
            "least_ratio",
            Shape::Number(Range::between(0.0, 1.0)),
            "0.05",
            "Smallest share with which the arm does not sink.",
        ),
        default(
            "reported",
            Shape::Choice(REPORTED),
            "by_motors",
            "Which force the library tells; settle it with a load cell.",
        ),
    ],
    exactly_one: &[],
};

const REPORTED: &[Word] = &[
    ("by_motors", "with which the motors push the tip"),
    ("by_sample", "with which the tip is pushed back"),
];

static AXIS: Shape = Shape::Choice(&[
    ("+x", "out of the base, towards the operator"),
    ("-x", "into the base"),
    ("+y", "to the operator's right"),
    ("-y", "to the operator's left"),
    ("+z", "up"),
    ("-z", "down"),
]);

pub(super) static CAMERAS: Table = Table {
    name: "rig_cameras",
    doc: "The two event cameras.",
    keys: &[
        required("camera1", Shape::Map(&CAMERA), "Camera 1."),
        required("camera2", Shape::Map(&CAMERA), "Camera 2."),
    ],
    exactly_one: &[],
};

static CAMERA: Table = Table {
    name: "rig_camera",
    doc: "One event camera. What is absent keeps the device's default; a protocol may override biases and region.",
    keys: &[
        default("model", Shape::Choice(MODELS), "evk1", "Which camera."),
        required(
            "serial",
            Shape::Text,
            "Its serial number, as `skinrig devices` shows it; for an EVK1 that does not tell it the port, as `usb-BUS-PORT.PORT`.",
        ),
        optional(
            "fpga",
            Shape::Text,
            "Expected FPGA version; another one fails the preflight.",
        ),
        optional(
            "biases",
            Shape::Named(&Shape::Whole {
                min: i32::MIN as i64,
                max: i32::MAX as i64,
            }),
            "Bias values by name, in the device's own unit (EVK1: mV). They win over those of `bias_file`.",
        ),
        optional(
            "bias_file",
            Shape::Text,
            "A `.bias` file, relative to this one; `${NAME}` stands for an environment variable.",
        ),
        optional(
            "roi",
            Shape::Map(ROI),
            "Pixels that stay on; all when absent.",
        ),
        optional(
            "noise_filter",
            Shape::Quantity(&[EventRate], Range::between(10_000.0, 10_000_000.0)),
            "The sensor's activity gate: nothing passes while its total rate is below this. Off when absent.",
        ),
        optional(
            "max_time_high_gap",
            Shape::Quantity(&[Time], Range::between(0.000_064, 10.0)),
            "EVK1: a longer step of the camera's time base counts as lost data, and spoils the press. Absent: steps are noted at the end, because how often a real camera sends its time base is not published.",
        ),
        default(
            "overflow_counter",
            Shape::Choice(OVERFLOWS),
            "loss",
            "EVK1: what a step of the camera's overflow counter is. What the counter of a real camera counts is not published; one that counts without a loss, which spoils presses for nothing, is set to `note`.",
        ),
        default(
            "read_back_exceptions",
            Shape::List {
                of: &Shape::Text,
                min: 0,
                max: 100,
            },
            "[]",
            "Addresses of registers, such as `\"0x0204\"`, that a real camera was seen to read back differently: which do is not published.",
        ),
        default(
            "read_status",
            Shape::List {
                of: &Shape::Text,
                min: 0,
                max: 100,
            },
            "[]",
            "EVK1: status bytes of register reads, such as `\"0x00\"`, with which the value counts as well as with 0x40. `--tolerant` tells which your camera sends.",
        ),
        default(
            "failed_reset",
            Shape::Choice(ACCEPTANCE),
            "refused",
            "EVK1: what a reset on the bus that fails before a run is.",
        ),
        default(
            "failed_transfers",
            Shape::Choice(TRANSFERS),
            "end",
            "EVK1: what a transfer of the event stream that fails is. A stall and a device that is gone end the stream in any case.",
        ),
        default(
            "sync",
            Shape::Choice(SYNC_MODES),
            "standalone",
            "Whose time base the camera follows.",
        ),
        default(
            "trigger_channel",
            count(0, 31),
            "0",
            "The trigger input that the box is wired to (EVK1: 0 main, 7 auxiliary, 6 loop-back of its own output).",
        ),
        default(
            "trigger_delay",
            Shape::Quantity(&[Time], Range::between(0.0, 0.001)),
            "0 us",
            "How long after an edge at its trigger input the camera stamps it, in whole microseconds: not published, to be measured on your bench. Analyses take it off the camera's edges; the session keeps them as they came.",
        ),
        required(
            "geometry",
            Shape::Map(NOMINAL_CAMERA),
            "Where the camera stands, as drawn or measured: where calibration starts.",
        ),
    ],
    exactly_one: &[],
};

const MODELS: &[Word] = &[
    ("evk1", "Prophesee EVK1, VGA, Gen3.1"),
    (
        "evk4",
        "Prophesee EVK4, in builds with `--features evk4`; recorded in full, analysed within 640 x 480 pixels",
    ),
    (
        "evk3_hd",
        "Prophesee EVK3 HD, as `evk4`; no trigger input, so only without a trigger box and standalone",
    ),
    (
        "silky_vga",
        "CenturyArks SilkyEvCam VGA, as `evk3_hd`; no biases either",
    ),
];

const ACCEPTANCE: &[Word] = &[
    ("refused", "a camera that is not opened"),
    ("accepted", "nothing to speak of"),
];

const TRANSFERS: &[Word] = &[
    ("end", "the end of the run"),
    (
        "loss",
        "lost data: a gap of the session, and the press is spoilt",
    ),
];

const OVERFLOWS: &[Word] = &[
    (
        "loss",
        "lost data: a gap of the session, and the press is spoilt",
    ),
    ("note", "a note at the end of the session"),
];

const SYNC_MODES: &[Word] = &[
    ("standalone", "its own"),
    ("master", "its own, and gives it to the other camera"),
    ("slave", "the other camera's"),
];

pub(super) static TRIGGER_BOX: Table = Table {
    name: "trigger_box",
    doc: "The trigger box.",
    keys: &[
        required(
            "port",
            Shape::Text,
            "Serial port, best one under `/dev/serial/by-id`; `${NAME}` stands for an environment variable. Ports are never guessed.",
        ),
        optional(
            "serial",
            Shape::Text,
            "The box's own serial number, as `skinrig devices --rig` shows it; absent: any.",
        ),
        optional(
            "firmware",
            Shape::Text,
            "Expected firmware version; absent: what this build of skinrig was written for.",
        ),
        default(
            "wiring",
            Shape::Map(&WIRING),
            "{}",
            "What each line of the box goes to.",
        ),
        default(
            "sync_period",
            Shape::Quantity(&[Time], Range::between(0.018, 65.0)),
            "100 ms",
            "From one coded sync train to the next, in whole milliseconds.",
        ),
        default(
            "max_drift_ppm",
            Shape::Number(Range::above_zero(20_000.0)),
            "5000",
            "How fast or slow the box's clock may be: an Arduino Uno has a ceramic resonator of 0.5 %, a board with a crystal 100.",
        ),
    ],
    exactly_one: &[],
};

static WIRING: Table = Table {
    name: "wiring",
    doc: "What each line of the box goes to. All outputs rise in the same cycle.",
    keys: &[
        default("output1", Shape::Choice(LINES), "camera1", "First output."),
        default("output2", Shape::Choice(LINES), "camera2", "Second output."),
        default("output3", Shape::Choice(LINES), "none", "Third output."),
        default(
            "input",
            Shape::Choice(INPUTS),
            "none",
            "The time-stamped input.",
        ),
    ],
    exactly_one: &[],
};

const LINES: &[Word] = &[
    ("camera1", "trigger input of camera 1"),
    ("camera2", "trigger input of camera 2"),
    ("other", "something else, an oscilloscope for example"),
    ("none", "nothing"),
];

const INPUTS: &[Word] = &[
    ("contact", "closes when the tip touches"),
    ("optical", "a light gate that the tip interrupts"),
    ("other", "something else"),
    ("none", "nothing; edges are not recorded"),
];
