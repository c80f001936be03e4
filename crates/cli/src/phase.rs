//! What a terminal shows while a command computes: the phase, how much it has read, and since when.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressState, ProgressStyle};

/// A phase is redrawn this often.
const REDRAW_EVERY: Duration = Duration::from_millis(100);

/// A phase of a command, shown on standard error until it is dropped; nothing is shown where that is no terminal.
pub(crate) struct Phase(ProgressBar);

impl Phase {
    /// A phase that cannot tell how far it is.
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
                    // Nothing can be done about a terminal that takes no text.
                    let _ = write!(out, "{megabytes} MB");
                },
            )
        })
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
