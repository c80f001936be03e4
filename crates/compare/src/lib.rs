//! Whether one skin is better than another.
//!
//! Numbers in, numbers out: no files, no SQL, no devices, no randomness but the seed in the settings.

pub mod causes;
pub mod comparability;
mod flat;
mod maps;
mod metrics;
mod places;
mod result;
pub mod statistics;
mod subject;
mod table;

pub use causes::{Again, Causes, Contribution, Exchange, Factor, Measured};
pub use comparability::{Difference, RULES, Rule, Weight, differences};
pub use flat::flatten;
pub use maps::{Here, Location};
pub use metrics::{Metric, Shown};
pub use result::{Choices, Comparison, Exchanged, Skin, compare};
pub use subject::{Facts, Session, Subject};
pub use table::{Against1, Margins, Row, Value};
