//! ctrl-C and other signals: once stops after the current press, twice aborts, three times halts. SIGTERM and a closed terminal
//! (SIGHUP) count as one ctrl-C, because the robot must not stay in the skin. With `nohup` the program is meant to outlive its
//! terminal, so SIGHUP stays ignored. Every other signal that would end the program silently counts too; SIGQUIT (ctrl-\) and an
//! exceeded limit of processor time count as two, which retracts at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use skinrig_controller::ControlHandle;

use crate::exit::Exit;

static PRESSED: AtomicU8 = AtomicU8::new(0);

/// The operator at this terminal, who can end the run from before the first device is opened. Clones share their state.
#[derive(Clone)]
pub(crate) struct Operator {
    control: ControlHandle,
    over: Arc<AtomicBool>,
    requested: Arc<AtomicBool>,
    of_suite: bool,
    attended: bool,
}

/// The signal handler or its thread cannot be set up.
#[derive(Debug, thiserror::Error)]
#[error("cannot listen for ctrl-C: {0}")]
pub(crate) struct SignalError(#[from] std::io::Error);

/// Messages for the first, second and third ctrl-C.
type Messages = [&'static str; 3];

const OF_RUN: Messages = [
    "stopping after this press; ctrl-C again retracts and stops now",
    "retracting and stopping now; ctrl-C again switches the motors off where the tip is",
    "switching the motors off where the tip is, and closing the session",
];

const OF_SUITE: Messages = [
    "ending the suite with this check; later checks stay open. ctrl-C again aborts a golden campaign",
    "retracting, and ending the suite; ctrl-C again switches the motors off where the tip is",
    "switching the motors off where the tip is, and ending the suite",
];

impl Operator {
    /// Handles signals from now on. A request before the run starts takes effect when it does.
    ///
    /// # Errors
    /// As [`on_ctrl_c`].
    pub(crate) fn listen() -> Result<Self, SignalError> {
        Self::with_messages(OF_RUN, false)
    }

    /// Like [`listen`](Self::listen), for a suite of checks, which continues after each run.
    ///
    /// # Errors
    /// As [`on_ctrl_c`].
    pub(crate) fn of_suite() -> Result<Self, SignalError> {
        Self::with_messages(OF_SUITE, true)
    }

    /// An operator without a terminal: only `control` ends the run, signals keep their default effect, and no progress is shown.
    pub(crate) fn elsewhere(control: ControlHandle) -> Self {
        Self {
            control,
            over: Arc::default(),
            requested: Arc::default(),
            of_suite: false,
            attended: false,
        }
    }

    fn with_messages(messages: Messages, of_suite: bool) -> Result<Self, SignalError> {
        let flag = || Arc::new(AtomicBool::new(false));
        let (control, over, requested) = (ControlHandle::new(), flag(), flag());
        let (halter, is_over, requested_flag) =
            (control.clone(), Arc::clone(&over), Arc::clone(&requested));
        on_ctrl_c(move |times| {
            if is_over.load(Ordering::SeqCst) {
                // The robot is at rest and the session is closed.
                errln!(
                    "\nthe session is closed; only its analysis was cut off\n  next: `skinrig analyze` of the session"
                );
                std::process::exit(i32::from(Exit::Stopped.code()));
            }
            requested_flag.store(true, Ordering::SeqCst);
            if let Some(messages) = messages.get(usize::from(times) - 1) {
                errln!("\n{messages}");
            }
            match times {
                1 => halter.stop(),
                2 => halter.abort(),
                3 => halter.halt(),
                _ => errln!(
                    "\nclosing the session; if nothing happens, press the force button of the robot"
                ),
            }
        })?;
        Ok(Self {
            control,
            over,
            requested,
            of_suite,
            attended: true,
        })
    }

    /// The handle that controls the run.
    #[must_use]
    pub(crate) const fn control(&self) -> &ControlHandle {
        &self.control
    }

    /// True if the operator is at a terminal.
    #[must_use]
    pub(crate) const fn is_attended(&self) -> bool {
        self.attended
    }

    /// True if ctrl-C was pressed or another signal requested an end.
    #[must_use]
    pub(crate) fn is_requested(&self) -> bool {
        self.requested.load(Ordering::SeqCst)
    }

    /// Called when the run is over and its session closed: from now on ctrl-C exits the program, except within a suite.
    pub(crate) fn run_is_over(&self) {
        self.over.store(!self.of_suite, Ordering::SeqCst);
    }
}

/// A flag that the first ctrl-C sets; the second ends the program.
///
/// # Errors
/// As [`on_ctrl_c`].
pub(crate) fn leave_on_ctrl_c() -> Result<Arc<AtomicBool>, SignalError> {
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    on_ctrl_c(move |times| {
        if times > 1 {
            std::process::exit(i32::from(Exit::Stopped.code()));
        }
        asked.store(true, Ordering::Relaxed);
    })?;
    Ok(stop)
}

/// Calls `react` with 1, 2, 3, ... each time ctrl-C is pressed, on a separate thread, until the program ends.
///
/// # Errors
/// When the thread or the handler cannot be set up.
pub(crate) fn on_ctrl_c(react: impl Fn(u8) + Send + 'static) -> Result<(), SignalError> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_io()
        .build()?;
    // Registered here, so that every signal has a handler once this returns.
    let mut signals = {
        let _inside = runtime.enter();
        Signals::new()?
    };
    std::thread::Builder::new()
        .name("ctrl-c".into())
        .spawn(move || {
            runtime.block_on(async {
                loop {
                    let min_presses = signals.next().await;
                    let pressed = PRESSED
                        .load(Ordering::SeqCst)
                        .saturating_add(1)
                        .max(min_presses);
                    PRESSED.store(pressed, Ordering::SeqCst);
                    react(pressed);
                }
            });
        })?;
    Ok(())
}

/// Signals that request an end, each with the smallest number of ctrl-C presses that it stands for.
#[cfg(unix)]
struct Signals(Vec<(tokio::signal::unix::Signal, u8)>);

#[cfg(unix)]
impl Signals {
    fn new() -> std::io::Result<Self> {
        use rustix::process::Signal;
        use tokio::signal::unix::{SignalKind, signal};
        let mut kinds = vec![
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
            kinds.push((Signal::HUP, 1));
        }
        let listen = |(kind, min_presses): (Signal, u8)| {
            Ok((signal(SignalKind::from_raw(kind.as_raw()))?, min_presses))
        };
        Ok(Self(
            kinds
                .into_iter()
                .map(listen)
                .collect::<std::io::Result<_>>()?,
        ))
    }

    /// Waits for the next one; the most urgent first.
    async fn next(&mut self) -> u8 {
        std::future::poll_fn(|context| {
            for (signal, min_presses) in &mut self.0 {
                if signal.poll_recv(context).is_ready() {
                    return std::task::Poll::Ready(*min_presses);
                }
            }
            std::task::Poll::Pending
        })
        .await
    }
}

/// Turns exceeding the file size limit of the process (`ulimit -f`) into a write error, like a full disk. Otherwise SIGXFSZ would
/// end the program, wherever the robot is.
pub(crate) fn take_file_limits_as_errors() {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .build();
        // Without a handler the signal keeps its default effect; commands still work.
        let Ok(runtime) = runtime else { return };
        let _inside = runtime.enter();
        // The handler stays for the rest of the process; its notifications are not needed.
        let _ = signal(SignalKind::from_raw(rustix::process::Signal::XFSZ.as_raw()));
    }
}

/// True when the parent left SIGHUP ignored, as `nohup` does. Linux reports it without an unsafe system call: bit n - 1 of
/// `SigIgn` in proc_pid_status(5). Elsewhere it is unknown, and SIGHUP stops the run.
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

/// Events that request an end.
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
            // No further events will come.
            None => std::future::pending().await,
        }
    }
}
