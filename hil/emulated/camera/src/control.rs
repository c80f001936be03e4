//! Controls the devices of a bus from any process, including the one under test: plugging, faults, counters, journals.
//!
//! One line of JSON per request and per reply, on the Unix stream socket `ROOT/control`.

use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

use serde::{Deserialize, Serialize};

pub use crate::evk1::Counters;
pub use crate::usb::queues::DeliveryTotals;
use crate::usb::usbfs::Setup;

/// Environment variable with the folder of the bus, for processes under test.
pub(crate) const ROOT_VARIABLE: &str = "UMOCKDEV_DIR";

/// A vendor request that reached a device.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Request {
    /// bRequest.
    pub request: u8,
    /// wValue.
    pub value: u16,
    /// wIndex.
    pub index: u16,
    /// Whether the transfer is from device to host.
    pub is_in: bool,
    /// Data from the host.
    pub data: Vec<u8>,
}

impl Request {
    pub(crate) fn new(setup: Setup, data: &[u8]) -> Self {
        Self {
            request: setup.request,
            value: setup.value,
            index: setup.index,
            is_in: setup.is_in(),
            data: data.to_vec(),
        }
    }

    /// Address in a register request.
    #[must_use]
    pub const fn register(&self) -> u32 {
        (self.index as u32) << 16 | self.value as u32
    }

    /// Value in a register write (request 0x56).
    #[must_use]
    pub fn written_value(&self) -> Option<u32> {
        let value = <[u8; 4]>::try_from(&self.data[..]).ok()?;
        (self.request == 0x56 && !self.is_in).then(|| u32::from_be_bytes(value))
    }
}

/// Observable state of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Observation {
    /// Data delivered to the host.
    pub delivered: DeliveryTotals,
    /// Its counters.
    pub counters: Counters,
}

/// A request to a device.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DeviceCommand {
    /// Unplugs the cable.
    Unplug,
    /// Plugs the cable in again: the same device at the same port, after a power-up.
    Plug,
    /// Stalls the data endpoint until the host clears it.
    Stall,
    /// Ends the next transfer this many bytes early; the following transfer has them.
    Cut(usize),
    /// Inserts these words into the next packet.
    Garbage(Vec<u32>),
    /// Number of words lost at the end of every packet, as with a full camera buffer; 0 is normal.
    #[serde(rename = "lose")]
    DropWords(usize),
    /// Number of pixels with an event every millisecond; 0 is normal.
    HotPixels(u16),
    /// Makes this register ignore writes.
    #[serde(rename = "stick")]
    IgnoreWrites(u32),
    /// Whether control requests stay unanswered.
    Silence(bool),
    /// Whether register reads report failure.
    FailReads(bool),
    /// Whether resets of the port fail.
    FailResets(bool),
    /// Fails one transfer, with a loss of its bytes, after this many more transfers.
    BreakTransfer(u32),
    /// An edge at a trigger input, in ns of the monotonic clock.
    Edge {
        /// The input.
        channel: u8,
        /// Whether it is a rising edge.
        rising: bool,
        /// Time.
        at_ns: i64,
    },
    /// Reads the counters.
    Observe,
    /// Reads the journal of vendor requests.
    Journal,
    /// Reads the value of a register, without a USB request.
    Register(u32),
    /// Sets the board's temperature, in 1/4096 °C.
    Temperature(u32),
}

/// A reply.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    /// Done.
    Done,
    /// To [`DeviceCommand::Observe`].
    Observed(Observation),
    /// To [`DeviceCommand::Journal`].
    Journal(Vec<Request>),
    /// To [`DeviceCommand::Register`].
    Register(u32),
    /// Failure.
    Failed(String),
}

/// A request with the serial number of the device.
pub(crate) type AddressedCommand = (String, DeviceCommand);

/// A connection to the emulator.
#[derive(Debug)]
pub struct Remote {
    root: PathBuf,
    line: Mutex<BufReader<UnixStream>>,
}

impl Remote {
    /// Connects to the bus in this folder.
    ///
    /// # Errors
    /// When the bus does not accept connections.
    pub fn connect(root: &Path) -> io::Result<Self> {
        let stream = UnixStream::connect(root.join("control"))?;
        stream.set_read_timeout(Some(Duration::from_secs(20)))?;
        Ok(Self {
            root: root.to_owned(),
            line: Mutex::new(BufReader::new(stream)),
        })
    }

    /// Connects to the bus of this process; `None` if it has none.
    ///
    /// # Errors
    /// When that bus does not accept connections.
    pub(crate) fn from_environment() -> io::Result<Option<Self>> {
        std::env::var_os(ROOT_VARIABLE)
            .map(|root| Self::connect(Path::new(&root)))
            .transpose()
    }

    /// The folder of the bus.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Sends a request to a device and waits until it is done.
    ///
    /// # Errors
    /// When the emulator is gone or the request fails.
    pub fn order(&self, serial: &str, order: DeviceCommand) -> io::Result<Answer> {
        let mut line = self
            .line
            .lock()
            .map_err(|e| io::Error::other(e.to_string()))?;
        let mut text = serde_json::to_string(&(serial, order))?;
        text.push('\n');
        line.get_mut().write_all(text.as_bytes())?;
        let mut answer = String::new();
        line.read_line(&mut answer)?;
        match serde_json::from_str(&answer)? {
            Answer::Failed(what) => Err(io::Error::other(what)),
            answer => Ok(answer),
        }
    }

    /// Data delivered and counters of a camera.
    ///
    /// # Errors
    /// As [`order`](Self::order).
    pub fn observe(&self, serial: &str) -> io::Result<Observation> {
        match self.order(serial, DeviceCommand::Observe)? {
            Answer::Observed(observed) => Ok(observed),
            other => Err(unexpected(&other)),
        }
    }

    /// All vendor requests that reached a device.
    ///
    /// # Errors
    /// As [`order`](Self::order).
    pub fn journal(&self, serial: &str) -> io::Result<Vec<Request>> {
        match self.order(serial, DeviceCommand::Journal)? {
            Answer::Journal(requests) => Ok(requests),
            other => Err(unexpected(&other)),
        }
    }

    /// The value of a register.
    ///
    /// # Errors
    /// As [`order`](Self::order).
    pub fn register(&self, serial: &str, address: u32) -> io::Result<u32> {
        match self.order(serial, DeviceCommand::Register(address))? {
            Answer::Register(value) => Ok(value),
            other => Err(unexpected(&other)),
        }
    }

    /// Injects an edge at a trigger input at `at_ns` of the monotonic clock
    /// ([`now_ns`](crate::world::now_ns)). Send it early enough, or it arrives late in the stream.
    ///
    /// # Errors
    /// As [`order`](Self::order).
    pub fn edge(&self, serial: &str, channel: u8, rising: bool, at_ns: i64) -> io::Result<()> {
        let edge = DeviceCommand::Edge {
            channel,
            rising,
            at_ns,
        };
        self.order(serial, edge).map(drop)
    }
}

fn unexpected(answer: &Answer) -> io::Error {
    io::Error::other(format!(
        "expected the reply to the request, found {answer:?}"
    ))
}
