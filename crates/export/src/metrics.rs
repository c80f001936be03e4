//! The table of results: one row per metric, with its interval.

use skinrig_analysis::result::{Analysis, Estimate, Metrics};

use crate::error::ExportError;
use crate::source::{Source, TableName};
use crate::table::{Table, Values};

/// A metric of a set of presses.
#[derive(Debug, Clone, Copy)]
pub struct MetricRow {
    /// Set of presses, for example `scored`.
    pub set: &'static str,
    /// For example `rmse`.
    pub metric: &'static str,
    /// `mm`, or `1` for a share.
    pub unit: &'static str,
    /// Of the presses at one depth; `None`: at all.
    pub depth_mm: Option<f64>,
    /// Value with its interval.
    pub estimate: Estimate,
}

/// Builds the table of a session; no rows without an analysis.
pub(crate) fn table(source: &Source<'_>) -> Result<Table, ExportError> {
    let rows = source
        .analysis
        .map_or_else(Vec::new, |(analysis, _)| metric_rows(analysis));
    let is_valid = source.analysis.is_some_and(|(a, _)| a.is_valid());
    let session_id = source.reader.session_id()?;
    let text = |of: &dyn Fn(&MetricRow) -> String| {
        Values::Text(rows.iter().map(|r| Some(of(r))).collect())
    };
    let real = |of: &dyn Fn(&MetricRow) -> Option<f64>| {
        Values::Real(rows.iter().map(|r| of(r).unwrap_or(f64::NAN)).collect())
    };
    let columns = [
        ("session_id", text(&|_| session_id.clone())),
        ("prototype", text(&|_| source.header.prototype.clone())),
        ("set", text(&|r| r.set.to_owned())),
        ("metric", text(&|r| r.metric.to_owned())),
        ("unit", text(&|r| r.unit.to_owned())),
        ("depth_mm", real(&|r| r.depth_mm)),
        ("value", real(&|r| r.estimate.value)),
        ("low", real(&|r| r.estimate.low)),
        ("high", real(&|r| r.estimate.high)),
        (
            "n",
            Values::Int(rows.iter().map(|r| i64::from(r.estimate.n)).collect()),
        ),
        // False: INVALID, the numbers must not be used.
        ("valid", Values::Flag(vec![is_valid; rows.len()])),
    ];
    Ok(Table {
        name: TableName::Results.name(),
        columns: columns
            .map(|(name, values)| (name.to_owned(), values))
            .into(),
    })
}

/// The metrics of an analysis, as the table of results has them.
#[must_use]
pub fn metric_rows(analysis: &Analysis) -> Vec<MetricRow> {
    let mut rows = of_set("scored", &analysis.scored);
    rows.extend(analysis.depths.iter().map(|depth| MetricRow {
        set: "scored",
        metric: "rmse",
        unit: "mm",
        depth_mm: Some(depth.depth_mm),
        estimate: depth.rmse_mm,
    }));
    rows.extend(of_set(
        "scored_without_exclusions",
        &analysis.scored_without_exclusions,
    ));
    rows.push(MetricRow {
        set: "penalised",
        metric: "rmse",
        unit: "mm",
        depth_mm: None,
        estimate: analysis.penalised.rmse_mm,
    });
    rows
}

fn of_set(set: &'static str, m: &Metrics) -> Vec<MetricRow> {
    let all = [
        ("rmse", "mm", m.rmse_mm),
        ("rmse_x", "mm", m.rmse_x_mm),
        ("rmse_y", "mm", m.rmse_y_mm),
        ("bias_x", "mm", m.bias_x_mm),
        ("bias_y", "mm", m.bias_y_mm),
        ("median", "mm", m.median_mm),
        ("p95", "mm", m.p95_mm),
        ("repeat_std", "mm", m.repeat_std_mm),
        ("located_rate", "1", m.located_rate),
        ("within_rate", "1", m.within_rate),
    ];
    all.into_iter()
        .map(|(metric, unit, estimate)| MetricRow {
            set,
            metric,
            unit,
            depth_mm: None,
            estimate,
        })
        .collect()
}
