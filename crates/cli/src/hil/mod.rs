//! `skinrig hil`: runs suites of checks on a bench.

pub(crate) mod accept;
mod alarms;
pub(crate) mod args;
pub(crate) mod bench;
mod campaign;
mod contradictions;
mod drill;
pub(crate) mod hold;
pub(crate) mod lease;
mod live;
mod messages;
mod real_bench;
mod rebuild;
pub(crate) mod run;
pub(crate) mod trend;
mod trouble;

use crate::exit::Outcome;
use args::{HilArgs, HilCommand};

/// `skinrig hil`.
///
/// # Errors
/// See the commands.
pub(crate) fn hil(args: &HilArgs, command_line: &str, json: bool) -> Outcome {
    match &args.command {
        HilCommand::Lease(a) => lease::lease(a, json),
        HilCommand::Run(a) => run::run(a, command_line, json),
        HilCommand::Trend(a) => trend::trend(a, json),
        HilCommand::Accept(a) => accept::accept(a, json),
    }
}
