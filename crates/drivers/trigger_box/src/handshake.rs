//! Handshake with a box: verifies device, serial number and firmware.

use std::time::Duration;

use skinrig_device::DeviceError;
use skinrig_model::{DeviceIdentity, DeviceRole};

use crate::link::{Link, LinkError, RequestTimeouts};
use crate::protocol::{
    BOX_NAME, FIRMWARE_VERSION, Hello, Outcome, PROTOCOL_VERSION, Reply, Request, TICKS_PER_US,
};

/// Interval of hello requests while a box starts.
const HELLO_INTERVAL: Duration = Duration::from_millis(150);

/// A verified box.
#[derive(Debug, Clone)]
pub struct Handshake {
    /// Identity of the box.
    pub identity: DeviceIdentity,
    /// Number of resets of the box, modulo 2^16.
    pub boot: u16,
}

/// Reason why there is no usable box on a line.
#[derive(Debug, thiserror::Error)]
pub enum HandshakeError {
    /// The line failed, or there was no reply.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Another device replied.
    #[error("expected a {BOX_NAME}, found {found}")]
    NotABox {
        /// Description of the reply.
        found: String,
    },
    /// The box runs another firmware.
    #[error(
        "expected firmware {FIRMWARE_VERSION} with protocol {PROTOCOL_VERSION}, found firmware {firmware} with protocol \
         {protocol}: flash it with `{}`",
        flash_command(port)
    )]
    WrongFirmware {
        /// Its firmware version.
        firmware: String,
        /// Its protocol version.
        protocol: u8,
        /// Its port.
        port: String,
    },
    /// Another box replied.
    #[error("expected the box with serial number {expected}, found {found}")]
    WrongSerial {
        /// Expected serial number.
        expected: String,
        /// Serial number of the box.
        found: String,
    },
}

/// The command that flashes the right firmware to the box at `port`.
#[must_use]
pub(crate) fn flash_command(port: &str) -> String {
    format!("make -C hil/trigger_box flash PORT={port}")
}

/// Sends hello until the box replies or `timeout` expires. The handshake disarms the box.
///
/// # Errors
/// [`HandshakeError`].
pub fn run_handshake(
    link: &mut Link,
    port: &str,
    serial: Option<&str>,
    timeout: Duration,
) -> Result<Handshake, HandshakeError> {
    let timeouts = RequestTimeouts {
        per_try: HELLO_INTERVAL,
        total: timeout,
    };
    let reply = link.request(&Request::Hello, timeouts)?;
    check(&reply.reply, port, serial)
}

fn check(reply: &Reply, port: &str, serial: Option<&str>) -> Result<Handshake, HandshakeError> {
    let hello = Hello::parse(&reply.data).filter(|_| reply.outcome == Outcome::Done);
    let Some(hello) = hello else {
        return Err(HandshakeError::NotABox {
            found: format!("a reply that is not a handshake ({:?})", reply.outcome),
        });
    };
    if hello.name != BOX_NAME {
        return Err(HandshakeError::NotABox { found: hello.name });
    }
    if reply.version != PROTOCOL_VERSION
        || hello.firmware != FIRMWARE_VERSION
        || u64::from(hello.ticks_per_us) != TICKS_PER_US
    {
        return Err(HandshakeError::WrongFirmware {
            firmware: hello.firmware.to_string(),
            protocol: reply.version,
            port: port.to_owned(),
        });
    }
    let found = if hello.serial.is_empty() {
        "no serial number".to_owned()
    } else {
        hello.serial
    };
    if let Some(expected) = serial.filter(|s| *s != found) {
        return Err(HandshakeError::WrongSerial {
            expected: expected.to_owned(),
            found,
        });
    }
    Ok(Handshake {
        identity: DeviceIdentity {
            model: BOX_NAME.to_owned(),
            serial: found,
            firmware: hello.firmware.to_string(),
        },
        boot: reply.boot,
    })
}

impl HandshakeError {
    /// Converts to an error of the device trait.
    #[must_use]
    pub(crate) fn into_device_error(self, serial: &str) -> DeviceError {
        let (role, serial) = (DeviceRole::TriggerBox, serial.to_owned());
        match self {
            Self::Link(e) => DeviceError::Lost {
                role,
                serial,
                detail: e.to_string(),
            },
            Self::NotABox { found } => DeviceError::Refused {
                role,
                serial,
                expected: format!("a {BOX_NAME}"),
                found,
            },
            Self::WrongFirmware {
                firmware,
                protocol,
                port,
            } => DeviceError::Refused {
                role,
                serial,
                expected: format!(
                    "firmware {FIRMWARE_VERSION} with protocol {PROTOCOL_VERSION} (flash it with `{}`)",
                    flash_command(&port)
                ),
                found: format!("firmware {firmware} with protocol {protocol}"),
            },
            Self::WrongSerial { expected, found } => DeviceError::Refused {
                role,
                serial,
                expected: format!("the box with serial number {expected}"),
                found,
            },
        }
    }
}
