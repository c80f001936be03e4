//! Errors of an EVK1, from the USB bus to a line of a bias file.

use crate::registers::Register;

/// Next step when a user has no permission to open the camera.
pub(crate) const UDEV_STEP: &str =
    "install hil/udev/70-skinrig.rules (hil/README.md), then reconnect the camera";

/// A transfer or a request to the USB stack failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UsbError {
    /// This computer has no accessible USB.
    #[error(
        "no USB on this computer ({0}): does /dev/bus/usb exist, and is it visible in this container?"
    )]
    NoUsb(String),
    /// The device was disconnected.
    #[error("the device is no longer on the bus: check cable and power")]
    Gone,
    /// Another program has the device open.
    #[error("another program uses the device: end it, or reconnect the device")]
    Busy,
    /// The operating system denies this user access.
    #[error("no permission to open the device: {}", UDEV_STEP)]
    NoPermission,
    /// The endpoint stalled.
    #[error("the endpoint stalled")]
    Stall,
    /// No reply within the time limit.
    #[error("no reply within the time limit")]
    Timeout,
    /// A request transferred too few bytes.
    #[error("expected {expected} bytes, transferred {found}")]
    Short {
        /// Required number of bytes.
        expected: usize,
        /// Transferred number of bytes.
        found: usize,
    },
    /// Cancelled transfers did not return in time; their memory is kept until the program ends.
    #[error("expected all transfers to return within {limit_ms} ms, found {left} still in flight")]
    Stuck {
        /// The time limit, ms.
        limit_ms: u64,
        /// Number of transfers in flight.
        left: usize,
    },
    /// Another error, with the message of the USB stack.
    #[error("{0}")]
    Other(String),
}

/// An EVK1 failed or rejected a request.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Evk1Error {
    /// USB failed.
    #[error("{doing}: {cause}")]
    Usb {
        /// The failed operation.
        doing: String,
        /// The USB error.
        cause: UsbError,
    },
    /// The device is not an EVK1 Gen3.1 that can stream.
    #[error("{place}: not an EVK1 Gen3.1: expected {expected}, found {found}")]
    NotEvk1 {
        /// Bus and port.
        place: String,
        /// Expected property.
        expected: String,
        /// Found property.
        found: String,
    },
    /// No camera with this serial number.
    #[error("expected an EVK1 with serial {serial}, found {found}")]
    NotFound {
        /// Requested serial number.
        serial: String,
        /// Connected devices.
        found: String,
    },
    /// The FPGA did not load its configuration.
    #[error(
        "expected the FPGA to be configured within {limit_s} s, found it still booting: power the camera off and on"
    )]
    NotBooted {
        /// The time limit, s.
        limit_s: u64,
    },
    /// A register read failed.
    #[error("reading {name} ({address:#06x}): expected status 0x40, found {status:#04x}")]
    Status {
        /// Name of the register.
        name: &'static str,
        /// Its address.
        address: u32,
        /// The status byte.
        status: u8,
    },
    /// A register read back with another value than was written.
    #[error(
        "{name} ({address:#06x}): expected {expected:#010x} after writing, found {found:#010x}: power the camera off and \
         on; if every camera of this model reads differently at this address, add it to `read_back_exceptions`"
    )]
    ReadBack {
        /// Name of the register.
        name: &'static str,
        /// Its address.
        address: u32,
        /// Written value.
        expected: u32,
        /// Value read back.
        found: u32,
    },
    /// A setting read back with another value than was written.
    #[error("{name}: expected {expected} after writing, found {found}")]
    Setting {
        /// Name of the setting.
        name: String,
        /// Written value.
        expected: String,
        /// Value read back.
        found: String,
    },
    /// A request beyond the camera's capabilities. Nothing was written.
    #[error("expected {expected}, found {found}")]
    Refused {
        /// Acceptable requests.
        expected: String,
        /// The request.
        found: String,
    },
    /// The camera is in the wrong state.
    #[error("expected to be {expected}, is {found}")]
    State {
        /// Required state.
        expected: &'static str,
        /// Actual state.
        found: &'static str,
    },
    /// The stopped camera continues to send.
    #[error(
        "expected the stopped camera to stop sending, found it still sending after {bytes} bytes: power-cycle it"
    )]
    StillSending {
        /// Bytes received after the stop.
        bytes: u64,
    },
    /// The overflow counter is at its end before the stream, so that no overflow could be told from none.
    #[error(
        "expected an overflow counter that can count, found it at its end ({}): power-cycle the camera; if it stays there, set \
         `overflow_counter: note` for this camera in the rig file",
        u16::MAX
    )]
    OverflowCounterFull,
    /// A malformed line of a bias file.
    #[error("bias file, line {line}: expected {expected}, found {found}")]
    BiasFile {
        /// Line number, from 1; one past the last line if something is missing.
        line: usize,
        /// Acceptable content.
        expected: String,
        /// Actual content.
        found: String,
    },
}

/// Collects the first error of a sequence of steps that all run.
#[derive(Debug, Default)]
pub(crate) struct FirstError(Option<Evk1Error>);

impl FirstError {
    /// Adds the result of a step.
    pub(crate) fn after(&mut self, step: Result<(), Evk1Error>) {
        if let Err(error) = step {
            self.0.get_or_insert(error);
        }
    }

    /// The first error, if any.
    pub(crate) fn outcome(self) -> Result<(), Evk1Error> {
        self.0.map_or(Ok(()), Err)
    }
}

impl Evk1Error {
    pub(crate) fn refused(expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::Refused {
            expected: expected.into(),
            found: found.into(),
        }
    }

    pub(crate) fn read_back(register: Register, expected: u32, found: u32) -> Self {
        Self::ReadBack {
            name: register.name,
            address: register.address,
            expected,
            found,
        }
    }
}

impl UsbError {
    /// Adds the failed operation.
    pub(crate) fn during(self, doing: impl Into<String>) -> Evk1Error {
        Evk1Error::Usb {
            doing: doing.into(),
            cause: self,
        }
    }
}
