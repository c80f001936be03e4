//! The EVK1 Gen3.1: registers, requests, sensor gates, time base, and the thread that makes its stream.
//!
//! Written from the EVK1 reference alone and kept apart from the driver's own table of registers, so that a slip in
//! one of the two shows.

mod camera;
mod clock;
mod counters;
mod pattern;
mod producer;
mod registers;
mod requests;
mod sensor;

pub use camera::Evk1;
pub use clock::SyncLine;
pub use counters::Counters;
pub use producer::produce;
