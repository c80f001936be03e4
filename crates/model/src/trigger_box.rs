//! Reports of a trigger box on its own clock, which tie host, box and cameras together.

use serde::{Deserialize, Serialize};

use crate::pulse::Mark;
use crate::time::HostTime;

/// Time on the trigger box's own clock, µs since power-on or reset. Unwrapped: it never goes back
/// unless the box was reset, which [`BoxReport::Reset`] reports.
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
    /// The box read its clock between two host times: certainly `sent <= box time <= received`.
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
        /// The mark.
        mark: Mark,
        /// Time.
        at: BoxTime,
    },
    /// The start pulse of a periodic sync train rose.
    Sync {
        /// Running number, modulo 2^17.
        count: u32,
        /// Time.
        at: BoxTime,
    },
    /// An edge at the box's input (a contact switch or an optical gate).
    Input {
        /// True for a rising edge.
        rising: bool,
        /// Time.
        at: BoxTime,
    },
    /// The box lost its clock (power, watchdog, reset button): times before and after this cannot be compared.
    Reset {
        /// Host time of the detection.
        noticed: HostTime,
    },
}
