//! The line as a serial port.

use std::io::{self, Read, Write};
use std::path::Path;
use std::time::Duration;

use serialport::{ClearBuffer, SerialPort};

use crate::protocol::BAUD_RATE;
use crate::wire::{Dial, OpenError, Wire};

/// How long a write may wait for room in the system's buffer.
const WRITE_PATIENCE: Duration = Duration::from_millis(200);

/// Opens a serial port by its path; a path under `/dev/serial/by-id` stays the same across unplugging.
#[derive(Debug, Clone)]
pub struct SerialDial {
    path: String,
}

impl SerialDial {
    /// The port at this path.
    #[must_use]
    pub fn new(path: impl Into<String>) -> Self {
        Self { path: path.into() }
    }
}

impl Dial for SerialDial {
    fn target(&self) -> &str {
        &self.path
    }

    fn dial(&mut self) -> Result<Box<dyn Wire>, OpenError> {
        let port = serialport::new(&self.path, BAUD_RATE)
            .timeout(WRITE_PATIENCE)
            .open()
            .map_err(|e| self.explain(&e))?;
        // What the system kept for somebody before us. A port that cannot forget it only costs us bad frames.
        let _ = port.clear(ClearBuffer::All);
        Ok(Box::new(SerialWire { port }))
    }
}

impl SerialDial {
    fn explain(&self, error: &serialport::Error) -> OpenError {
        let port = self.path.clone();
        match error.kind() {
            serialport::ErrorKind::Io(io::ErrorKind::NotFound) => OpenError::Absent(port),
            serialport::ErrorKind::Io(io::ErrorKind::PermissionDenied) => {
                OpenError::NotPermitted(port)
            }
            // Both of the port's locks are reported like this, and so is a missing port on some systems.
            serialport::ErrorKind::NoDevice if Path::new(&self.path).exists() => {
                OpenError::Busy(port)
            }
            serialport::ErrorKind::NoDevice => OpenError::Absent(port),
            _ => OpenError::Other {
                port,
                detail: error.to_string(),
            },
        }
    }
}

struct SerialWire {
    port: Box<dyn SerialPort>,
}

impl Wire for SerialWire {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        // The port's timeout guards the wait for room only; a frame is so short that it then fits at once.
        self.port.set_timeout(WRITE_PATIENCE)?;
        self.port.write_all(bytes)
    }

    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        self.port.set_timeout(patience)?;
        match self.port.read(buffer) {
            Ok(0) => Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(n) => Ok(n),
            Err(e)
                if matches!(
                    e.kind(),
                    io::ErrorKind::TimedOut | io::ErrorKind::Interrupted
                ) =>
            {
                Ok(0)
            }
            Err(e) => Err(e),
        }
    }
}
