//! What keeps an emulated bus from being made.

use std::io;
use std::path::PathBuf;

/// Names the preload library where it is not beside the program.
pub(crate) const SHIM_VARIABLE: &str = "SKINRIG_USBSHIM";
pub(crate) const SHIM: &str = "libusbshim.so";

/// A bus cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// The machine refuses.
    #[error("emulated bus: {0}")]
    Io(#[from] io::Error),
    /// Two devices of one name, or a number that is none.
    #[error("emulated bus: expected {expected}, found {found}")]
    Config {
        /// What would do.
        expected: String,
        /// What was given.
        found: String,
    },
    /// What the pixels should do cannot be done.
    #[error("emulated camera: {0}")]
    Content(String),
    /// The preload library is not there.
    #[error("emulated bus: expected {SHIM} at {}; build skinrig-usbshim or set {SHIM_VARIABLE}", .0.display())]
    NoShim(PathBuf),
}
