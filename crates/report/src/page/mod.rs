//! Owns the HTML page: inputs of its template and script.
//!
//! The template is `assets/page.html` with `assets/sections/*.html` (minijinja, auto-escaped) in the common frame
//! (`assets/frame/`); the script is `assets/script/*.js`. The script gets one JSON value with named column-wise tables:
//! press table, tooltips and CSV downloads all read it.

mod alignment;
mod areas;
mod assets;
mod calibration;
mod comparison;
pub(crate) mod findings;
mod latency;
mod locator;
mod reduction;

use std::collections::BTreeMap;

use minijinja::value::Serde;
use minijinja::{Value, context};
use serde::Serialize;
use skinrig_analysis::result::Analysis;

use assets::{SCRIPT, TEMPLATES};

use crate::derive;
use crate::error::ReportError;
use crate::figures;
use crate::format::{digits_of_error, grouped, interval, number, or_missing, phrase};
use crate::frame::{Frame, safe};
use crate::grid::Grid;
use crate::input::ReportInput;
use crate::provenance::Provenance;
use crate::svg::{FIGURE_CSS, plain_css};
use crate::tables;
use crate::terminal::{clock_method, metric_rows};

/// JSON that is safe inside `<script>`: escapes `<`, `>`, `&` and JavaScript's line separators, so no text can end the
/// element or open a comment.
///
/// # Errors
/// When `value` has no JSON form (a map with non-string keys).
pub(crate) fn script_json<T: Serialize>(value: &T) -> Result<String, serde_json::Error> {
    let mut value = serde_json::to_value(value)?;
    show_all(&mut value);
    let text = serde_json::to_string(&value)?;
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '<' => out.push_str("\\u003c"),
            '>' => out.push_str("\\u003e"),
            '&' => out.push_str("\\u0026"),
            '\u{2028}' => out.push_str("\\u2028"),
            '\u{2029}' => out.push_str("\\u2029"),
            c => out.push(c),
        }
    }
    Ok(out)
}

/// Escapes control characters in every text of `value`.
fn show_all(value: &mut serde_json::Value) {
    use serde_json::Value as Json;
    match value {
        Json::String(text) => {
            if let std::borrow::Cow::Owned(shown) = skinrig_model::text::visible(text) {
                *text = shown;
            }
        }
        Json::Array(items) => items.iter_mut().for_each(show_all),
        Json::Object(map) => map.values_mut().for_each(show_all),
        Json::Null | Json::Bool(_) | Json::Number(_) => {}
    }
}

