//! Every key of a suite: the checks there are, what they need to know, what they measure and in which unit.

use super::Metric;
use super::limits::{COUNT, DATA, DRIFT, EVENTS, FORCE, LENGTH, RATE, SHARE, TIME, limit, metric};
use crate::keys::{count, default, optional, required};
use crate::shape::{Key, Range, Shape, Table};
use skinrig_settings::Dimension;

/// The version of the language of suites that this crate reads.
const VERSION: i64 = 1;

const DURATION: Shape = Shape::Quantity(&[Dimension::Time], Range::above_zero(3600.0));
const DISTANCE: Shape = Shape::Quantity(&[Dimension::Length], Range::above_zero(50.0));
const DEPTH_OF: Shape = Shape::Quantity(&[Dimension::Length], Range::above_zero(10.0));

const fn skip() -> Key {
    optional(
        "skip",
        Shape::Text,
        "Why the check is not made for now. It is SKIPPED with this reason, and its limits stay in the file.",
    )
}

/// The whole file.
pub(crate) static SUITE: Table = Table {
    name: "suite",
    doc: "A skinrig suite: what is checked on a bench, with limits that are stated before anything is measured.",
    keys: &[
        required(
            "skinrig_suite",
            count(VERSION, VERSION),
            "Version of the language of suites: 1.",
        ),
        required(
            "name",
            Shape::Text,
            "Name of the suite. It stands in every result.",
        ),
        optional(
            "description",
            Shape::Text,
            "Anything worth keeping about it.",
        ),
        required(
            "budget",
            Shape::Quantity(&[Dimension::Time], Range::above_zero(86_400.0)),
            "How long the whole suite may take, repeats included. A check that does not fit any more is not begun.",
        ),
        default(
            "repeats",
            Shape::Map(&REPEATS),
            "{}",
            "When a check is made again. Every attempt stays in the result.",
        ),
        required(
            "checks",
            Shape::Map(&CHECKS),
            "The checks, each with its limits.",
        ),
    ],
    exactly_one: &[],
};

static REPEATS: Table = Table {
    name: "repeats",
    doc: "When a check that did not pass is made again, and when that changes its verdict.",
    keys: &[
        default(
            "at_most",
            count(0, 10),
            "2",
            "How often a check that did not pass is made again; 0: never.",
        ),
        default(
            "must_pass",
            count(1, 10),
            "2",
            "So many attempts in a row must pass before a check counts as passed after a failure, and then as MARGINAL.",
        ),
    ],
    exactly_one: &[],
};

/// One check as the tables know it.
pub(super) struct Entry {
    pub name: &'static str,
    pub title: &'static str,
    pub metrics: &'static [Metric],
}

macro_rules! checks {
    ($($table:ident $metrics:ident $name:literal $title:literal $doc:literal
        { $($parameter:expr),* $(,)? } { $($metric:literal $unit:literal $limit:ident $what:literal),+ $(,)? })+) => {
        $(
            static $metrics: &[Metric] = &[$(metric($metric, $what, $unit)),+];
            static $table: Table = Table {
                name: concat!("check_", $name),
                doc: $doc,
                keys: &[
                    $($parameter,)*
                    $(limit(metric($metric, $what, $unit), &$limit),)+
                    skip(),
                ],
                exactly_one: &[],
            };
        )+
        /// The checks in the order in which they are made.
        pub(super) static CATALOGUE: &[Entry] = &[
            $(Entry { name: $name, title: $title, metrics: $metrics }),+
        ];
        static CHECKS: Table = Table {
            name: "checks",
            doc: "The checks of a suite. They are made in the order of this list, whatever the order in the file.",
            keys: &[$(optional($name, Shape::Map(&$table), $doc)),+],
            exactly_one: &[],
        };
    };
}

