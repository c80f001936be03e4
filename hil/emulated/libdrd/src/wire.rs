//! Messages between library or control client and firmware: one JSON value per line, one reply per request.

use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use skinrig_drd_abi::ErrorCode;

use crate::config::{Contact, Fault, Setting, When};

/// No reply takes longer than this unless the firmware is gone.
const REPLY_WITHIN: Duration = Duration::from_secs(20);

/// What is asked of the firmware process.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Request {
    /// A library introduces the process that it drives the arm for.
    Hello {
        /// Process id.
        pid: u32,
    },
    /// A call about one device.
    Device {
        /// Place in the enumeration.
        index: usize,
        /// The call.
        call: Call,
    },
    /// How many devices are connected, and how many of them free: two values.
    Count,
    /// From the control client.
    Control(Control),
}

/// A call about one device.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Call {
    /// Takes the device.
    Open,
    /// Gives it back.
    Close,
    /// Values: type, serial (negative if unreadable), firmware version, memory fine, supported.
    Identity,
    /// Values: the status vector.
    Status,
    /// Whether it is calibrated: one value.
    Initialised,
    /// Begins the calibration; it goes on until [`ArmState::initialising`](crate::ArmState) is false.
    AutoInit,
    /// Begins the sweep of the end stops.
    CheckInit,
    /// Starts regulation.
    Start,
    /// Stops regulation; `keep_force` leaves the motors on.
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
    /// Hold here.
    Hold,
    /// Sets a parameter.
    Set(Setting, Vec<f64>),
    /// Reads a parameter.
    Get(Setting),
}

/// From the control client.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Control {
    /// Makes something go wrong.
    Inject(When, Fault),
    /// Repairs everything.
    ClearFaults,
    /// Puts another sample under the tip, or none.
    SetContact(Option<Contact>),
    /// Puts the tip elsewhere by hand, m, at rest.
    Place([f64; 3]),
}

/// What comes back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reply {
    /// Result of the call; negative for failure.
    pub rc: i32,
    /// Error code of a failure.
    pub code: i32,
    /// What was asked for.
    pub values: Vec<f64>,
}

impl Reply {
    /// Success without more.
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
    pub fn ask(&mut self, request: &Request) -> io::Result<Reply> {
        self.send(request)?;
        self.receive()?
            .ok_or_else(|| io::ErrorKind::UnexpectedEof.into())
    }
}
