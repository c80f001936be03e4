//! Tests of the emulated bus and its cameras through the real libusb, with a client based on the
//! EVK1 reference alone.
#![cfg(target_os = "linux")]

mod client;
mod devices;
mod faults;
mod light;
mod stream;
mod time;
