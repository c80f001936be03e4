//! Reports of a trigger box on its own clock: the ties between host, box and cameras.

use serde::{Deserialize, Serialize};

use crate::pulse::Mark;
use crate::time::HostTime;

/// An instant on the trigger box's own clock, µs since it was switched on or reset. Unwrapped: it never goes back
/// unless the box was reset, which [`BoxReport::Reset`] tells.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct BoxTime {
    /// µs.
    pub us: u64,
}

/// A report of the trigger box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "what", rename_all = "snake_case")]
pub enum BoxReport {
    /// The box read its clock between two instants of the host: `sent <= box time <= received`, certainly.
    Exchange {
        /// Before the first byte of the request left the host.
        sent: HostTime,
        /// After the last byte of the answer reached the host.
        received: HostTime,
        /// Time of the box's clock.
        at: BoxTime,
    },
    /// The start pulse of a mark's train rose.
    Mark {
        /// Which mark.
        mark: Mark,
        /// When.
        at: BoxTime,
    },
    /// The start pulse of a periodic sync train rose.
    Sync {
        /// Running number, modulo 2^17.
        count: u32,
        /// When.
        at: BoxTime,
    },
    /// An edge at the box's input (a contact switch or an optical gate).
    Input {
        /// True for a rising edge.
        rising: bool,
        /// When.
        at: BoxTime,
    },
    /// The box lost its clock (power, watchdog, reset button): times before and after this do not compare.
    Reset {
        /// Host time at which the reset was noticed.
        noticed: HostTime,
    },
}
