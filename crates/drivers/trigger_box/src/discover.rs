//! Checks which of the configured ports have a trigger box.

use std::fmt;
use std::time::Duration;

use skinrig_device::RealClock;
use skinrig_model::DeviceIdentity;

use crate::handshake::{HandshakeError, run_handshake};
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
    match run_handshake(&mut link, port, None, hello_timeout) {
        Ok(handshake) => PortState::Ready(handshake.identity),
        Err(e) => PortState::Unusable(e),
    }
}
