//! The EVK1 Gen3.1: registers, requests, event filters, time base, and the thread that generates its stream.
//!
//! Written from the EVK1 reference alone, independently of the driver's register table, so that an
//! error in either shows.

mod camera;
mod clock;
mod counters;
mod pattern;
mod producer;
mod registers;
mod requests;
mod sensor;

pub(crate) use camera::Evk1;
pub(crate) use clock::SyncLine;
pub use counters::Counters;
pub(crate) use producer::produce;
