//! Steers the devices of a bus from anywhere, the process under test included: plug, faults, counters, journals.
//!
//! One line of JSON per order and per answer, on the Unix stream socket `ROOT/steer`.

use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::evk1::Counters as Evk1Counters;
use crate::usb::queues::Handed as HandedOver;
use crate::usb::usbfs::Setup;

/// What has been handed to the host from the data endpoint.
pub type Handed = HandedOver;
/// What a camera has counted.
pub type Counters = Evk1Counters;

/// Names the folder of the bus in a process under test.
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
    /// From device to host.
    pub is_in: bool,
    /// What came from the host.
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

    /// The register that a register request is about.
    #[must_use]
    pub const fn register(&self) -> u32 {
        (self.index as u32) << 16 | self.value as u32
    }

    /// The value that a register write (request 0x56) writes.
    #[must_use]
    pub fn written(&self) -> Option<u32> {
        let value = <[u8; 4]>::try_from(&self.data[..]).ok()?;
        (self.request == 0x56 && !self.is_in).then(|| u32::from_be_bytes(value))
    }
}

/// What a camera shows of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Observation {
    /// What the host has.
    pub handed: Handed,
    /// What it counted.
    pub counters: Counters,
}

/// An order for one device.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// Pull the cable.
    Unplug,
    /// Plug it in again: the same device at the same port, powered up anew.
    Plug,
    /// Stall the data endpoint until the host clears it.
    Stall,
    /// The next transfer ends this many bytes early; they follow in the one after it.
    Cut(usize),
    /// Put these words into the next packet.
    Garbage(Vec<u32>),
    /// Every packet loses this many words at its end, as when the camera's buffer is full; 0 is well.
    Lose(usize),
    /// So many pixels make an event every millisecond, whatever they see; 0 is well.
    HotPixels(u16),
    /// Writes to this register do not take.
    Stick(u32),
    /// Whether control requests stay unanswered.
    Silence(bool),
    /// Whether register reads report failure.
    FailReads(bool),
    /// Whether resets of the port fail.
    FailResets(bool),
    /// After so many more transfers with bytes one fails, and its bytes are lost.
    BreakTransfer(u32),
    /// An edge at a trigger input, at a time of the monotonic clock in ns.
    Edge {
        /// The input.
        channel: u8,
        /// True for a rising edge.
        rising: bool,
        /// When.
        at_ns: i64,
    },
    /// Tell what the camera has counted.
    Observe,
    /// Tell every vendor request so far.
    Journal,
    /// Tell the value of a register, without a request.
    Register(u32),
    /// Let the board have this temperature, in 1/4096 °C.
    Temperature(u32),
}

/// The answer to an order.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    /// Done.
    Done,
    /// To [`Order::Observe`].
    Observed(Observation),
    /// To [`Order::Journal`].
    Journal(Vec<Request>),
    /// To [`Order::Register`].
    Register(u32),
    /// It cannot be done.
    Failed(String),
}

/// An order on its way: the serial number of the device, and what to do.
pub(crate) type Addressed = (String, Order);

/// A line to the emulator.
#[derive(Debug)]
pub struct Remote {
    root: PathBuf,
    line: Mutex<BufReader<UnixStream>>,
}

impl Remote {
    /// Connects to the bus in this folder.
    ///
    /// # Errors
    /// When nobody listens there.
    pub fn connect(root: &Path) -> io::Result<Self> {
        let stream = UnixStream::connect(root.join("steer"))?;
        stream.set_read_timeout(Some(Duration::from_secs(20)))?;
        Ok(Self {
            root: root.to_owned(),
            line: Mutex::new(BufReader::new(stream)),
        })
    }

    /// Connects to the bus that this process runs on; `None` when it runs on none.
    ///
    /// # Errors
    /// When it should, and nobody listens there.
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

    /// Gives an order to a device and waits until it is done.
    ///
    /// # Errors
    /// When the emulator is gone or cannot do it.
    pub fn order(&self, serial: &str, order: Order) -> io::Result<Answer> {
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

    /// What a camera has counted.
    ///
    /// # Errors
    /// As [`order`](Self::order).
    pub fn observe(&self, serial: &str) -> io::Result<Observation> {
        match self.order(serial, Order::Observe)? {
            Answer::Observed(seen) => Ok(seen),
            other => Err(unexpected(&other)),
        }
    }

    /// Every vendor request that has reached a device.
    ///
    /// # Errors
    /// As [`order`](Self::order).
    pub fn journal(&self, serial: &str) -> io::Result<Vec<Request>> {
        match self.order(serial, Order::Journal)? {
            Answer::Journal(requests) => Ok(requests),
            other => Err(unexpected(&other)),
        }
    }

    /// The value of a register.
    ///
    /// # Errors
    /// As [`order`](Self::order).
    pub fn register(&self, serial: &str, address: u32) -> io::Result<u32> {
        match self.order(serial, Order::Register(address))? {
            Answer::Register(value) => Ok(value),
            other => Err(unexpected(&other)),
        }
    }

    /// An edge at a trigger input at `at_ns` of the monotonic clock ([`now_ns`](crate::world::now_ns)). One that is to keep its
    /// place in the stream is told some time ahead.
    ///
    /// # Errors
    /// As [`order`](Self::order).
    pub fn edge(&self, serial: &str, channel: u8, rising: bool, at_ns: i64) -> io::Result<()> {
        let edge = Order::Edge {
            channel,
            rising,
            at_ns,
        };
        self.order(serial, edge).map(drop)
    }
}

fn unexpected(answer: &Answer) -> io::Error {
    io::Error::other(format!(
        "expected the answer to another order, found {answer:?}"
    ))
}
