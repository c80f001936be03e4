//! What the history has nights of.

/// A bench and a suite of which the history has nights.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line {
    /// Name of the bench.
    pub rig: String,
    /// Name of the suite.
    pub suite: String,
    /// So many nights.
    pub nights: usize,
}
