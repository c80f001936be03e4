//! Checks which of the configured ports have a trigger box.

use std::path::{Path, PathBuf};
use std::time::Duration;
use std::{fmt, io};

use skinrig_device::RealClock;
use skinrig_model::DeviceIdentity;

use crate::handshake::{HandshakeError, shake_hands};
use crate::link::Link;
use crate::serial::SerialConnector;
use crate::wire::{OpenError, connect_when_free};

/// How long to wait for a busy port.
const BUSY_TIMEOUT: Duration = Duration::from_millis(500);

/// A port and its state.
#[derive(Debug)]
pub struct FoundPort {
    /// Path.
    pub port: String,
    /// State.
    pub state: PortState,
}

/// State of a port. Displays with the next step.
#[derive(Debug)]
pub enum PortState {
    /// A usable box.
    Ready(DeviceIdentity),
    /// The port cannot be opened: absent, busy, not permitted.
    Closed(OpenError),
    /// The port opened, but there is no usable box.
    Unusable(HandshakeError),
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

/// Checks each of `ports` in order. Never guesses ports: bytes sent to another device may make it move.
///
/// Opening a port resets an Arduino; a silent port takes `hello_timeout`. A box that is found is left disarmed.
#[must_use]
pub fn enumerate(ports: &[String], hello_timeout: Duration) -> Vec<FoundPort> {
    ports
        .iter()
        .map(|port| FoundPort {
            port: port.clone(),
            state: check_port(port, hello_timeout),
        })
        .collect()
}

fn check_port(port: &str, hello_timeout: Duration) -> PortState {
    let wire = match connect_when_free(&mut SerialConnector::new(port), BUSY_TIMEOUT) {
        Ok(wire) => wire,
        Err(e) => return PortState::Closed(e),
    };
    let mut link = Link::new(wire, RealClock::start());
    match shake_hands(&mut link, port, None, hello_timeout) {
        Ok(handshake) => PortState::Ready(handshake.identity),
        Err(e) => PortState::Unusable(e),
    }
}

/// Directory in which Linux keeps a stable name for each serial adapter.
pub const BY_ID: &str = "/dev/serial/by-id";

/// The port in `by_id` (see [`BY_ID`]) whose USB adapter has this serial number, if any.
///
/// Names in this directory end with `_SERIAL-ifNN`, followed by `-portN` for adapters with several ports (systemd's `60-serial.rules`).
/// Of several ports the first one is returned.
///
/// # Errors
/// When the directory exists but cannot be read.
pub fn port_of_adapter(by_id: &Path, serial: &str) -> io::Result<Option<PathBuf>> {
    let entries = match std::fs::read_dir(by_id) {
        // The directory appears with the first adapter.
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
        // A substring is a different serial number.
        assert_eq!(find("0285BI"), None);
        let absent = port_of_adapter(&dir.path().join("absent"), "A50285BI");
        assert_eq!(absent.unwrap(), None);
    }
}
