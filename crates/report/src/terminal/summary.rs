//! Owns the summary that ends a command: the answer first, at most [`MAX_LINES`] lines; the page and the table have the rest.

use std::fmt::Write as _;

use skinrig_analysis::result::Analysis;
use skinrig_text::{Paint, WIDTH, elide};

use super::text::{plain, wrap};
use crate::format::{grouped, interval, number, or_missing};
use crate::input::ReportInput;
use crate::provenance::InterruptionRow;

/// Lines of a summary. With three paths and the next step below it, a command ends with a dozen lines.
const MAX_LINES: usize = 8;
/// Lines of one remark.
const MAX_REMARK: usize = 2;
/// Lines of the advice for the leading fault.
const MAX_ADVICE: usize = 4;

/// See [`crate::terminal_summary`].
pub(crate) fn summary(input: &ReportInput<'_>, color: bool) -> String {
    let paint = Paint::new(color);
    let mut out = head(input, paint);
    let mut room = MAX_LINES.saturating_sub(out.lines().count());
    let all = remarks(input);
    for (i, remark) in all.iter().enumerate() {
        let left = all.len() - i;
        let lines = remark.lines().count();
        // A line stays free for the number of those left out.
        if lines + usize::from(left > 1) > room {
            let text = format!("{left} more: see the report, or add -v");
            out += &paint.warn(&wrap("          ", &text));
            break;
        }
        room -= lines;
        out += &paint.warn(remark);
    }
    out
}

fn head(input: &ReportInput<'_>, paint: Paint) -> String {
    use crate::page::findings::fault;
    let (a, p) = (input.analysis, &input.provenance);
    let mut out = String::new();
    // Print problems before any number.
    if !a.findings.is_empty() {
        let names: Vec<String> = a.findings.iter().map(fault).collect();
        let text = wrap("FAULT     ", &plain(&names.join("; ")));
        out += &paint.warn(&cut(text, MAX_REMARK));
    }
    if a.is_valid() {
        let rmse = &a.scored.rmse_mm;
        let text = match rmse.value {
            Some(value) => format!(
                "RMSE      {} mm, 95 % interval {}, n {} presses{}",
                number(Some(value), 2),
                interval(rmse, 1.0, 2),
                rmse.n,
                crate::derive::locator(a)
                    .map_or_else(String::new, |l| format!(", locator {}", l.name()))
            ),
            None => "RMSE      none: no scored press was located".to_owned(),
        };
        let _ = writeln!(out, "{}", paint.bold(&text));
    } else {
        out += &paint.warn(&wrap("INVALID   ", "use no number of this session"));
    }
    if let Some(variant) = &p.variant {
        out += &paint.warn(&cut(
            wrap("VARIANT   ", &plain(&variant.to_string())),
            MAX_REMARK,
        ));
    }
    if let Some(word) = p.stand_in() {
        let rig = plain(or_missing(&p.rig_name));
        let text = format!("{rig} - {}, not measured on hardware", word.to_uppercase());
        out += &paint.warn(&cut(wrap("rig       ", &text), MAX_REMARK));
    }
    if let Some(why) = &p.run_end_reason {
        let text = format!("{}: {why}", or_missing(&p.run_end));
        out += &cut(wrap("run       ", &plain(&text)), MAX_REMARK);
    }
    let c = &a.counts;
    let _ = writeln!(
        out,
        "presses   {} planned = {} valid + {} missed + {} invalid + {} excluded",
        c.planned, c.valid, c.missed, c.invalid, c.excluded
    );
    out
}

/// All that qualifies the answer, the gravest first; each a few lines.
fn remarks(input: &ReportInput<'_>) -> Vec<String> {
    let (a, p) = (input.analysis, &input.provenance);
    let mut all: Vec<(&str, String)> = Vec::new();
    if !a.counts.add_up() {
        let text = "these counts do not add up: do not trust this result";
        all.push(("presses   ", text.to_owned()));
    }
    all.extend(a.findings.first().map(|f| ("do        ", f.advice.clone())));
    let reasons = a.invalid_because();
    all.extend(reasons.into_iter().map(|why| ("INVALID   ", why)));
    if a.is_valid() {
        all.extend(crate::derive::geometry_note(a).map(|text| ("geometry  ", text)));
        all.extend(other_counts(a).map(|text| ("RMSE      ", text)));
    }
    for (i, lost) in p.lost_bytes.iter().enumerate().filter(|(_, l)| **l > 0) {
        let text = format!("camera {}: {} bytes lost", i + 1, grouped(*lost));
        all.push(("loss      ", text));
    }
    // A pause changes no answer, and the reason for the end of the run stands in the head.
    let pause = |row: &&InterruptionRow| matches!(row.kind.as_str(), "pause" | "resume");
    let faults = p.interruptions.iter().filter(|row| !pause(row));
    for row in faults.filter(|row| !row.ended_run) {
        let at = number(Some(row.t_s), 1);
        let text = format!("{} at {at} s: {}", row.kind, row.reason);
        all.push(("event     ", text));
    }
    let off_sensor = crate::derive::off_sensor(a);
    all.extend(off_sensor.into_iter().map(|text| ("left out  ", text)));
    for rejection in crate::derive::rejections(a, false) {
        let text = format!("{} {}: {}", rejection.n, rejection.verdict, rejection.rule);
        all.push(("left out  ", text));
    }
    all.extend(crate::derive::disagreement(a).map(|text| ("warning   ", text)));
    let warnings = a.alignment.warnings.iter().chain(&a.warnings);
    all.extend(warnings.map(|text| ("warning   ", text.clone())));
    let lines = |first| match first {
        "do        " => MAX_ADVICE,
        _ => MAX_REMARK,
    };
    all.into_iter()
        .map(|(first, text)| cut(wrap(first, &plain(&text)), lines(first)))
        .collect()
}

/// The RMSE counted in other ways, where it differs.
fn other_counts(a: &Analysis) -> impl Iterator<Item = String> {
    let all = &a.scored_without_exclusions;
    let excluded = (*all != a.scored).then(|| {
        let rmse = &all.rmse_mm;
        let value = number(rmse.value, 2);
        format!("{value} mm with nothing excluded, n {} presses", rmse.n)
    });
    let failed = &a.penalised;
    let failures = (failed.failures > 0).then(|| {
        format!(
            "{} mm with the {} failures counted, n {} presses",
            number(failed.rmse_mm.value, 2),
            failed.failures,
            failed.rmse_mm.n
        )
    });
    excluded.into_iter().chain(failures)
}

/// The first `max_lines` lines of a wrapped text.
fn cut(text: String, max_lines: usize) -> String {
    if text.lines().count() <= max_lines {
        return text;
    }
    let mut lines: Vec<String> = text.lines().take(max_lines).map(str::to_owned).collect();
    if let Some(last) = lines.last_mut() {
        *last = elide(last, WIDTH);
    }
    lines.join("\n") + "\n"
}
