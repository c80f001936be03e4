//! Owns the data tables of the studies, for download from figures and tables.

use serde_json::{Value, json};
use skinrig_analysis::result::{
    Analysis, Estimate, Latency, ModelTest, Reduction, ReductionCurve, ReductionRow,
    ReferenceReduction,
};

use super::table::{Table, rounded};
use crate::{comparison, derive};

/// All tables of the analysis, by name.
pub(super) fn all(a: &Analysis) -> Vec<(&'static str, Table)> {
    let latency = a.latency.as_ref();
    let calibration = a.calibration.as_ref();
    let tables = [
        ("reduction", a.reduction.as_ref().map(reduction)),
        ("latency_sweep", latency.map(sweep)),
        ("latency_course", latency.map(course)),
        ("latency_onsets", latency.map(onsets)),
        ("models", calibration.map(|c| models(&c.compared))),
        ("correlation", calibration.map(correlation)),
        ("residuals", calibration.map(|_| residuals(a))),
        ("threshold", a.threshold.as_ref().map(threshold)),
        ("coverage", a.coverage.as_ref().map(coverage)),
        ("cmre", a.cmre.as_ref().map(cmre)),
        ("bit_rates", a.bit_rates.as_ref().map(bit_rates)),
        ("comparison", Some(compared(a))),
        (
            "reference_reduction",
            a.reference.as_ref().map(|r| reference(&r.reduction)),
        ),
        ("activity", (!a.activity.is_empty()).then(|| activity(a))),
    ];
    let there = tables.into_iter();
    there.filter_map(|(name, t)| Some((name, t?))).collect()
}

/// One column per end of an estimate.
fn estimates<'a>(
    table: Table,
    names: [&'static str; 3],
    rows: impl Iterator<Item = &'a Estimate> + Clone,
    digits: i32,
) -> Table {
    let [value, low, high] = names;
    table
        .column(value, rows.clone().map(|e| rounded(e.value, digits)))
        .column(low, rows.clone().map(|e| rounded(e.low, digits)))
        .column(high, rows.map(|e| rounded(e.high, digits)))
}

/// Selects an estimate of a row.
type Part = fn(&ReductionRow) -> &Estimate;

