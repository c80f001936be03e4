//! Progress of a run: a live bar on a terminal, plain lines elsewhere.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use skinrig_controller::{Progress, ProgressTracker};
use skinrig_model::{CameraId, HostDuration, PlannedPress, PressHistory, PressRole, Record};

use crate::remote::{LivePress, RunSnapshot};

/// Shortest interval between redraws of the bar.
const REDRAW_EVERY: Duration = Duration::from_millis(100);

/// Shows a run from its records.
pub(crate) struct ProgressView {
    tracker: ProgressTracker,
    display: Display,
    drawn: Option<Instant>,
    began: Instant,
}

enum Display {
    /// A live bar on standard error.
    Bar(ProgressBar),
    /// A line on standard error each time another tenth of the presses is done.
    Lines { tenths: usize },
    /// Nothing: called by another program.
    Hidden,
}

impl ProgressView {
    /// A view for a run that should take `expected` of rig time; a bar when standard error is a terminal.
    #[must_use]
    pub(crate) fn new(presses: usize, expected: HostDuration) -> Self {
        let display = if std::io::stderr().is_terminal() {
            let bar = ProgressBar::with_draw_target(
                Some(presses as u64),
                ProgressDrawTarget::stderr_with_hz(10),
            );
            // The template is a constant; should it ever be wrong, the default style still counts presses.
            if let Ok(style) =
                ProgressStyle::with_template("{bar:20.cyan/blue} {prefix}\n{wide_msg}")
            {
                bar.set_style(style.progress_chars("━━╌"));
            }
            Display::Bar(bar)
        } else {
            Display::Lines { tenths: 0 }
        };
        Self {
            tracker: ProgressTracker::new(Some(expected)),
            display,
            drawn: None,
            began: Instant::now(),
        }
    }

    /// A view that counts but shows nothing.
    #[must_use]
    pub(crate) fn hidden(expected: HostDuration) -> Self {
        Self {
            tracker: ProgressTracker::new(Some(expected)),
            display: Display::Hidden,
            drawn: None,
            began: Instant::now(),
        }
    }

    /// A view for a further leg of a session, as [`new`](Self::new).
    #[must_use]
    pub(crate) fn resumed(
        presses: &[PlannedPress],
        histories: &[PressHistory],
        pending: &[bool],
        expected: HostDuration,
    ) -> Self {
        let mut view = Self::new(presses.len(), expected);
        view.tracker = view.tracker.resumed(presses, histories, pending);
        if let Display::Lines { tenths } = &mut view.display {
            *tenths = view.tracker.progress().done * 10 / presses.len().max(1);
        }
        view
    }

    /// The run as of the last record.
    #[must_use]
    pub(crate) const fn progress(&self) -> &Progress {
        self.tracker.progress()
    }

    /// Writes lines above the bar.
    pub(crate) fn print(&self, text: &str) {
        match &self.display {
            Display::Bar(bar) => bar.suspend(|| errln!("{text}")),
            Display::Lines { .. } => errln!("{text}"),
            Display::Hidden => {}
        }
    }

    /// Takes the next record.
    pub(crate) fn update(&mut self, record: &Record) {
        self.tracker.update(record);
        let done = self.tracker.progress().done;
        let waited = self.began.elapsed();
        match &mut self.display {
            Display::Bar(bar) => {
                let due = self.drawn.is_none_or(|at| at.elapsed() >= REDRAW_EVERY);
                if due {
                    bar.set_position(done as u64);
                    bar.set_prefix(where_and_when(&self.tracker, waited));
                    bar.set_message(streams(&self.tracker));
                    self.drawn = Some(Instant::now());
                }
            }
            Display::Lines { tenths } => {
                let planned = self.tracker.progress().planned.max(1);
                // Presses given up at the end do not count as progress.
                let attempted = done - self.tracker.progress().missed;
                let reached = attempted * 10 / planned;
                if reached > *tenths {
                    *tenths = reached;
                    errln!(
                        "{}  {}",
                        where_and_when(&self.tracker, waited),
                        streams(&self.tracker)
                    );
                }
            }
            Display::Hidden => {}
        }
    }

    /// Removes the bar; printed lines stay.
    pub(crate) fn finish(&mut self) {
        if let Display::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
    }
}

