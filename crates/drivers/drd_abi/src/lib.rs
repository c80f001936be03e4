//! Declarations of libdrd's C interface: signatures, constants, error codes. Contains no vendor code.
//!
//! libdrd is Force Dimension's robotics library and includes their haptics library (libdhd). It is loaded at run time and never linked.
//! The facts (names, argument order, numbers) are those of the public headers of SDK 3.7.1, 3.10.0 and 3.17.5; the descriptions are
//! our own.
//!
//! One table, [`drd_symbols!`], lists every function in use. It generates the function types in [`fns`], the loader's [`Functions`] and the
//! list [`SYMBOLS`]. The emulated libdrd checks its exports against the same table at compile time.
//!
//! # Rules of this interface
//! - Calling convention `extern "system"`: `stdcall` on 32-bit Windows, the C convention elsewhere.
//! - C++ default arguments do not exist in the binary interface: pass every argument, the device's [`DeviceId`] last.
//! - The device ID is a C `char` that can be -1, hence `i8` on every platform.
//! - A returned C++ `bool` is declared as `u8` and compared with 0 ([`is_true`]): a Rust `bool` with a byte other than 0 or 1 is undefined
//!   behaviour.
//! - A call succeeded when its result is [`>= 0`](succeeded): 1 ([`TIMEGUARD`]) and 2
//!   ([`MOTOR_SATURATED`]) are successes.
//! - The error code is kept per thread: read it on the thread of the failed call, before any other call.
//! - Returned strings are static, belong to the library and may be NULL.
//! - Before SDK [3.7.1](SdkVersion::OLDEST) some names have other arguments: check the version first.

mod constants;
mod error;
mod functions;
mod status;
mod table;
mod version;

pub use constants::*;
pub use error::ErrorCode;
pub use functions::{Functions, Group, MissingFunctions, Requirement, SYMBOLS, Symbol, fns};
pub use status::{ForceOffCause, STATUS_CAPACITY, StatusField, StatusVector};
pub use version::SdkVersion;
