//! Error codes of the library.

use std::fmt;

/// An error code, which the library keeps per thread.
///
/// The documentation rarely states which call sets which code: expect any code from any call.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ErrorCode(pub i32);

/// Declares the codes and their descriptions.
macro_rules! codes {
    ($($(#[$doc:meta])* $name:ident = $code:literal, $text:literal;)*) => {
        impl ErrorCode {
            $($(#[$doc])* pub const $name: Self = Self($code);)*

            /// All codes declared by SDK 3.17.5.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            /// Name of the code without the vendor's prefix; `None` for an unknown code.
            #[must_use]
            pub const fn name(self) -> Option<&'static str> {
                match self.0 {
                    $($code => Some(stringify!($name)),)*
                    _ => None,
                }
            }

            /// Description of the code.
            #[must_use]
            pub const fn meaning(self) -> &'static str {
                match self.0 {
                    $($code => $text,)*
                    _ => "an error code unknown to this driver",
                }
            }
        }
    };
}

codes! {
    /// No failure.
    NO_ERROR = 0, "no error";
    /// Unspecified.
    UNDOCUMENTED = 1, "an error that the library does not explain";
    /// The connection to the device failed: unplugged, powered off, or a USB fault.
    COM = 2, "the connection to the device failed";
    /// The controller is busy.
    DHC_BUSY = 3, "the device's controller is busy";
    /// No USB driver, or no permission.
    NO_DRIVER_FOUND = 4, "no usable USB driver, or no permission to use the device";
    /// No device is connected.
    NO_DEVICE_FOUND = 5, "no device found";
    /// The device does not support this.
    NOT_AVAILABLE = 6, "the device does not support this";
    /// The operation timed out.
    TIMEOUT = 7, "the operation timed out";
    /// The target is out of reach.
    GEOMETRY = 8, "the target is out of reach";
    /// A protected call without expert mode.
    EXPERT_MODE_DISABLED = 9, "expert mode is off";
    /// The library does not implement this.
    NOT_IMPLEMENTED = 10, "the library does not implement this";
    /// Out of memory.
    OUT_OF_MEMORY = 11, "out of memory";
    /// The device is not calibrated.
    DEVICE_NOT_READY = 12, "the device is not ready: not initialised or in reset";
    /// A file is missing.
    FILE_NOT_FOUND = 13, "a file was not found";
    /// The controller's memory is damaged.
    CONFIGURATION = 14, "the device's configuration is damaged";
    /// An index is out of range.
    INVALID_INDEX = 15, "an index is out of range";
    /// No longer supported.
    DEPRECATED = 16, "the library no longer supports this device or call";
    /// A NULL or invalid argument.
    NULL_ARGUMENT = 17, "an argument is NULL or invalid";
    /// The redundant encoders disagree.
    REDUNDANT_FAIL = 18, "the redundant encoders disagree";
    /// The feature is disabled.
    NOT_ENABLED = 19, "the feature is disabled";
    /// Another process has the device open.
    DEVICE_IN_USE = 20, "another process uses the device";
    /// A parameter is out of range.
    INVALID = 21, "a parameter is out of range";
    /// The regulation thread is not running (since 3.10).
    NO_REGULATION = 22, "regulation is not running";
}

impl fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => write!(f, "{} (code {} {name})", self.meaning(), self.0),
            None => write!(f, "{} (code {})", self.meaning(), self.0),
        }
    }
}
