//! The suites in a history.

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
