//! When a run waits by itself until a disturbance is over.

use serde::{Deserialize, Serialize};
use skinrig_model::HostDuration;

use crate::build::seconds;
use crate::keys::{default, optional};
use crate::shape::{Field, Key, Keys, Range, Shape, Table, Word};
use skinrig_settings::Collector;
use skinrig_settings::Dimension::{Data, DataRate, EventRate, Temperature, Time};

/// What suspends a run, and for how long. Nothing when no condition is given.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Suspend {
    /// Event rate of either camera, events per second: a storm is above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub event_rate: Option<Threshold>,
    /// Event rate of either camera, events per second: a dark or covered scene is below.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dark: Option<Threshold>,
    /// Bytes per second that either camera loses: too many are above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lost_bytes: Option<Threshold>,
    /// Free bytes where the session is written: too few are below.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disk_free: Option<Threshold>,
    /// Temperature of either camera, °C: too hot is above. Off without a limit: what a camera may bear, its maker says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<Threshold>,
    /// What becomes of the press under way.
    pub press: UnderWay,
    /// So long must all be well again before the run goes on.
    pub resume_after: HostDuration,
    /// After so long the run ends.
    pub give_up_after: HostDuration,
}

/// Two levels: one that suspends, and another, on the calm side of it, from which on all is well again.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Threshold {
    /// Beyond this suspends.
    pub trip: f64,
    /// From this on all is well again; above `trip` when values below it suspend.
    pub resume: f64,
    /// So long must it be beyond `trip`.
    pub lasting: HostDuration,
}

impl Threshold {
    /// True for values that suspend. A value that is no number does not.
    #[must_use]
    pub fn is_beyond(&self, value: f64) -> bool {
        if self.trip > self.resume {
            value > self.trip
        } else {
            value < self.trip
        }
    }

    /// True for values at which all is well again. A value that is no number is not well.
    #[must_use]
    pub fn is_calm(&self, value: f64) -> bool {
        if self.trip > self.resume {
            value <= self.resume
        } else {
            value >= self.resume
        }
    }
}

/// What becomes of the press under way when the run is suspended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum UnderWay {
    /// It is finished.
    #[default]
    Finish,
    /// It is broken off; its data would be worth nothing.
    BreakOff,
}

impl Default for Suspend {
    fn default() -> Self {
        Self {
            event_rate: None,
            dark: None,
            lost_bytes: None,
            disk_free: None,
            temperature: None,
            press: UnderWay::Finish,
            resume_after: HostDuration::from_millis(5_000),
            give_up_after: HostDuration::from_millis(600_000),
        }
    }
}

