//! Touch felt while events arrive: detection, and position with its region at every instant.
//!
//! Data flows one way: `slots` joins the events of both cameras on common time and counts them per pixel region; `bank` compares
//! each slot with the `background` and with how touches begin at the places learnt ([`learn()`]); [`Detector`] decides.
//! Integers and exactly reproducible arithmetic: the same events give the same answers, however they are cut.

mod background;
mod bank;
mod clock;
mod counts;
mod detector;
mod interleave;
mod learn;
mod live;
mod log_table;
mod model;
mod patterns;
mod position;
mod regions;
mod score;
mod slots;
mod threshold;
mod touch;
mod training;

pub use clock::SLOT_US;
pub use detector::{Detection, Detector, Felt, UnusableClock};
pub use interleave::interleave;
pub use learn::learn;
pub use live::{CameraLeads, Estimate, Live, LiveError, LiveSettings};
pub use model::TouchModel;
pub use position::{Position, PositionEstimator, PositionRow};
pub use score::{DetectionScore, ScoredPress};
pub use slots::Uncounted;
pub use threshold::{IdleStatistic, ThresholdError};
pub use training::{Training, TrainingError};

#[cfg(test)]
mod tests;
