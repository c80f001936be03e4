//! Verdicts, causes and trends of nightly runs. Pure computation, without devices or files.
//!
//! A [`Night`] is a tree: checks, their attempts, the parts of an attempt (one per device), the measurements of a part.
//! Every measurement is compared with a limit stated in advance; a parent takes the worst verdict of its children ([`Verdict`]).
//! [`Evidence`] records what prevented a measurement and what else was observed. From it, [`rules`] derive whether to look at the
//! skin, the rig, the computer or the software.

mod cause;
pub mod evidence;
pub mod judge;
pub mod junit;
pub mod night;
pub mod rules;
pub mod trend;
mod unsound;
pub mod verdict;

pub use cause::Cause;
pub use evidence::{Evidence, EvidenceKind};
pub use night::{Attempt, CheckResult, GoldenSession, Measurement, Night, Part, Versions};
pub use rules::{Rule, RuleResult};
pub use unsound::unsound;
pub use verdict::{NightExit, Verdict};
