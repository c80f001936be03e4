//! From a session file to its analysis, in named stages.
//!
//! 1. [`Session::open`]: the file, its header and the rig that it describes, with the settings of the analysis.
//! 2. [`Session::recorded`]: everything the analysis needs but the events, in the times in which each leg was recorded.
//! 3. [`Recorded::align`]: the legs of a resumed run in one time.
//! 4. [`Aligned::analyze`]: the complete analysis, with the robot's path and, when asked for, the public code's results.
//!
//! [`analyze`] runs all four. Other programs call this crate; the command line parses, calls it and prints.

mod contacts;
mod error;
mod events;
mod rig_document;
mod session;
mod settings;
mod stages;

pub use error::ResultsError;
pub use events::{Rescan, SessionEvents};
pub use rig_document::RigDocument;
pub use session::Session;
pub use settings::Choices;
pub use stages::{Aligned, Analyzed, Recorded, analyze};
