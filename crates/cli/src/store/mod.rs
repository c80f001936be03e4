//! `skinrig store`: sessions in an object store, with a reference in the place of each.

pub(crate) mod args;
#[cfg(feature = "s3")]
mod moves;

use self::args::StoreArgs;
use crate::exit::Outcome;

/// `skinrig store`.
///
/// # Errors
/// [`Failure::input`](crate::exit::Failure::input) for a wrong address or session, and in a build without the feature `s3`;
/// [`Failure::internal`](crate::exit::Failure::internal) if the store or the disk fails.
#[cfg(feature = "s3")]
pub(crate) fn store(args: &StoreArgs, json: bool) -> Outcome {
    moves::store(args, json)
}

/// As above.
#[cfg(not(feature = "s3"))]
pub(crate) fn store(_: &StoreArgs, _: bool) -> Outcome {
    Err(crate::exit::Failure::input(
        "expected a build with support for object stores, found one without\n  next: cargo build --release -p skinrig --features s3",
    ))
}

/// Makes references to objects readable in this program. Nothing is asked of a store before the first one.
#[cfg(feature = "s3")]
pub fn read_references() {
    skinrig_recorder::use_object_store(|| {
        Ok(Box::new(skinrig_objects::Objects(
            skinrig_objects::connect(std::env::vars())?,
        )))
    });
}

/// As above: an error of each reference names the feature.
#[cfg(not(feature = "s3"))]
pub const fn read_references() {}
