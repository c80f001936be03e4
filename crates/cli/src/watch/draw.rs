//! Draws a frame as text: about 80 columns, no control characters.

use skinrig_model::text::is_hidden;
use skinrig_model::{HostDuration, PressRole};

use super::frame::{Frame, LatestAttempt, LocationStatus};
use crate::progress::{clock_text, eta_text};
use crate::remote::RunSnapshot;
use crate::rig::gates;

/// Maximum size of the map, columns and rows.
const MAX_CELLS: [usize; 2] = [36, 18];

/// The frame as text.
#[must_use]
pub(super) fn text(frame: &Frame) -> String {
    let p = &frame.presses;
    let mut lines = vec![
        format!("session  {}", frame.session.display()),
        format!("state    {}", frame.state),
        format!(
            "run      {} on {}, rig {}; begun {}",
            frame.protocol, frame.prototype, frame.rig, frame.started_at
        ),
        format!(
            "presses  {} planned: {} valid, {} invalid, {} missed, {} excluded, {} to go",
            p.planned,
            p.valid,
            p.invalid,
            p.missed,
            p.excluded,
            p.open()
        ),
    ];
    if let Some(live) = &frame.live {
        lines.extend(of_run(live));
    }
    let free = frame.disk_free_bytes.map(|b| gates::size(b as f64));
    let free = free.unwrap_or_else(|| "unknown".into());
    lines.push(format!("disk     {free} free"));
    lines.push(String::new());
    lines.extend(map(frame));
    if !frame.latest.is_empty() {
        lines.push(String::new());
        lines.push("latest presses            signal to noise, camera 1 and 2".to_owned());
        lines.extend(frame.latest.iter().map(latest));
    }
    if !frame.faults.is_empty() {
        lines.push(String::new());
        let more = frame.fault_count - frame.faults.len();
        lines.push(match more {
            0 => "interruptions".to_owned(),
            n => format!("interruptions ({n} earlier ones)"),
        });
        let faults = frame.faults.iter();
        lines.extend(faults.map(|f| format!("  {:>10.3} s  {}: {}", f.t_s, f.kind, f.reason)));
    }
    // Text from untrusted files must not move the cursor.
    let plain = |line: String| line.replace(|c: char| c.is_control() || is_hidden(c), " ");
    lines.into_iter().map(plain).collect::<Vec<_>>().join("\n")
}

fn of_run(live: &RunSnapshot) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(p) = &live.press {
        let block = match p.role {
            PressRole::Sync => "sync".to_owned(),
            PressRole::Calibrate | PressRole::Score => format!("repetition {}", p.repetition),
        };
        let [x, y] = p.at_mm;
        lines.push(format!(
            "now      press {} of {} ({block}) at ({x:.1}, {y:.1}) mm; {} retaken",
            p.number, live.planned, live.retaken
        ));
    }
    let seconds = HostDuration::from_secs_f64;
    let elapsed = seconds(live.elapsed_s);
    let waited = std::time::Duration::try_from_secs_f64(live.waited_s).unwrap_or_default();
    lines.push(format!(
        "time     {} of rig time in this leg; eta {}",
        clock_text(elapsed),
        eta_text(elapsed, live.eta_s.map(seconds), waited)
    ));
    for (k, camera) in live.cameras.iter().enumerate() {
        let rate = camera.events_per_s.map(|r| format!("{:.1}", r / 1e3));
        lines.push(format!(
            "camera {} {:>9} kev/s; {} of {} marks seen; {} bytes lost",
            k + 1,
            rate.as_deref().unwrap_or("-"),
            camera.marks_seen,
            live.marks_sent,
            camera.lost_bytes
        ));
    }
    lines
}

fn latest(press: &LatestAttempt) -> String {
    let [one, two] = press
        .cameras
        .map(|signal| signal.map_or_else(|| "-".to_owned(), |s| format!("{:.1}", s.ratio())));
    let [x, y] = press.at_mm;
    let attempt_note = match press.attempt {
        1 => String::new(),
        n => format!(", attempt {n}"),
    };
    let reason = press.reason.as_deref();
    let reason = reason.map_or_else(String::new, |r| format!(": {r}"));
    format!(
        "  {:>5}  ({x:>6.1}, {y:>6.1}) mm  {one:>7} {two:>7}  {}{attempt_note}{reason}",
        press.press, press.verdict
    )
}

