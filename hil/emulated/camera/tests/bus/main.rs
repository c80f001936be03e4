//! The emulated bus and its cameras, tested through the real libusb by a client based on the EVK1 reference alone.
#![cfg(target_os = "linux")]

mod client;
mod devices;
mod faults;
mod light;
mod stream;
mod time;
