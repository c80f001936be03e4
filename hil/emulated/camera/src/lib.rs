//! Emulated EVK1 cameras on an emulated USB bus, which a process under test sees through the real libusb.
//!
//! ```text
//!  process under test                     emulator (this crate: a thread of the parent, or its own process)
//!  driver -> rusb -> libusb -> ioctl --+
//!                                      |  Unix socket per device
//!                        libusbshim.so +--> usb::serve -> usb::queues <- evk1::producer <- content (events)
//!                                                      -> evk1::requests -> registers      <- world (edges, tip)
//! ```
//!
//! A [`Bus`] creates a folder that looks like a computer's `/sys` and `/dev` with the configured devices, and serves the system calls that
//! the preload library `skinrig-usbshim` forwards. No part of the driver is replaced.
//!
//! * [`config`]: devices and their content; also the JSON input of the binary `emulated-cameras`.
//! * [`world`]: trigger edges, the time of their source, and the robot's tip, from other threads or processes.
//! * [`control`]: plugging, faults, counters and the journal of requests, also from the process under test.
//! * [`harness`]: runs a test again under the preload library.
//!
//! Everything here is emulated: the behaviour of a real EVK1 is known only from public sources (`evk1.md`, "the EVK1 reference" in the
//! source code). Open questions are settings in [`config`] or marked *assumed*.
#![cfg(target_os = "linux")]

pub mod bus;
pub mod config;
pub mod content;
pub mod control;
mod error;
mod evk1;
pub mod harness;
mod random;
mod treuzell;
mod usb;
pub mod world;

pub use bus::Bus;
pub use config::{BusConfig, DeviceConfig, Evk1Config};
pub use control::Remote;
pub use error::BusError;
