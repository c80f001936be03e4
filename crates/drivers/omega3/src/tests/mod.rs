//! Tests of the driver with a scripted library on a virtual clock: exact, without real waits.

mod engine;
mod open;
mod owner;
mod scripted;
