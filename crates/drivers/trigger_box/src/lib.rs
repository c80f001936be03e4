//! The trigger box over a serial port: coded pulses, time-stamped inputs, the box's own clock.
//!
//! The box is an ATmega328P with the firmware of `hil/trigger_box`. From below upwards: [`wire`] is the seam to the
//! bytes, [`serial`] the serial port behind it, [`frame`] and [`protocol`] what the bytes mean, [`link`] one
//! request and its reply, [`offset`] the ties between the clocks, and [`SerialTriggerBox`] the device.

pub mod config;
pub mod discover;
pub mod driver;
pub mod frame;
pub mod greeting;
pub mod link;
mod notes;
pub mod offset;
pub mod protocol;
pub mod serial;
mod shared;
pub mod wire;
mod worker;

pub use config::TriggerBoxConfig;
pub use discover::{BY_ID, FoundPort, PortState, enumerate, port_of_adapter};
pub use driver::SerialTriggerBox;
pub use wire::{Dial, OpenError, Wire};
