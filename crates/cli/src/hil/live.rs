//! Shows a running suite in the terminal and writes the night after every check.

use std::io::{self, IsTerminal};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use skinrig_hil::NightObserver;
use skinrig_hil::night_folder::NightFolder;
use skinrig_nightly::Night;
use skinrig_protocol::suite::{Check, Suite};
use skinrig_report::night;
use skinrig_text::Paint;

/// Prints the progress of a night and saves its results.
pub(super) struct NightProgress {
    folder: NightFolder,
    display: Display,
    paint: Paint,
    total: usize,
    shown: usize,
    write_error: Option<io::Error>,
}

enum Display {
    /// A live line on standard error.
    Bar(ProgressBar),
    /// A line on standard error for each check.
    Lines,
}

impl NightProgress {
    /// Progress of a night of `suite` in `folder`.
    #[must_use]
    pub(super) fn new(folder: NightFolder, suite: &Suite) -> Self {
        let terminal = io::stderr().is_terminal();
        let display = if terminal {
            let bar = ProgressBar::with_draw_target(
                Some(suite.checks.len() as u64),
                ProgressDrawTarget::stderr_with_hz(10),
            );
            // The template is a constant. If it were invalid, the default style would still count checks.
            if let Ok(style) =
                ProgressStyle::with_template("{bar:20.cyan/blue} {pos}/{len} {elapsed}  {wide_msg}")
            {
                bar.set_style(style.progress_chars("━━╌"));
            }
            bar.enable_steady_tick(Duration::from_secs(1));
            Display::Bar(bar)
        } else {
            Display::Lines
        };
        Self {
            folder,
            display,
            paint: paint(&io::stderr()),
            total: suite.checks.len(),
            shown: 0,
            write_error: None,
        }
    }

    /// Removes the live line and returns the first error from writing the night.
    pub(super) fn finish(self) -> Option<io::Error> {
        if let Display::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
        self.write_error
    }

    fn print(&self, text: &str) {
        match &self.display {
            Display::Bar(bar) => bar.suspend(|| errln!("{text}")),
            Display::Lines => errln!("{text}"),
        }
    }
}

/// Styles for `stream`.
pub(super) fn paint(stream: &impl IsTerminal) -> Paint {
    Paint::new(crate::terminal::is_coloured(stream))
}

impl NightObserver for NightProgress {
    fn attempt_started(&mut self, _night: &Night, check: &Check, attempt: usize) {
        let repetition = match attempt {
            1 => String::new(),
            n => format!(", attempt {n}"),
        };
        match &self.display {
            Display::Bar(bar) => bar.set_message(format!("{}{repetition}", check.title)),
            Display::Lines if attempt > 1 => errln!("{}{repetition}", check.title),
            Display::Lines => {}
        }
    }

    fn check_finished(&mut self, night: &Night) {
        if let Err(e) = self.folder.write_json(night) {
            self.write_error.get_or_insert(e);
        }
        let width = self.total.to_string().len();
        for check in night.checks.iter().skip(self.shown) {
            self.shown += 1;
            let line = night::line(check, self.paint);
            self.print(&format!("{:>width$}/{}  {line}", self.shown, self.total));
        }
        if let Display::Bar(bar) = &self.display {
            bar.set_position(self.shown as u64);
        }
    }
}
