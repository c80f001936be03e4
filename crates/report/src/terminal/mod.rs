//! Owns the terminal table of results: findings, headline, presses, clocks; the studies are in [`studies`].

pub(crate) mod digits;
mod studies;
mod summary;

use skinrig_analysis::result::{
    Alignment, AlignmentStatus, Analysis, ClockFit, ClockMethod, Estimate, MapName, Metrics,
    PressCounts,
};
use skinrig_model::StopMetric;
use skinrig_text::{Column as Cells, Paint, Style, WIDTH, clip};

pub(crate) use self::summary::summary;
use crate::document::{Column, Note, Row, Section, Table, terminal};
use crate::format::plain;
use crate::format::{digits_of_error, grouped, interval, number, or_missing};
use crate::input::ReportInput;
use crate::page::findings::{fault, law};
use crate::{course, derive, selection};

/// A formatted metric.
pub(crate) struct MetricRow {
    pub(crate) key: &'static str,
    pub(crate) name: String,
    pub(crate) value: String,
    pub(crate) unit: &'static str,
    pub(crate) interval: String,
    pub(crate) n: u32,
    pub(crate) what_n: &'static str,
}

/// Metrics in display order.
pub(crate) fn metric_rows(a: &Analysis) -> Vec<MetricRow> {
    let m = &a.scored;
    let rows = vec_of_metrics(a, m);
    if a.is_valid() {
        return rows;
    }
    // Numbers of an invalid session are not to be read: their places say so.
    rows.into_iter()
        .map(|row| MetricRow {
            value: "INVALID".to_owned(),
            unit: "",
            interval: String::new(),
            ..row
        })
        .collect()
}

fn vec_of_metrics(a: &Analysis, m: &Metrics) -> Vec<MetricRow> {
    let mm = |key, name: &str, e: &Estimate, what_n| MetricRow {
        key,
        name: name.to_owned(),
        value: number(e.value, 2),
        unit: "mm",
        interval: interval(e, 1.0, 2),
        n: e.n,
        what_n,
    };
    let share = |key, name, e: &Estimate| MetricRow {
        key,
        name,
        value: number(e.value.map(|v| 100.0 * v), 1),
        unit: "%",
        interval: interval(e, 100.0, 1),
        n: e.n,
        what_n: "attempted",
    };
    vec![
        mm("rmse", "RMSE", &m.rmse_mm, "presses"),
        mm("rmse-x", "RMSE along x", &m.rmse_x_mm, "presses"),
        mm("rmse-y", "RMSE along y", &m.rmse_y_mm, "presses"),
        mm("bias-x", "bias along x", &m.bias_x_mm, "presses"),
        mm("bias-y", "bias along y", &m.bias_y_mm, "presses"),
        mm("median", "median error", &m.median_mm, "presses"),
        mm("p95", "95th percentile", &m.p95_mm, "presses"),
        mm(
            "repeat-std",
            "std between repetitions",
            &m.repeat_std_mm,
            if a.depths.is_empty() {
                "locations"
            } else {
                "location-depths"
            },
        ),
        share("located", "located rate".to_owned(), &m.located_rate),
        share(
            "within",
            format!("within {} mm", a.settings.within_mm),
            &m.within_rate,
        ),
    ]
}

/// One line about a clock fit, without the camera's name.
pub(crate) fn clock_method(method: ClockMethod) -> &'static str {
    match method {
        ClockMethod::TimeBase => "the trigger box's time base",
        ClockMethod::TriggerMarks => "trigger marks",
        ClockMethod::EventRates => "event rates",
    }
}

/// See [`crate::terminal_table`].
pub(crate) fn table(input: &ReportInput<'_>, color: bool) -> String {
    let a = input.analysis;
    let studies = if a.is_valid() {
        studies::all(a)
    } else {
        Section::plain().with(Note::new("studies", "withheld: the session is INVALID"))
    };
    let sections = [
        head(input),
        problems(a),
        scored(input),
        presses(a).with_all(clocks(a)).with_all(events(input)),
        studies,
    ];
    terminal(&sections, Paint::new(color))
}

