//! Emulated EVK1 cameras on an emulated USB bus: what a process under test sees through the real libusb.
//!
//! ```text
//!  process under test                     emulator (this crate: a thread of the parent, or its own process)
//!  driver -> rusb -> libusb -> ioctl --+
//!                                      |  Unix socket per device
//!                        libusbshim.so +--> usb::serve -> usb::queues <- evk1::producer <- content (events)
//!                                                      -> evk1::requests -> registers      <- world (edges, tip)
//! ```
//!
//! A [`Bus`] makes a folder that looks like a machine's `/sys` and `/dev` with the configured devices in it, and answers
//! the system calls that the preload library `skinrig-usbshim` sends over. Nothing of the driver is replaced.
//!
//! * [`config`]: which devices there are and what they show; also the JSON of the binary `emulated-cameras`.
//! * [`world`]: trigger edges, the time of who makes them, and the robot's tip, from other threads or processes.
//! * [`steer`]: plug and unplug, faults, counters, the journal of requests; from the process under test as well.
//! * [`harness`]: a test that runs itself again under the preload library.
//!
//! Everything here is emulated: what a real EVK1 does is known from public sources only (`evk1.md` in the sources'
//! words: the EVK1 reference), and what they leave open is a setting in [`config`] or marked *assumed*.
#![cfg(target_os = "linux")]

pub mod bus;
pub mod config;
pub mod content;
mod error;
mod evk1;
pub mod harness;
mod random;
pub mod steer;
mod treuzell;
mod usb;
pub mod world;

pub use bus::Bus;
pub use config::{BusConfig, DeviceConfig, Evk1Config};
pub use error::BusError;
pub use steer::Remote;