/// `press 12/246  rep 2  (10.0, 2.0) mm  eta 0:00:08 (0:11:00 of rig time)`
fn where_and_when(tracker: &ProgressTracker, waited: Duration) -> String {
    let p = tracker.progress();
    let press = p.press.map_or_else(String::new, |press| {
        let block = match press.role {
            PressRole::Sync => "sync".to_owned(),
            PressRole::Calibrate | PressRole::Score => format!("rep {}", press.repetition.number()),
        };
        format!("  {block}  ({:.1}, {:.1}) mm", press.at.x_mm, press.at.y_mm)
    });
    let paused = if p.paused { "  PAUSED" } else { "" };
    let eta = eta_text(p.elapsed, p.eta, waited);
    format!("press {}{press}{paused}  eta {eta}", tracker.press_label())
}

/// Remaining time for the user, and the remaining rig time if the rig runs at another pace.
fn eta_text(elapsed: HostDuration, rig: Option<HostDuration>, waited: Duration) -> String {
    let Some(rig) = rig.filter(|_| elapsed.0 > 0) else {
        return "-".into();
    };
    let pace = waited.as_secs_f64() / elapsed.as_secs_f64();
    let wait = clock_text(HostDuration::from_secs_f64(rig.as_secs_f64() * pace));
    if (0.8..1.25).contains(&pace) {
        wait
    } else {
        format!("{wait} ({} of rig time)", clock_text(rig))
    }
}

/// `0:11:00 of rig time in this leg; eta 0:00:08`
#[must_use]
pub(crate) fn time_text(live: &RunSnapshot) -> String {
    let seconds = HostDuration::from_secs_f64;
    let elapsed = seconds(live.elapsed_s);
    let waited = Duration::try_from_secs_f64(live.waited_s).unwrap_or_default();
    format!(
        "{} of rig time in this leg; eta {}",
        clock_text(elapsed),
        eta_text(elapsed, live.eta_s.map(seconds), waited)
    )
}

/// `sync` or `repetition 2`.
#[must_use]
pub(crate) fn block_text(press: &LivePress) -> String {
    match press.role {
        PressRole::Sync => "sync".to_owned(),
        PressRole::Calibrate | PressRole::Score => format!("repetition {}", press.repetition),
    }
}

/// `camera 1 31.2, camera 2 28.0 kev/s  trigger 24 sent, 24+24 seen`
fn streams(tracker: &ProgressTracker) -> String {
    let p = tracker.progress();
    let rate = |camera| {
        tracker
            .events_per_s(camera)
            .map_or_else(|| "-".into(), |r| format!("{:.1}", r / 1e3))
    };
    let lost: u64 = p.cameras.iter().map(|c| c.lost_bytes).sum();
    let lost = if lost > 0 {
        format!("  LOST {lost} bytes")
    } else {
        String::new()
    };
    let count = |n: usize, what: &str| match n {
        0 => String::new(),
        n => format!("  {n} {what}"),
    };
    let ended =
        count(p.invalid, "invalid") + &count(p.excluded, "excluded") + &count(p.retaken, "retaken");
    format!(
        "camera 1 {}, camera 2 {} kev/s  trigger {} sent, {}+{} seen{ended}{lost}",
        rate(CameraId::One),
        rate(CameraId::Two),
        p.marks_sent,
        p.cameras[0].marks_seen,
        p.cameras[1].marks_seen,
    )
}

/// `h:mm:ss`.
#[must_use]
pub(crate) fn clock_text(d: HostDuration) -> String {
    let s = d.as_secs_f64().round().max(0.0) as u64;
    format!("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_eta_is_the_users_waiting_time() {
        let s = HostDuration::from_secs_f64;
        let eta = |waited| eta_text(s(100.0), Some(s(200.0)), Duration::from_secs(waited));
        assert_eq!(eta(1), "0:00:02 (0:03:20 of rig time)");
        assert_eq!(eta(100), "0:03:20");
        assert_eq!(eta_text(s(0.0), Some(s(200.0)), Duration::ZERO), "-");
        assert_eq!(eta_text(s(1.0), None, Duration::ZERO), "-");
    }

    #[test]
    fn durations_read_like_a_clock() {
        assert_eq!(clock_text(HostDuration::from_secs_f64(0.4)), "0:00:00");
        assert_eq!(clock_text(HostDuration::from_secs_f64(3725.0)), "1:02:05");
        assert_eq!(clock_text(HostDuration(-5)), "0:00:00");
    }
}
