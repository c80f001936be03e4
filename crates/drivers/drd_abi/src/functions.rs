//! What the table becomes: function types, the list of symbols, and the struct of resolved functions.

use std::ffi::{CStr, c_void};
use std::fmt;
use std::ptr::NonNull;

use crate::drd_symbols;

/// What a function is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    /// Errors, version, time.
    Library,
    /// Finding, opening, closing.
    Open,
    /// Which device it is.
    Identify,
    /// Calibration.
    Initialise,
    /// Mounting, mass, limits.
    Settings,
    /// Regulated motion and its parameters.
    Regulation,
    /// Pose, force, status, rates.
    Read,
    /// Taking the power off.
    Emergency,
    /// What the library guards behind its expert mode.
    Expert,
}

/// Whether the driver can do without a function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// Absent: the library is refused.
    Required,
    /// Absent: the driver goes on without.
    Optional,
}

/// One line of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Symbol {
    /// Exported name.
    pub name: &'static str,
    /// What it is for.
    pub group: Group,
    /// Whether we can do without.
    pub need: Need,
    /// Arguments and result as Rust types.
    pub signature: &'static str,
}

/// The required functions that a library lacks, in the order of the table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Missing(pub Vec<&'static str>);

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the library lacks {}", self.0.join(", "))
    }
}

impl std::error::Error for Missing {}

/// The word of the table as a [`Need`].
macro_rules! need {
    (required) => {
        Need::Required
    };
    (optional) => {
        Need::Optional
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

        /// Every function that we use, in the order of the table.
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
        /// The functions of one loaded library. Good for as long as the library stays loaded.
        #[derive(Debug, Clone, Copy)]
        #[expect(non_snake_case, reason = "the names of the C interface")]
        pub struct Functions {
            $($(#[$rdoc])* pub $req: fns::$req,)*
            $($(#[$odoc])* pub $opt: Option<fns::$opt>,)*
        }

        #[expect(non_snake_case, reason = "the names of the C interface")]
        impl Functions {
            /// Looks every function of the table up.
            ///
            /// # Errors
            /// [`Missing`] with all the required functions for which `lookup` gave `None`.
            ///
            /// # Safety
            /// Each address that `lookup` returns must be that of a function of the name asked for, of an
            /// SDK of at least [`SdkVersion::OLDEST`](crate::SdkVersion::OLDEST), in a library that is
            /// never unloaded while the result or a copy of it is in use.
            pub unsafe fn resolve(
                mut lookup: impl FnMut(&'static CStr) -> Option<NonNull<c_void>>,
            ) -> Result<Self, Missing> {
                let mut missing = Vec::new();
                $(let $req = lookup(c_name(concat!(stringify!($req), "\0")));
                if $req.is_none() {
                    missing.push(stringify!($req));
                })*
                $(let $opt = lookup(c_name(concat!(stringify!($opt), "\0")));)*
                // One refutable pattern for all the required ones: present, or told together.
                let ($(Some($req),)*) = ($($req,)*) else {
                    return Err(Missing(missing));
                };
                Ok(Self {
                    // SAFETY: by this function's contract the address is that of this very function.
                    $($req: unsafe { std::mem::transmute::<NonNull<c_void>, fns::$req>($req) },)*
                    $($opt: $opt.map(|address| {
                        // SAFETY: by this function's contract the address is that of this very function.
                        unsafe { std::mem::transmute::<NonNull<c_void>, fns::$opt>(address) }
                    }),)*
                })
            }
        }
    };
}

/// A literal that ends with its NUL, as a C string.
const fn c_name(with_nul: &'static str) -> &'static CStr {
    match CStr::from_bytes_with_nul(with_nul.as_bytes()) {
        Ok(name) => name,
        Err(_) => panic!("a name of the table holds a NUL"),
    }
}

drd_symbols!(declare []);
