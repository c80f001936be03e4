//! Draws a frame as text for a terminal of any width.

use skinrig_model::text::is_hidden;
use skinrig_text::{Column, LongWords, Paint, Style, Table, WIDTH, clip, wrap};

use super::failures::{CameraLoss, Failure};
use super::frame::{Frame, LatestAttempt};
use super::map::map;
use crate::progress::{block_text, time_text};
use crate::remote::{LiveTouch, RunSnapshot};
use crate::rig::gates;

/// Number of causes shown.
const CAUSES: usize = 4;
/// Narrowest terminal that lines fit.
const NARROW: usize = 40;
/// Columns from which the latest presses show their places.
const PLACE_FROM: usize = 60;
/// Less free space than this is pointed out, bytes.
const LOW_DISK_BYTES: u64 = 2_000_000_000;

/// Where a frame is drawn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Canvas {
    columns: usize,
    /// Lines of the terminal; `None` without one.
    rows: Option<usize>,
    paint: Paint,
}

impl Canvas {
    /// A terminal of this size; without one, lines of the usual width.
    pub(super) fn new(size: Option<(u16, u16)>, paint: Paint) -> Self {
        Self {
            columns: size.map_or(WIDTH, |(_, columns)| usize::from(columns).max(NARROW)),
            rows: size.map(|(rows, _)| usize::from(rows)),
            paint,
        }
    }

    /// A line with a label in the first nine columns, wrapped.
    fn line(&self, label: &str, style: Option<Style>, text: &str) -> Vec<String> {
        // Text from untrusted files must not move the cursor.
        let plain = text.replace(|c: char| c.is_control() || is_hidden(c), " ");
        let label = format!("{label:<9}");
        let room = self.columns.saturating_sub(label.len());
        let wrapped = wrap(&plain, room, LongWords::Cut);
        let paint = |(i, text): (usize, &String)| {
            let line = format!("{:<9}{text}", if i == 0 { &label } else { "" });
            match style {
                Some(style) => self.paint.apply(style, &line),
                None => line,
            }
        };
        wrapped.iter().enumerate().map(paint).collect()
    }
}

/// The frame as text: what needs attention first, then progress, map, latest presses and interruptions. On a low terminal the
/// map and the latest presses are left out.
pub(super) fn text(frame: &Frame, canvas: Canvas) -> String {
    let mut lines = canvas.line("session", None, &frame.session.display().to_string());
    lines.extend(state(frame, canvas));
    lines.extend(attention(frame, canvas));
    lines.extend(progress(frame, canvas));
    let mut tail = failures(frame, canvas);
    tail.extend(interruptions(frame, canvas));
    for more in [
        latest(frame, canvas),
        under_blank(map(frame, canvas.columns)),
    ] {
        let height = lines.len() + more.len() + tail.len();
        if canvas.rows.is_none_or(|rows| height < rows) {
            lines.extend(more);
        }
    }
    lines.extend(tail);
    lines.join("\n")
}

/// The lines below an empty one, if there are any.
fn under_blank(lines: Vec<String>) -> Vec<String> {
    let blank = (!lines.is_empty()).then(String::new);
    blank.into_iter().chain(lines).collect()
}

fn state(frame: &Frame, canvas: Canvas) -> Vec<String> {
    let mut lines = canvas.line("state", None, &frame.state);
    let run = format!(
        "{} on {}, rig {}; begun {}",
        frame.protocol, frame.prototype, frame.rig, frame.started_at
    );
    lines.extend(canvas.line("run", None, &run));
    lines
}

/// Problems for the operator.
fn attention(frame: &Frame, canvas: Canvas) -> Vec<String> {
    let mut lines = Vec::new();
    let last = frame
        .latest
        .last()
        .and_then(|press| press.reason.as_deref());
    if let (n @ 1.., Some(reason)) = (frame.failures_in_a_row, last) {
        let which = match n {
            1 => "the last attempt is invalid".to_owned(),
            n => format!("the last {n} attempts are invalid"),
        };
        let text = format!("{which}: {reason}");
        lines.extend(canvas.line("FAILING", Some(Style::Error), &text));
    }
    for (k, loss) in frame.losses.iter().enumerate() {
        let live = frame.live.as_ref().map_or(0, |l| l.cameras[k].lost_bytes);
        if loss.bytes.max(live) > 0 {
            let text = format!("camera {}: {}", k + 1, lost(*loss, live));
            lines.extend(canvas.line("LOST", Some(Style::Error), &text));
        }
    }
    if let Some(free) = frame.disk_free_bytes.filter(|b| *b < LOW_DISK_BYTES) {
        let free = gates::size(free as f64);
        let text = format!(
            "expected at least {} free, found {free}",
            gates::size(LOW_DISK_BYTES as f64)
        );
        lines.extend(canvas.line("DISK", Some(Style::Warning), &text));
    }
    lines
}