/// See [`crate::html`].
pub(crate) fn render(input: &ReportInput<'_>) -> Result<String, ReportError> {
    let (a, p) = (input.analysis, &input.provenance);
    let fig: BTreeMap<String, Value> = figures::all(input)
        .into_iter()
        .map(|f| (f.id.clone(), Value::from(Serde(f))))
        .collect();
    let c = &a.counts;
    let usable = a.is_valid();
    let count = |key: &str, name: &str, n: u32| context! { key, name, n };
    let frame = Frame {
        templates: &TEMPLATES,
        styles: &[FIGURE_CSS],
        script: SCRIPT,
    };
    frame.render(context! {
        plain_css => safe(&plain_css()),
        data => safe(&script_json(&tables::script_data(input))?),
        session => or_missing(&p.session_id),
        heading => heading(&p.protocol_name),
        extent => extent(input),
        stand_in => p.stand_in(),
        rig_name => or_missing(&p.rig_name),
        variant => p.variant.as_ref().map(ToString::to_string),
        overrides => p.overrides.clone(),
        rig_kind => p.rig_kind.clone(),
        violations => a.invalid_because(),
        usable,
        started => or_missing(&p.started),
        prototype => or_missing(&p.prototype),
        run_end => or_missing(&p.run_end),
        run_end_reason => p.run_end_reason.clone(),
        run_end_s => p.interruptions.iter().find(|i| i.ended_run).map(|i| number(Some(i.t_s), 1)),
        metrics => metrics(input),
        rmse_all => context! {
            differs => usable && a.scored_without_exclusions != a.scored,
            value => number(a.scored_without_exclusions.rmse_mm.value, 2),
            interval => interval(&a.scored_without_exclusions.rmse_mm, 1.0, 2),
            n => a.scored_without_exclusions.rmse_mm.n,
        },
        penalised => penalised(a).filter(|_| usable),
        geometry_note => derive::geometry_note(a),
        locator_note => derive::locator_note(a),
        threshold_note => threshold_note(a),
        findings => findings::values(&a.findings),
        contents => contents(input),
        grids => grids(input),
        has_cells => a.coverage.as_ref().is_some_and(|c| c.cell_mm.is_some()),
        diagonal => a.scored.rmse_diagonal_percent.filter(|_| usable).map(|v| number(Some(v), 2)),
        counts => [
            count("valid", "valid", c.valid),
            count("missed", "missed", c.missed),
            count("invalid", "invalid", c.invalid),
            count("excluded", "excluded", c.excluded),
        ],
        planned => c.planned,
        sync => c.sync,
        add_up => c.add_up(),
        disagreement => derive::disagreement(a),
        empty => a.presses.is_empty(),
        warnings => [&a.alignment.warnings[..], &a.warnings].concat(),
        legs => p.several_legs().iter()
            .map(|leg| context! { number => leg.number, text => crate::course::leg(leg) })
            .collect::<Vec<_>>(),
        retaken => crate::course::retaken(p),
        retaken_for => crate::course::reasons(p),
        interruptions => p.interruptions.iter().filter(|i| !i.ended_run)
            .map(|i| context! { t => number(Some(i.t_s), 1), kind => i.kind.clone(), reason => i.reason.clone() })
            .collect::<Vec<_>>(),
        notes => p.notes.iter()
            .map(|n| context! { t => number(Some(n.t_s), 1), text => n.text.clone() })
            .collect::<Vec<_>>(),
        losses => p.lost_bytes.iter().enumerate().filter(|(_, b)| **b > 0)
            .map(|(i, b)| context! { camera => i + 1, bytes => grouped(*b), times => crate::course::losses(p, i) })
            .collect::<Vec<_>>(),
        off_sensor => derive::off_sensor(a),
        rejections => rejections(a, false),
        sync_rejections => rejections(a, true),
        depths => a.depths.iter().filter(|_| usable)
            .map(|d| context! {
                depth => d.depth_mm.to_string(), value => number(d.rmse_mm.value, 2),
                interval => interval(&d.rmse_mm, 1.0, 2), n => d.rmse_mm.n,
            })
            .collect::<Vec<_>>(),
        provenance => provenance_rows(p, a.version),
        devices => (!p.devices.is_empty()).then(|| Value::from(Serde(devices(p)))),
        preflight => (!p.preflight.is_empty()).then(|| Value::from(Serde(preflight(p)))),
        preflight_checks => p.preflight.len(),
        clocks => clocks(input),
        calibration => calibration(input),
        settings => tables::settings(a),
        tradeoff_unreadable => input.tradeoff.and_then(Result::err).map(ToString::to_string),
        fig,
        press_total => a.presses.len(),
    })
}

