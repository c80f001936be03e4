//! Control client: starts an emulated arm, reads its true state, and injects faults.

use std::fs;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use tempfile::TempDir;

use crate::config::{ArmConfig, Contact, Fault, When};
use crate::journal::Journal;
use crate::page::{ArmState, Page};
use crate::wire::{Connection, Control, Request};
use crate::{FIRMWARE_VARIABLE, entry, file};

/// Polling interval of waits.
const POLL_INTERVAL: Duration = Duration::from_micros(500);

/// Read-only view of a running arm from any process.
#[derive(Debug)]
pub struct ArmView {
    page: Page,
}

impl ArmView {
    /// Attaches to the arm in `directory`.
    ///
    /// # Errors
    /// When no arm runs there.
    pub fn attach(directory: &Path) -> io::Result<Self> {
        Page::open(&directory.join(file::PAGE)).map(|page| Self { page })
    }

    /// State of the arm, at most one millisecond old on an idle machine. Takes well below a microsecond.
    ///
    /// # Errors
    /// When the firmware died.
    pub fn state(&self) -> io::Result<ArmState> {
        let connection_lost = || {
            io::Error::new(
                io::ErrorKind::BrokenPipe,
                "the firmware of the emulated arm died",
            )
        };
        self.page.read().ok_or_else(connection_lost)
    }
}

/// An arm with its firmware process; dropping it ends both.
#[derive(Debug)]
pub struct EmulatedArm {
    // Declared first, so that the firmware ends before its directory is removed.
    firmware: Firmware,
    connection: Mutex<Connection>,
    view: ArmView,
    directory: TempDir,
}

/// The firmware process; killed on drop.
#[derive(Debug)]
struct Firmware(Child);

impl Drop for Firmware {
    fn drop(&mut self) {
        // Both fail only if the process has already ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl EmulatedArm {
    /// Starts the firmware of an arm in a new directory with a copy of the library.
    ///
    /// # Errors
    /// When the library was not built beside this executable, the process cannot be started, or the
    /// configuration is invalid.
    pub fn spawn(config: &ArmConfig) -> io::Result<Self> {
        assert_ne!(entry::link_entry(), 0, "the linker kept the entry");
        let directory = tempfile::Builder::new().prefix("arm-").tempdir()?;
        fs::write(
            directory.path().join(file::CONFIG),
            serde_json::to_vec_pretty(config)?,
        )?;
        fs::copy(
            library_beside_this_executable()?,
            directory.path().join(file::LIBRARY),
        )?;
        let child = Command::new(std::env::current_exe()?)
            .env(FIRMWARE_VARIABLE, directory.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let mut firmware = Firmware(child);
        let mut ready = String::new();
        if let Some(output) = firmware.0.stdout.take() {
            BufReader::new(output).read_line(&mut ready)?;
        }
        if ready != "ready\n" {
            let status = firmware.0.wait()?;
            let fault =
                format!("the firmware of the emulated arm did not start: {status}, {ready:?}");
            return Err(io::Error::other(fault));
        }
        Ok(Self {
            connection: Mutex::new(Connection::connect(directory.path())?),
            view: ArmView::attach(directory.path())?,
            directory,
            firmware,
        })
    }

    /// The library that drives this arm, for the loader.
    #[must_use]
    pub fn library(&self) -> PathBuf {
        self.directory.path().join(file::LIBRARY)
    }

    /// Directory of the arm, for [`ARM_VARIABLE`](crate::ARM_VARIABLE) and [`ArmView::attach`].
    #[must_use]
    pub fn directory(&self) -> &Path {
        self.directory.path()
    }

    /// The firmware's process.
    #[must_use]
    pub fn firmware_pid(&self) -> u32 {
        self.firmware.0.id()
    }

    /// The true state of the arm, see [`ArmView::state`].
    ///
    /// # Errors
    /// When the firmware died.
    pub fn state(&self) -> io::Result<ArmState> {
        self.view.state()
    }

    /// Waits until the arm's state satisfies a condition, and returns it.
    ///
    /// # Errors
    /// [`io::ErrorKind::TimedOut`] after `within`, with the last state; or when the firmware died.
    pub fn wait_until(
        &self,
        within: Duration,
        condition: impl Fn(&ArmState) -> bool,
    ) -> io::Result<ArmState> {
        let started = Instant::now();
        loop {
            let state = self.state()?;
            if condition(&state) {
                return Ok(state);
            }
            if started.elapsed() > within {
                let fault = format!("timed out after {within:?} with the arm in {state:?}");
                return Err(io::Error::new(io::ErrorKind::TimedOut, fault));
            }
            thread::sleep(POLL_INTERVAL);
        }
    }

    /// Injects a fault.
    ///
    /// # Errors
    /// When the firmware died.
    pub fn inject(&self, when: When, fault: Fault) -> io::Result<()> {
        self.control(Control::Inject(when, fault))
    }

    /// Clears all faults, including scheduled ones. Does not undo their effects.
    ///
    /// # Errors
    /// When the firmware died.
    pub fn clear_faults(&self) -> io::Result<()> {
        self.control(Control::ClearFaults)
    }

    /// Replaces or removes the sample under the tip.
    ///
    /// # Errors
    /// When the firmware died.
    pub fn set_contact(&self, contact: Option<Contact>) -> io::Result<()> {
        self.control(Control::SetContact(contact))
    }

    /// Moves the tip by hand to a position, m, at rest.
    ///
    /// # Errors
    /// When the firmware died.
    pub fn place(&self, position_m: [f64; 3]) -> io::Result<()> {
        self.control(Control::Place(position_m))
    }

    /// Journal of all C calls so far.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn journal(&self) -> io::Result<Journal> {
        Journal::read(self.directory.path())
    }

    fn control(&self, control: Control) -> io::Result<()> {
        let mut connection = self
            .connection
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        connection.request(&Request::Control(control)).map(|_| ())
    }
}

/// The `libdrd.so` that Cargo built with this executable.
///
/// # Errors
/// [`io::ErrorKind::NotFound`] if it does not exist.
pub fn library_beside_this_executable() -> io::Result<PathBuf> {
    let name = format!(
        "{}drd{}",
        std::env::consts::DLL_PREFIX,
        std::env::consts::DLL_SUFFIX
    );
    let executable = std::env::current_exe()?;
    // Test executables are in `deps`, like the library; programs are one level above.
    let places = executable
        .parent()
        .into_iter()
        .flat_map(|d| [d.join(&name), d.join("deps").join(&name)]);
    places.into_iter().find(|p| p.exists()).ok_or_else(|| {
        let fault = format!(
            "expected {name} beside {}, found none",
            executable.display()
        );
        io::Error::new(io::ErrorKind::NotFound, fault)
    })
}
