//! Turns a session file into its analysis, in named stages.
//!
//! 1. [`Session::open`]: reads the file, its header and rig description, and the analysis settings.
//! 2. [`Session::read_input`]: reads everything that the analysis needs except the events, with the times of each leg as
//!    recorded.
//! 3. [`RecordedSession::align`]: aligns the legs of a resumed run.
//! 4. [`AlignedSession::analyze`]: runs the complete analysis, with the robot's path and, on request, the public code's
//!    results.
//!
//! [`analyze`] runs all four. [`take_look`] looks at a running campaign.

mod campaign;
mod contacts;
mod earlier;
mod earlier_mismatch;
mod error;
mod event_statistics;
mod events;
mod learn_skin;
mod origin;
mod rig_document;
mod session;
mod settings;
mod shared_events;
mod stages;
mod take_look;
mod window;

pub use earlier_mismatch::EarlierMismatch;
pub use error::{LookFault, NotLearnt, ResultsError};
pub use event_statistics::{event_statistics, press_statistics};
pub use events::{Rescan, SessionEvents};
pub use learn_skin::learn_skin;
pub use origin::{Origin, differences_from_optical};
pub use rig_document::RigDocument;
pub use session::Session;
pub use settings::AnalysisOptions;
pub use stages::{AlignedSession, AnalyzedSession, RecordedSession, analyze};
pub use take_look::take_look;
pub use window::{ChunkIndex, events_between};
