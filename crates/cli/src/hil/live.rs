//! What a terminal shows while a suite runs, and the night kept after every check.

use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use skinrig_hil::NightObserver;
use skinrig_nightly::Night;
use skinrig_protocol::suite::{Check, Suite};
use skinrig_report::night;
use skinrig_text::Paint;

use super::folder;

/// Shows the night as it grows, and writes it down.
pub(super) struct Live {
    folder: PathBuf,
    display: Display,
    paint: Paint,
    total: usize,
    told: usize,
    unwritten: Option<io::Error>,
}

enum Display {
    /// A live line on standard error.
    Bar(ProgressBar),
    /// A line on standard error for each check.
    Lines,
}

impl Live {
    /// For a night of `suite` that is kept in `folder`.
    #[must_use]
    pub(super) fn new(folder: PathBuf, suite: &Suite) -> Self {
        let terminal = io::stderr().is_terminal();
        let display = if terminal {
            let bar = ProgressBar::with_draw_target(
                Some(suite.checks.len() as u64),
                ProgressDrawTarget::stderr_with_hz(10),
            );
            // The template is a constant; should it ever be wrong, the default style still counts checks.
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
            told: 0,
            unwritten: None,
        }
    }

    /// Takes the live line away, and tells the first fault in writing the night down.
    pub(super) fn finish(self) -> Option<io::Error> {
        if let Display::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
        self.unwritten
    }

    fn say(&self, text: &str) {
        match &self.display {
            Display::Bar(bar) => bar.suspend(|| errln!("{text}")),
            Display::Lines => errln!("{text}"),
        }
    }
}

/// The styles of `stream`.
pub(super) fn paint(stream: &impl IsTerminal) -> Paint {
    Paint::new(crate::terminal::is_coloured(stream))
}

impl NightObserver for Live {
    fn attempt_started(&mut self, _night: &Night, check: &Check, attempt: usize) {
        let again = match attempt {
            1 => String::new(),
            n => format!(", attempt {n}"),
        };
        match &self.display {
            Display::Bar(bar) => bar.set_message(format!("{}{again}", check.title)),
            Display::Lines if attempt > 1 => errln!("{}{again}", check.title),
            Display::Lines => {}
        }
    }

    fn check_finished(&mut self, night: &Night) {
        if let Err(e) = folder::write_json(&self.folder, night) {
            self.unwritten.get_or_insert(e);
        }
        let width = self.total.to_string().len();
        for check in night.checks.iter().skip(self.told) {
            self.told += 1;
            let line = night::line(check, self.paint);
            self.say(&format!("{:>width$}/{}  {line}", self.told, self.total));
        }
        if let Display::Bar(bar) = &self.display {
            bar.set_position(self.told as u64);
        }
    }
}
