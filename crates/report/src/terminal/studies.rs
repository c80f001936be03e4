//! Owns the studies in the terminal table: a few lines each.

use std::fmt::Write as _;

use skinrig_analysis::result::{
    Analysis, Estimate, Latency, Reduction, ReductionRow, ReferenceCode, Thinning,
};
use skinrig_text::Column as Cells;

use crate::document::{Column, Note, Row, Section, Table};
use crate::format::{interval, number, rounded_to_interval};
use crate::page::indentation::line;

/// Factors with their own line; the page lists all.
const FACTORS: [u32; 4] = [1, 16, 256, 1024];

/// The calibration: error, model, reason, and how well it is determined.
pub(super) fn calibration(a: &Analysis) -> Option<Note> {
    let c = a.calibration.as_ref()?;
    let mut text = format!(
        "RMSE {} -> {} mm over {} calibration presses; model {}, {} of {} parameters determined, {} of {} starts agree",
        number(Some(c.rmse_before_mm), 2),
        number(Some(c.rmse_after_mm), 2),
        c.n,
        c.model.label(),
        c.rank,
        c.names.len(),
        c.starts_agreeing,
        c.starts,
    );
    if let Some(chosen) = c.compared.iter().find(|m| m.chosen) {
        let _ = write!(
            text,
            "; {} mm {} on held-out locations, {} models compared",
            number(chosen.rmse_mm.value, 2),
            interval(&chosen.rmse_mm, 1.0, 2),
            c.compared.len()
        );
    }
    Some(Note::new("fit", text))
}

/// All studies that were run.
pub(super) fn all(a: &Analysis) -> Section {
    let reduced = a.reduction.as_ref();
    Section::plain()
        .with_all(areas(a))
        .with_all(line(a).map(|text| Note::new("depth", text)))
        .with_all(rates(a))
        .with_all(a.latency.iter().flat_map(latency))
        .with_all(reduced.map(reduction))
        .with_all(reduced.map(reduction_note))
        .with_all(a.reference.iter().flat_map(reference))
}

fn with(e: &Estimate, scale: f64, digits: usize) -> String {
    let value = number(e.value.map(|v| v * scale), digits);
    format!("{value} {}", interval(e, scale, digits))
}

fn areas(a: &Analysis) -> Vec<Note> {
    let mut out = Vec::new();
    if let Some(t) = &a.threshold {
        let text = format!(
            "{} cluster events, chosen on {} calibration presses, rejects {} of them",
            t.events, t.n, t.left_out
        );
        out.push(Note::new("threshold", text));
    }
    if let Some(c) = &a.coverage {
        let text = format!(
            "skin {} mm², seen by both {} mm², probed {} mm² at {} locations",
            number(Some(c.skin_mm2), 0),
            number(Some(c.seen_by_both_mm2), 0),
            number(c.probed_mm2, 0),
            c.locations
        );
        out.push(Note::new("area", text));
        let taxels = |e| {
            let (e, digits) = rounded_to_interval(e);
            with(&e, 1.0, digits)
        };
        let text = format!(
            "{} in the probed area; {} if the RMSE holds over the whole skin",
            taxels(&c.taxels_probed),
            taxels(&c.taxels_skin)
        );
        out.push(Note::new("taxels", text));
    }
    if let Some(c) = &a.cmre {
        let text = format!(
            "{}; cells of {} mm, Gaussian of {} mm, n {}",
            crate::format::contact_map(&c.percent),
            c.settings.cell_mm,
            c.settings.sigma_mm,
            c.percent.n
        );
        out.push(Note::new("CMRE", text));
    }
    out
}

fn rates(a: &Analysis) -> Option<Note> {
    let r = a.bit_rates.as_ref()?;
    let text = format!(
        "press window {} kB/s, idle {} kB/s at {} bits per event, n {}",
        with(&r.press_bytes_per_s, 1e-3, 1),
        with(&r.idle_bytes_per_s, 1e-3, 1),
        r.bits_per_event,
        r.press_bytes_per_s.n
    );
    Some(Note::new("data", text))
}

