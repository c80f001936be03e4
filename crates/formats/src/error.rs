//! Errors of foreign formats.

use std::path::PathBuf;

use thiserror::Error;

use crate::raw::HeaderProblem;

/// An error of this crate. Messages name the file, the location in it, and the expected and found values.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FormatsError {
    /// An item is earlier than the encoder's output so far.
    #[error("expected items in time order, found {found_us} µs after {written_us} µs was written")]
    OutOfOrder {
        /// The item's time, µs.
        found_us: u64,
        /// Time of the stream so far, µs.
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
    /// A time-base cadence that the format does not support.
    #[error("expected a TIME_HIGH cadence that divides 64 µs, found {0} µs")]
    Cadence(u64),
    /// Reading or writing failed.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// An HDF5 file that the HDF5 library rejects, for example a truncated one.
    #[error("{}: expected a readable HDF5 file: {problem}", path.display())]
    Hdf5 {
        /// The file.
        path: PathBuf,
        /// Error of the library.
        problem: String,
    },
    /// A file of the wrong kind.
    #[error("{}: expected {expected}, found {found}", path.display())]
    Container {
        /// The file.
        path: PathBuf,
        /// What is valid there.
        expected: String,
        /// Actual content, and the next step.
        found: String,
    },
    /// One dataset of a container does not fit.
    #[error("{}: dataset {dataset}: expected {expected}, found {found}", path.display())]
    Dataset {
        /// The file.
        path: PathBuf,
        /// The dataset's path inside the file.
        dataset: String,
        /// Valid content.
        expected: String,
        /// Actual content.
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
        /// Valid content.
        expected: String,
        /// Actual content.
        found: String,
    },
    /// A line of a RAW header.
    #[error(
        "{}: header, byte {offset}, key `{key}`: {problem}",
        path.display()
    )]
    Header {
        /// The file.
        path: PathBuf,
        /// Offset of the line, bytes; the header's end for a missing line.
        offset: u64,
        /// The key; empty if the line has none.
        key: String,
        /// Expected and found values.
        #[source]
        problem: HeaderProblem,
    },
    /// A key or value that a RAW header cannot contain.
    #[error(
        "header key `{key}`: expected a unique key without spaces, and text in one line, found {value:?}"
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
        /// Valid content.
        expected: String,
        /// Actual content.
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
