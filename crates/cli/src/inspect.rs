//! `skinrig inspect`.
use crate::args::InspectArgs;
use crate::exit::{Exit, Outcome};
/// x
pub fn inspect(_: &InspectArgs, _: bool) -> Outcome {
    Ok(Exit::Ok)
}
