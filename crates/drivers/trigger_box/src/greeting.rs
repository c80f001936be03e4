//! The first words with a box: is it one, is it the right one, does it run the right firmware?

use std::time::Duration;

use skinrig_device::DeviceError;
use skinrig_model::{DeviceIdentity, DeviceRole};

use crate::link::{Link, LinkError, Patience};
use crate::protocol::{
    BOX_NAME, FIRMWARE_VERSION, Hello, Outcome, PROTOCOL_VERSION, Reply, Request, TICKS_PER_US,
};

/// From one hello to the next while a box starts.
const HELLO_TRY: Duration = Duration::from_millis(150);

/// A box that answered as it should.
#[derive(Debug, Clone)]
pub struct Greeted {
    /// Who it is.
    pub identity: DeviceIdentity,
    /// How often it was reset, modulo 2^16.
    pub boot: u16,
}

/// Why a line leads to no box that this driver can use.
#[derive(Debug, thiserror::Error)]
pub enum GreetingError {
    /// The line broke, or nobody answered.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Somebody else answered.
    #[error("expected a {BOX_NAME}, found {found}")]
    NotABox {
        /// What came.
        found: String,
    },
    /// The box runs another firmware.
    #[error(
        "expected firmware {FIRMWARE_VERSION} with protocol {PROTOCOL_VERSION}, found firmware {firmware} with protocol \
         {protocol}: flash it with `{}`",
        flash_command(port)
    )]
    WrongFirmware {
        /// Its version.
        firmware: String,
        /// Its protocol.
        protocol: u8,
        /// Where it is.
        port: String,
    },
    /// It is another box.
    #[error("expected the box with serial number {expected}, found {found}")]
    WrongSerial {
        /// Wanted.
        expected: String,
        /// There.
        found: String,
    },
}

/// The command that puts the right firmware on the box at `port`.
#[must_use]
pub(crate) fn flash_command(port: &str) -> String {
    format!("make -C hil/trigger_box flash PORT={port}")
}

/// Says hello until the box answers or `timeout` is over. A box that was greeted is disarmed.
///
/// # Errors
/// [`GreetingError`].
pub fn greet(
    link: &mut Link,
    port: &str,
    serial: Option<&str>,
    timeout: Duration,
) -> Result<Greeted, GreetingError> {
    let patience = Patience {
        per_try: HELLO_TRY,
        total: timeout,
    };
    let answer = link.ask(&Request::Hello, patience)?;
    check(&answer.reply, port, serial)
}

fn check(reply: &Reply, port: &str, serial: Option<&str>) -> Result<Greeted, GreetingError> {
    let hello = Hello::parse(&reply.answers).filter(|_| reply.outcome == Outcome::Done);
    let Some(hello) = hello else {
        return Err(GreetingError::NotABox {
            found: format!("an answer that is no greeting ({:?})", reply.outcome),
        });
    };
    if hello.name != BOX_NAME {
        return Err(GreetingError::NotABox { found: hello.name });
    }
    if reply.version != PROTOCOL_VERSION
        || hello.firmware != FIRMWARE_VERSION
        || u64::from(hello.ticks_per_us) != TICKS_PER_US
    {
        return Err(GreetingError::WrongFirmware {
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
        return Err(GreetingError::WrongSerial {
            expected: expected.to_owned(),
            found,
        });
    }
    Ok(Greeted {
        identity: DeviceIdentity {
            model: BOX_NAME.to_owned(),
            serial: found,
            firmware: hello.firmware.to_string(),
        },
        boot: reply.boot,
    })
}

impl GreetingError {
    /// The same for whoever opened the device.
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
