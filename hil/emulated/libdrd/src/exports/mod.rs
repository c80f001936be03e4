//! The C interface: every function of the table, checked against it at compile time.

mod device;
mod library;
mod outcome;
mod reading;
mod regulation;
mod settings;

use skinrig_drd_abi::drd_symbols;

use device::*;
use library::*;
use reading::*;
use regulation::*;
use settings::*;

/// Fails to compile if an export is missing or has another signature than in the table.
macro_rules! same_signatures {
    ($($group:ident $need:ident {
        $($(#[$doc:meta])* $name:ident($($arg:ident: $ty:ty),* $(,)?) -> $ret:ty;)*
    })*) => {
        $($(const _: skinrig_drd_abi::fns::$name = $name;)*)*
    };
}

drd_symbols!(same_signatures []);