checks! {
    IDENTITY IDENTITY_METRICS "identity" "identity and firmware"
        "Model, serial number and firmware of every device, as the rig file expects them." {} {
        "differences" "" COUNT "Answers that differ from the rig file's, per device.",
    }
    SETTINGS SETTINGS_METRICS "settings" "settings read back"
        "Biases, region and inputs of the cameras, written as for a run and read back." {} {
        "differences" "" COUNT "Settings that read back with another value, per camera.",
    }
    DISK DISK_METRICS "disk" "disk"
        "A file is written where sessions go, synchronised, read back and removed." {
        default("amount", Shape::Quantity(&[Dimension::Data], Range::between(1e6, 1e11)), "200 MB", "How much is written."),
    } {
        "write_rate" "B/s" RATE "Bytes per second, the last synchronisation included.",
        "free" "B" DATA "Free space.",
    }
    TRIGGER_LOOPBACK TRIGGER_METRICS "trigger_loopback" "trigger loopback"
        "Coded trains from the trigger box, seen by both cameras." {
        default("trains", count(1, 10_000), "20", "How many trains are sent."),
    } {
        "lost_pulses" "" COUNT "Pulses sent and not seen, per camera.",
        "extra_pulses" "" COUNT "Edges seen that nobody sent, per camera.",
        "unread_trains" "" COUNT "Trains that do not read back under their own name, per camera.",
        "jitter" "s" TIME "Standard deviation of the edges' times about the trains' own, per camera.",
    }
    CLOCKS CLOCK_METRICS "clocks" "camera clocks"
        "The cameras' clocks against the trigger box's." {
        default("duration", DURATION, "10 s", "For how long."),
    } {
        "drift" "ppm" DRIFT "How much faster than the trigger box's, per camera.",
        "residual" "s" TIME "Root mean square of the trains' distances from a straight line, per camera.",
        "offset" "s" TIME "Time of camera 1 minus that of camera 2 at one and the same pulse: how far apart they started.",
    }
    IDLE IDLE_METRICS "idle" "stream at rest"
        "Data rate and loss with nothing moving." {
        default("duration", DURATION, "5 s", "For how long."),
    } {
        "data_rate" "B/s" RATE "Bytes per second, per camera.",
        "lost" "B" DATA "Bytes known to be lost, per camera.",
        "gaps" "" COUNT "Gaps in the stream, per camera.",
    }
    NOISE_DARK NOISE_DARK_METRICS "noise_dark" "noise in the dark"
        "Noise floor and hot pixels with the lamps off." {
        default("duration", DURATION, "5 s", "For how long."),
        default("hot_above", Shape::Quantity(&[Dimension::EventRate], Range::above_zero(1e7)), "100 ev/s", "A pixel above this rate is hot."),
    } {
        "rate" "ev/s" EVENTS "Events per second of the whole sensor, per camera.",
        "hot_pixels" "" COUNT "Pixels above `hot_above`, per camera.",
        "hottest" "ev/s" EVENTS "Rate of the hottest pixel, per camera.",
    }
    NOISE_LIT NOISE_LIT_METRICS "noise_lit" "noise in the light"
        "Noise floor and hot pixels with the lamps on." {
        default("duration", DURATION, "5 s", "For how long."),
        default("hot_above", Shape::Quantity(&[Dimension::EventRate], Range::above_zero(1e7)), "100 ev/s", "A pixel above this rate is hot."),
    } {
        "rate" "ev/s" EVENTS "Events per second of the whole sensor, per camera.",
        "hot_pixels" "" COUNT "Pixels above `hot_above`, per camera.",
        "hottest" "ev/s" EVENTS "Rate of the hottest pixel, per camera.",
    }
    TEST_PATTERN PATTERN_METRICS "test_pattern" "built-in test pattern"
        "Data rate and loss while the cameras make events by themselves." {
        default("duration", DURATION, "3 s", "For how long."),
        default("rate", Shape::Quantity(&[Dimension::EventRate], Range::above_zero(5e7)), "1 Mev/s", "What the pattern is set to."),
    } {
        "received" "%" SHARE "Events received, of those that the pattern makes, per camera.",
        "lost" "B" DATA "Bytes known to be lost, per camera.",
        "gaps" "" COUNT "Gaps in the stream, per camera.",
    }
    ROBOT_STATE ROBOT_STATE_METRICS "robot_state" "robot state"
        "Whether the robot is initialised, takes its limits, powers up and stays where it is." {} {
        "faults" "" COUNT "Faults of the robot: not initialised, limits that do not read back, motors that do not start.",
        "creep" "mm" LENGTH "How far the tip moves within a second of holding still.",
    }
    REPEATABILITY REPEATABILITY_METRICS "repeatability" "robot repeatability"
        "Five points in free air, approached again and again from different sides." {
        default("approaches", count(2, 100), "5", "Approaches of each point."),
        default("speed", Shape::Quantity(&[Dimension::Speed], Range::above_zero(100.0)), "40 mm/s", "How fast."),
    } {
        "spread" "mm" LENGTH "Standard deviation of the tip's place about each point's mean, all points together.",
        "error" "mm" LENGTH "Mean distance of the tip from where it was sent.",
    }
    STEP_RESPONSE STEP_METRICS "step_response" "robot step response"
        "Moves in free air." {
        default("distance", DISTANCE, "5 mm", "How far."),
        default("steps", count(1, 100), "5", "How often."),
    } {
        "settling" "s" TIME "Median time from the end of the commanded move until the tip stays within 0.1 mm.",
        "overshoot" "mm" LENGTH "Largest distance beyond the target.",
        "error" "mm" LENGTH "Largest distance from the target a second after the move.",
    }
    DEPTH DEPTH_METRICS "depth" "depth against touch-off"
        "Presses near the points of the touch-off: where the tip touches, and how deep it goes." {
        default("depth", DEPTH_OF, "1 mm", "How deep."),
        default("presses", count(1, 100), "3", "How often at each point."),
    } {
        "surface" "mm" LENGTH "Largest height of a touch above or below the frame's surface.",
        "error" "mm" LENGTH "Root mean square of measured minus commanded depth.",
    }
    FORCE_CEILING FORCE_METRICS "force_ceiling" "commanded-force ceiling"
        "The tip is sent into the skin deeper than the limit of its force allows." {
        default("force", Shape::Quantity(&[Dimension::Force], Range::above_zero(12.0)), "1 N", "The limit that is set."),
        default("depth", DEPTH_OF, "2 mm", "How deep the tip is sent."),
    } {
        "peak" "N" FORCE "Largest force that the robot tells.",
        "trips" "" COUNT "Times that the limit took the power off, per press: 0 when the force is only bounded.",
    }
    GOLDEN GOLDEN_METRICS "golden" "golden skin"
        "A short campaign on the skin that stays on the bench, with the same presses at its start and end." {
        required("protocol", Shape::Text, "Its protocol, relative to this file."),
    } {
        "rmse" "mm" LENGTH "RMSE of the localisation.",
        "repeat_std" "mm" LENGTH "Mean standard deviation between repetitions of a place.",
        "latency" "s" TIME "Median time from contact to detection.",
        "press_events" "ev/s" EVENTS "Events per second during presses, both cameras together.",
        "idle_events" "ev/s" EVENTS "Events per second between presses, both cameras together.",
        "located" "%" SHARE "Presses that were located, of those planned.",
        "valid" "%" SHARE "Presses that were recorded without a fault, of those planned.",
        "reference_shift" "mm" LENGTH "How far the estimates of the reference presses moved from the start to the end.",
        "reference_events" "%" SHARE "Events of the reference presses at the end, of those at the start.",
        "lost" "B" DATA "Bytes known to be lost, both cameras together.",
    }
    WATCHDOG_DRILL WATCHDOG_METRICS "watchdog_drill" "watchdog drill"
        "The program that holds the arm in free air is killed; the arm must brake by itself." {} {
        "braked_within" "s" TIME "From the kill until the motors are known to be off.",
        "drop" "mm" LENGTH "How far the tip moved until it was looked at again.",
    }
    STOP_DRILL STOP_METRICS "stop_drill" "emergency stop drill"
        "The arm is stopped in the middle of a move in free air." {} {
        "stopped_within" "s" TIME "From the order until the tip rests.",
        "distance" "mm" LENGTH "How far it moved meanwhile.",
    }
}