fn head(input: &ReportInput<'_>) -> Section {
    let p = &input.provenance;
    let variant = p.variant.as_ref();
    let variant = variant.map(|v| Note::new("VARIANT", v.to_string()).warning());
    let changes = (!p.overrides.is_empty()).then(|| p.overrides.join(" --set "));
    let changes = changes.map(|changes| Note::new("recorded", format!("with --set {changes}")));
    let rig = or_missing(&p.rig_name);
    let rig = match p.stand_in() {
        None => Note::new("rig", rig),
        Some(word) => {
            let word = word.to_uppercase();
            Note::new("rig", format!("{rig} - {word}, not measured on hardware")).warning()
        }
    };
    let protocol = format!("{}, seed {}", or_missing(&p.protocol_name), p.seed);
    let end = match &p.run_end_reason {
        Some(why) => format!("{}: {why}", or_missing(&p.run_end)),
        None => or_missing(&p.run_end).to_owned(),
    };
    let selected = selection::headline(input);
    Section::plain()
        .with_all(selected.map(|text| Note::new("SELECTION", text).warning()))
        .with(Note::new("session", or_missing(&p.session_id)))
        .with_all(variant)
        .with_all(changes)
        .with(rig)
        .with(Note::new("protocol", protocol))
        .with(Note::new("run", end))
}

/// Must be read before any number: violations, findings of the audit, warnings.
fn problems(a: &Analysis) -> Section {
    let violations = match a.alignment.is_usable() {
        true => &[][..],
        false => &a.alignment.violations[..],
    };
    let violations = violations
        .iter()
        .map(|v| Note::new("INVALID", v.to_string()));
    let findings = a.findings.iter().flat_map(|f| {
        let (fault, law, evidence) = (fault(f), law(f), &f.evidence);
        let note = match f.invalidates {
            true => Note::new("INVALID", format!("{fault}: {evidence}. Violated: {law}.")),
            false => Note::new("fault", format!("{fault}. Violated: {law}. {evidence}")),
        };
        [note, Note::of(format!("do: {}", f.advice))]
    });
    let nothing = a.nothing_counts().map(ToString::to_string);
    let nothing = nothing.map(|why| Note::new("INVALID", why));
    let warnings = a.remarks().map(ToString::to_string);
    let warnings = derive::disagreement(a).into_iter().chain(warnings);
    let warnings = warnings.map(|text| Note::new("warning", text));
    let notes = violations.chain(findings).chain(nothing).chain(warnings);
    Section::plain().with_all(notes.map(Note::warning))
}

/// The metrics, and the RMSE counted in other ways.
fn scored(input: &ReportInput<'_>) -> Section {
    let a = input.analysis;
    let columns = [
        Column::of_terminals("scored presses", Cells::left(24)),
        Column::of_terminals("value", Cells::right(7)),
        Column::of_terminals("", Cells::left(3)),
        Column::of_terminals("95 % interval", Cells::centre(20)),
        Column::of_terminals("n", Cells::right(6)),
        Column::of_terminals("", Cells::left(0)),
    ];
    let row = |name: String, value: String, unit: &str, interval: String, n: u32, what: &str| {
        Row::new([
            name,
            value,
            unit.to_owned(),
            interval,
            n.to_string(),
            what.to_owned(),
        ])
    };
    let mut table = Table::of("scored", "Scored presses", columns);
    // The metric that a campaign asks about has the level of its look.
    let level = |metric| {
        let level = derive::level_at_look(a, metric);
        level.map_or_else(String::new, |level| format!(" {level} %"))
    };
    for r in metric_rows(a) {
        let is_rmse = r.key == "rmse";
        let style = is_rmse.then_some(Style::Bold);
        let interval = match r.key {
            "rmse" => r.interval + &level(StopMetric::Rmse),
            "median" => r.interval + &level(StopMetric::Median),
            _ => r.interval,
        };
        let row = row(r.name, r.value, r.unit, interval, r.n, r.what_n);
        table.add(row.style(style));
    }
    if !a.is_valid() {
        return Section::plain().with(table);
    }
    let rmse = &a.scored.rmse_mm;
    if let Some(share) = a.scored.rmse_diagonal_percent {
        let interval =
            interval(rmse, 100.0 / a.rig.outline.diagonal_mm(), 2) + &level(StopMetric::Rmse);
        let (name, value) = ("RMSE, share of diagonal", number(Some(share), 2));
        table.add(row(
            name.to_owned(),
            value,
            "%",
            interval,
            rmse.n,
            "presses",
        ));
    }
    let mut millimetres = |name: String, e: &Estimate| {
        let (value, interval) = (number(e.value, 2), interval(e, 1.0, 2));
        table.add(row(name, value, "mm", interval, e.n, "presses"));
    };
    if let Some(without) = selection::rmse_without(input) {
        millimetres("RMSE, no selection".to_owned(), without);
    }
    if a.scored_without_exclusions != a.scored {
        let all = &a.scored_without_exclusions.rmse_mm;
        millimetres("RMSE, no exclusions".to_owned(), all);
    }
    if a.penalised.failures > 0 {
        millimetres("RMSE, failures counted".to_owned(), &a.penalised.rmse_mm);
    }
    for d in &a.depths {
        millimetres(format!("RMSE at {} mm depth", d.depth_mm), &d.rmse_mm);
    }
    let geometry = derive::geometry_note(a);
    let geometry = geometry.map(|note| Note::new("geometry", note).warning());
    Section::plain().with(table).with_all(geometry)
}

