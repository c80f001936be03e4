//! Touch felt while events arrive: detection, and position with its region at every instant.
//!
//! Data flows one way: `slots` joins the events of both cameras on common time and counts them per pixel region; `bank` compares
//! each slot with the `background` and with how touches begin at the places learnt ([`learn()`]); [`Detector`] decides.
//! Integers and exactly reproducible arithmetic: the same events give the same answers, however they are cut.

mod background;
mod bank;
mod clock;
mod counts;
mod depth;
mod detector;
mod direction;
mod envelope;
mod felt;
mod history;
mod interleave;
mod learn;
mod learn_skin;
mod live;
mod log_table;
mod model;
mod patterns;
mod position;
mod regions;
mod rise;
mod run_estimator;
mod score;
mod settling;
mod skin_model;
mod slots;
mod stream;
mod threshold;
mod tip;
mod touch;
mod training;
mod worker;

pub use clock::SLOT_US;
pub use detector::{Detection, Detector, Felt, UnusableClock};
pub use felt::felt;
pub use interleave::interleave;
pub use learn::learn;
pub use live::{Decoders, Live};
pub use model::TouchModel;
pub use position::{Opening, Position, PositionEstimator, PositionRow};
pub use score::{DetectionScore, ScoredPress};
pub use skin_model::SkinModel;
pub use slots::Uncounted;
pub use stream::{CameraLeads, Estimate, StreamError, StreamSettings};
pub use threshold::{IdleStatistic, ThresholdError};
pub use tip::{TipCourse, TipCourses};
pub use training::{Training, TrainingError};
pub use worker::{News, Worker};

#[cfg(test)]
mod tests;
