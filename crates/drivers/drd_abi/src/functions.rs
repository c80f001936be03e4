//! Code generated from the table: function types, the list of symbols, and the struct of resolved functions.

use std::ffi::{CStr, c_void};
use std::fmt;
use std::ptr::NonNull;

use crate::drd_symbols;

/// Purpose of a function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    /// Errors, version, time.
    Library,
    /// Finding, opening, closing.
    Open,
    /// Identity of a device.
    Identify,
    /// Calibration.
    Initialise,
    /// Mounting, mass, limits.
    Settings,
    /// Regulated motion and its parameters.
    Regulation,
    /// Pose, force, status, rates.
    Read,
    /// Switching the power off.
    Emergency,
    /// Functions that require expert mode.
    Expert,
}

/// Whether the driver needs a function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Requirement {
    /// If missing, the library is rejected.
    Required,
    /// If missing, the driver works without it.
    Optional,
}

/// An entry of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Symbol {
    /// Exported name.
    pub name: &'static str,
    /// Purpose.
    pub group: Group,
    /// Whether the driver needs it.
    pub need: Requirement,
    /// Arguments and result as Rust types.
    pub signature: &'static str,
}

/// Required functions missing in a library, in the order of the table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MissingFunctions(pub Vec<&'static str>);

impl fmt::Display for MissingFunctions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the library lacks {}", self.0.join(", "))
    }
}

impl std::error::Error for MissingFunctions {}

/// Converts the table's keyword to a [`Requirement`].
macro_rules! need {
    (required) => {
        Requirement::Required
    };
    (optional) => {
        Requirement::Optional
    };
}

/// Declares types, list and struct from the whole table.
macro_rules! declare {
    ($($group:ident $need:ident {
        $($(#[$doc:meta])* $name:ident($($arg:ident: $ty:ty),* $(,)?) -> $ret:ty;)*
    })*) => {
        /// The type of each function, under the function's name.
        #[expect(non_camel_case_types, reason = "the names of the C interface")]
        pub mod fns {
            $($(
                $(#[$doc])*
                pub type $name = unsafe extern "system" fn($($arg: $ty),*) -> $ret;
            )*)*
        }

        /// All functions in use, in the order of the table.
        pub const SYMBOLS: &[Symbol] = &[$($(
            Symbol {
                name: stringify!($name),
                group: Group::$group,
                need: need!($need),
                signature: stringify!(($($arg: $ty),*) -> $ret),
            },
        )*)*];

        struct_of! { [] [] $($need { $($(#[$doc])* $name;)* })* }
    };
}

/// Splits the table's blocks into required and optional functions, then declares [`Functions`].
macro_rules! struct_of {
    ([$($req:tt)*] [$($opt:tt)*] required { $($body:tt)* } $($rest:tt)*) => {
        struct_of! { [$($req)* $($body)*] [$($opt)*] $($rest)* }
    };
    ([$($req:tt)*] [$($opt:tt)*] optional { $($body:tt)* } $($rest:tt)*) => {
        struct_of! { [$($req)*] [$($opt)* $($body)*] $($rest)* }
    };
    ([$($(#[$rdoc:meta])* $req:ident;)*] [$($(#[$odoc:meta])* $opt:ident;)*]) => {
        /// Functions of a loaded library. Valid as long as the library stays loaded.
        #[derive(Debug, Clone, Copy)]
        #[expect(non_snake_case, reason = "the names of the C interface")]
        pub struct Functions {
            $($(#[$rdoc])* pub $req: fns::$req,)*
            $($(#[$odoc])* pub $opt: Option<fns::$opt>,)*
        }

        #[expect(non_snake_case, reason = "the names of the C interface")]
        impl Functions {
            /// Looks up all functions of the table.
            ///
            /// # Errors
            /// [`MissingFunctions`] with all required functions for which `lookup` returned `None`.
            ///
            /// # Safety
            /// Each address that `lookup` returns must be that of a function with the requested name, of an
            /// SDK of at least [`SdkVersion::OLDEST`](crate::SdkVersion::OLDEST), in a library that is
            /// never unloaded while the result or a copy of it is in use.
            pub unsafe fn resolve(
                mut lookup: impl FnMut(&'static CStr) -> Option<NonNull<c_void>>,
            ) -> Result<Self, MissingFunctions> {
                let mut missing = Vec::new();
                $(let $req = lookup(c_name(concat!(stringify!($req), "\0")));
                if $req.is_none() {
                    missing.push(stringify!($req));
                })*
                $(let $opt = lookup(c_name(concat!(stringify!($opt), "\0")));)*
                // One refutable pattern for all required functions: all present, or all missing ones reported together.
                let ($(Some($req),)*) = ($($req,)*) else {
                    return Err(MissingFunctions(missing));
                };
                Ok(Self {
                    // SAFETY: by this function's contract the address is that of this function.
                    $($req: unsafe { std::mem::transmute::<NonNull<c_void>, fns::$req>($req) },)*
                    $($opt: $opt.map(|address| {
                        // SAFETY: by this function's contract the address is that of this function.
                        unsafe { std::mem::transmute::<NonNull<c_void>, fns::$opt>(address) }
                    }),)*
                })
            }
        }
    };
}

/// A NUL-terminated literal as a C string.
const fn c_name(with_nul: &'static str) -> &'static CStr {
    match CStr::from_bytes_with_nul(with_nul.as_bytes()) {
        Ok(name) => name,
        Err(_) => panic!("a name of the table holds a NUL"),
    }
}

drd_symbols!(declare []);
