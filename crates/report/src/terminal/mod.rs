//! Owns the terminal table of results: findings, headline, presses, clocks; the studies are in [`studies`].

mod studies;
mod summary;
mod text;

use std::fmt::Write as _;

use skinrig_analysis::result::{
    Alignment, AlignmentStatus, Analysis, ClockFit, ClockMethod, Estimate, MapName, Metrics,
};
use skinrig_text::{Column, Paint, Table, WIDTH, clip};

pub(crate) use self::summary::summary;
pub(crate) use self::text::{plain, wrap};
use crate::format::{digits_of_error, grouped, interval, number, or_missing};
use crate::input::ReportInput;

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
    let paint = Paint::new(color);
    let (a, p) = (input.analysis, &input.provenance);
    let mut out = String::new();
    out += &wrap("session   ", &plain(or_missing(&p.session_id)));
    if let Some(variant) = &p.variant {
        out += &paint.warn(&wrap("VARIANT   ", &plain(&variant.to_string())));
    }
    if !p.overrides.is_empty() {
        out += &wrap(
            "recorded  ",
            &plain(&format!("with --set {}", p.overrides.join(" --set "))),
        );
    }
    let rig = plain(or_missing(&p.rig_name));
    if let Some(word) = p.stand_in() {
        let word = word.to_uppercase();
        out += &paint.warn(&wrap(
            "rig       ",
            &format!("{rig} - {word}, not measured on hardware"),
        ));
    } else {
        out += &wrap("rig       ", &rig);
    }
    out += &wrap(
        "protocol  ",
        &plain(&format!(
            "{}, seed {}",
            or_missing(&p.protocol_name),
            p.seed
        )),
    );
    let end = match &p.run_end_reason {
        Some(why) => format!("{}: {why}", or_missing(&p.run_end)),
        None => or_missing(&p.run_end).to_owned(),
    };
    out += &wrap("run       ", &plain(&end));
    out.push('\n');
    let before = out.len();
    for reason in a.invalid_because() {
        out += &paint.warn(&wrap("INVALID   ", &plain(&reason)));
    }
    out += &paint.warn(&findings(a));
    if let Some(text) = crate::derive::disagreement(a) {
        out += &paint.warn(&wrap("warning   ", &text));
    }
    for warning in a.alignment.warnings.iter().chain(&a.warnings) {
        out += &paint.warn(&wrap("warning   ", &plain(warning)));
    }
    if out.len() > before {
        out.push('\n');
    }

    let table = Table::new([
        Column::left(24),
        Column::right(7),
        Column::left(3),
        Column::centre(20),
        Column::right(6),
    ])
    .gap(1);
    let presses = |name: &str, value: String, unit: &str, interval: String, n: u32| {
        table.row([name, &value, unit, &interval, &n.to_string(), "presses"]) + "\n"
    };
    let millimetres = |name: &str, e: &Estimate| {
        let (value, interval) = (number(e.value, 2), interval(e, 1.0, 2));
        presses(name, value, "mm", interval, e.n)
    };
    let head = table.row(["scored presses", "value", "", "95 % interval", "n"]);
    let _ = writeln!(out, "{}", paint.bold(&head));
    for r in metric_rows(a) {
        let n = r.n.to_string();
        let line = table.row([&r.name, &r.value, r.unit, &r.interval, &n, r.what_n]);
        let line = if r.key == "rmse" {
            paint.bold(&line)
        } else {
            line
        };
        let _ = writeln!(out, "{line}");
    }
    let usable = a.is_valid();
    if let Some(share) = a.scored.rmse_diagonal_percent.filter(|_| usable) {
        let e = &a.scored.rmse_mm;
        let scale = 100.0 / a.rig.outline.diagonal_mm();
        out += &presses(
            "RMSE, share of diagonal",
            number(Some(share), 2),
            "%",
            interval(e, scale, 2),
            e.n,
        );
    }
    if usable && a.scored_without_exclusions != a.scored {
        let e = &a.scored_without_exclusions.rmse_mm;
        out += &millimetres("RMSE, no exclusions", e);
    }
    let f = &a.penalised;
    if usable && f.failures > 0 {
        out += &millimetres("RMSE, failures counted", &f.rmse_mm);
    }
    if let Some(note) = crate::derive::geometry_note(a).filter(|_| usable) {
        out += &paint.warn(&wrap("geometry  ", &note));
    }
    for d in a.depths.iter().filter(|_| usable) {
        out += &millimetres(&format!("RMSE at {} mm depth", d.depth_mm), &d.rmse_mm);
    }
    out.push('\n');

    let c = &a.counts;
    let _ = writeln!(
        out,
        "presses   {} planned = {} valid + {} missed + {} invalid + {} excluded",
        c.planned, c.valid, c.missed, c.invalid, c.excluded
    );
    if !c.add_up() {
        let _ = writeln!(
            out,
            "{}",
            paint.warn("          these counts do not add up: do not trust this result")
        );
    }
    if c.sync > 0 {
        let plural = if c.sync == 1 { "" } else { "es" };
        let _ = writeln!(
            out,
            "          and {} sync press{plural}, counted apart",
            c.sync
        );
    }
    if usable && f.failures > 0 {
        let text = format!(
            "{} failed, each counted as {} mm where failures count{}",
            f.failures,
            number(Some(f.penalty_mm), 1),
            match f.beyond_penalty {
                0 => String::new(),
                n => format!("; {n} of them as their own larger error"),
            }
        );
        out += &wrap("penalty   ", &text);
    }
    out += &left_out(a, false);
    out += &left_out(a, true);
    for (i, clock) in a.clocks.iter().enumerate() {
        out += &clock_lines(i + 1, clock.as_ref());
    }
    out += &alignment_lines(&a.alignment);
    if usable {
        out += &studies::calibration(a);
        if let Some(note) = crate::derive::locator_note(a) {
            out += &wrap("locator   ", &note);
        }
    }
    for (i, lost) in p.lost_bytes.iter().enumerate().filter(|(_, l)| **l > 0) {
        let mut text = format!("camera {}: {} bytes lost", i + 1, grouped(*lost));
        for time in crate::course::losses(p, i) {
            text += &format!("; {time}");
        }
        out += &paint.warn(&wrap("loss      ", &text));
    }
    for text in crate::derive::off_sensor(a) {
        out += &wrap("left out  ", &text);
    }
    for leg in p.several_legs() {
        let first = format!("{:<10}", format!("leg {}", leg.number));
        out += &wrap(&first, &plain(&crate::course::leg(leg)));
    }
    if let Some(text) = crate::course::retaken(p) {
        out += &wrap("retaken   ", &text);
        let reasons = crate::course::reasons(p);
        for reason in reasons.iter().take(MAX_RULES) {
            out += &wrap("          ", &plain(reason));
        }
        if let Some(more) = reasons.len().checked_sub(MAX_RULES + 1) {
            let text = format!("and {} other reasons", more + 1);
            out += &wrap("          ", &text);
        }
    }
    for row in &p.interruptions {
        let mut text = format!("{} at {} s", row.kind, number(Some(row.t_s), 1));
        // The reason for the end of the run is shown above.
        if !row.ended_run {
            let _ = write!(text, ": {}", row.reason);
        }
        let text = plain(&text);
        out += &paint.warn(&wrap("event     ", &text));
    }
    let studies = if usable {
        studies::all(a)
    } else {
        wrap("studies   ", "withheld: the session is INVALID")
    };
    if !studies.is_empty() {
        out.push('\n');
        out += &studies;
    }
    out
}

