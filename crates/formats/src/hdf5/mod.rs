//! bimvee HDF5 containers: Python dictionaries of events, dumped by hickle 3, 4 or 5.
//!
//! bimvee has no layout of its own, so the tree depends on the hickle version. In all versions, every
//! link is a dictionary key in quotes, and versions 3 and 4 put each value one level deeper, in a dataset
//! named `data_0` or `data`. A *dvs dictionary* is a parent with `ts`, `x`, `y` and `pol`.
//!
//! # Time
//! `ts` is in seconds. An event's time is `round(ts * 10^6)` µs: the file's own time, which begins near 0 in
//! files from bimvee's importer. The `tsOffset` of the dictionary is the offset added to the
//! camera's time (`camera time = ts - tsOffset`); it is reported and never applied.
//!
//! # Memory
//! Columns are read and written in slices of some ten thousand rows, so memory does not grow with the file.

mod column;
mod read;
mod tree;
mod write;

pub use read::EventReader;
pub use tree::{Container, DvsEntry};
pub use write::EventWriter;

/// Rows per write: they stay in the second-level cache, and are one chunk of a file written here.
const BATCH_ROWS: usize = 16_384;