/// Tables of the sections by name; tables without data are absent.
fn grids(input: &ReportInput<'_>) -> BTreeMap<&'static str, Value> {
    let a = input.analysis;
    [
        ("alignment", alignment::maps(a)),
        ("trigger_lines", alignment::lines(a)),
        ("coverage", areas::coverage(a)),
        ("cmre", areas::cmre(a)),
        ("bit_rates", areas::bit_rates(a)),
        ("fit", calibration::fit(a)),
        ("models", calibration::models(a)),
        ("locators", locator::locators(a)),
        ("reliability", locator::reliability(a)),
        ("reduction", reduction::reduction(a)),
        ("latency", latency::latency(a)),
        ("from_contact", latency::from_contact(a)),
        ("msows", Some(comparison::msows(input))),
        ("skins", Some(comparison::skins(input))),
        ("sensors", Some(comparison::sensors(input))),
        ("reference", comparison::reference(a)),
        ("reference_reduction", comparison::reference_reduction(a)),
    ]
    .into_iter()
    // For an invalid session, only tables that explain why.
    .filter(|(name, _)| {
        a.is_valid() || ["alignment", "trigger_lines", "msows", "skins", "sensors"].contains(name)
    })
    .filter_map(|(name, grid)| Some((name, Value::from(Serde(grid?)))))
    .collect()
}

/// Sections in page order: anchor and name.
fn contents(input: &ReportInput<'_>) -> Vec<(&'static str, &'static str)> {
    let a = input.analysis;
    let single = !a.pictures.is_empty() || !a.zooms.is_empty();
    let rates = a.is_valid() && (a.bit_rates.is_some() || a.cmre.is_some());
    [
        ("results", "Results", true),
        ("provenance", "Provenance", true),
        ("skin", "Skin map", true),
        ("errors", "Errors", true),
        ("events", "Events", true),
        ("single", "Single presses", single),
        ("calibration", "Calibration", true),
        ("data-reduction", "Data reduction", true),
        ("detection", "Detection latency", true),
        ("rates", "Data rates, contact map", rates),
        ("comparison", "Comparison", true),
        ("session", "Session", true),
        ("presses", "Presses", true),
    ]
    .into_iter()
    .filter_map(|(anchor, name, there)| there.then_some((anchor, name)))
    .collect()
}

/// RMSE with failures counted, if there are any.
fn penalised(a: &Analysis) -> Option<Value> {
    let p = &a.penalised;
    (p.failures > 0 && p.rmse_mm.value.is_some()).then(|| {
        context! {
            value => number(p.rmse_mm.value, 2), interval => interval(&p.rmse_mm, 1.0, 2), n => p.rmse_mm.n,
            failures => p.failures, penalty => number(Some(p.penalty_mm), 1), beyond => p.beyond_penalty,
        }
    })
}

/// Origin of the minimum number of cluster events.
fn threshold_note(a: &Analysis) -> Option<String> {
    let t = a.threshold.as_ref()?;
    Some(format!(
        "A press needs {} cluster events in each camera. This threshold was chosen on the {} calibration presses alone \
         and rejects {} of them.",
        t.events, t.n, t.left_out
    ))
}

fn rejections(a: &Analysis, sync: bool) -> Vec<Value> {
    let rows = derive::rejections(a, sync).into_iter();
    rows.map(|r| context! { verdict => r.verdict.name(), rule => r.rule, example => r.example, n => r.n })
        .collect()
}

/// Name of the protocol without folder and suffix.
fn heading(protocol: &str) -> String {
    let file = protocol.rsplit(['/', '\\']).next().unwrap_or(protocol);
    let stem = file
        .strip_suffix(".yaml")
        .or_else(|| file.strip_suffix(".yml"))
        .unwrap_or(file);
    or_missing(stem.strip_suffix(".schedule").unwrap_or(stem)).to_owned()
}

fn extent(input: &ReportInput<'_>) -> String {
    let (repetitions, locations) = derive::extent(input.analysis);
    let count = |n: u32, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    format!(
        "{}, {}",
        count(repetitions, "repetition"),
        count(locations, "location")
    )
}

fn metrics(input: &ReportInput<'_>) -> Vec<Value> {
    metric_rows(input.analysis)
        .into_iter()
        .map(|r| {
            context! { key => r.key, name => r.name, value => r.value, unit => r.unit,
            interval => r.interval, n => r.n, what_n => r.what_n }
        })
        .collect()
}

fn provenance_rows(p: &Provenance, analysis_version: u32) -> Vec<Value> {
    let row = |key: &str, value: &str, code: bool| {
        // The first characters of a digest identify it; the full value is in the title and in print.
        let digest = value.len() == 64 && value.bytes().all(|b| b.is_ascii_hexdigit());
        let short = digest.then(|| &value[..12]);
        context! { key, value => or_missing(value), code, short }
    };
    let mut rows = vec![
        row("session", &p.session_id, true),
        row("started", &p.started, false),
        row("operator", &p.operator, false),
        row("prototype", &p.prototype, false),
        row("rig", &p.rig_name, false),
        row("rig kind", &p.rig_kind, false),
        row("host", &p.host, false),
        row("seed", &p.seed.to_string(), true),
        row("software", &p.software, false),
        row("analysis version", &analysis_version.to_string(), false),
        row("protocol", &p.protocol_name, false),
        row("protocol SHA-256", &p.protocol_sha256, true),
        row("plan SHA-256", &p.plan_sha256, true),
        row("results SHA-256", &p.results_hash, true),
        row("command line", &p.command_line, true),
    ];
    if !p.overrides.is_empty() {
        rows.push(row("overrides", &p.overrides.join("  "), true));
    }
    rows
}

fn devices(p: &Provenance) -> Grid {
    let columns = ["Role", "Model", "`Serial", "Firmware"];
    Grid::new("devices", "Devices", &columns).with(p.devices.iter().map(|d| {
        let (model, serial) = (d.model.clone(), d.serial.clone());
        [phrase(&d.role), model, serial, d.firmware.clone()]
    }))
}

fn preflight(p: &Provenance) -> Grid {
    let columns = ["Check", "Expected", "Found", "Verdict"];
    Grid::new("preflight", "Preflight", &columns).with(p.preflight.iter().map(|c| {
        let found = match &*c.next_step {
            "" => c.found.clone(),
            next => format!("{}; {next}", c.found),
        };
        let verdict = c.verdict.name().to_owned();
        [c.check.clone(), c.expected.clone(), found, verdict]
    }))
}

fn clocks(input: &ReportInput<'_>) -> Vec<Value> {
    let of = |(i, fit): (usize, &Option<skinrig_analysis::result::ClockFit>)| match fit {
        None => context! { camera => i + 1, found => false },
        Some(c) => context! {
            camera => i + 1,
            found => true,
            method => clock_method(c.method),
            offset => number(Some(c.offset_us), 1),
            drift => number(Some(c.drift_ppm), digits_of_error(c.drift_se_ppm)),
            drift_se => number(Some(c.drift_se_ppm), digits_of_error(c.drift_se_ppm)),
            rms => number(Some(c.residual_rms_us), 2),
            max => number(Some(c.residual_max_us), 2),
            n => c.n,
            rejected => c.rejected,
        },
    };
    input.analysis.clocks.iter().enumerate().map(of).collect()
}

fn calibration(input: &ReportInput<'_>) -> Option<Value> {
    let c = input.analysis.calibration.as_ref()?;
    let rows: Vec<Value> = tables::calibration(c)
        .into_iter()
        .map(|r| {
            context! { name => r.name, before => number(r.before, 4), after => number(r.after, 4),
            se => number(r.standard_error, 4), determined => r.standard_error.is_some(),
            interval => r.interval.map(|(low, high)| format!("[{}, {}]", number(Some(low), 4), number(Some(high), 4))) }
        })
        .collect();
    Some(context! {
        rows,
        rmse_before => number(Some(c.rmse_before_mm), 3),
        rmse_after => number(Some(c.rmse_after_mm), 3),
        n => c.n,
        termination => c.termination.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heading_is_the_name_of_the_protocol() {
        assert_eq!(heading("protocols/paper-meander.yaml"), "paper-meander");
        assert_eq!(heading("C:\\lab\\a.b.yml"), "a.b");
        assert_eq!(
            heading("single-repetition.schedule.yaml"),
            "single-repetition"
        );
        assert_eq!(heading("replay of demo"), "replay of demo");
        assert_eq!(heading(""), "not recorded");
    }

    #[test]
    fn script_json_cannot_end_its_element() {
        let text = script_json(&"</script><!--\u{2028}&").unwrap();
        assert_eq!(
            text,
            "\"\\u003c/script\\u003e\\u003c!--\\\\u{2028}\\u0026\""
        );
        let back: String = serde_json::from_str(&text).unwrap();
        assert_eq!(back, "</script><!--\\u{2028}&");
    }
}