/// The outcomes as a sum.
fn sum(c: &PressCounts) -> String {
    format!(
        "{} planned = {} valid + {} missed + {} invalid + {} excluded",
        c.planned, c.valid, c.missed, c.invalid, c.excluded
    )
}

/// Outcomes of the presses, and why some do not count.
fn presses(a: &Analysis) -> Section {
    let c = &a.counts;
    let wrong = "these counts do not add up: do not trust this result";
    let wrong = (!c.add_up()).then(|| Note::of(wrong).warning());
    let plural = if c.sync == 1 { "" } else { "es" };
    let sync = format!("and {} sync press{plural}, counted apart", c.sync);
    let f = &a.penalised;
    let penalty = (a.is_valid() && f.failures > 0).then(|| {
        let beyond = match f.beyond_penalty {
            0 => String::new(),
            n => format!("; {n} of them as their own larger error"),
        };
        let penalty = number(Some(f.penalty_mm), 1);
        let text = format!(
            "{} failed, each counted as {penalty} mm where failures count{beyond}",
            f.failures
        );
        Note::new("penalty", text)
    });
    Section::plain()
        .with(Note::new("presses", sum(c)))
        .with_all(wrong)
        .with_all((c.sync > 0).then(|| Note::of(sync)))
        .with_all(penalty)
        .with_all(left_out(a, false))
        .with_all(left_out(a, true))
}

/// Clocks, their alignment, and what the calibration made of them.
fn clocks(a: &Analysis) -> Vec<Note> {
    let fits = (1..).zip(&a.clocks);
    let mut notes: Vec<Note> = fits.map(|(k, fit)| clock(k, fit.as_ref())).collect();
    notes.push(alignment(&a.alignment));
    if a.is_valid() {
        notes.extend(studies::calibration(a));
        let origin = derive::recalibration_note(a);
        notes.extend(origin.map(|note| Note::new("remount", note)));
        let locator = derive::locator_note(a);
        notes.extend(locator.map(|note| Note::new("locator", note)));
    }
    notes
}

/// Losses, legs, retakes and interruptions.
fn events(input: &ReportInput<'_>) -> Vec<Note> {
    let (a, p) = (input.analysis, &input.provenance);
    let mut notes = Vec::new();
    for (i, lost) in p.lost_bytes.iter().enumerate().filter(|(_, l)| **l > 0) {
        let mut text = format!("camera {}: {} bytes lost", i + 1, grouped(*lost));
        for time in course::losses(p, i) {
            text += &format!("; {time}");
        }
        notes.push(Note::new("loss", text).warning());
    }
    let off_sensor = derive::off_sensor(a).into_iter();
    notes.extend(off_sensor.map(|text| Note::new("left out", text)));
    let legs = p.several_legs().iter();
    notes.extend(legs.map(|leg| Note::new(format!("leg {}", leg.number), course::leg(leg))));
    if let Some(text) = course::retaken(p) {
        notes.push(Note::new("retaken", text));
        let reasons = course::reasons(p);
        let more = reasons.len().saturating_sub(MAX_RULES);
        notes.extend(reasons.into_iter().take(MAX_RULES).map(Note::of));
        notes.extend((more > 0).then(|| Note::of(format!("and {more} other reasons"))));
    }
    notes.extend(p.interruptions.iter().map(|row| {
        // The reason for the end of the run is shown above.
        let why = match row.ended_run {
            true => String::new(),
            false => format!(": {}", row.reason),
        };
        let text = format!("{} at {} s{why}", row.kind, number(Some(row.t_s), 1));
        Note::new("event", text).warning()
    }));
    notes
}