fn reduction(study: &Reduction) -> Table {
    let rows: Vec<(&ReductionCurve, &ReductionRow)> = study
        .curves
        .iter()
        .flat_map(|c| c.rows.iter().map(move |r| (c, r)))
        .collect();
    let of = |f: fn(&ReductionRow) -> Option<f64>, digits| {
        rows.iter().map(move |(_, r)| rounded(f(r), digits))
    };
    let mut table = Table::new()
        .column("thinning", rows.iter().map(|(c, _)| json!(c.thinning)))
        .column("factor", rows.iter().map(|(_, r)| json!(r.factor)))
        .column("events_per_view", of(|r| Some(r.events_per_view), 3));
    let parts: [([&'static str; 3], Part); 6] = [
        (["rmse_mm", "rmse_low_mm", "rmse_high_mm"], |r| &r.rmse_mm),
        (["pass_rate", "pass_rate_low", "pass_rate_high"], |r| {
            &r.pass_rate
        }),
        (
            ["within_rate", "within_rate_low", "within_rate_high"],
            |r| &r.within_rate,
        ),
        (
            ["located_rate", "located_rate_low", "located_rate_high"],
            |r| &r.located_rate,
        ),
        (
            [
                "press_bytes_per_s",
                "press_bytes_per_s_low",
                "press_bytes_per_s_high",
            ],
            |r| &r.press_bytes_per_s,
        ),
        (
            [
                "idle_bytes_per_s",
                "idle_bytes_per_s_low",
                "idle_bytes_per_s_high",
            ],
            |r| &r.idle_bytes_per_s,
        ),
    ];
    for (names, part) in parts {
        table = estimates(table, names, rows.iter().map(|(_, r)| part(r)), 5);
    }
    table
        .column(
            "rmse_lowest_seed_mm",
            of(|r| r.rmse_of_seeds_mm.map(|s| s.0), 5),
        )
        .column(
            "rmse_highest_seed_mm",
            of(|r| r.rmse_of_seeds_mm.map(|s| s.1), 5),
        )
}

fn sweep(l: &Latency) -> Table {
    let rows = &l.sweep;
    Table::new()
        .column(
            "threshold",
            rows.iter().map(|r| rounded(Some(r.threshold), 4)),
        )
        .column("onsets", rows.iter().map(|r| json!(r.onsets)))
        .column(
            "detected_rate",
            rows.iter().map(|r| rounded(Some(r.detected_rate), 5)),
        )
        .column("median_ms", rows.iter().map(|r| rounded(r.median_ms, 3)))
        .column("width_ms", rows.iter().map(|r| rounded(r.width_ms, 3)))
        .column("false_alarms", rows.iter().map(|r| json!(r.false_alarms)))
        .column(
            "at_risk_s",
            rows.iter().map(|r| rounded(Some(r.at_risk_s), 4)),
        )
        .column(
            "false_alarms_per_s",
            rows.iter().map(|r| rounded(Some(r.false_alarms_per_s), 6)),
        )
        .column(
            "chosen",
            (0..rows.len()).map(|i| json!(u8::from(l.chosen.is_some_and(|c| c as usize == i)))),
        )
}

fn course(l: &Latency) -> Table {
    let c = &l.course;
    let bins = c.press_per_s.iter().map(Vec::len).min().unwrap_or(0);
    let of = |k: usize| {
        c.press_per_s[k]
            .iter()
            .take(bins)
            .map(|v| rounded(Some(f64::from(*v)), 0))
    };
    let background =
        |k: usize| std::iter::repeat_n(rounded(Some(f64::from(c.background_per_s[k])), 0), bins);
    Table::new()
        .column(
            "since_contact_ms",
            (0..bins).map(|i| rounded(Some(c.start_ms + c.bin_ms * i as f64), 3)),
        )
        .column("press_p5_per_s", of(0))
        .column("press_p50_per_s", of(1))
        .column("press_p95_per_s", of(2))
        .column("background_p5_per_s", background(0))
        .column("background_p50_per_s", background(1))
        .column("background_p95_per_s", background(2))
}

fn onsets(l: &Latency) -> Table {
    let onset = l.onsets.iter().map(|(_, t)| rounded(*t, 3));
    let early = l.onsets.iter().map(|(press, _)| {
        let tripped = l.false_detections.iter().find(|(p, _)| p == press);
        rounded(tripped.map(|(_, t)| *t), 3)
    });
    Table::new()
        .column("press", l.onsets.iter().map(|(p, _)| json!(p)))
        .column("onset_after_contact_ms", onset)
        .column("false_alarm_after_contact_ms", early)
}

fn models(rows: &[skinrig_analysis::result::ModelComparison]) -> Table {
    let test = |of: fn(&ModelTest) -> f64| {
        rows.iter()
            .map(move |m| rounded(m.test.as_ref().map(of), 5))
    };
    let table = Table::new()
        .column("model", rows.iter().map(|m| json!(m.model)))
        .column("parameters", rows.iter().map(|m| json!(m.parameters)));
    estimates(
        table,
        [
            "validated_rmse_mm",
            "validated_rmse_low_mm",
            "validated_rmse_high_mm",
        ],
        rows.iter().map(|m| &m.rmse_mm),
        5,
    )
    .column(
        "bounded_rmse_mm",
        rows.iter().map(|m| rounded(m.bounded_rmse_mm, 5)),
    )
    .column(
        "against",
        rows.iter().map(|m| json!(m.test.map(|t| t.against))),
    )
    .column("gain_mm", test(|t| t.gain_mm))
    .column("gain_standard_error_mm", test(|t| t.standard_error_mm))
    .column("gain_in_standard_errors", test(|t| t.ratio))
    .column("needed_standard_errors", test(|t| t.needed))
    .column(
        "fitted_rmse_mm",
        rows.iter().map(|m| rounded(m.fitted_rmse_mm, 5)),
    )
    .column("chosen", rows.iter().map(|m| json!(u8::from(m.chosen))))
}

fn correlation(c: &skinrig_analysis::result::CalibrationResult) -> Table {
    let pairs = || {
        let rows = c.names.iter().zip(&c.correlation);
        rows.flat_map(|(a, row)| c.names.iter().zip(row).map(move |(b, r)| (a, b, r)))
    };
    Table::new()
        .column("parameter", pairs().map(|(a, _, _)| json!(a)))
        .column("with", pairs().map(|(_, b, _)| json!(b)))
        .column("correlation", pairs().map(|(_, _, r)| rounded(*r, 4)))
}

fn residuals(a: &Analysis) -> Table {
    let rows = derive::residuals(a);
    let of = |f: fn(&derive::Residual) -> Option<f64>| rows.iter().map(move |r| rounded(f(r), 3));
    Table::new()
        .column("press", rows.iter().map(|r| json!(r.press)))
        .column("truth_x_mm", of(|r| Some(r.truth.x_mm)))
        .column("truth_y_mm", of(|r| Some(r.truth.y_mm)))
        .column("before_x_mm", of(|r| r.before.map(|p| p.x_mm)))
        .column("before_y_mm", of(|r| r.before.map(|p| p.y_mm)))
        .column("after_x_mm", of(|r| r.after.map(|p| p.x_mm)))
        .column("after_y_mm", of(|r| r.after.map(|p| p.y_mm)))
}

fn threshold(t: &skinrig_analysis::result::ThresholdChoice) -> Table {
    let rows = &t.candidates;
    Table::new()
        .column("events", rows.iter().map(|(e, _)| json!(e)))
        .column("cost_mm", rows.iter().map(|(_, c)| rounded(Some(*c), 4)))
        .column(
            "chosen",
            rows.iter().map(|(e, _)| json!(u8::from(*e == t.events))),
        )
}

/// One row per quantity, with value and interval.
fn quantities(rows: &[(&'static str, Estimate)]) -> Table {
    let table = Table::new().column("quantity", rows.iter().map(|(name, _)| json!(name)));
    estimates(
        table,
        ["value", "low", "high"],
        rows.iter().map(|(_, e)| e),
        5,
    )
    .column("n", rows.iter().map(|(_, e)| json!(e.n)))
}

const fn plain(value: Option<f64>, n: u32) -> Estimate {
    Estimate {
        value,
        low: None,
        high: None,
        n,
    }
}

fn coverage(c: &skinrig_analysis::result::Coverage) -> Table {
    let n = c.locations;
    quantities(&[
        ("skin_mm2", plain(Some(c.skin_mm2), 0)),
        ("seen_by_both_mm2", plain(Some(c.seen_by_both_mm2), 0)),
        ("probed_mm2", plain(c.probed_mm2, n)),
        ("cell_mm", plain(c.cell_mm, n)),
        ("taxels_probed", c.taxels_probed),
        ("taxels_skin", c.taxels_skin),
    ])
}

fn cmre(c: &skinrig_analysis::result::Cmre) -> Table {
    quantities(&[
        ("cmre_percent", c.percent),
        ("cell_mm", plain(Some(c.settings.cell_mm), 0)),
        ("sigma_mm", plain(Some(c.settings.sigma_mm), 0)),
        ("sr_mm", plain(Some(c.settings.sr_mm), 0)),
        ("without_score", plain(Some(f64::from(c.without_score)), 0)),
    ])
}

fn bit_rates(r: &skinrig_analysis::result::BitRates) -> Table {
    quantities(&[
        ("press_events_per_s", r.press_events_per_s),
        ("idle_events_per_s", r.idle_events_per_s),
        ("press_bytes_per_s", r.press_bytes_per_s),
        ("idle_bytes_per_s", r.idle_bytes_per_s),
        ("bits_per_event", plain(Some(r.bits_per_event), 0)),
        ("press_s", r.press_s),
    ])
}

fn compared(a: &Analysis) -> Table {
    let rows = comparison::rows(a);
    let cell = |c: &comparison::Cell| match c {
        comparison::Cell::Missing => Value::Null,
        comparison::Cell::Text(text) => json!(text),
        comparison::Cell::Value(e) => rounded(e.value, 5),
    };
    Table::new()
        .column("quantity", rows.iter().map(|r| json!(r.metric.name())))
        .column("session", rows.iter().map(|r| cell(&r.session)))
        .column("session_at_1024", rows.iter().map(|r| cell(&r.reduced)))
        .column("paper", rows.iter().map(|r| json!(r.paper)))
        .column("paper_at_1024", rows.iter().map(|r| json!(r.paper_reduced)))
        .column("msows", rows.iter().map(|r| json!(r.msows)))
        .column("footnotes", rows.iter().map(|r| json!(r.notes)))
}

fn reference(rows: &[ReferenceReduction]) -> Table {
    Table::new()
        .column("factor", rows.iter().map(|r| json!(r.factor)))
        .column("rmse_mm", rows.iter().map(|r| rounded(r.rmse_mm, 5)))
        .column(
            "pass_rate",
            rows.iter().map(|r| rounded(Some(r.pass_rate), 5)),
        )
        .column(
            "pass_rate_failures_failing",
            rows.iter().map(|r| rounded(Some(r.honest_pass_rate), 5)),
        )
}

/// Sums per sensor row over the columns of the crop. The figure itself holds the full image; tens of thousands of cells
/// would outweigh the page.
fn activity(a: &Analysis) -> Table {
    let rows = || {
        a.activity.iter().flat_map(|p| {
            let width = usize::from(p.width).max(1);
            p.counts
                .chunks(width)
                .enumerate()
                .map(move |(i, row)| (p, i, row.iter().sum::<u64>()))
        })
    };
    Table::new()
        .column("camera", rows().map(|(p, _, _)| json!(p.camera.number())))
        .column(
            "first_row_px",
            rows().map(|(p, i, _)| json!(i * usize::from(p.cell_px))),
        )
        .column("rows", rows().map(|(p, _, _)| json!(p.cell_px)))
        .column("events", rows().map(|(_, _, n)| json!(n)))
}
