//! Owns the summary that ends a command: the answer first, at most [`MAX_LINES`] lines; the page and the table have the rest.

use skinrig_analysis::result::Analysis;
use skinrig_model::Reaction;
use skinrig_text::Paint;

use crate::derive;
use crate::document::{Note, Tone};
use crate::format::{grouped, interval, number, or_missing};
use crate::input::ReportInput;
use crate::page::findings::fault;
use crate::page::indentation::line;
use crate::provenance::{InterruptionRow, Variant};
use crate::selection;

/// Lines of a summary. With three paths and the next step below it, a command ends with a dozen lines.
const MAX_LINES: usize = 8;
/// Lines of one remark.
const MAX_REMARK: usize = 2;
/// Lines of the advice for the leading fault.
const MAX_ADVICE: usize = 4;

/// See [`crate::terminal_summary`].
pub(crate) fn summary(input: &ReportInput<'_>, color: bool) -> String {
    let paint = Paint::new(color);
    let mut out: String = head(input).iter().map(|note| note.lines(paint)).collect();
    let mut room = MAX_LINES.saturating_sub(out.lines().count());
    let all = remarks(input);
    for (i, remark) in all.iter().enumerate() {
        let mut left = all.len() - i;
        let text = remark.lines(paint);
        let lines = text.lines().count();
        // A line stays free for the number of those left out.
        if lines + usize::from(left > 1) > room {
            // The gravest is always told, be it cut.
            if i == 0 && room > 1 {
                out += &remark.clone().at_most(room - 1).lines(paint);
                left -= 1;
            }
            let text = format!("{left} more: see the report, or add -v");
            out += &Note::of(text).warning().lines(paint);
            break;
        }
        room -= lines;
        out += &text;
    }
    out
}

fn head(input: &ReportInput<'_>) -> Vec<Note> {
    let (a, p) = (input.analysis, &input.provenance);
    let mut notes = Vec::new();
    let selected = selection::headline(input);
    notes.extend(selected.map(|text| Note::new("SELECTION", text).warning()));
    // Print problems before any number.
    if !a.findings.is_empty() {
        let names: Vec<String> = a.findings.iter().map(fault).collect();
        notes.push(Note::new("FAULT", names.join("; ")).warning());
    }
    let rmse = &a.scored.rmse_mm;
    notes.push(if !a.is_valid() {
        Note::new("INVALID", "use no number of this session").warning()
    } else if rmse.value.is_none() {
        Note::new("RMSE", "none: no scored press was located").tone(Tone::Answer)
    } else {
        let locator = derive::locator(a);
        let locator = locator.map_or_else(String::new, |l| format!(", locator {}", l.name()));
        let text = match derive::rmse_at_look(a) {
            Some(at) => format!(
                "{} mm, {} % interval {}, {}{locator}",
                at.value, at.level, at.interval, at.extent
            ),
            None => {
                let (value, interval) = (number(rmse.value, 2), interval(rmse, 1.0, 2));
                format!(
                    "{value} mm, 95 % interval {interval}, n {} presses{locator}",
                    rmse.n
                )
            }
        };
        Note::new("RMSE", text).tone(Tone::Answer)
    });
    if a.is_valid() && a.findings.is_empty() {
        notes.extend(derive::rmse_elsewhere(a).map(|text| Note::new("", text)));
    }
    notes.extend(selection::without(input).map(|text| Note::new("", text).warning()));
    if a.is_valid() {
        notes.extend(line(a).map(|text| Note::new("depth", text)));
        notes.extend(felt(a).map(|text| Note::new("felt", text)));
    }
    let is_more = |v: &&Variant| v.selection.is_none() || v.changes().is_some();
    if let Some(variant) = p.variant.as_ref().filter(is_more) {
        notes.push(Note::new("VARIANT", variant.to_string()).warning());
    }
    if let Some(word) = p.stand_in() {
        let (rig, word) = (or_missing(&p.rig_name), word.to_uppercase());
        let text = format!("{rig} - {word}, not measured on hardware");
        notes.push(Note::new("rig", text).warning());
    }
    if let Some(why) = &p.run_end_reason {
        notes.push(Note::new(
            "run",
            format!("{}: {why}", or_missing(&p.run_end)),
        ));
    }
    notes.push(Note::new("presses", super::sum(&a.counts)));
    notes
        .into_iter()
        .map(|note| note.at_most(MAX_REMARK))
        .collect()
}