/// Rules with their own line; the page lists all.
const MAX_RULES: usize = 6;

/// Rejected presses, one line per rule; the run's end and the page give the details.
fn left_out(a: &Analysis, sync: bool) -> Vec<Note> {
    let rows = derive::rejections(a, sync);
    let (shown, others) = rows.split_at(rows.len().min(MAX_RULES));
    let labels = [if sync { "sync" } else { "left out" }].into_iter();
    let labels = labels.chain(std::iter::repeat(""));
    let lines = shown.iter().zip(labels).map(|(r, label)| {
        let text = plain(&format!("{} {}: {}", r.n, r.verdict, r.rule));
        Note::new(label, clip(&text, WIDTH - 10))
    });
    let more = (!others.is_empty()).then(|| {
        let n: u32 = others.iter().map(|r| r.n).sum();
        Note::of(format!("{n} by {} other rules", others.len()))
    });
    lines.chain(more).collect()
}

/// The alignment certificate in one or two lines.
fn alignment(certificate: &Alignment) -> Note {
    let mut parts = Vec::new();
    for (name, what) in [
        (MapName::Camera1FromBox, "camera 1"),
        (MapName::Camera2FromBox, "camera 2"),
    ] {
        let both = (certificate.interval_us(name), certificate.bound_us(name));
        if let (Some(noise_us), Some(bound_us)) = both {
            parts.push(format!(
                "{what} ± {} µs (95 %), systematic error at most {} µs",
                number(Some(noise_us), 2),
                number(Some(bound_us), 1)
            ));
        }
    }
    if let Some(bound_us) = certificate.bound_us(MapName::HostFromBox) {
        parts.push(format!(
            "host certainly within {} µs",
            number(Some(bound_us), 1)
        ));
    }
    for (k, line) in certificate.lines.iter().enumerate() {
        let extra = line.doubled + line.spurious;
        parts.push(format!(
            "input {}: {} % lost, {} % doubled or spurious",
            k + 1,
            number(Some(100.0 * line.share(line.lost)), 1),
            number(Some(100.0 * line.share(extra)), 1)
        ));
    }
    let verdict = match certificate.status {
        AlignmentStatus::Valid => "valid",
        AlignmentStatus::Invalid => "INVALID",
        AlignmentStatus::NotCertified => "not certified: no usable reports of a trigger box",
    };
    let by_box = (!parts.is_empty()).then(|| format!("on the box's clock {}", parts.join(", ")));
    let by_rates = certificate.rates.as_ref().map(crate::format::by_rates);
    let figures: Vec<String> = [by_box, by_rates].into_iter().flatten().collect();
    let text = match certificate.status {
        _ if figures.is_empty() => verdict.to_owned(),
        AlignmentStatus::NotCertified => format!("{verdict}; {}", figures.join("; ")),
        _ => format!("{verdict}: {}", figures.join("; ")),
    };
    Note::new("alignment", text)
}

fn clock(camera: usize, fit: Option<&ClockFit>) -> Note {
    let label = format!("clock {camera}");
    let Some(c) = fit else {
        return Note::new(
            label,
            "not aligned: neither trigger marks nor sync presses fit",
        );
    };
    let digits = digits_of_error(c.drift_se_ppm);
    let [drift, error] = [c.drift_ppm, c.drift_se_ppm].map(|v| number(Some(v), digits));
    let text = format!(
        "drift {drift} ± {error} ppm, residual rms {} µs, max {} µs, n {} ({} rejected), from {}",
        number(Some(c.residual_rms_us), 2),
        number(Some(c.residual_max_us), 2),
        c.n,
        c.rejected,
        clock_method(c.method)
    );
    Note::new(label, text)
}
