//! Which of the configured ports lead to a trigger box, and what to do about the others.

use std::path::{Path, PathBuf};
use std::time::Duration;
use std::{fmt, io};

use skinrig_device::RealClock;
use skinrig_model::DeviceIdentity;

use crate::greeting::{GreetingError, greet};
use crate::link::Link;
use crate::serial::SerialDial;
use crate::wire::{OpenError, dial_patiently};

/// How long a port may be busy before that is told.
const BUSY_PATIENCE: Duration = Duration::from_millis(500);

/// A port and what is behind it.
#[derive(Debug)]
pub struct FoundPort {
    /// Its path.
    pub port: String,
    /// What was found.
    pub state: PortState,
}

/// What is behind a port. Displays as a fragment with the next step.
#[derive(Debug)]
pub enum PortState {
    /// A box that this driver can use.
    Ready(DeviceIdentity),
    /// The port cannot be opened: absent, busy, not permitted.
    Closed(OpenError),
    /// It opened, and there is no box that this driver can use.
    Unusable(GreetingError),
}

impl fmt::Display for PortState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ready(identity) => write!(
                f,
                "ready: {} {}, firmware {}",
                identity.model, identity.serial, identity.firmware
            ),
            Self::Closed(error) => error.fmt(f),
            Self::Unusable(error) => error.fmt(f),
        }
    }
}

/// Looks behind each of `ports`, in order. Ports are never guessed: bytes sent to a stranger may move something.
///
/// Opening a port resets an Arduino, and a silent port takes `hello_timeout`. A box that is found is left disarmed.
#[must_use]
pub fn enumerate(ports: &[String], hello_timeout: Duration) -> Vec<FoundPort> {
    ports
        .iter()
        .map(|port| FoundPort {
            port: port.clone(),
            state: look(port, hello_timeout),
        })
        .collect()
}

fn look(port: &str, hello_timeout: Duration) -> PortState {
    let wire = match dial_patiently(&mut SerialDial::new(port), BUSY_PATIENCE) {
        Ok(wire) => wire,
        Err(e) => return PortState::Closed(e),
    };
    let mut link = Link::new(wire, RealClock::start());
    match greet(&mut link, port, None, hello_timeout) {
        Ok(greeted) => PortState::Ready(greeted.identity),
        Err(e) => PortState::Unusable(e),
    }
}

/// Where Linux keeps a name for each serial adapter that stays the same across unplugging.
pub const BY_ID: &str = "/dev/serial/by-id";

/// The port in `by_id` (see [`BY_ID`]) whose USB adapter has this serial number, `None` when there is none.
///
/// The names there end in `_SERIAL-ifNN`, followed by `-portN` for adapters with several ports (systemd's
/// `60-serial.rules`); of several ports the first one is taken.
///
/// # Errors
/// When the directory is there and cannot be read.
pub fn port_of_adapter(by_id: &Path, serial: &str) -> io::Result<Option<PathBuf>> {
    let entries = match std::fs::read_dir(by_id) {
        // Made when the first adapter is plugged in.
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        other => other?,
    };
    let mut ports = Vec::new();
    for entry in entries {
        let path = entry?.path();
        let name = path.file_name().and_then(|n| n.to_str()).unwrap_or("");
        let adapter = name.split_once("-if").map_or(name, |(adapter, _)| adapter);
        if adapter.rsplit_once('_').is_some_and(|(_, s)| s == serial) {
            ports.push(path);
        }
    }
    Ok(ports.into_iter().min())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_adapter_is_found_by_its_serial_number() {
        let dir = tempfile::tempdir().unwrap();
        let names = [
            "usb-Arduino__www.arduino.cc__0043_85735313932351E0C1B1-if00",
            "usb-FTDI_FT232R_USB_UART_A50285BI-if00-port0",
            "usb-FTDI_Dual_FT7-if01-port0",
            "usb-FTDI_Dual_FT7-if00-port0",
        ];
        for name in names {
            std::fs::write(dir.path().join(name), "").unwrap();
        }
        let find = |serial| port_of_adapter(dir.path(), serial).unwrap();
        assert_eq!(
            find("85735313932351E0C1B1"),
            Some(dir.path().join(names[0]))
        );
        assert_eq!(find("A50285BI"), Some(dir.path().join(names[1])));
        assert_eq!(find("FT7"), Some(dir.path().join(names[3])));
        // A part of a serial number is another one.
        assert_eq!(find("0285BI"), None);
        let absent = port_of_adapter(&dir.path().join("absent"), "A50285BI");
        assert_eq!(absent.unwrap(), None);
    }
}
