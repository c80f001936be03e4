//! Runs the nightly suite on a bench: the checks, their order and repeats, the lease of the bench and the history of nights.
//!
//! A check ([`checks::run`]) gets its devices from a [`Bench`], uses them through their traits, and fills a [`Findings`] with measured
//! values and with evidence of what prevented a measurement. `skinrig-nightly` judges the findings: limits, verdicts and causes.

pub mod arm;
pub mod bench;
pub mod checks;
pub mod device_evidence;
pub mod findings;
mod golden_evidence;
mod golden_values;
pub mod history;
pub mod lease;
pub mod night_folder;
pub mod run_evidence;
pub mod runner;
mod streams;
mod test_volume;

pub use bench::{Bench, CampaignRun, Devices, DrillResult, OnlineComparison, Problem, Slot};
pub use checks::disk_write_rate;
pub use findings::{Findings, GoldenRecord};
pub use runner::{NightObserver, SuiteRunner};
