//! Driver of the trigger box on a serial port: coded pulses, time-stamped inputs, and the box's own clock.
//!
//! The box is an ATmega328P with the firmware in `hil/trigger_box`. From the bottom up: [`wire`] abstracts the byte stream, [`serial`] is
//! the serial port, [`frame`] and [`protocol`] define the encoding, [`link`] performs one request, [`offset`] relates the clocks, and
//! [`SerialTriggerBox`] is the device.

pub mod config;
mod discover;
pub mod driver;
pub mod frame;
pub mod handshake;
pub mod link;
mod notes;
pub mod offset;
pub mod protocol;
pub mod serial;
mod shared;
pub mod wire;
mod worker;

pub use config::TriggerBoxConfig;
pub use discover::{FoundPort, PortState, enumerate};
pub use driver::SerialTriggerBox;
pub use wire::{Connector, OpenError, Wire};
