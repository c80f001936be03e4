//! The line over a serial port.

use std::io::{self, Read, Write};
use std::path::Path;
use std::time::Duration;

use serialport::{ClearBuffer, SerialPort};

use crate::protocol::BAUD_RATE;
use crate::wire::{Connector, OpenError, Wire};

/// How long a write may wait for space in the system's buffer.
const WRITE_TIMEOUT: Duration = Duration::from_millis(200);

/// Opens a serial port by path. A path under `/dev/serial/by-id` stays valid across reconnections.
#[derive(Debug, Clone)]
pub struct SerialConnector {
    path: String,
}

impl SerialConnector {
    /// For the port at `path`.
    #[must_use]
    pub fn new(path: impl Into<String>) -> Self {
        Self { path: path.into() }
    }
}

impl Connector for SerialConnector {
    fn target(&self) -> &str {
        &self.path
    }

    fn connect(&mut self) -> Result<Box<dyn Wire>, OpenError> {
        let port = serialport::new(&self.path, BAUD_RATE)
            .timeout(WRITE_TIMEOUT)
            .open()
            .map_err(|e| self.explain(&e))?;
        // Discards data buffered for a previous program. Failure only costs some bad frames.
        let _ = port.clear(ClearBuffer::All);
        Ok(Box::new(SerialWire { port }))
    }
}

impl SerialConnector {
    fn explain(&self, error: &serialport::Error) -> OpenError {
        let port = self.path.clone();
        match error.kind() {
            serialport::ErrorKind::Io(io::ErrorKind::NotFound) => OpenError::Absent(port),
            serialport::ErrorKind::Io(io::ErrorKind::PermissionDenied) => {
                OpenError::NotPermitted(port)
            }
            // Both kinds of port locks are reported like this, and on some systems a missing port too.
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
        // The port's timeout covers the wait for space only; a frame is short enough to fit then.
        self.port.set_timeout(WRITE_TIMEOUT)?;
        self.port.write_all(bytes)
    }

    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        self.port.set_timeout(timeout)?;
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
