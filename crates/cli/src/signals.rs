//! ctrl-C: once stops after the current press, twice aborts, three times halts. A polite end by the system (SIGTERM)
//! and a terminal that goes away (SIGHUP) count as a ctrl-C: the robot must not stay in the skin. Who started the
//! program with `nohup` said that it outlives its terminal: then SIGHUP stays ignored. Every other signal that would end the
//! program without a word counts too, SIGQUIT (ctrl-\) and a used up limit of processor time as two: those retract at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use skinrig_controller::ControlHandle;

use crate::exit::Exit;

static PRESSED: AtomicU8 = AtomicU8::new(0);

/// The operator at this terminal, with a hand on the run from before the first device is opened. Clones are the same one.
#[derive(Clone)]
pub(crate) struct Operator {
    control: ControlHandle,
    over: Arc<AtomicBool>,
    asked: Arc<AtomicBool>,
    of_suite: bool,
    attended: bool,
}

/// The system refused the handler of signals, or its thread.
#[derive(Debug, thiserror::Error)]
#[error("cannot listen for ctrl-C: {0}")]
pub(crate) struct SignalError(#[from] std::io::Error);

/// What ctrl-C is answered with, once, twice and three times.
type Words = [&'static str; 3];

const OF_RUN: Words = [
    "stopping after this press; ctrl-C again retracts and stops now",
    "retracting and stopping now; ctrl-C again switches the motors off where the tip is",
    "switching the motors off where the tip is, and closing the session",
];

const OF_SUITE: Words = [
    "ending the suite with this check; later checks stay open. ctrl-C again aborts a golden campaign",
    "retracting, and ending the suite; ctrl-C again switches the motors off where the tip is",
    "switching the motors off where the tip is, and ending the suite",
];

impl Operator {
    /// Listens from now on. What is asked for before the run begins is heard when it does.
    ///
    /// # Errors
    /// As `on_ctrl_c`.
    pub(crate) fn listen() -> Result<Self, SignalError> {
        Self::answering(OF_RUN, false)
    }

    /// As [`listen`](Self::listen), for a suite of checks: it goes on when a run in it is over.
    ///
    /// # Errors
    /// As [`on_ctrl_c`].
    pub(crate) fn of_suite() -> Result<Self, SignalError> {
        Self::answering(OF_SUITE, true)
    }

    /// An operator at no terminal: `control` alone ends the run, signals keep their meaning, and no progress is shown.
    pub(crate) fn elsewhere(control: ControlHandle) -> Self {
        Self {
            control,
            over: Arc::default(),
            asked: Arc::default(),
            of_suite: false,
            attended: false,
        }
    }

    fn answering(words: Words, of_suite: bool) -> Result<Self, SignalError> {
        let flag = || Arc::new(AtomicBool::new(false));
        let (control, over, asked) = (ControlHandle::new(), flag(), flag());
        let (hand, is_over, is_asked) = (control.clone(), Arc::clone(&over), Arc::clone(&asked));
        on_ctrl_c(move |times| {
            if is_over.load(Ordering::SeqCst) {
                // Nothing moves any more and the session is closed.
                std::process::exit(i32::from(Exit::Stopped.code()));
            }
            is_asked.store(true, Ordering::SeqCst);
            if let Some(words) = words.get(usize::from(times) - 1) {
                errln!("\n{words}");
            }
            match times {
                1 => hand.stop(),
                2 => hand.abort(),
                3 => hand.halt(),
                _ => errln!(
                    "\nclosing the session; if nothing happens, press the force button of the robot"
                ),
            }
        })?;
        Ok(Self {
            control,
            over,
            asked,
            of_suite,
            attended: true,
        })
    }

    /// The hand on the run.
    #[must_use]
    pub(crate) const fn control(&self) -> &ControlHandle {
        &self.control
    }

    /// True if there is a terminal to show the run on.
    #[must_use]
    pub(crate) const fn is_attended(&self) -> bool {
        self.attended
    }

    /// Whether ctrl-C was pressed, or the system asked for an end.
    #[must_use]
    pub(crate) fn asked(&self) -> bool {
        self.asked.load(Ordering::SeqCst)
    }

    /// The run is over and its session closed: from now on ctrl-C leaves the program. Within a suite it does not.
    pub(crate) fn run_is_over(&self) {
        self.over.store(!self.of_suite, Ordering::SeqCst);
    }
}

/// Calls `react` with 1, 2, 3, ... each time ctrl-C is pressed, from a thread of its own, until the program ends.
///
/// # Errors
/// When the system refuses the thread or the handler.
pub(crate) fn on_ctrl_c(react: impl Fn(u8) + Send + 'static) -> Result<(), SignalError> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_io()
        .build()?;
    // Registered here, so that no signal finds the program without a handler once this returns.
    let mut signals = {
        let _inside = runtime.enter();
        Signals::new()?
    };
    std::thread::Builder::new()
        .name("ctrl-c".into())
        .spawn(move || {
            runtime.block_on(async {
                loop {
                    let least = signals.next().await;
                    let pressed = PRESSED.load(Ordering::SeqCst).saturating_add(1).max(least);
                    PRESSED.store(pressed, Ordering::SeqCst);
                    react(pressed);
                }
            });
        })?;
    Ok(())
}

/// What asks for an end, each with the count of ctrl-C that it is at least.
#[cfg(unix)]
struct Signals(Vec<(tokio::signal::unix::Signal, u8)>);

#[cfg(unix)]
impl Signals {
    fn new() -> std::io::Result<Self> {
        use rustix::process::Signal;
        use tokio::signal::unix::{SignalKind, signal};
        let mut wanted = vec![
            (Signal::QUIT, 2),
            (Signal::XCPU, 2),
            (Signal::INT, 1),
            (Signal::TERM, 1),
            (Signal::USR1, 1),
            (Signal::USR2, 1),
            (Signal::ALARM, 1),
            (Signal::VTALARM, 1),
            (Signal::PROF, 1),
            #[cfg(target_os = "linux")]
            (Signal::IO, 1),
            #[cfg(target_os = "linux")]
            (Signal::POWER, 1),
        ];
        if !hangup_is_ignored() {
            wanted.push((Signal::HUP, 1));
        }
        let listen =
            |(kind, least): (Signal, u8)| Ok((signal(SignalKind::from_raw(kind.as_raw()))?, least));
        Ok(Self(
            wanted
                .into_iter()
                .map(listen)
                .collect::<std::io::Result<_>>()?,
        ))
    }

    /// Waits for the next one; the gravest first.
    async fn next(&mut self) -> u8 {
        std::future::poll_fn(|context| {
            for (signal, least) in &mut self.0 {
                if signal.poll_recv(context).is_ready() {
                    return std::task::Poll::Ready(*least);
                }
            }
            std::task::Poll::Pending
        })
        .await
    }
}

/// Makes a file that grows beyond the limit of the process (`ulimit -f`) an error of the write, as a full disk is one. Without
/// this the system ends the program by SIGXFSZ, with the robot wherever it is.
pub(crate) fn take_file_limits_as_errors() {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .build();
        // What cannot be listened to keeps its meaning; no command works less well for it.
        let Ok(runtime) = runtime else { return };
        let _inside = runtime.enter();
        // The handler stays for the rest of the process; nobody needs to hear from it.
        let _ = signal(SignalKind::from_raw(rustix::process::Signal::XFSZ.as_raw()));
    }
}

/// True when the parent left SIGHUP ignored, as `nohup` does. Linux tells it without a system call that Rust calls
/// unsafe: bit n - 1 of `SigIgn` in proc_pid_status(5). Elsewhere it is not known, and SIGHUP stops the run.
#[cfg(unix)]
fn hangup_is_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    ignored_signals(&status).is_some_and(|mask| mask & 1 != 0) // SIGHUP is 1
}

/// The mask of ignored signals in the text of `/proc/PID/status`.
#[cfg(unix)]
fn ignored_signals(status: &str) -> Option<u64> {
    let mask = status.lines().find_map(|l| l.strip_prefix("SigIgn:"))?;
    u64::from_str_radix(mask.trim(), 16).ok()
}

/// What asks for an end.
#[cfg(windows)]
struct Signals(tokio::signal::windows::CtrlC);

#[cfg(windows)]
impl Signals {
    fn new() -> std::io::Result<Self> {
        tokio::signal::windows::ctrl_c().map(Self)
    }

    async fn next(&mut self) -> u8 {
        match self.0.recv().await {
            Some(()) => 1,
            // The system has no more of them.
            None => std::future::pending().await,
        }
    }
}
