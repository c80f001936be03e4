//! A stand-in for libdrd: the same C interface over a simulated arm whose firmware is a process of its own.
//!
//! Built as `libdrd.so` it is loaded by the production driver exactly as the vendor's library is. It holds
//! no vendor code: names, signatures and numbers come from `skinrig-drd-abi`, and wherever the vendor does
//! not say how its library behaves, this one takes the strictest or the worst plausible behaviour.
//!
//! # Processes
//! - The **firmware process** is the arm: inertia, gravity, motors, contact, modes, watchdog, velocity
//!   trip, in real time in steps of 250 µs. It outlives the program that drives the arm.
//! - The **library** in the driving program turns each C call into a message to it, keeps the last error of
//!   each thread and writes the journal. Poses are read from a page of shared memory, without a message.
//! - The **control client** ([`EmulatedArm`]) of a test or of the emulated bench starts the firmware, sees
//!   the true state of the arm and injects faults.
//!
//! The regulation loop, in the vendor's library a thread of the driving program, is computed in step with
//! the arm so that a busy machine does not shake the arm; it stops at once when the driving
//! program dies or is stopped by a signal, and the motors then keep the last force until the watchdog
//! trips or someone brakes.
//!
//! # Finding each other
//! [`EmulatedArm::spawn`] makes a directory with the socket, the page, the journal and a copy of
//! `libdrd.so`; a library looks for its arm beside itself, then in the directory named by
//! [`ARM_VARIABLE`]. One copy per arm keeps parallel tests of one process apart: the loader takes two files for
//! two libraries. Without an arm the library finds no device.
//!
//! Cargo does not build the binaries of a dependency, so the firmware runs from whatever executable links
//! this crate: started again with `FIRMWARE_VARIABLE` set, it becomes the firmware before its `main`. The
//! binary `drd-firmware` is the same for use from a shell.
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

/// Names the directory of the arm for a library that has none beside itself.
pub const ARM_VARIABLE: &str = "SKINRIG_EMULATED_ARM";

/// Set to the arm's directory, it makes an executable that links this crate the firmware of that arm.
pub(crate) const FIRMWARE_VARIABLE: &str = "SKINRIG_EMULATED_ARM_FIRMWARE";

/// Names of the files in an arm's directory.
mod file {
    /// The firmware's socket.
    pub const SOCKET: &str = "arm.sock";
    /// The page of shared memory.
    pub const PAGE: &str = "arm.page";
    /// The configuration, JSON.
    pub const CONFIG: &str = "arm.json";
    /// The journal of calls.
    pub(crate) const JOURNAL: &str = "journal.txt";
    /// The copy of the library.
    pub(crate) const LIBRARY: &str = "libdrd.so";
}
