//! Owns the data tables of the studies, for download from figures and tables.

use serde_json::Value;
use skinrig_analysis::result::{
    Activity, Analysis, BitRates, CalibrationResult, Cmre, Coverage, Estimate, Latency,
    LocatorResult, ModelComparison, QuantityAtDepth, Reduction, ReferenceReduction,
    ThresholdChoice,
};

use super::table::Table;
use crate::{comparison, derive};

/// All tables of the analysis, by name.
pub(super) fn all(a: &Analysis) -> Vec<(&'static str, Value)> {
    let latency = a.latency.as_ref();
    let depth = a.indentation.as_ref().and_then(|i| i.depth.as_ref());
    let calibration = a.calibration.as_ref();
    let reference = a.reference.as_ref();
    let activity = Some(&a.activity).filter(|all| !all.is_empty());
    let tables = [
        ("reduction", a.reduction.as_ref().map(reduction)),
        ("latency_sweep", latency.map(sweep)),
        ("latency_course", latency.map(course)),
        ("latency_onsets", latency.map(onsets)),
        ("models", calibration.map(|c| models(&c.compared))),
        ("locators", a.locator.as_ref().map(locators)),
        ("reliability", a.locator.as_ref().map(reliability)),
        ("indentation", depth.map(|q| indentation(&q.depths))),
        ("correlation", calibration.map(correlation)),
        ("residuals", calibration.map(|_| residuals(a))),
        ("threshold", a.threshold.as_ref().map(threshold)),
        ("coverage", a.coverage.as_ref().map(coverage)),
        ("cmre", a.cmre.as_ref().map(cmre)),
        ("bit_rates", a.bit_rates.as_ref().map(bit_rates)),
        ("comparison", Some(compared(a))),
        (
            "reference_reduction",
            reference.map(|r| reference_rows(&r.reduction)),
        ),
        ("activity", activity.map(|all| rows_of_events(all))),
    ];
    let there = tables.into_iter();
    there.filter_map(|(name, t)| Some((name, t?))).collect()
}

fn locators(l: &LocatorResult) -> Value {
    Table::of(&l.compared)
        .any("locator", |r| r.locator)
        .estimate(["rmse_mm", "rmse_low_mm", "rmse_high_mm"], 5, |r| {
            &r.rmse_mm
        })
        .number("bounded_rmse_mm", 5, |r| r.bounded_rmse_mm)
        .number("over_repetitions_mm", 5, |r| r.over_repetitions_mm)
        .any("against", |r| r.test.map(|t| t.against))
        .number("gain_mm", 5, |r| r.test.map(|t| t.gain_mm))
        .number("gain_standard_error_mm", 5, |r| {
            r.test.map(|t| t.standard_error_mm)
        })
        .number("gain_ratio", 4, |r| r.test.map(|t| t.ratio))
        .number("needed_ratio", 4, |r| r.test.map(|t| t.needed))
        .any("unfit", |r| r.unfit.map(|why| why.to_string()))
        .flag("chosen", |r| r.chosen)
        .finish()
}

fn indentation(rows: &[QuantityAtDepth]) -> Value {
    Table::of(rows)
        .number("depth_mm", 4, |r| r.depth_mm)
        .estimate(["rmse_mm", "rmse_low_mm", "rmse_high_mm"], 5, |r| {
            &r.scored.rmse
        })
        .number("bias_mm", 5, |r| r.scored.bias.value)
        .number("covered", 5, |r| r.scored.covered.value)
        .number("left_out_rmse_mm", 5, |r| r.left_out.rmse.value)
        .number("left_out_bias_mm", 5, |r| r.left_out.bias.value)
        .number("left_out_covered", 5, |r| r.left_out.covered.value)
        .finish()
}

fn reliability(l: &LocatorResult) -> Value {
    Table::of(&l.reliability)
        .number("stated", 4, |r| r.level)
        .estimate(["inside", "inside_low", "inside_high"], 5, |r| &r.inside)
        .finish()
}

