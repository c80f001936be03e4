//! How often presses are taken again.

use serde::{Deserialize, Serialize};
use skinrig_model::{PressHistory, PressVerdict};

use crate::keys::{count, default};
use crate::shape::{Field, Key, Keys, Table};

/// How often a press that brought no data through no fault of the skin is taken again: at once, in place, as a new
/// attempt. Which causes are meant stands in `docs/reference/runs.md`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Retakes {
    /// Attempts beyond the first at one press.
    pub per_press: u32,
    /// Retakes between the start of a run, or its being resumed, and its end: a rig that loses data all the time is to be
    /// repaired, not to be worn out.
    pub per_session: u32,
}

impl Default for Retakes {
    fn default() -> Self {
        Self {
            per_press: 2,
            per_session: 20,
        }
    }
}

impl Retakes {
    /// No press is taken again: a recording has each one as often as it has it.
    pub const NONE: Self = Self {
        per_press: 0,
        per_session: 0,
    };

    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// Whether a resumed run takes a press with this history (again): when it is neither valid nor excluded, and either did not
    /// come to its end or has an attempt left. Attempts that the rig or the operator cost are given back; when the plan was done
    /// already, only presses whose last attempt was are taken again.
    #[must_use]
    pub fn wants(&self, history: &PressHistory) -> bool {
        match &history.verdict {
            None | Some(PressVerdict::Missed(_)) => true,
            Some(PressVerdict::Valid | PressVerdict::Excluded(_)) => false,
            Some(verdict @ PressVerdict::Invalid(_)) => {
                let is_open = history.given_back || !history.plan_done;
                verdict.is_cut_off() || (is_open && history.spent <= self.per_press)
            }
        }
    }
}

/// The keys of `retakes`.
pub(crate) static RETAKES: Table = Table {
    name: "retakes",
    doc: "How often a press is taken again, at once and in place, because its data were lost or it came too late.",
    keys: KEYS,
    exactly_one: &[],
};

const KEYS: &[Key] = &[
    default(
        "per_press",
        count(0, 100),
        "2",
        "Attempts beyond the first at one press; 0 for none.",
    ),
    default(
        "per_session",
        count(0, 100_000),
        "20",
        "Retakes of all presses together; a resumed run counts from 0 again.",
    ),
];

/// Reads a mapping of the table `retakes`.
pub(crate) fn retakes(f: &Field) -> Option<Retakes> {
    Some(Retakes {
        per_press: f.count("per_press")?,
        per_session: f.count("per_session")?,
    })
}
