//! Errors in the text header of a RAW file.

use super::header::{MAX_LINE, MAX_LINES};

/// Error in a line of a RAW header, or in all of it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum HeaderProblem {
    /// The file begins with something else.
    #[error("expected a header that begins with `% `, found {start:?}")]
    Missing {
        /// The first characters of the file.
        start: String,
    },
    /// The line is too long.
    #[error("expected a line of at most {MAX_LINE} bytes, found no end of line")]
    LongLine,
    /// The line is not UTF-8.
    #[error("expected text in UTF-8, found {found:?}")]
    NotUtf8 {
        /// The beginning of the line.
        found: String,
    },
    /// The line is blank.
    #[error("expected a key, found an empty line")]
    NoKey,
    /// There are too many lines.
    #[error("expected at most {MAX_LINES} header lines, found more")]
    ManyLines,
    /// The value of a key is invalid.
    #[error("{mismatch}, found {found}")]
    Value {
        /// What is valid for the key.
        #[source]
        mismatch: ValueMismatch,
        /// The value.
        found: String,
    },
    /// The header does not state the word format.
    #[error("expected one of EVT2, EVT21, EVT3 in `format` or `evt`, found {0}")]
    Format(#[source] FormatProblem),
}

/// Expected form of an invalid header value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ValueMismatch {
    /// The options of `format` are not pairs.
    #[error("expected options of the form name=value")]
    Options,
    /// The size has no `x`.
    #[error("expected WIDTHxHEIGHT")]
    Geometry,
    /// The system ID is not a number.
    #[error("expected a decimal number")]
    Number,
    /// The byte order is unknown.
    #[error("expected endianness little or legacy")]
    Endianness,
    /// The byte order contradicts an earlier line.
    #[error("expected the endianness that the header states elsewhere")]
    OtherEndianness,
    /// The size is not a number, or out of range.
    #[error("expected a {side} in 1..=2048")]
    Size {
        /// `width` or `height`.
        side: &'static str,
    },
    /// The size contradicts an earlier line.
    #[error("expected {side} {stated} as stated elsewhere in the header")]
    OtherSize {
        /// `width` or `height`.
        side: &'static str,
        /// The earlier size, pixels.
        stated: u16,
    },
}

/// Reason why a header does not give the word format.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FormatProblem {
    /// The `format` is unknown.
    #[error("format `{format}`")]
    Format {
        /// Its name.
        format: String,
    },
    /// The `evt` is unknown.
    #[error("evt `{evt}`")]
    Evt {
        /// Its version.
        evt: String,
    },
    /// The two keys contradict each other.
    #[error("format `{format}` and evt `{evt}`")]
    Contradiction {
        /// Value of `format`.
        format: String,
        /// Value of `evt`.
        evt: String,
    },
    /// No key states or implies the format.
    #[error("neither key, and no system_ID that implies it")]
    Unstated,
}
