//! Byte stream to a box: a trait for serial ports and scripted tests.

use std::io;
use std::time::{Duration, Instant};

/// An open line to a box.
pub trait Wire: Send {
    /// Writes a short frame completely.
    ///
    /// # Errors
    /// Any error of the line, which is then closed.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Reads available bytes, waiting up to `timeout`; 0 on timeout.
    ///
    /// # Errors
    /// As for [`Wire::write`].
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize>;
}

/// Opens lines to one box, repeatedly.
pub trait Connector: Send {
    /// Name of the target, for messages.
    fn target(&self) -> &str;

    /// Opens the line.
    ///
    /// # Errors
    /// [`OpenError`].
    fn connect(&mut self) -> Result<Box<dyn Wire>, OpenError>;
}

/// Interval of attempts to open a busy line.
const BUSY_INTERVAL: Duration = Duration::from_millis(50);

/// Opens a line and waits up to `timeout` while another program has it open: modem managers probe new serial ports for a moment, and a
/// port stays open until the last process that inherited it closes it.
///
/// # Errors
/// [`OpenError`].
pub(crate) fn connect_when_free(
    connector: &mut dyn Connector,
    timeout: Duration,
) -> Result<Box<dyn Wire>, OpenError> {
    let end = Instant::now() + timeout;
    loop {
        match connector.connect() {
            Err(OpenError::Busy(_)) if Instant::now() < end => std::thread::sleep(BUSY_INTERVAL),
            other => return other,
        }
    }
}

/// Why a line could not be opened.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OpenError {
    /// The port does not exist.
    #[error(
        "{0}: no such port: connect the box, and look for its name under /dev/serial/by-id or with `dmesg`"
    )]
    Absent(String),
    /// Another program has it open.
    #[error("{0}: busy: another program has opened it; end that program (`fuser -v {0}` names it)")]
    Busy(String),
    /// The operating system denies access.
    #[error(
        "{0}: not permitted: join the group that owns it (`sudo usermod -aG dialout $USER`, then log in again)"
    )]
    NotPermitted(String),
    /// Another error.
    #[error("{port}: cannot be opened: {detail}")]
    Other {
        /// Path of the port.
        port: String,
        /// Error of the operating system.
        detail: String,
    },
}
