//! The seam below the driver: bytes to and from a box, over a serial port or a script.

use std::io;
use std::time::{Duration, Instant};

/// An open line to a box.
pub trait Wire: Send {
    /// Writes all of a short frame.
    ///
    /// # Errors
    /// Anything that the line says; the line is then given up.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Reads what has come, waiting for `patience` at most; 0 when nothing came.
    ///
    /// # Errors
    /// As for [`Wire::write`].
    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize>;
}

/// Opens lines to one box, again and again.
pub trait Dial: Send {
    /// Where the line goes, for messages.
    fn target(&self) -> &str;

    /// Opens the line.
    ///
    /// # Errors
    /// [`OpenError`].
    fn dial(&mut self) -> Result<Box<dyn Wire>, OpenError>;
}

/// From one attempt to open a busy line to the next.
const BUSY_INTERVAL: Duration = Duration::from_millis(50);

/// Opens a line, and waits for `patience` while another program has it: whatever looks at new serial ports (a modem
/// manager) does so for a moment, and a port is released only when the last process that inherited it lets go.
///
/// # Errors
/// [`OpenError`].
pub(crate) fn dial_patiently(
    dial: &mut dyn Dial,
    patience: Duration,
) -> Result<Box<dyn Wire>, OpenError> {
    let end = Instant::now() + patience;
    loop {
        match dial.dial() {
            Err(OpenError::Busy(_)) if Instant::now() < end => std::thread::sleep(BUSY_INTERVAL),
            other => return other,
        }
    }
}

/// Why a line could not be opened.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OpenError {
    /// No such port.
    #[error(
        "{0}: no such port: plug the box in, and look for its name under /dev/serial/by-id or with `dmesg`"
    )]
    Absent(String),
    /// Another program has it.
    #[error("{0}: busy: another program has opened it; end that program (`fuser -v {0}` names it)")]
    Busy(String),
    /// The user may not open it.
    #[error(
        "{0}: not permitted: join the group that owns it (`sudo usermod -aG dialout $USER`, then log in again)"
    )]
    NotPermitted(String),
    /// Anything else.
    #[error("{port}: cannot be opened: {detail}")]
    Other {
        /// Which port.
        port: String,
        /// What the system said.
        detail: String,
    },
}
