//! The suites in a history.

use skinrig_nightly::Night;

/// A suite on one bench, with the number of its nights.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SuiteNights {
    /// Name of the bench.
    pub rig: String,
    /// `bench` or `emulated`.
    pub rig_kind: String,
    /// Name of the suite.
    pub suite: String,
    /// Number of nights.
    pub nights: usize,
    /// Start of the newest, RFC 3339, UTC.
    pub newest: String,
}

impl SuiteNights {
    /// Whether the night is one of this suite on this bench.
    #[must_use]
    pub fn has(&self, night: &Night) -> bool {
        (&self.rig, &self.rig_kind, &self.suite) == (&night.rig, &night.rig_kind, &night.suite)
    }
}
