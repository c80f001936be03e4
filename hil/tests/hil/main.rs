//! Tests of the checks of a bench, their runner, history and lease.

mod cameras;
mod history;
mod lease;
mod robot;
mod runner;