/// Audit findings, shown before all numbers.
fn findings(a: &Analysis) -> String {
    use crate::page::findings::{fault, law};
    let mut out = String::new();
    for f in &a.findings {
        let text = format!("{}. Violated: {}. {}", fault(f), law(f), f.evidence);
        out += &wrap("fault     ", &plain(&text));
        out += &wrap("          ", &plain(&format!("do: {}", f.advice)));
    }
    out
}

/// Rules with their own line; the page lists all.
const MAX_RULES: usize = 6;

/// Rejected presses, one line per rule.
fn left_out(a: &Analysis, sync: bool) -> String {
    let rows = crate::derive::rejections(a, sync);
    let first = if sync { "sync      " } else { "left out  " };
    let indent = " ".repeat(first.len());
    let mut out = String::new();
    for (i, r) in rows.iter().take(MAX_RULES).enumerate() {
        let text = plain(&format!("{} {}: {}", r.n, r.verdict, r.rule));
        // One line each; the run's end and the page give the details.
        let room = WIDTH - first.len();
        out += &wrap(if i == 0 { first } else { &indent }, &clip(&text, room));
    }
    if rows.len() > MAX_RULES {
        let more: u32 = rows[MAX_RULES..].iter().map(|r| r.n).sum();
        out += &wrap(
            &indent,
            &format!("{more} by {} other rules", rows.len() - MAX_RULES),
        );
    }
    out
}

/// The alignment certificate in one or two lines.
fn alignment_lines(certificate: &Alignment) -> String {
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
    wrap("alignment ", &text)
}

fn clock_lines(camera: usize, clock: Option<&ClockFit>) -> String {
    let first = format!("clock {camera}   ");
    let Some(c) = clock else {
        return wrap(
            &first,
            "not aligned: neither trigger marks nor sync presses fit",
        );
    };
    let drift = format!(
        "{} ± {}",
        number(Some(c.drift_ppm), digits_of_error(c.drift_se_ppm)),
        number(Some(c.drift_se_ppm), digits_of_error(c.drift_se_ppm))
    );
    let text = format!(
        "drift {drift} ppm, residual rms {} µs, max {} µs, n {} ({} rejected), from {}",
        number(Some(c.residual_rms_us), 2),
        number(Some(c.residual_max_us), 2),
        c.n,
        c.rejected,
        clock_method(c.method)
    );
    wrap(&first, &text)
}