fn reduction(study: &Reduction) -> Value {
    let curves = study.curves.iter();
    let rows = curves.flat_map(|c| c.rows.iter().map(move |r| (c.thinning, r)));
    Table::of(rows)
        .any("thinning", |(thinning, _)| *thinning)
        .any("factor", |(_, r)| r.factor)
        .number("events_per_view", 3, |(_, r)| r.events_per_view)
        .estimate(["rmse_mm", "rmse_low_mm", "rmse_high_mm"], 5, |(_, r)| {
            &r.rmse_mm
        })
        .estimate(
            ["pass_rate", "pass_rate_low", "pass_rate_high"],
            5,
            |(_, r)| &r.pass_rate,
        )
        .estimate(
            ["within_rate", "within_rate_low", "within_rate_high"],
            5,
            |(_, r)| &r.within_rate,
        )
        .estimate(
            ["located_rate", "located_rate_low", "located_rate_high"],
            5,
            |(_, r)| &r.located_rate,
        )
        .estimate(
            [
                "press_bytes_per_s",
                "press_bytes_per_s_low",
                "press_bytes_per_s_high",
            ],
            5,
            |(_, r)| &r.press_bytes_per_s,
        )
        .estimate(
            [
                "idle_bytes_per_s",
                "idle_bytes_per_s_low",
                "idle_bytes_per_s_high",
            ],
            5,
            |(_, r)| &r.idle_bytes_per_s,
        )
        .number("rmse_lowest_seed_mm", 5, |(_, r)| {
            r.rmse_of_seeds_mm.map(|s| s.0)
        })
        .number("rmse_highest_seed_mm", 5, |(_, r)| {
            r.rmse_of_seeds_mm.map(|s| s.1)
        })
        .finish()
}

fn sweep(l: &Latency) -> Value {
    Table::of(l.sweep.iter().enumerate())
        .number("threshold", 4, |(_, r)| r.threshold)
        .any("onsets", |(_, r)| r.onsets)
        .number("detected_rate", 5, |(_, r)| r.detected_rate)
        .number("median_ms", 3, |(_, r)| r.median_ms)
        .number("width_ms", 3, |(_, r)| r.width_ms)
        .any("false_alarms", |(_, r)| r.false_alarms)
        .number("at_risk_s", 4, |(_, r)| r.at_risk_s)
        .number("false_alarms_per_s", 6, |(_, r)| r.false_alarms_per_s)
        .flag("chosen", |(i, _)| {
            l.chosen.is_some_and(|c| c as usize == *i)
        })
        .finish()
}

fn course(l: &Latency) -> Value {
    let c = &l.course;
    let press = |k: usize| move |i: &usize| f64::from(c.press_per_s[k][*i]);
    let background = |k: usize| move |_: &usize| f64::from(c.background_per_s[k]);
    Table::of(0..c.press_per_s.iter().map(Vec::len).min().unwrap_or(0))
        .number("since_contact_ms", 3, |i| c.start_ms + c.bin_ms * *i as f64)
        .number("press_p5_per_s", 0, press(0))
        .number("press_p50_per_s", 0, press(1))
        .number("press_p95_per_s", 0, press(2))
        .number("background_p5_per_s", 0, background(0))
        .number("background_p50_per_s", 0, background(1))
        .number("background_p95_per_s", 0, background(2))
        .finish()
}

fn onsets(l: &Latency) -> Value {
    Table::of(&l.onsets)
        .any("press", |(press, _)| *press)
        .number("onset_after_contact_ms", 3, |(_, onset)| *onset)
        .number("false_alarm_after_contact_ms", 3, |(press, _)| {
            let early = l.false_detections.iter().find(|(p, _)| p == press);
            early.map(|(_, ms)| *ms)
        })
        .finish()
}

fn models(rows: &[ModelComparison]) -> Value {
    let validated = [
        "validated_rmse_mm",
        "validated_rmse_low_mm",
        "validated_rmse_high_mm",
    ];
    Table::of(rows)
        .any("model", |m| m.model)
        .any("parameters", |m| m.parameters)
        .estimate(validated, 5, |m| &m.rmse_mm)
        .number("bounded_rmse_mm", 5, |m| m.bounded_rmse_mm)
        .any("against", |m| m.test.map(|t| t.against))
        .number("gain_mm", 5, |m| m.test.map(|t| t.gain_mm))
        .number("gain_standard_error_mm", 5, |m| {
            m.test.map(|t| t.standard_error_mm)
        })
        .number("gain_in_standard_errors", 5, |m| m.test.map(|t| t.ratio))
        .number("needed_standard_errors", 5, |m| m.test.map(|t| t.needed))
        .number("fitted_rmse_mm", 5, |m| m.fitted_rmse_mm)
        .flag("chosen", |m| m.chosen)
        .finish()
}

fn correlation(c: &CalibrationResult) -> Value {
    let rows = c.names.iter().zip(&c.correlation);
    let pairs = rows.flat_map(|(a, row)| c.names.iter().zip(row).map(move |(b, r)| (a, b, *r)));
    Table::of(pairs)
        .any("parameter", |(a, ..)| *a)
        .any("with", |(_, b, _)| *b)
        .number("correlation", 4, |(.., r)| *r)
        .finish()
}

