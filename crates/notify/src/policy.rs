//! Limits of the tries.

use std::time::Duration;

use skinrig_model::HostDuration;
use skinrig_protocol::Notify;

/// Limits of the tries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Policy {
    /// Most tries per message and channel.
    pub tries: u32,
    /// Wait before the second try; doubled before each further one.
    pub backoff: Duration,
    /// How long [`finish`](crate::Notifier::finish) waits for results.
    pub grace: Duration,
}

impl Policy {
    /// The limits of the settings.
    #[must_use]
    pub fn of(settings: &Notify) -> Self {
        Self {
            tries: settings.tries,
            backoff: duration(settings.backoff),
            grace: duration(settings.grace),
        }
    }
}

pub(crate) fn duration(of: HostDuration) -> Duration {
    Duration::from_nanos(of.0.max(0).unsigned_abs())
}
