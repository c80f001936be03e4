//! Formats the analysis options of a tradeoff.

use std::fmt::Write as _;

use skinrig_analysis::tradeoff::{Choice, Region};
use skinrig_model::{CentroidRule, Estimator, Precision};

use crate::format::number;

/// Short label: estimator, then every option that differs from its default.
#[must_use]
pub fn label(choice: &Choice) -> String {
    let mut out = match (choice.estimator, choice.centroid) {
        (Estimator::Dbscan, CentroidRule::LargestCluster) => "dbscan",
        (Estimator::Dbscan, CentroidRule::AllClusters) => "dbscan all",
        (Estimator::ColumnMedian, _) => "median",
        (Estimator::HistogramPeak, _) => "peak",
        (Estimator::Streaming, _) => "streaming",
    }
    .to_owned();
    if choice.precision == Precision::F32 {
        out += " f32";
    }
    if let Some(ms) = choice.window_ms {
        let _ = write!(out, ", {ms} ms");
    }
    if choice.thinning > 1 {
        let _ = write!(out, ", 1/{}", choice.thinning);
    }
    if choice.bin_px > 1 {
        let _ = write!(out, ", bin {}", choice.bin_px);
    }
    match choice.region {
        Region::Full => {}
        Region::Half => out += ", half rows",
        Region::Quarter => out += ", quarter rows",
    }
    out
}

/// Three significant digits; no decimals from 100.
pub(crate) fn short(value: f64) -> String {
    let digits = if value >= 100.0 {
        0
    } else if value >= 10.0 {
        1
    } else {
        2
    };
    number(Some(value), digits)
}
