//! Everything that can go wrong with a foreign format.

use std::path::PathBuf;

use thiserror::Error;

/// An error of this crate. Messages name the file, the place in it, what was expected and what was found.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FormatsError {
    /// An item handed to an encoder lies before what it already wrote.
    #[error("expected items in time order, found {found_us} µs after {written_us} µs was written")]
    OutOfOrder {
        /// The item's time, µs.
        found_us: u64,
        /// What the stream has reached, µs.
        written_us: u64,
    },
    /// A value does not fit the field that the format has for it.
    #[error("expected {what} in 0..={max}, found {found}")]
    OutOfRange {
        /// The quantity.
        what: &'static str,
        /// Largest value that fits.
        max: u64,
        /// The value.
        found: u64,
    },
    /// A time-base cadence that the format cannot keep.
    #[error("expected a TIME_HIGH cadence that divides 64 µs, found {0} µs")]
    Cadence(u64),
    /// Reading or writing failed.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}
