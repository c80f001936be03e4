//! Progress of a computation on the terminal: phase, bytes read, elapsed time.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressState, ProgressStyle};

/// Redraw interval.
const REDRAW_EVERY: Duration = Duration::from_millis(100);

/// A phase of a command, shown on standard error until it is dropped; shows nothing if that is not a terminal.
pub(crate) struct Phase(ProgressBar);

impl Phase {
    /// A phase of unknown length.
    pub(crate) fn begin(text: &str) -> Self {
        Self::draw(text, "{spinner} {msg}, {elapsed}", |style| style)
    }

    /// A phase that counts the bytes it has read.
    pub(crate) fn reading(text: &str, bytes: Arc<AtomicU64>) -> Self {
        Self::draw(text, "{spinner} {msg}, {read} read, {elapsed}", |style| {
            style.with_key(
                "read",
                move |_: &ProgressState, out: &mut dyn std::fmt::Write| {
                    let megabytes = bytes.load(Ordering::Relaxed) / 1_000_000;
                    // A terminal that takes no text cannot be helped.
                    let _ = write!(out, "{megabytes} MB");
                },
            )
        })
    }

    /// A phase of so many equal steps; call [`Self::step`] after each.
    pub(crate) fn steps(text: &str, count: u32) -> Self {
        let phase = Self::draw(
            text,
            "{spinner} {msg} {bar:20} {pos} of {len}, {elapsed}",
            |style| style,
        );
        phase.0.set_length(u64::from(count));
        phase
    }

    /// Prints lines above the phase.
    pub(crate) fn above(&self, print: impl FnOnce()) {
        self.0.suspend(print);
    }

    /// Shows that `finished` steps are done.
    pub(crate) fn step(&self, finished: u32) {
        self.0.set_position(u64::from(finished));
    }

    /// Replaces the text.
    pub(crate) fn say(&self, text: String) {
        self.0.set_message(text);
    }

    fn draw(text: &str, template: &str, keys: impl FnOnce(ProgressStyle) -> ProgressStyle) -> Self {
        let bar = ProgressBar::new_spinner();
        // The templates are constants; should one ever be wrong, the default style still shows the phase.
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(keys(style));
        }
        bar.set_message(text.to_owned());
        bar.tick();
        bar.enable_steady_tick(REDRAW_EVERY);
        Self(bar)
    }
}

impl Drop for Phase {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