/// Touches felt while the session was recorded.
fn felt(a: &Analysis) -> Option<String> {
    let f = a.felt.as_ref()?;
    let mut text = format!(
        "{} of {} scored presses while recording, {} ms after contact",
        f.felt,
        f.presses,
        number(f.delay_ms.median, 1)
    );
    if let Some(r) = &f.reactions {
        let what = match r.reaction {
            Reaction::Stop => "stopped",
            Reaction::Lift => "lifted",
        };
        let (n, ms) = (r.reaction_ms.n, number(r.reaction_ms.median, 1));
        text += &format!("; {n} {what} after {ms} ms");
    }
    Some(text)
}

/// All that qualifies the answer, the gravest first; each a few lines.
fn remarks(input: &ReportInput<'_>) -> Vec<Note> {
    let (a, p) = (input.analysis, &input.provenance);
    let mut all: Vec<(&str, String)> = Vec::new();
    if !a.counts.add_up() {
        let text = "these counts do not add up: do not trust this result";
        all.push(("presses", text.to_owned()));
    }
    all.extend(a.findings.first().map(|f| ("do", f.advice.clone())));
    let reasons = a.invalid_because();
    all.extend(reasons.into_iter().map(|why| ("INVALID", why)));
    let (grave, others): (Vec<_>, Vec<_>) = a.remarks().partition(|w| w.cause.is_grave());
    all.extend(grave.iter().map(|w| ("warning", w.to_string())));
    if a.is_valid() {
        all.extend(derive::geometry_note(a).map(|text| ("geometry", text)));
        all.extend(other_counts(a).map(|text| ("RMSE", text)));
    }
    for (i, lost) in p.lost_bytes.iter().enumerate().filter(|(_, l)| **l > 0) {
        let text = format!("camera {}: {} bytes lost", i + 1, grouped(*lost));
        all.push(("loss", text));
    }
    // A pause changes no answer, and the reason for the end of the run stands in the head.
    let pause = |row: &&InterruptionRow| matches!(row.kind.as_str(), "pause" | "resume");
    let faults = p.interruptions.iter().filter(|row| !pause(row));
    for row in faults.filter(|row| !row.ended_run) {
        let at = number(Some(row.t_s), 1);
        all.push(("event", format!("{} at {at} s: {}", row.kind, row.reason)));
    }
    let off_sensor = derive::off_sensor(a);
    all.extend(off_sensor.into_iter().map(|text| ("left out", text)));
    for rejection in derive::rejections(a, false) {
        let text = format!("{} {}: {}", rejection.n, rejection.verdict, rejection.rule);
        all.push(("left out", text));
    }
    all.extend(derive::disagreement(a).map(|text| ("warning", text)));
    all.extend(others.iter().map(|w| ("warning", w.to_string())));
    let notes = all.into_iter().map(|(label, text)| {
        let lines = if label == "do" {
            MAX_ADVICE
        } else {
            MAX_REMARK
        };
        Note::new(label, text).warning().at_most(lines)
    });
    notes.collect()
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
        let plural = if failed.failures == 1 { "" } else { "s" };
        format!(
            "{} mm with the {} failure{plural} counted, n {} presses",
            number(failed.rmse_mm.value, 2),
            failed.failures,
            failed.rmse_mm.n
        )
    });
    excluded.into_iter().chain(failures)
}
