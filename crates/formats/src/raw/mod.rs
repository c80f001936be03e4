//! Prophesee RAW files: a text header and the camera's words.
//!
//! The header is lines of `% key value`. Files of the vendor's tools from version 4 on end it with `% end`;
//! older ones, all of the EVK1's time, end it at the first line that does not begin with `% ` (EVK1 reference,
//! section 4.4). Nothing follows the words. Times are left as the camera counted them; the vendor's own reader
//! shifts them so that the first is near 0.

mod header;
mod problem;
mod read;
mod write;

pub use header::RawHeader;
pub use problem::{FormatProblem, HeaderProblem, ValueMismatch};
pub use read::RawReader;
pub use write::{RawMetadata, RawWriter};
