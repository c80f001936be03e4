//! The EVK1 Gen3.1: registers, requests, event filters, time base, and the thread that generates its stream.
//!
//! Written from the EVK1 reference alone and independent of the driver's register table, so that an error in one of them shows.

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
