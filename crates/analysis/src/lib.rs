//! Analyses a session: clock fits, segmentation, clustering, triangulation, calibration, metrics.
//!
//! Pure computation: no files, SQL, devices or clocks; randomness comes only from the seed in the settings. The result is
//! bit-identical for the same input on the same machine.
//!
//! Data flows one way: [`timebase`], or [`clock`] without trigger box reports, maps host time to each camera's clock;
//! [`segment`] turns measured press times into windows of camera time; one pass over the events fills a [`grid`] per window,
//! and [`dbscan`] finds its clusters; [`triangulate`] intersects the rays of the two centroids; [`calibrate`] fits the
//! camera geometry to the calibration presses ([`sets`]); [`metrics`] evaluates the scored ones.

mod accumulate;
mod activity;
mod analyze;
mod audit;
pub mod background;
pub mod bit_rates;
mod bursts;
pub mod calibrate;
mod camera_clocks;
mod camera_pass;
mod caveats;
mod ceiling;
mod changes;
pub mod check;
pub mod clock;
mod closeups;
pub mod cmre;
mod counters;
pub mod coverage;
mod crowded;
pub mod dbscan;
pub mod digits;
mod distinct;
mod error;
pub mod estimators;
mod event_cache;
pub mod event_runs;
pub mod event_statistics;
mod exact;
pub mod exclusion;
pub mod grid;
mod hash;
pub mod hot_pixels;
mod indentation;
pub mod input;
mod judging_settings;
mod lanes;
pub mod latency;
mod leg;
pub mod legs;
mod locate_presses;
pub mod locator;
pub mod metrics;
pub mod motion;
pub mod multi_touch;
mod onsets;
mod over_locations;
mod pixels;
mod press_event_collector;
pub mod press_events;
mod press_spans;
mod press_view;
mod quiet_parts;
pub mod rates;
pub mod reduction;
pub mod reference_code;
mod repeats;
pub mod result;
pub mod rule;
pub mod segment;
mod session_base;
pub mod sets;
mod stamp_steps;
mod storms;
mod stream;
mod stretch;
pub mod sums;
pub mod tie;
pub mod timebase;
pub mod tradeoff;
pub mod triangulate;
mod untimed;
mod unused_settings;
pub mod verdict;
mod width;
mod with_text;

pub use analyze::{analyze, analyze_recalibrated, analyze_with_events};
pub use error::{AnalysisError, RecalibrationError};
pub use hash::results_hash;
pub use input::{Descent, EarlierAttempt, EventSource, EventSourceError, SessionInput};
pub use leg::LegStart;
pub use press_events::{RetainedPresses, Retention};
pub use result::{ANALYSIS_VERSION, Analysis};