/// Map of the locations from above, y up: one character each, or several locations per character if there are too many.
fn map(frame: &Frame) -> Vec<String> {
    let axis = |k: usize| Axis::new(frame.places.iter().map(|p| p.at_mm[k]), MAX_CELLS[k]);
    let (Some(x), Some(y)) = (axis(0), axis(1)) else {
        return Vec::new();
    };
    let mut cells = vec![vec![None::<LocationStatus>; x.cells]; y.cells];
    for place in &frame.places {
        let cell = &mut cells[y.cells - 1 - y.of(place.at_mm[1])][x.of(place.at_mm[0])];
        match cell {
            None => *cell = Some(place.clone()),
            Some(sum) => {
                sum.planned += place.planned;
                sum.valid += place.valid;
                sum.failed += place.failed;
            }
        }
    }
    let live = frame.live.as_ref().and_then(|live| live.press.as_ref());
    let now = live
        .filter(|press| press.role != PressRole::Sync)
        .map(|press| (y.cells - 1 - y.of(press.at_mm[1]), x.of(press.at_mm[0])));
    let row = |(i, row): (usize, &Vec<Option<LocationStatus>>)| {
        let cell = |(j, cell): (usize, &Option<LocationStatus>)| match cell {
            _ if now == Some((i, j)) => "@ ",
            None => "  ",
            Some(place) => mark(place),
        };
        let text: String = row.iter().enumerate().map(cell).collect();
        format!("  {}", text.trim_end())
    };
    let mut lines: Vec<String> = cells.iter().enumerate().map(row).collect();
    lines.push("  . to do  o begun  # done  x not all valid  @ now".to_owned());
    lines
}

fn mark(place: &LocationStatus) -> &'static str {
    match (place.valid, place.failed) {
        (_, 1..) => "x ",
        (0, 0) => ". ",
        (valid, 0) if valid < place.planned => "o ",
        _ => "# ",
    }
}

/// Maps coordinates along one axis to cells.
struct Axis {
    from: f64,
    span: f64,
    cells: usize,
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, most: usize) -> Option<Self> {
        let mut values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|a, b| (*a - *b).abs() < 0.01);
        let (from, to) = (*values.first()?, *values.last()?);
        Some(Self {
            from,
            span: to - from,
            cells: values.len().min(most),
        })
    }

    fn of(&self, value: f64) -> usize {
        if self.span == 0.0 {
            return 0;
        }
        let last = (self.cells - 1) as f64;
        // Only non-finite values are outside; they become 0.
        ((value - self.from) / self.span * last)
            .round()
            .clamp(0.0, last) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_place_shows_its_progress() {
        let place = |planned, valid, failed| LocationStatus {
            at_mm: [0.0; 2],
            planned,
            valid,
            failed,
        };
        let marks = [(2, 0, 0), (2, 1, 0), (2, 2, 0), (2, 1, 1)];
        let marks = marks.map(|(p, v, f)| mark(&place(p, v, f)));
        assert_eq!(marks, [". ", "o ", "# ", "x "]);
    }

    #[test]
    fn places_spread_over_the_map() {
        let axis = Axis::new([4.0, -4.0, 0.0, 4.0].into_iter(), 18).unwrap();
        assert_eq!(axis.cells, 3);
        assert_eq!([-4.0, 0.0, 4.0].map(|v| axis.of(v)), [0, 1, 2]);
        let many = Axis::new((0..100).map(f64::from), 18).unwrap();
        assert_eq!((many.cells, many.of(0.0), many.of(99.0)), (18, 0, 17));
        assert_eq!(Axis::new([1.0].into_iter(), 5).unwrap().of(1.0), 0);
        assert!(Axis::new([].into_iter(), 5).is_none());
    }
}
