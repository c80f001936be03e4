//! What can go wrong with an EVK1, from the USB bus up to a line of a bias file.

use crate::registers::Register;

/// What to do when a user may not open the camera.
pub const UDEV_STEP: &str =
    "install hil/udev/70-skinrig.rules (hil/README.md), then plug the camera in again";

/// A transfer or a request to the USB stack failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UsbError {
    /// This machine has no USB that a program may use.
    #[error(
        "no USB on this machine ({0}): is /dev/bus/usb there, and visible from this container?"
    )]
    NoUsb(String),
    /// The device left the bus.
    #[error("the device is gone from the bus: check cable and power")]
    Gone,
    /// Another program holds the device.
    #[error("another program holds the device: end it, or unplug and plug in again")]
    Busy,
    /// The operating system does not let this user open the device.
    #[error("no permission to open the device: {}", UDEV_STEP)]
    NoPermission,
    /// The endpoint answered with a stall.
    #[error("the endpoint stalled")]
    Stall,
    /// No answer within the time limit.
    #[error("no answer within the time limit")]
    Timeout,
    /// Fewer bytes were transferred than a request needs.
    #[error("expected {expected} bytes, transferred {found}")]
    Short {
        /// Bytes needed.
        expected: usize,
        /// Bytes transferred.
        found: usize,
    },
    /// Transfers could not be taken back in time; their memory is kept until the program ends.
    #[error("expected all transfers back within {limit_ms} ms, found {left} still under way")]
    Stuck {
        /// The time limit, ms.
        limit_ms: u64,
        /// Transfers not taken back.
        left: usize,
    },
    /// Anything else, in the words of the USB stack.
    #[error("{0}")]
    Other(String),
}

/// An EVK1 could not do what was asked.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Evk1Error {
    /// USB failed.
    #[error("{doing}: {cause}")]
    Usb {
        /// What was being done.
        doing: String,
        /// What happened.
        cause: UsbError,
    },
    /// Whatever it is, it is not an EVK1 Gen3.1 that can stream.
    #[error("{place}: not an EVK1 Gen3.1: expected {expected}, found {found}")]
    NotEvk1 {
        /// Where it is plugged in.
        place: String,
        /// What an EVK1 Gen3.1 shows.
        expected: String,
        /// What this device shows.
        found: String,
    },
    /// No camera with this serial number answers.
    #[error("expected an EVK1 with serial {serial}, found {found}")]
    NotFound {
        /// The serial number looked for.
        serial: String,
        /// What is there instead.
        found: String,
    },
    /// The FPGA is not configured.
    #[error(
        "expected the FPGA to be configured within {limit_s} s, found it still booting: power the camera off and on"
    )]
    NotBooted {
        /// The time limit, s.
        limit_s: u64,
    },
    /// The device did not accept a read of a register.
    #[error("reading {name} ({address:#06x}): expected status 0x40, found {status:#04x}")]
    Status {
        /// Name of the register.
        name: &'static str,
        /// Its address.
        address: u32,
        /// The status byte.
        status: u8,
    },
    /// A register did not read back as written.
    #[error(
        "{name} ({address:#06x}): expected {expected:#010x} after writing, found {found:#010x}: power the camera off and \
         on; an address at which every camera of this kind reads differently goes into `read_back_exceptions`"
    )]
    ReadBack {
        /// Name of the register.
        name: &'static str,
        /// Its address.
        address: u32,
        /// What was written.
        expected: u32,
        /// What was read.
        found: u32,
    },
    /// A setting did not read back as written.
    #[error("{name}: expected {expected} after writing, found {found}")]
    Setting {
        /// Which setting.
        name: String,
        /// What was written.
        expected: String,
        /// What was read.
        found: String,
    },
    /// Outside what the camera can or may do. Nothing was written.
    #[error("expected {expected}, found {found}")]
    Refused {
        /// What would have been accepted.
        expected: String,
        /// What was asked for.
        found: String,
    },
    /// The camera is in a state in which it cannot do this.
    #[error("expected to be {expected}, is {found}")]
    State {
        /// The state that the request needs.
        expected: &'static str,
        /// The state it is in.
        found: &'static str,
    },
    /// It was stopped and sends all the same.
    #[error(
        "expected the stopped camera to fall silent, found it still sending after {bytes} bytes: power it off and on"
    )]
    StillSending {
        /// Bytes that came since it should have been silent.
        bytes: u64,
    },
    /// A line of a bias file.
    #[error("bias file, line {line}: expected {expected}, found {found}")]
    BiasFile {
        /// 1 for the first line; the line after the last for something missing.
        line: usize,
        /// What would have been accepted.
        expected: String,
        /// What is there.
        found: String,
    },
}

/// What became of steps that are all taken, whatever became of those before: the first error.
#[derive(Debug, Default)]
pub(crate) struct FirstError(Option<Evk1Error>);

impl FirstError {
    /// A step was taken.
    pub(crate) fn after(&mut self, step: Result<(), Evk1Error>) {
        if let Err(error) = step {
            self.0.get_or_insert(error);
        }
    }

    /// What became of all of them.
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
    /// The error with what was being done.
    pub(crate) fn during(self, doing: impl Into<String>) -> Evk1Error {
        Evk1Error::Usb {
            doing: doing.into(),
            cause: self,
        }
    }
}
