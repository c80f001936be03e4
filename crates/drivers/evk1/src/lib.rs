//! Driver of the Prophesee EVK1 Gen3.1 event camera: registers and streaming over libusb.
//!
//! From the bottom up: [`usb`] transfers requests and data, [`inbox`] queues received bytes, [`access`] reads and writes [`registers`],
//! [`sequences`] and the settings modules define what is written in which order, [`chunks`] creates the chunks of a recording, and
//! [`Evk1`] implements [`EventCamera`](skinrig_device::EventCamera). [`enumerate`] lists the connected cameras.
//!
//! Facts about the camera come from the public driver OpenEB 3.1.2, the last one that supported it; each module names its source file.
//! Unpublished facts are never assumed: the driver does not rely on reset values of registers, and registers that read back
//! differently are configured ([`Evk1Config::read_back_exceptions`]).

pub mod access;
pub mod biases;
pub mod camera;
pub mod chunks;
pub mod config;
pub mod error;
pub mod identify;
pub mod inbox;
pub mod noise_filter;
mod overflow;
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
pub use error::{Evk1Error, UsbError};
pub use identify::{CameraState, FoundDevice, Identity, enumerate};
pub use report::StreamReport;
pub use tolerance::{Mismatch, Mismatches, Tolerance, ToleranceKey};
pub use triggers::TriggerOut;
