//! The Prophesee EVK1 Gen3.1 as an event camera: registers and streaming over libusb.
//!
//! From the wire up: [`usb`] moves requests and bytes, [`inbox`] holds what arrived, [`access`] reads and writes
//! [`registers`], [`sequences`] and the settings' modules know what to write in which order, [`chunks`] makes the
//! recording's chunks, and [`Evk1`] is the [`EventCamera`](skinrig_device::EventCamera) over all of it. [`enumerate`]
//! lists what is plugged in.
//!
//! Facts about the camera come from the public driver OpenEB 3.1.2, the last one that knew it; each module names its
//! source file. What is not public stays a question: nothing here relies on the reset values of registers, and which
//! registers read back differently is a matter of configuration ([`Evk1Config::read_back_exceptions`]).

pub mod access;
pub mod biases;
pub mod camera;
pub mod chunks;
pub mod config;
pub mod error;
pub mod identify;
pub mod inbox;
pub mod noise_filter;
pub mod pattern;
pub mod registers;
pub mod report;
pub mod requests;
pub mod roi;
pub mod sequences;
pub mod settings;
pub mod sync;
pub mod time_base;
pub mod tolerance;
pub mod triggers;
pub mod usb;

pub use camera::Evk1;
pub use config::Evk1Config;
pub use error::{Evk1Error, UDEV_STEP, UsbError};
pub use identify::{Found, FoundState, Identity, enumerate};
pub use report::StreamReport;
pub use tolerance::{Accept, Mismatch, Mismatches, Tolerance};
pub use triggers::TriggerOut;
