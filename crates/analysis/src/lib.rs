//! What a session says about the skin: clock fits, segmentation, clustering, triangulation, calibration, metrics.
//!
//! Numbers in, numbers out: no files, no SQL, no devices, no clock, no randomness but the seed in the
//! settings. The same input gives the same result to the last bit on the same machine.
//!
//! Data flows one way: [`timebase`], or [`clock`] without reports of a trigger box, finds where host time lies on each camera's clock, [`segment`] turns measured
//! press times into windows of camera time, one pass over the events fills a [`grid`] per window and [`dbscan`]
//! finds its clusters, [`triangulate`] intersects the rays of the two centroids, [`calibrate`] fits the
//! camera geometry to the presses that calibrate ([`sets`]), [`metrics`] judges those that score.

mod accumulate;
mod activity;
mod analyze;
mod audit;
pub mod bit_rates;
pub mod calibrate;
mod caveats;
pub mod check;
pub mod clock;
mod closeups;
pub mod cmre;
mod counters;
pub mod coverage;
pub mod dbscan;
pub mod distributions;
mod error;
pub mod estimators;
mod exact;
pub mod grid;
mod hash;
mod held;
pub mod input;
mod judge;
mod keeper;
pub mod kept;
pub mod latency;
mod leg;
pub mod legs;
pub mod metrics;
pub mod motion;
mod onsets;
mod pixels;
mod press_spans;
pub mod rates;
mod reading;
pub mod reduction;
pub mod reference_code;
pub mod result;
pub mod seeded;
pub mod segment;
mod session_base;
pub mod sets;
mod stream;
pub mod sums;
pub mod timebase;
pub mod tradeoff;
pub mod triangulate;
mod untimed;
pub mod verdict;
mod width;

pub use analyze::{analyze, analyze_and_keep};
pub use error::AnalysisError;
pub use hash::results_hash;
pub use input::{Descent, EarlierAttempt, EventSource, SessionInput};
pub use kept::{Keep, Kept};
pub use leg::LegStart;
pub use result::{ANALYSIS_VERSION, Analysis};
