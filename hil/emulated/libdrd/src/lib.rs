//! An emulated libdrd: the same C interface over a simulated arm, whose firmware runs in a separate process.
//!
//! The production driver loads it as `libdrd.so` exactly like the vendor's library. It contains no vendor code: names, signatures and
//! numbers come from `skinrig-drd-abi`. Where the vendor's behaviour is not documented, it uses the strictest or worst plausible one.
//!
//! # Processes
//! - The **firmware process** is the arm: inertia, gravity, motors, contact, modes, watchdog, velocity trip, in real time in steps of 250 µs.
//!   It outlives the program that drives the arm.
//! - The **library** in the driving program converts each C call to a message, keeps the last error of each thread and writes the journal.
//!   It reads poses from shared memory, without a message.
//! - The **control client** ([`EmulatedArm`]) of a test or the emulated bench starts the firmware, reads the true state of the arm and
//!   injects faults.
//!
//! The regulation loop, which is a thread of the driving program in the vendor's library, is computed together with the arm, so that a busy
//! machine does not disturb it. It stops at once when the driving program dies or is stopped by a signal; the motors then keep the last
//! force until the watchdog trips or another program brakes.
//!
//! # Connection
//! [`EmulatedArm::spawn`] creates a directory with the socket, the shared memory, the journal and a copy of `libdrd.so`. A library searches
//! for its arm in its own directory, then in the one named by [`ARM_VARIABLE`]; without an arm it finds no device. One copy per arm
//! separates parallel tests in one process, because the loader treats two files as two libraries.
//!
//! Cargo does not build the binaries of a dependency, so the firmware runs from any executable that links this crate: started with
//! `FIRMWARE_VARIABLE` set, it becomes the firmware before its `main`. The binary `drd-firmware` does the same from a shell.
#![cfg(unix)]

mod config;
mod control;
mod entry;
mod exports;
pub mod firmware;
mod host;
pub mod journal;
mod page;
mod time;
mod wire;

pub use config::{ArmConfig, Contact, DeviceConfig, Fault, Setting, When};
pub use control::{ArmView, EmulatedArm, library_beside_this_executable};
pub use page::{ArmState, Mode};

/// Environment variable with the directory of the arm, for a library without one in its own directory.
pub const ARM_VARIABLE: &str = "SKINRIG_EMULATED_ARM";

/// Environment variable with the arm's directory, which turns an executable that links this crate into the arm's firmware.
pub(crate) const FIRMWARE_VARIABLE: &str = "SKINRIG_EMULATED_ARM_FIRMWARE";

/// Names of the files in an arm's directory.
mod file {
    /// The firmware's socket.
    pub const SOCKET: &str = "arm.sock";
    /// The shared memory.
    pub const PAGE: &str = "arm.page";
    /// The configuration, JSON.
    pub const CONFIG: &str = "arm.json";
    /// The journal.
    pub(crate) const JOURNAL: &str = "journal.txt";
    /// The copy of the library.
    pub(crate) const LIBRARY: &str = "libdrd.so";
}