fn residuals(a: &Analysis) -> Value {
    Table::of(derive::residuals(a))
        .any("press", |r| r.press)
        .number("truth_x_mm", 3, |r| r.truth.x_mm)
        .number("truth_y_mm", 3, |r| r.truth.y_mm)
        .number("before_x_mm", 3, |r| r.before.map(|p| p.x_mm))
        .number("before_y_mm", 3, |r| r.before.map(|p| p.y_mm))
        .number("after_x_mm", 3, |r| r.after.map(|p| p.x_mm))
        .number("after_y_mm", 3, |r| r.after.map(|p| p.y_mm))
        .finish()
}

fn threshold(t: &ThresholdChoice) -> Value {
    Table::of(&t.candidates)
        .any("events", |(events, _)| *events)
        .number("cost_mm", 4, |(_, cost)| *cost)
        .flag("chosen", |(events, _)| *events == t.events)
        .finish()
}

/// One row per quantity, with value and interval.
fn quantities(rows: &[(&'static str, Estimate)]) -> Value {
    Table::of(rows)
        .any("quantity", |(name, _)| *name)
        .estimate(["value", "low", "high"], 5, |(_, e)| e)
        .any("n", |(_, e)| e.n)
        .finish()
}

fn plain(value: impl Into<Option<f64>>, n: u32) -> Estimate {
    Estimate {
        value: value.into(),
        low: None,
        high: None,
        n,
    }
}

fn coverage(c: &Coverage) -> Value {
    let n = c.locations;
    quantities(&[
        ("skin_mm2", plain(c.skin_mm2, 0)),
        ("seen_by_both_mm2", plain(c.seen_by_both_mm2, 0)),
        ("probed_mm2", plain(c.probed_mm2, n)),
        ("cell_mm", plain(c.cell_mm, n)),
        ("taxels_probed", c.taxels_probed),
        ("taxels_skin", c.taxels_skin),
    ])
}

fn cmre(c: &Cmre) -> Value {
    quantities(&[
        ("cmre_percent", c.percent),
        ("cell_mm", plain(c.settings.cell_mm, 0)),
        ("sigma_mm", plain(c.settings.sigma_mm, 0)),
        ("sr_mm", plain(c.settings.sr_mm, 0)),
        ("without_score", plain(f64::from(c.without_score), 0)),
    ])
}

fn bit_rates(r: &BitRates) -> Value {
    quantities(&[
        ("press_events_per_s", r.press_events_per_s),
        ("idle_events_per_s", r.idle_events_per_s),
        ("press_bytes_per_s", r.press_bytes_per_s),
        ("idle_bytes_per_s", r.idle_bytes_per_s),
        ("bits_per_event", plain(r.bits_per_event, 0)),
        ("press_s", r.press_s),
    ])
}

fn compared(a: &Analysis) -> Value {
    let cell = |c: &comparison::Cell| match c {
        comparison::Cell::Missing => Value::Null,
        comparison::Cell::Text(text) => (*text).into(),
        comparison::Cell::Value(e) => super::table::rounded(e.value, 5),
    };
    Table::of(comparison::rows(a))
        .any("quantity", |r| r.metric.name())
        .any("session", |r| cell(&r.session))
        .any("session_at_1024", |r| cell(&r.reduced))
        .any("paper", |r| r.paper)
        .any("paper_at_1024", |r| r.paper_reduced)
        .any("msows", |r| r.msows)
        .any("footnotes", |r| r.notes)
        .finish()
}

fn reference_rows(rows: &[ReferenceReduction]) -> Value {
    Table::of(rows)
        .any("factor", |r| r.factor)
        .number("rmse_mm", 5, |r| r.rmse_mm)
        .number("pass_rate", 5, |r| r.pass_rate)
        .number("pass_rate_failures_failing", 5, |r| r.honest_pass_rate)
        .finish()
}

/// Sums per sensor row over the columns of the crop. The figure itself holds the full image; tens of thousands of cells
/// would outweigh the page.
fn rows_of_events(pictures: &[Activity]) -> Value {
    let rows = pictures.iter().flat_map(|p| {
        let rows = p.counts.chunks(usize::from(p.width).max(1)).enumerate();
        rows.map(move |(i, row)| (p, i, row.iter().sum::<u64>()))
    });
    Table::of(rows)
        .any("camera", |(p, ..)| p.camera.number())
        .any("first_row_px", |(p, i, _)| i * usize::from(p.cell_px))
        .any("rows", |(p, ..)| p.cell_px)
        .any("events", |(.., n)| *n)
        .finish()
}
