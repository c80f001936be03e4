//! Owns the JSON document of a report.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json as object};
use skinrig_analysis::result::{Analysis, Estimate, PressCounts};

use crate::comparison;
use crate::input::ReportInput;
use crate::provenance::{SelectionEffect, Variant};

/// Value of the document's `format` field.
pub(crate) const JSON_FORMAT: &str = "skinrig-report";
/// Version of the document's layout. Version 1 counted presses, repetitions and locations from 0; version 2 counts from 1;
/// version 3 has warnings and reasons as `kind`, fields and `text`; version 4 has depth and force in `indentation`.
pub const JSON_VERSION: u32 = 4;

/// Analysis fields that hold bulk data for figures.
const BULK: [&str; 5] = ["rates", "pictures", "zooms", "activity", "motion"];

/// Per-session summary for lists of many sessions. It is at the end of the document, so that readers need not parse all of
/// it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Unique ID of the session.
    pub session_id: String,
    /// Hash of the session's content, of its seal; `None` without a seal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub content_sha256: Option<String>,
    /// Version of the analysis.
    pub analysis_version: u32,
    /// Hash of the result.
    pub results_hash: String,
    /// Differences from the session's own settings; `None` for the official analysis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variant: Option<Variant>,
    /// What the selection of the variant changes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub selection: Option<SelectionEffect>,
    /// Settings overridden when the session was recorded, as `key=value`.
    #[serde(default)]
    pub overrides: Vec<String>,
    /// False if the numbers must not be used: the clocks are not known well enough, or the audit found that positions,
    /// cameras or rows are not what they claim to be.
    pub valid: bool,
    /// Likely faults found by the audit, most certain first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<String>,
    /// Outcomes of the presses.
    pub counts: PressCounts,
    /// RMSE of the scored presses.
    pub rmse_mm: Estimate,
    /// RMSE where no press calibrated, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_out_rmse_mm: Option<Estimate>,
    /// Std between repetitions.
    pub repeat_std_mm: Estimate,
    /// Share of scored presses that were located.
    pub located_rate: Estimate,
}

impl Summary {
    fn of(input: &ReportInput<'_>) -> Self {
        let (analysis, scored) = (input.analysis, &input.analysis.scored);
        Self {
            session_id: input.provenance.session_id.clone(),
            content_sha256: input.provenance.content_sha256.clone(),
            analysis_version: analysis.version,
            variant: input.provenance.variant.clone(),
            selection: input.provenance.selection.clone(),
            overrides: input.provenance.overrides.clone(),
            results_hash: input.provenance.results_hash.clone(),
            valid: analysis.is_valid(),
            faults: analysis
                .findings
                .iter()
                .map(crate::page::findings::fault)
                .collect(),
            counts: analysis.counts,
            rmse_mm: scored.rmse_mm,
            left_out_rmse_mm: analysis.left_out_rmse(),
            repeat_std_mm: scored.repeat_std_mm,
            located_rate: scored.located_rate,
        }
    }
}

/// Copy with empty bulk fields: each of their numbers as a JSON value would take most of the time of the document.
fn without_bulk(analysis: &Analysis) -> Analysis {
    let mut copy = analysis.clone();
    copy.rates = Default::default();
    copy.pictures.clear();
    copy.zooms.clear();
    copy.activity.clear();
    copy.motion = None;
    copy.alignment.residuals.clear();
    copy
}

/// See [`crate::json`].
pub(crate) fn json(input: &ReportInput<'_>) -> Value {
    // Both are plain data with string keys, so JSON can hold them (NaN becomes null).
    let mut analysis = serde_json::to_value(without_bulk(input.analysis)).unwrap_or(Value::Null);
    if let Some(map) = analysis.as_object_mut() {
        for field in BULK {
            map.remove(field);
        }
        if let Some(alignment) = map.get_mut("alignment").and_then(Value::as_object_mut) {
            alignment.remove("residuals");
        }
    }
    object!({
        "format": JSON_FORMAT,
        "format_version": JSON_VERSION,
        "analysis": analysis,
        "comparison": comparison::rows(input.analysis),
        "provenance": input.provenance,
        "summary": Summary::of(input),
        "valid": input.analysis.is_valid(),
    })
}
