//! Errors when creating an emulated bus.

use std::io;
use std::path::PathBuf;

/// Environment variable with the path of the preload library, if it is not next to the program.
pub(crate) const SHIM_VARIABLE: &str = "SKINRIG_USBSHIM";
pub(crate) const SHIM: &str = "libusbshim.so";

/// The bus could not be created.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// The system failed.
    #[error("emulated bus: {0}")]
    Io(#[from] io::Error),
    /// Two devices with the same name, or an invalid number.
    #[error("emulated bus: expected {expected}, found {found}")]
    Config {
        /// Acceptable values.
        expected: String,
        /// Given value.
        found: String,
    },
    /// The pixel content is not available.
    #[error("emulated camera: {0}")]
    Content(String),
    /// The preload library does not exist.
    #[error("emulated bus: expected {SHIM} at {}; build skinrig-usbshim or set {SHIM_VARIABLE}", .0.display())]
    NoShim(PathBuf),
}
