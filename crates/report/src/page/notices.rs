//! Owns the remarks about a session: losses, warnings, legs, interruptions, notes.

use skinrig_model::RunEnd;

use crate::document::{Group, Note, Text};
use crate::format::{capitalised, grouped, number};
use crate::input::ReportInput;
use crate::scene_prediction::sentence;
use crate::{course, derive};

/// Interruptions that ended the run.
const FAULTS: [&str; 3] = ["fault", "abort", "halt"];

/// The card of remarks.
pub(super) fn notices(input: &ReportInput<'_>) -> Group {
    let (a, p) = (input.analysis, &input.provenance);
    let troubles = troubles(input);
    let silent = a.findings.is_empty().then(|| {
        let text = "The plausibility audit found no violation in the laws it could test.";
        Note::of(text).good().test_id("audit-silent")
    });
    let is_quiet =
        troubles.is_empty() && !matches!(input.scene, Some(Ok(s)) if !s.differing().is_empty());
    let quiet =
        is_quiet.then(|| Note::of("No warnings, faults, interruptions or lost data.").good());
    let off_sensor = derive::off_sensor(a).into_iter();
    let notes = p.notes.iter().map(|n| {
        let at = number(Some(n.t_s), 1);
        Note::new("note", format!("at {at} s: {}", n.text))
    });
    let title = "What to know";
    Group::titled(title)
        .class("list")
        .test_id("notices")
        .region(title)
        .with_all(settings(input))
        .with_all(off_sensor.map(|text| Note::new("Left out.", format!("{text}."))))
        .with_all(troubles)
        .with_all(silent)
        .with_all(scene(input))
        .with_all(quiet)
        .with_all(notes)
}

/// The audit's row on the scene, if its predictions were simulated.
fn scene(input: &ReportInput<'_>) -> Option<Note> {
    let note = match input.scene? {
        Err(e) => Note::new("Scene.", e.to_string()).bad(),
        Ok(found) => {
            let head = Text::from(format!(
                "{}: {}.",
                capitalised(&found.scene_in_words()),
                found.verdict()
            ));
            let differing = found.differing();
            let text = differing.iter().fold(head, |text, row| {
                text.line_break().add(capitalised(&sentence(row))).add(".")
            });
            let note = Note::new("Scene.", text);
            if differing.is_empty() {
                note.good()
            } else {
                note.warning()
            }
        }
    };
    Some(note.test_id("scene"))
}

/// Settings that are not the protocol's own.
fn settings(input: &ReportInput<'_>) -> Vec<Note> {
    let (a, overrides) = (input.analysis, &input.provenance.overrides);
    let mut notes = Vec::new();
    if !overrides.is_empty() {
        let changes = overrides.iter().fold(Text::new(), |text, change| {
            text.code(format!("--set {change}")).add(" ")
        });
        let note = Note::new("Recorded with changes.", changes);
        notes.push(note.warning().test_id("overrides"));
    }
    if a.reference.is_some() && a.is_valid() {
        let text =
            Text::from("The settings are the public code's; its own way of judging is under ");
        let note = Note::new(
            "Reference-code mode.",
            text.link("#comparison", "Comparison").add("."),
        );
        notes.push(note.warning().test_id("reference-mode"));
    }
    notes
}

/// Everything that a perfect session has not.
fn troubles(input: &ReportInput<'_>) -> Vec<Note> {
    let (a, p) = (input.analysis, &input.provenance);
    let mut notes = Vec::new();
    if let Some(text) = derive::disagreement(a) {
        notes.push(Note::new("Disagreement.", format!("{text}.")).bad());
    }
    if let Some(why) = &p.run_end_reason {
        let ending = p.interruptions.iter().find(|i| i.ended_run);
        let at = ending.map_or_else(String::new, |i| format!(" at {} s", number(Some(i.t_s), 1)));
        let end = crate::format::or_missing(&p.run_end);
        let note = Note::new(format!("Run {end}{at}."), &**why);
        let decided = p.run_end_cause.as_ref().and_then(RunEnd::decision);
        notes.push(if decided.is_some() { note } else { note.bad() });
    }
    for (i, bytes) in p.lost_bytes.iter().enumerate().filter(|(_, b)| **b > 0) {
        let mut text = format!("Camera {}: {} bytes", i + 1, grouped(*bytes));
        for time in course::losses(p, i) {
            text += &format!("; {time}");
        }
        notes.push(Note::new("Data lost.", text + ".").bad());
    }
    notes.extend(a.remarks().map(|w| Note::of(w.to_string()).warning()));
    let legs = p.several_legs();
    if !legs.is_empty() {
        let head = "The session was resumed; the clocks of each leg are fitted separately.";
        let text = legs.iter().fold(Text::from(head), |text, leg| {
            let name = format!("leg {}", leg.number);
            let about = format!(" {}", course::leg(leg));
            text.line_break().bold(name).add(about)
        });
        let label = format!("In {} legs.", legs.len());
        notes.push(Note::new(label, text).warning().test_id("legs"));
    }
    if let Some(retaken) = course::retaken(p) {
        let head = Text::from(format!("{retaken}."));
        let reasons = course::reasons(p).into_iter();
        let text = reasons.fold(head, |text, reason| text.line_break().add(reason));
        notes.push(Note::new("Retaken.", text).warning().test_id("retaken"));
    }
    for i in p.interruptions.iter().filter(|i| !i.ended_run) {
        let at = number(Some(i.t_s), 1);
        let note = Note::new(&*i.kind, format!("at {at} s: {}", i.reason));
        notes.push(match FAULTS.contains(&&*i.kind) {
            true => note.bad(),
            false => note.warning(),
        });
    }
    notes
}
