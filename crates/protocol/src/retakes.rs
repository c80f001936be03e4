//! Conditions for retaking a press.

use serde::{Deserialize, Serialize};
use skinrig_model::{PressHistory, PressVerdict};
use skinrig_settings::Settings;

/// Immediate retakes of presses whose data were lost or that were too late.
/// `docs/reference/runs.md` lists the causes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Settings)]
pub struct Retakes {
    /// Attempts beyond the first at one press; 0 for none.
    #[setting(default = "2", max = 100)]
    pub per_press: u32,
    /// Retakes of all presses together; a resumed run counts from 0 again. A rig that keeps losing data needs repair.
    #[setting(default = "20", max = 100_000)]
    pub per_session: u32,
}

impl Retakes {
    /// No retakes.
    pub const NONE: Self = Self {
        per_press: 0,
        per_session: 0,
    };

    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// Whether a resumed run takes a press with this history (again): if it is neither valid nor excluded, and either was cut off
    /// or has an attempt left. Attempts lost to the rig or the operator do not count. If the plan was completed
    /// before, only presses whose last attempt was lost in this way are taken again.
    #[must_use]
    pub fn should_retake(&self, history: &PressHistory) -> bool {
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
