//! What a night of checks says: verdicts, causes, results, trends. Numbers in, numbers out.
//!
//! A [`Night`] is a tree: checks, their attempts, the parts of an attempt (one per device), the measurements of a part.
//! Every measurement meets the limit that was stated before it was made; the worst child's verdict is its parent's
//! ([`Verdict`]). What kept something from being measured, and what else was seen, is [`Evidence`]; [`rules`] tell from
//! it whether the skin, the rig, the computer or the software is to be looked at.

mod cause;
pub mod evidence;
pub mod judge;
pub mod junit;
pub mod night;
pub mod rules;
pub mod trend;
pub mod verdict;

pub use cause::Cause;
pub use evidence::{Evidence, EvidenceKind};
pub use night::{Attempt, CheckResult, Golden, Measurement, Night, Part, Versions};
pub use rules::{Rule, Ruling};
pub use verdict::{NightExit, Verdict};
