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
    /// An HDF5 file that the HDF5 library refuses; truncated files end here too.
    #[error("{}: expected a readable HDF5 file: {problem}", path.display())]
    Hdf5 {
        /// The file.
        path: PathBuf,
        /// What the library said.
        problem: String,
    },
    /// A file that is not what it should be as a whole.
    #[error("{}: expected {expected}, found {found}", path.display())]
    Container {
        /// The file.
        path: PathBuf,
        /// What was needed.
        expected: String,
        /// What is there, and what to do next.
        found: String,
    },
    /// One dataset of a container does not fit.
    #[error("{}: dataset {dataset}: expected {expected}, found {found}", path.display())]
    Dataset {
        /// The file.
        path: PathBuf,
        /// The dataset's path inside the file.
        dataset: String,
        /// What was needed.
        expected: String,
        /// What is there.
        found: String,
    },
    /// One value of a dataset is impossible.
    #[error("{}: dataset {dataset}, row {row}: expected {expected}, found {found}", path.display())]
    Row {
        /// The file.
        path: PathBuf,
        /// The dataset's path inside the file.
        dataset: String,
        /// Index of the value, 0 for the first.
        row: u64,
        /// What was needed.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A line of a RAW header.
    #[error(
        "{}: header, byte {offset}, key `{key}`: expected {expected}, found {found}",
        path.display()
    )]
    Header {
        /// The file.
        path: PathBuf,
        /// Where the line begins, bytes; the header's end for what is missing.
        offset: u64,
        /// The key; empty when the line has none.
        key: String,
        /// What was needed.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A key or value that a RAW header cannot hold.
    #[error(
        "header key `{key}`: expected a key of its own without spaces, and text in one line, found {value:?}"
    )]
    HeaderValue {
        /// The key.
        key: String,
        /// The value.
        value: String,
    },
    /// A line of a table.
    #[error("{}:{line}: expected {expected}, found {found}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// The line, 1 for the first.
        line: u64,
        /// What was needed.
        expected: String,
        /// What is there.
        found: String,
    },
}

impl FormatsError {
    /// Names the file of an I/O error.
    pub(crate) fn io(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, source }
    }

    /// Names the file of an HDF5 library error.
    pub(crate) fn hdf5(path: &std::path::Path) -> impl FnOnce(rust_hdf5::Hdf5Error) -> Self {
        let path = path.to_owned();
        move |error| Self::Hdf5 {
            path,
            problem: error.to_string(),
        }
    }
}
