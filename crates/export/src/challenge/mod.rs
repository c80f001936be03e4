//! A challenge: the events of a session's presses for anyone who wants to locate them, with the positions of the calibration
//! presses, and the positions of the scored presses sealed away in a file of answers.
//!
//! Presses have new numbers in a random order, and times count from the contact, because the order of a path gives positions
//! away. The order follows from random bytes, which the file of answers holds: its hash in the description commits to the positions
//! without giving them away, even to someone who knows all positions of the plan.

mod answers;
mod error;
mod estimates;
mod guest;
mod make;
mod score;

pub use answers::{Answer, Answers, ChallengeSelection};
pub use error::{ChallengeError, EstimateError};
pub use estimates::{Estimates, Position};
pub use guest::{Examination, Guest, GuestError, LeftOut, Timeouts, examine};
pub use make::{ChallengeFiles, ChallengeOptions, EventQuery, make};
pub use score::{Judgement, score};

/// Name of the description in the folder of a challenge.
pub(crate) const DESCRIPTION: &str = "challenge.json";
/// Suffix of the table of presses in that folder.
pub(crate) const STEM: &str = "challenge";
/// Version of the layout of description and answers.
pub(crate) const FORMAT: u32 = 1;
