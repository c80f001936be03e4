//! Conversion of durations to the bench's clock.

use std::time::Duration;

use skinrig_model::HostDuration;

/// Converts a duration; saturates.
pub(crate) fn span(duration: Duration) -> HostDuration {
    HostDuration(i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX))
}
