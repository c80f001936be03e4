//! The whole driver, including libusb, on an emulated bus: production code down to the system calls.
#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "tests")]

mod bench;
mod devices;
mod faults;
mod pattern;
mod settings;
mod stream;
mod time;