impl Suspend {
    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// The keys of `suspend`.
pub(crate) static SUSPEND: Table = Table {
    name: "suspend",
    doc: "Conditions under which the run waits at clearance height until they are over.",
    keys: &[
        optional(
            "event_rate",
            Shape::Map(&STORM),
            "An event storm: the rate of either camera.",
        ),
        optional(
            "dark",
            Shape::Map(&DARK),
            "A dark or covered scene: the event rate of either camera.",
        ),
        optional(
            "lost_bytes",
            Shape::Map(&LOSS),
            "Bytes that either camera loses.",
        ),
        optional(
            "disk_free",
            Shape::Map(&DISK),
            "Free space where the session is written.",
        ),
        optional(
            "temperature",
            Shape::Map(&HEAT),
            "Temperature of either camera; one that cannot tell it is not watched.",
        ),
        default(
            "press",
            Shape::Choice(UNDER_WAY),
            "finish",
            "What becomes of the press under way.",
        ),
        default(
            "resume_after",
            Shape::Quantity(&[Time], Range::above_zero(3600.0)),
            "5 s",
            "So long must all be well again before the run goes on.",
        ),
        default(
            "give_up_after",
            Shape::Quantity(&[Time], Range::above_zero(86_400.0)),
            "10 min",
            "After so long in suspension the run ends.",
        ),
    ],
    exactly_one: &[],
};

const UNDER_WAY: &[Word] = &[
    ("finish", "it is finished, and counts by what was recorded"),
    ("break_off", "it is broken off and its outcome is invalid"),
];

const MOST: f64 = 1e15;
const LASTING: Shape = Shape::Quantity(&[Time], Range::from_zero(3600.0));
const LASTING_DOC: &str = "So long must it last.";
const RATE: Shape = Shape::Quantity(&[EventRate], Range::from_zero(MOST));
const LOST: Shape = Shape::Quantity(&[DataRate], Range::from_zero(MOST));
const ROOM: Shape = Shape::Quantity(&[Data], Range::from_zero(MOST));
const WARMTH: Shape = Shape::Quantity(&[Temperature], Range::between(-40.0, 150.0));

const fn needed(name: &'static str, shape: Shape, doc: &'static str) -> Key {
    crate::keys::required(name, shape, doc)
}

static STORM: Table = Table {
    name: "suspend_event_rate",
    doc: "Two event rates.",
    keys: &[
        needed("above", RATE, "Suspends."),
        needed("resume_below", RATE, "Well again; smaller."),
        default("for", LASTING, "1 s", LASTING_DOC),
    ],
    exactly_one: &[],
};

static DARK: Table = Table {
    name: "suspend_dark",
    doc: "Two event rates.",
    keys: &[
        needed("below", RATE, "Suspends."),
        needed("resume_above", RATE, "Well again; larger."),
        default("for", LASTING, "10 s", LASTING_DOC),
    ],
    exactly_one: &[],
};

static LOSS: Table = Table {
    name: "suspend_lost_bytes",
    doc: "Two rates of loss.",
    keys: &[
        needed("above", LOST, "Suspends."),
        needed("resume_below", LOST, "Well again; smaller."),
        default("for", LASTING, "1 s", LASTING_DOC),
    ],
    exactly_one: &[],
};

static DISK: Table = Table {
    name: "suspend_disk_free",
    doc: "Two amounts of free space.",
    keys: &[
        needed("below", ROOM, "Suspends."),
        needed("resume_above", ROOM, "Well again; larger."),
        default("for", LASTING, "0 s", LASTING_DOC),
    ],
    exactly_one: &[],
};

static HEAT: Table = Table {
    name: "suspend_temperature",
    doc: "Two temperatures.",
    keys: &[
        needed("above", WARMTH, "Suspends."),
        needed("resume_below", WARMTH, "Well again; smaller."),
        default("for", LASTING, "2 s", LASTING_DOC),
    ],
    exactly_one: &[],
};

/// Reads a mapping of the table `suspend`.
pub(crate) fn suspend(f: &Field, out: &mut Collector) -> Option<Suspend> {
    let mut one = |key: &str, trip: &str, resume: &str| -> Option<Option<Threshold>> {
        let Some(t) = f.get(key) else {
            return Some(None);
        };
        let threshold = Threshold {
            trip: t.quantity(trip)?,
            resume: t.quantity(resume)?,
            lasting: seconds(t.quantity("for")?),
        };
        let upward = trip == "above";
        if threshold.trip == threshold.resume || (threshold.trip > threshold.resume) != upward {
            let side = if upward { "smaller" } else { "larger" };
            out.error(
                t.span,
                format!("suspend.{key}"),
                "the two levels leave no room between them",
            )
            .expected(format!("`{resume}` {side} than `{trip}`"))
            .found(format!("{} and {}", threshold.resume, threshold.trip));
            return None;
        }
        Some(Some(threshold))
    };
    Some(Suspend {
        event_rate: one("event_rate", "above", "resume_below")?,
        dark: one("dark", "below", "resume_above")?,
        lost_bytes: one("lost_bytes", "above", "resume_below")?,
        disk_free: one("disk_free", "below", "resume_above")?,
        temperature: one("temperature", "above", "resume_below")?,
        press: match f.word("press")? {
            "break_off" => UnderWay::BreakOff,
            _ => UnderWay::Finish,
        },
        resume_after: seconds(f.quantity("resume_after")?),
        give_up_after: seconds(f.quantity("give_up_after")?),
    })
}
