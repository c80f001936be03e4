//! Messages between the library or control client and the firmware: one JSON value per line, one reply per request.

use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use skinrig_drd_abi::ErrorCode;

use crate::config::{Contact, Fault, Setting, When};

/// Time limit of a reply; exceeded only if the firmware is gone.
const REPLY_WITHIN: Duration = Duration::from_secs(20);

/// A request to the firmware process.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Request {
    /// Introduces the process for which a library drives the arm.
    Hello {
        /// Process id.
        pid: u32,
    },
    /// A call about one device.
    Device {
        /// Index in the enumeration.
        index: usize,
        /// The call.
        call: Call,
    },
    /// Number of connected devices, and of free ones: two values.
    Count,
    /// A request of the control client.
    Control(Control),
}

/// A call about one device.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Call {
    /// Opens the device.
    Open,
    /// Closes the device.
    Close,
    /// Values: type, serial (negative if unreadable), firmware version, memory test passed, supported.
    Identity,
    /// Values: the status vector.
    Status,
    /// Whether it is calibrated: one value.
    Initialised,
    /// Starts the calibration, which runs until [`ArmState::initialising`](crate::ArmState) is false.
    AutoInit,
    /// Starts the sweep of the end stops.
    CheckInit,
    /// Starts regulation.
    Start,
    /// Stops the regulation; `keep_force` leaves the motors on.
    Stop {
        /// Leave the motors on.
        keep_force: bool,
    },
    /// Motors off, brake.
    Brake,
    /// Motor power on or off.
    Force(bool),
    /// Brake on or off.
    Brakes(bool),
    /// Straight line to a point, m.
    Move([f64; 3]),
    /// Filtered target, m.
    Track([f64; 3]),
    /// Holds the position.
    Hold,
    /// Sets a parameter.
    Set(Setting, Vec<f64>),
    /// Reads a parameter.
    Get(Setting),
}

/// Requests of the control client.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Control {
    /// Injects a fault.
    Inject(When, Fault),
    /// Clears all faults.
    ClearFaults,
    /// Replaces or removes the sample under the tip.
    SetContact(Option<Contact>),
    /// Moves the tip by hand, m, at rest.
    Place([f64; 3]),
}

/// A reply.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reply {
    /// Result of the call; negative for failure.
    pub rc: i32,
    /// Error code of a failure.
    pub code: i32,
    /// Requested values.
    pub values: Vec<f64>,
}

impl Reply {
    /// Success without values.
    pub fn ok() -> Self {
        Self::values(Vec::new())
    }

    /// Success with values.
    pub fn values(values: Vec<f64>) -> Self {
        Self {
            rc: 0,
            code: 0,
            values,
        }
    }

    /// Failure.
    pub fn failed(code: ErrorCode) -> Self {
        Self {
            rc: -1,
            code: code.0,
            values: Vec::new(),
        }
    }
}

/// One end of a connection.
#[derive(Debug)]
pub struct Connection {
    stream: BufReader<UnixStream>,
}

impl Connection {
    /// Takes over an accepted connection.
    pub fn new(stream: UnixStream) -> Self {
        Self {
            stream: BufReader::new(stream),
        }
    }

    /// Connects to the firmware of the arm in `directory`.
    pub fn connect(directory: &Path) -> io::Result<Self> {
        let stream = UnixStream::connect(directory.join(crate::file::SOCKET))?;
        stream.set_read_timeout(Some(REPLY_WITHIN))?;
        stream.set_write_timeout(Some(REPLY_WITHIN))?;
        Ok(Self::new(stream))
    }

    /// Sends one message.
    pub fn send(&mut self, message: &impl Serialize) -> io::Result<()> {
        let mut line = serde_json::to_vec(message)?;
        line.push(b'\n');
        self.stream.get_mut().write_all(&line)
    }

    /// Receives one message; `None` when the other end has closed.
    pub fn receive<T: DeserializeOwned>(&mut self) -> io::Result<Option<T>> {
        let mut line = String::new();
        if self.stream.read_line(&mut line)? == 0 {
            return Ok(None);
        }
        Ok(Some(serde_json::from_str(&line)?))
    }

    /// Sends a request and waits for its reply.
    pub fn request(&mut self, request: &Request) -> io::Result<Reply> {
        self.send(request)?;
        self.receive()?
            .ok_or_else(|| io::ErrorKind::UnexpectedEof.into())
    }
}
