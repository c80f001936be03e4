//! The C interface of libdrd as declarations: signatures, constants, error codes; no vendor code.
//!
//! libdrd is Force Dimension's robotic library and contains all of their haptic library (libdhd); it is
//! loaded at run time and never linked. The facts below (names, argument order, numbers) are those of
//! the public headers of SDK 3.7.1, 3.10.0 and 3.17.5; every wording is ours.
//!
//! One table, [`drd_symbols!`], lists every function that we use. From it come the function types in
//! [`fns`], the loader's [`Functions`] and the list [`SYMBOLS`]; the stand-in of the emulated bench checks
//! its exports against the same table at compile time, so that the two cannot drift apart.
//!
//! # Rules of this interface
//! - Calling convention `extern "system"`: `stdcall` on 32-bit Windows, the C convention elsewhere.
//! - C++ default arguments do not cross the border: every argument is passed, the device's
//!   [`DeviceId`] last.
//! - The device id is a C `char` that takes -1, hence `i8` on every platform.
//! - A C++ `bool` that comes back is taken as `u8` and compared with 0 ([`is_true`]): another byte than 0 or 1 in a Rust
//!   `bool` is undefined behaviour.
//! - A call succeeded when its result is [`>= 0`](succeeded): 1 ([`TIMEGUARD`]) and 2
//!   ([`MOTOR_SATURATED`]) are successes.
//! - The error code is kept per thread: read it on the thread that failed, before any other call.
//! - Returned texts belong to the library, are static and may be NULL.
//! - Below SDK [3.7.1](SdkVersion::OLDEST) some names carry other arguments: ask for the version first.

mod constants;
mod error;
mod functions;
mod status;
mod table;
mod version;

pub use constants::*;
pub use error::ErrorCode;
pub use functions::{Functions, Group, Missing, Need, SYMBOLS, Symbol, fns};
pub use status::{ForceOffCause, STATUS_CAPACITY, StatusField, StatusVector};
pub use version::SdkVersion;