/// `4096 bytes in 2 gaps, 1.3 ms`. The run may have lost bytes that are not in the file yet.
fn lost(loss: CameraLoss, live_bytes: u64) -> String {
    let mut text = format!("{} bytes", loss.bytes.max(live_bytes));
    if loss.gaps > 0 {
        let plural = if loss.gaps == 1 { "" } else { "s" };
        text += &format!(" in {} gap{plural}", loss.gaps);
        if let Some(us) = loss.lost_us {
            text += &format!(", {:.1} ms", us as f64 / 1e3);
        }
    }
    text + "; presses in the gaps are invalid"
}

fn progress(frame: &Frame, canvas: Canvas) -> Vec<String> {
    let p = &frame.presses;
    let mut lines = canvas.line(
        "presses",
        None,
        &format!(
            "{} planned: {} valid, {} invalid, {} missed, {} excluded, {} to go",
            p.planned,
            p.valid,
            p.invalid,
            p.missed,
            p.excluded,
            p.open()
        ),
    );
    if let Some(live) = &frame.live {
        lines.extend(of_run(live, canvas));
    }
    let free = frame.disk_free_bytes.map(|b| gates::size(b as f64));
    let free = free.unwrap_or_else(|| "unknown".into());
    lines.extend(canvas.line("disk", None, &format!("{free} free")));
    lines
}

fn of_run(live: &RunSnapshot, canvas: Canvas) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(p) = &live.press {
        let block = block_text(p);
        let [x, y] = p.at_mm;
        let text = format!(
            "press {} of {} ({block}) at ({x:.1}, {y:.1}) mm; {} retaken",
            p.number, live.planned, live.retaken
        );
        lines.extend(canvas.line("now", None, &text));
    }
    lines.extend(canvas.line("time", None, &time_text(live)));
    if let Some(touch) = &live.touch {
        lines.extend(canvas.line("felt", None, &felt(touch)));
    }
    for (k, camera) in live.cameras.iter().enumerate() {
        let rate = camera.events_per_s.map(|r| format!("{:.1}", r / 1e3));
        let text = format!(
            "{:>7} kev/s; {} of {} marks seen",
            rate.as_deref().unwrap_or("-"),
            camera.marks_seen,
            live.marks_sent
        );
        lines.extend(canvas.line(&format!("camera {}", k + 1), None, &text));
    }
    lines
}

/// `12 of 14 scored presses, 1 touch between presses; touched now, at (8.1, -2.0) mm, 95 % region 3.1 x 2.0 mm (semi-axes), 0.8 ± 0.3 mm
/// deep`
fn felt(touch: &LiveTouch) -> String {
    let mut text = format!(
        "{} of {} scored presses, {} touch{} between presses",
        touch.felt,
        touch.presses,
        touch.between,
        if touch.between == 1 { "" } else { "es" }
    );
    if touch.skipped > 0 {
        text += &format!("; skipped bytes {} times to keep up", touch.skipped);
    }
    match touch.at_mm.filter(|_| touch.touching) {
        Some([x, y]) => text += &format!("; touched now, at ({x:.1}, {y:.1}) mm"),
        None if touch.touching => text += "; touched now",
        None => text += "; not touched now",
    }
    if let Some(region) = touch.region.filter(|_| touch.touching) {
        let [long, short] = region.semi_axes_mm;
        text += &format!(", 95 % region {long:.1} x {short:.1} mm (semi-axes)");
    }
    if let Some(depth) = touch.depth.filter(|_| touch.touching) {
        text += &format!(", {:.1} ± {:.1} mm deep", depth.mm, depth.within_mm);
    }
    text
}

/// Invalid attempts by cause.
fn failures(frame: &Frame, canvas: Canvas) -> Vec<String> {
    let mut lines = Vec::new();
    for failure in frame.failures.iter().take(CAUSES) {
        let count = format!("{:>5} x", failure.attempts);
        lines.extend(canvas.line(&count, None, &cause(failure)));
    }
    let rest: usize = frame.failures.iter().skip(CAUSES).map(|f| f.attempts).sum();
    if rest > 0 {
        lines.extend(canvas.line(&format!("{rest:>5} x"), None, "other causes"));
    }
    if !lines.is_empty() {
        lines.insert(0, canvas.paint.bold("invalid attempts, by cause"));
    }
    under_blank(lines)
}

