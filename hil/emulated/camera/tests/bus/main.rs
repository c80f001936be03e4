//! The emulated bus and its cameras, seen through the real libusb by a client that knows only the EVK1 reference.
#![cfg(target_os = "linux")]

mod client;
mod devices;
mod faults;
mod light;
mod stream;
mod time;
