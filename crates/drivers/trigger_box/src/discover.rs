//! Which of the configured ports lead to a trigger box, and what to do about the others.

use std::fmt;
use std::time::Duration;

use skinrig_device::RealClock;
use skinrig_model::DeviceIdentity;

use crate::greeting::{GreetingError, greet};
use crate::link::Link;
use crate::serial::SerialDial;
use crate::wire::{Dial, OpenError};

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
    let wire = match SerialDial::new(port).dial() {
        Ok(wire) => wire,
        Err(e) => return PortState::Closed(e),
    };
    let mut link = Link::new(wire, RealClock::start());
    match greet(&mut link, port, None, hello_timeout) {
        Ok(greeted) => PortState::Ready(greeted.identity),
        Err(e) => PortState::Unusable(e),
    }
}
