//! ctrl-C: once stops after the current press, twice aborts, three times leaves at once.

use std::sync::atomic::{AtomicU8, Ordering};

static PRESSED: AtomicU8 = AtomicU8::new(0);

/// Calls `react` with 1, 2, 3, ... each time ctrl-C is pressed, from a thread of its own, until the program ends.
///
/// # Errors
/// A message when the system refuses the thread or the handler.
pub fn on_ctrl_c(react: impl Fn(u8) + Send + 'static) -> Result<(), String> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_io()
        .build()
        .map_err(|e| format!("cannot listen for ctrl-C: {e}"))?;
    std::thread::Builder::new()
        .name("ctrl-c".into())
        .spawn(move || {
            runtime.block_on(async {
                while tokio::signal::ctrl_c().await.is_ok() {
                    react(PRESSED.fetch_add(1, Ordering::SeqCst).saturating_add(1));
                }
            });
        })
        .map(drop)
        .map_err(|e| format!("cannot listen for ctrl-C: {e}"))
}