fn latency(l: &Latency) -> Vec<Note> {
    let chosen = l.chosen.and_then(|i| l.sweep.get(i as usize));
    let text = format!(
        "{} % of {} trials detected at h {}; onsets 5-95 % within {} ms; {} false alarms/s",
        with(&l.detected_rate, 100.0, 1),
        l.trials,
        number(chosen.map(|r| r.threshold), 1),
        with(&l.width_ms, 1.0, 1),
        with(&l.false_alarms_per_s, 1.0, 2)
    );
    let mut out = vec![Note::new("detection", text)];
    if let Some(list) = crate::detector::false_detections(l) {
        let text = format!("fired before contact, and therefore not detected: {list}");
        out.push(Note::of(text));
    }
    out.push(match &l.from_contact {
        Some(c) => {
            let text = format!(
                "median {} ms after measured contact, ± {} ms each; 5 % {} ms, 95 % {} ms; {} before contact, {} missed",
                with(&c.median_ms, 1.0, 1),
                number(Some(c.uncertainty_ms), 2),
                number(c.p5_ms.value, 1),
                number(c.p95_ms.value, 1),
                c.before_contact,
                c.missed
            );
            Note::new("latency", text)
        }
        None => Note::new(
            "latency",
            "not from contact: contacts were not measured on an independent clock",
        ),
    });
    if let Some(r) = &l.reduced {
        let text = format!(
            "{} % detected, 5-95 % within {} ms, {} false alarms/s",
            with(&r.detected_rate, 100.0, 1),
            with(&r.width_ms, 1.0, 1),
            with(&r.false_alarms_per_s, 1.0, 2)
        );
        out.push(Note::of(format!("1/{} of the events: {text}", r.factor)));
    }
    out.extend(crate::detector::remarks(l).into_iter().map(Note::of));
    out
}

fn reduction(study: &Reduction) -> Table {
    let columns = [
        Column::of_terminals("reduction", Cells::left(9)),
        Column::of_terminals("1/k", Cells::right(6)),
        Column::of_terminals("RMSE (mm)", Cells::right(22)),
        Column::of_terminals("pass (%)", Cells::right(9)),
        Column::of_terminals(
            format!("within {} mm (%)", study.within_mm),
            Cells::right(17),
        ),
        Column::of_terminals("located (%)", Cells::right(12)),
    ];
    let rows = study.curves.iter().flat_map(|curve| {
        let kind = match curve.thinning {
            Thinning::Exact => "exact",
            Thinning::Bernoulli => "Bernoulli",
        };
        let shown = curve.rows.iter().filter(|r| FACTORS.contains(&r.factor));
        shown.map(move |row| reduction_row(kind, row))
    });
    Table::of("reduction", "Data reduction", columns).with(rows)
}

fn reduction_note(study: &Reduction) -> Note {
    Note::of(format!(
        "n {} presses, {} seeds; pass below {} mm, the 95th percentile at 1/1",
        study.presses,
        study.seeds,
        number(study.pass_threshold_mm, 2)
    ))
}

fn reduction_row(kind: &str, row: &ReductionRow) -> Row {
    let percent = |e: &Estimate| number(e.value.map(|v| 100.0 * v), 1);
    Row::new([
        kind.to_owned(),
        row.factor.to_string(),
        with(&row.rmse_mm, 1.0, 2),
        percent(&row.pass_rate),
        percent(&row.within_rate),
        percent(&row.located_rate),
    ])
}

fn reference(r: &ReferenceCode) -> Vec<Note> {
    let text = format!(
        "RMSE {} mm (x {}, y {}) in-sample, {} of {} presses inside the square: evaluated as in the public code, not \
         comparable with the numbers above",
        number(r.rmse_mm, 2),
        number(r.rmse_x_mm, 2),
        number(r.rmse_y_mm, 2),
        r.inside,
        r.presses
    );
    let mut out = vec![Note::new("reference", text)];
    if !r.calibrated {
        out.push(Note::of(
            "nominal camera geometry: these presses determine no plausible calibration with the public code's choices",
        ));
    }
    if !r.parameters.is_empty() {
        let each = r.parameters.iter();
        let each = each.map(|(name, value)| format!("{name} {}", number(Some(*value), 3)));
        let text = format!("parameters: {}", each.collect::<Vec<_>>().join(", "));
        out.push(Note::of(text));
    }
    let shown = r
        .reduction
        .iter()
        .filter(|row| FACTORS.contains(&row.factor));
    let rates = shown.map(|row| {
        let percent = |share: f64| number(Some(100.0 * share), 1);
        let (published, honest) = (percent(row.pass_rate), percent(row.honest_pass_rate));
        format!("1/{} {published} ({honest})", row.factor)
    });
    let rates = rates.collect::<Vec<_>>().join(", ");
    if !rates.is_empty() {
        let text = format!(
            "pass rate in % as in the public code (missing presses counted as failed): {rates}"
        );
        out.push(Note::of(text));
    }
    out
}