fn cause(failure: &Failure) -> String {
    let numbers: Vec<String> = failure.presses.iter().map(ToString::to_string).collect();
    let which = match failure.presses.len() {
        1 => "press",
        _ => "latest presses",
    };
    let good = match failure.made_good {
        0 => String::new(),
        n => format!("; {n} made good by a retake"),
    };
    format!("{} ({which} {}{good})", failure.reason, numbers.join(", "))
}

fn latest(frame: &Frame, canvas: Canvas) -> Vec<String> {
    let has_place = canvas.columns >= PLACE_FROM;
    let place = Column::right(if has_place { 20 } else { 0 });
    let number = Column::right(7);
    let table = Table::new([number, place, number, number]).gap(1);
    let row = |cells: [&str; 5]| clip(&table.row(cells), canvas.columns);
    let of = |press: &LatestAttempt| {
        let [x, y] = press.at_mm;
        let at = if has_place {
            format!("({x:.1}, {y:.1}) mm")
        } else {
            String::new()
        };
        let ratio = |k: usize| {
            press.cameras[k].map_or_else(|| "-".to_owned(), |s| format!("{:.1}", s.ratio()))
        };
        let again = match press.attempt {
            1 => String::new(),
            n => format!(", attempt {n}"),
        };
        let verdict = format!(" {}{again}", press.verdict);
        row([
            &press.press.to_string(),
            &at,
            &ratio(0),
            &ratio(1),
            &verdict,
        ])
    };
    let mut lines: Vec<String> = frame.latest.iter().map(of).collect();
    if !lines.is_empty() {
        let head = row([
            "press",
            if has_place { "place" } else { "" },
            "SNR 1",
            "SNR 2",
            "",
        ]);
        lines.insert(0, canvas.paint.bold(&head));
    }
    under_blank(lines)
}

fn interruptions(frame: &Frame, canvas: Canvas) -> Vec<String> {
    let mut lines = Vec::new();
    for f in &frame.faults {
        let text = format!("{}: {}", f.kind, f.reason);
        lines.extend(canvas.line(&format!("{:>6.1} s", f.t_s), None, &text));
    }
    if !lines.is_empty() {
        let head = match frame.fault_count - frame.faults.len() {
            0 => "interruptions".to_owned(),
            n => format!("interruptions ({n} earlier ones)"),
        };
        lines.insert(0, canvas.paint.bold(&head));
    }
    under_blank(lines)
}

#[cfg(test)]
mod tests {
    use skinrig_model::{TouchDepth, TouchKind, TouchRegion};
    use skinrig_text::width;

    use super::*;

    #[test]
    fn lines_fit_a_narrow_terminal_and_hostile_text_is_plain() {
        let canvas = Canvas::new(Some((24, 44)), Paint::new(false));
        let reason =
            "the last 3 attempts are invalid: camera 1 sent no bytes\u{1b}[2J for a long time";
        let lines = canvas.line("FAILING", None, reason);
        assert!(
            lines.len() > 1 && lines.iter().all(|l| width(l) <= 44),
            "{lines:?}"
        );
        assert!(lines[1].starts_with("         "));
        assert!(!lines.concat().contains('\u{1b}'));
    }

    #[test]
    fn what_is_felt_is_described_with_its_region() {
        let mut touch = LiveTouch {
            touching: true,
            kind: TouchKind::Position,
            t_s: 12.0,
            lag_ms: 4.0,
            at_mm: Some([8.06, -2.0]),
            region: Some(TouchRegion {
                semi_axes_mm: [3.1, 2.0],
                angle_deg: 30.0,
            }),
            depth: Some(TouchDepth {
                mm: 0.82,
                within_mm: 0.31,
            }),
            presses: 14,
            felt: 12,
            between: 1,
            skipped: 0,
        };
        assert_eq!(
            felt(&touch),
            "12 of 14 scored presses, 1 touch between presses; touched now, at (8.1, -2.0) mm, 95 % region 3.1 x 2.0 mm (semi-axes), 0.8 ± 0.3 mm deep"
        );
        (touch.touching, touch.between, touch.skipped) = (false, 0, 2);
        assert_eq!(
            felt(&touch),
            "12 of 14 scored presses, 0 touches between presses; skipped bytes 2 times to keep up; not touched now"
        );
    }

    #[test]
    fn losses_are_described_with_their_length() {
        let loss = CameraLoss {
            bytes: 64,
            gaps: 2,
            lost_us: Some(1_300),
        };
        assert!(lost(loss, 0).starts_with("64 bytes in 2 gaps, 1.3 ms;"));
        let none = CameraLoss {
            bytes: 0,
            gaps: 0,
            lost_us: Some(0),
        };
        assert!(lost(none, 8).starts_with("8 bytes;"));
    }
}
