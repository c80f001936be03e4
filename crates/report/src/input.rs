//! What a report is made from.

use skinrig_analysis::result::Analysis;
use skinrig_analysis::tradeoff::Tradeoff;

use crate::provenance::Provenance;

/// What a report is made from.
#[derive(Debug, Clone)]
pub struct ReportInput<'a> {
    /// The numbers.
    pub analysis: &'a Analysis,
    /// Where they come from.
    pub provenance: Provenance,
    /// What speed costs in accuracy, when that was measured on this session: the result, or why it cannot be read.
    pub tradeoff: Option<Result<&'a Tradeoff, &'a str>>,
}
