//! ctrl-C: once stops after the current press, twice aborts, three times leaves at once. A polite end by the
//! system (SIGTERM) and a terminal that goes away (SIGHUP) count as a ctrl-C: the robot must not stay in the skin.

use std::sync::atomic::{AtomicU8, Ordering};

static PRESSED: AtomicU8 = AtomicU8::new(0);

/// Calls `react` with 1, 2, 3, ... each time ctrl-C is pressed, from a thread of its own, until the program ends.
///
/// # Errors
/// A message when the system refuses the thread or the handler.
pub fn on_ctrl_c(react: impl Fn(u8) + Send + 'static) -> Result<(), String> {
    let refused = |e: std::io::Error| format!("cannot listen for ctrl-C: {e}");
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_io()
        .build()
        .map_err(refused)?;
    // Registered here, so that no signal finds the program without a handler once this returns.
    let mut signals = {
        let _inside = runtime.enter();
        Signals::new().map_err(refused)?
    };
    std::thread::Builder::new()
        .name("ctrl-c".into())
        .spawn(move || {
            runtime.block_on(async {
                while signals.next().await.is_some() {
                    react(PRESSED.fetch_add(1, Ordering::SeqCst).saturating_add(1));
                }
            });
        })
        .map(drop)
        .map_err(refused)
}

/// What asks for an end.
#[cfg(unix)]
struct Signals([tokio::signal::unix::Signal; 3]);

#[cfg(unix)]
impl Signals {
    fn new() -> std::io::Result<Self> {
        use tokio::signal::unix::{SignalKind, signal};
        Ok(Self([
            signal(SignalKind::interrupt())?,
            signal(SignalKind::terminate())?,
            signal(SignalKind::hangup())?,
        ]))
    }

    async fn next(&mut self) -> Option<()> {
        let [interrupt, terminate, hangup] = &mut self.0;
        tokio::select! {
            seen = interrupt.recv() => seen,
            seen = terminate.recv() => seen,
            seen = hangup.recv() => seen,
        }
    }
}

/// What asks for an end.
#[cfg(windows)]
struct Signals(tokio::signal::windows::CtrlC);

#[cfg(windows)]
impl Signals {
    fn new() -> std::io::Result<Self> {
        tokio::signal::windows::ctrl_c().map(Self)
    }

    async fn next(&mut self) -> Option<()> {
        self.0.recv().await
    }
}
