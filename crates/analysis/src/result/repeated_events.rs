//! Events of a camera that come once more, for warnings.

use serde::{Deserialize, Serialize};

/// Events that are those of an earlier time once more: pixel, polarity and the time between them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RepeatedEvents {
    /// Their share in all events of the crop, 0 to 1.
    pub share: f64,
    /// Camera time of the first, s.
    pub from_s: f64,
}
