//! A camera that changes in the course of a session, for warnings.

use std::fmt::{Display, Formatter, Result};

use serde::{Deserialize, Serialize};
use skinrig_model::PressId;

/// What changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Changed {
    /// Events of a press beyond the idle rate.
    Events,
    /// Share of ON events, 0 to 1.
    OnShare,
    /// Time from the contact to the middle event of the press, ms.
    DelayMs,
}

impl Changed {
    /// The quantity of a value as it is compared: events by their logarithm.
    pub(crate) fn of(self, compared: f64) -> f64 {
        match self {
            Self::Events => libm::exp(compared),
            Self::OnShare | Self::DelayMs => compared,
        }
    }
}

/// What a camera gives at the same places, before a press and from it on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CameraChange {
    /// What changed.
    pub what: Changed,
    /// Press from which on.
    pub from: PressId,
    /// Median over the places of their mean before,
    pub before: f64,
    /// and after.
    pub after: f64,
    /// Places pressed before and after.
    pub places: usize,
}

impl Display for CameraChange {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let Self {
            what,
            from,
            before,
            after,
            places,
        } = *self;
        match what {
            Changed::Events => write!(f, "a press gives {after:.0} events instead of {before:.0}")?,
            Changed::OnShare => write!(
                f,
                "{:.0} % of the events of a press are ON instead of {:.0} %",
                100.0 * after,
                100.0 * before
            )?,
            Changed::DelayMs => write!(
                f,
                "the middle event of a press comes {after:.0} instead of {before:.0} ms after the contact"
            )?,
        }
        write!(
            f,
            " from about {from} on (median of {places} places): find out what changed there, such as light, lens, bias, clock or skin, and \
             record these presses again"
        )
    }
}
