//! Tests of the checks of a bench, their runner, history and lease.

mod cameras;
mod history;
mod lease;
mod robot;
mod runner;
#[path = "../../examples/simulated_history.rs"]
#[expect(dead_code, reason = "an example has a `main`")]
mod simulated_history;
