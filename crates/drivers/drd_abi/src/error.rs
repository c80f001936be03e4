//! Error codes of the library.

use std::fmt;

/// An error code as the library keeps it per thread.
///
/// Which call sets which code is hardly documented: treat every code as possible everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ErrorCode(pub i32);

/// Declares the codes and their words.
macro_rules! codes {
    ($($(#[$doc:meta])* $name:ident = $code:literal, $text:literal;)*) => {
        impl ErrorCode {
            $($(#[$doc])* pub const $name: Self = Self($code);)*

            /// Every code that SDK 3.17.5 declares.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            /// The code's name without the vendor's prefix; `None` for a code that we do not know.
            #[must_use]
            pub const fn name(self) -> Option<&'static str> {
                match self.0 {
                    $($code => Some(stringify!($name)),)*
                    _ => None,
                }
            }

            /// What the code means, in our words.
            #[must_use]
            pub const fn meaning(self) -> &'static str {
                match self.0 {
                    $($code => $text,)*
                    _ => "a code that this driver does not know",
                }
            }
        }
    };
}

codes! {
    /// Nothing failed.
    NO_ERROR = 0, "no error";
    /// Not told.
    UNDOCUMENTED = 1, "an error that the library does not explain";
    /// The link to the device broke: unplugged, powered off, or a USB fault.
    COM = 2, "the link to the device broke";
    /// The controller has no time for this now.
    DHC_BUSY = 3, "the device's controller is busy";
    /// No USB driver, or no permission.
    NO_DRIVER_FOUND = 4, "no usable USB driver, or no permission to use the device";
    /// No device is connected.
    NO_DEVICE_FOUND = 5, "no device found";
    /// This device cannot do that.
    NOT_AVAILABLE = 6, "this device cannot do that";
    /// It took too long.
    TIMEOUT = 7, "it took too long";
    /// The target cannot be reached.
    GEOMETRY = 8, "the target is out of reach";
    /// A guarded call without expert mode.
    EXPERT_MODE_DISABLED = 9, "expert mode is off";
    /// The library lacks it.
    NOT_IMPLEMENTED = 10, "the library does not implement that";
    /// No memory.
    OUT_OF_MEMORY = 11, "out of memory";
    /// The device is not calibrated.
    DEVICE_NOT_READY = 12, "the device is not ready: not initialised or in reset";
    /// A file is missing.
    FILE_NOT_FOUND = 13, "a file was not found";
    /// The controller's memory does not hold what it should.
    CONFIGURATION = 14, "the device's configuration is damaged";
    /// An index beyond its range.
    INVALID_INDEX = 15, "an index is out of range";
    /// No longer supported.
    DEPRECATED = 16, "the library no longer supports this device or call";
    /// A NULL or invalid argument.
    NULL_ARGUMENT = 17, "an argument is NULL or invalid";
    /// The redundant encoders disagree.
    REDUNDANT_FAIL = 18, "the redundant encoders disagree";
    /// The feature is off.
    NOT_ENABLED = 19, "the feature is off";
    /// Another process holds the device.
    DEVICE_IN_USE = 20, "another process holds the device";
    /// A parameter out of range.
    INVALID = 21, "a parameter is out of range";
    /// The regulation thread does not run (since 3.10).
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
