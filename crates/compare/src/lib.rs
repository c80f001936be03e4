//! Compares skins: is one better, are they comparable, and what explains the difference. Compares a session with simulated ones.
//!
//! Pure computation: no files, SQL or devices; randomness comes only from the seed in the settings.

pub mod causes;
pub mod comparability;
mod flatten;
mod location_results;
mod locations;
mod metrics;
mod no_result;
mod result;
pub mod scene;
mod sequential;
mod subject;
mod table;
pub mod twin;

pub use causes::{Causes, Contribution, CrossEvaluation, Factor, FactorMeasurement, Reanalysis};
pub use comparability::{Difference, RULES, Rule, Severity, differences, fact_differences};
pub use flatten::flatten;
pub use location_results::{Location, LocationComparison};
pub use metrics::{DisplayFormat, Metric};
pub use no_result::NoResult;
pub use result::{Comparison, ComparisonOptions, Reanalyses, Skin, compare};
pub use sequential::{Look, SequentialComparison};
pub use subject::{Session, SessionFacts, Subject};
pub use table::{BaselineComparison, Margins, Row, Value};
