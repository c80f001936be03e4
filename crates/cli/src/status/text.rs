//! Terminal text of `skinrig status`.

use skinrig_model::RunEnd;
use skinrig_recorder::{PressTally, SessionTotals};
use skinrig_text::{LongWords, hang};

use super::state::{LastOutcome, Status, Stored};
use crate::paths::shell_path;
use crate::progress::{block_text, time_text};
use crate::remote::RunSnapshot;
use crate::rig::gates;

/// Prints `text` beside a label, wrapped; long words such as paths stay whole.
fn line(label: &str, text: &str) {
    let text = hang(&format!("{label:<10}"), text, LongWords::Keep);
    crate::terminal::out(format_args!("{text}"));
}

/// `: reason`, or nothing.
fn because(reason: Option<&str>) -> String {
    reason.map_or_else(String::new, |why| format!(": {why}"))
}

/// The current state of the session, in words.
fn state(status: &Status) -> String {
    let stored = status.stored.as_ref();
    let end = stored.and_then(|s| s.end.0.as_ref());
    let is_sealed = stored.is_some_and(|s| s.sealed);
    match (&status.live, &status.writer, end) {
        (Some(live), by, _) => {
            let by = by.as_deref().unwrap_or("process unknown");
            format!("{} ({by})", live.state)
        }
        (None, Some(by), _) => {
            let why = because(status.silence.as_deref());
            format!("written by {by}, which does not respond{why}")
        }
        (None, None, Some(RunEnd::Completed)) if is_sealed => "completed".to_owned(),
        (None, None, Some(end)) => {
            let sealed = if is_sealed { "" } else { ", not sealed" };
            let reason = because(end.reason().as_deref());
            format!("{}{sealed}{reason}", end.name())
        }
        (None, None, None) => "cut off: no program is running it".to_owned(),
    }
}

/// Command that continues an incomplete session that no program writes.
fn next_step(status: &Status) -> Option<String> {
    let stored = status.stored.as_ref();
    let end = stored.and_then(|s| s.end.0.as_ref());
    let completed = stored.is_some_and(|s| s.sealed) && end.is_some_and(RunEnd::is_complete);
    if status.live.is_some() || status.writer.is_some() || completed {
        return None;
    }
    Some(match stored.map(|s| s.rig_kind.as_str()) {
        Some("imported" | "replayed") => "import or replay it again".to_owned(),
        _ => format!("skinrig resume {}", shell_path(&status.session)),
    })
}

/// Prints the state, one label a line, then what happened last.
pub(super) fn print(status: &Status) {
    line("session", &status.session.display().to_string());
    line("state", &state(status));
    if let Some(next) = next_step(status) {
        // On one line, to be copied.
        crate::terminal::out(format_args!("{:<10}{next}\n", "next"));
    }
    let stored = status.stored.as_ref();
    if let Some(s) = stored {
        let run = format!(
            "{} on {}, rig {}; begun {} by {}; leg {}",
            s.protocol, s.prototype, s.rig, s.started_at, s.operator, s.legs
        );
        line("run", &run);
    }
    match (&status.live, stored) {
        (Some(live), _) => print_live(live),
        (None, Some(stored)) => print_planned(&stored.totals),
        (None, None) => {}
    }
    let lost = stored.map_or(0, |s| s.totals.lost_bytes);
    line(
        "lost",
        &format!("{lost} bytes of the camera streams in the session file"),
    );
    match status.disk_free_bytes {
        Some(free) => line("disk", &format!("{} free", gates::size(free as f64))),
        None => line("disk", "free space unknown"),
    }
    if let Some(stored) = stored {
        print_latest(stored);
    }
}

/// The latest outcomes, interruptions and notes.
fn print_latest(stored: &Stored) {
    for LastOutcome {
        press,
        attempt,
        verdict,
    } in &stored.last_outcomes
    {
        let again = match attempt {
            0 | 1 => String::new(),
            number => format!(", attempt {number}"),
        };
        let reason = because(verdict.reason().as_deref());
        line("", &format!("{press}{again} {}{reason}", verdict.name()));
    }
    let earlier = stored.interruption_count - stored.last_interruptions.len();
    if earlier > 0 {
        line("", &format!("{earlier} earlier interruptions"));
    }
    for row in &stored.last_interruptions {
        let (t, kind) = (row.t.as_secs_f64(), row.kind.name());
        line("", &format!("{t:.3} s {kind}: {}", row.reason));
    }
    for row in &stored.last_notes {
        line(
            "",
            &format!("{:.3} s note: {}", row.t.as_secs_f64(), row.text),
        );
    }
}

fn print_live(live: &RunSnapshot) {
    let press = live.press.as_ref().map_or_else(String::new, |p| {
        let block = block_text(p);
        let [x, y] = p.at_mm;
        format!(" ({block}, at ({x:.1}, {y:.1}) mm)")
    });
    let text = format!(
        "{} of {}{press}; {} done: {} valid, {} invalid, {} missed, {} excluded; {} retaken",
        live.press.as_ref().map_or(0, |p| p.number),
        live.planned,
        live.done,
        live.valid,
        live.invalid,
        live.missed,
        live.excluded,
        live.retaken
    );
    line("press", &text);
    line("time", &time_text(live));
    let [one, two] = live.cameras.each_ref().map(|c| {
        c.events_per_s
            .map_or_else(|| "-".to_owned(), |r| format!("{:.1}", r / 1e3))
    });
    let [a, b] = &live.cameras;
    let text = format!(
        "camera 1 {one}, camera 2 {two} kev/s; trigger {} sent, {}+{} seen; {}+{} bytes lost in this leg",
        live.marks_sent, a.marks_seen, b.marks_seen, a.lost_bytes, b.lost_bytes
    );
    line("streams", &text);
}

fn print_planned(totals: &SessionTotals) {
    let PressTally {
        planned,
        valid,
        invalid,
        missed,
        excluded,
    } = &totals.presses;
    let mut text = format!(
        "{planned} planned: {valid} valid, {invalid} invalid, {missed} missed, {excluded} excluded"
    );
    if totals.sync.planned > 0 {
        let sync = &totals.sync;
        text += &format!("; {} of {} sync presses valid", sync.valid, sync.planned);
    }
    line("press", &text);
}
