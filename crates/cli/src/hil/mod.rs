//! `skinrig hil`: a suite of checks on a bench.

pub mod accept;
mod alarms;
pub mod args;
pub mod bench;
mod drill;
mod folder;
mod golden;
mod golden_numbers;
pub mod hold;
pub mod lease;
mod live;
mod real_bench;
pub mod run;
pub mod trend;
mod trouble;

use crate::exit::Outcome;
use args::{HilArgs, HilCommand};

/// `skinrig hil`.
///
/// # Errors
/// [`crate::exit::Failure`] with the code that says what kind.
pub fn hil(args: &HilArgs, command_line: &str, json: bool) -> Outcome {
    match &args.command {
        HilCommand::Lease(a) => lease::lease(a, json),
        HilCommand::Run(a) => run::run(a, command_line, json),
        HilCommand::Trend(a) => trend::trend(a, json),
        HilCommand::Accept(a) => accept::accept(a, json),
    }
}
