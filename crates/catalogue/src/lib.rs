//! A catalogue of a lab: sessions, analyses, nights and prototypes in one database that answers questions.
//!
//! The files stay the truth. [`Catalogue::register`] reads sessions into the catalogue, each in one transaction and keyed by its
//! own identifier, so that a repeated or interrupted call neither loses nor doubles one. [`Catalogue::status`] compares the
//! catalogue with a folder, [`Catalogue::refresh`] reads what differs, and [`Question`] holds the questions.
//! `migrations/catalogue/` documents the columns.
//!
//! All functions block: do not call them on a thread that runs async tasks.

mod address;
mod catalogue;
mod db;
mod entry;
mod error;
mod folder;
mod insert;
mod listing;
mod nights;
mod open;
mod press;
mod prototypes;
mod question;
mod questions;
mod results;
pub mod results_digest;
mod results_error;
mod roles;
mod schema;
mod status;
mod trends;
mod value;
mod write;

pub use address::{Address, CATALOGUE_FILE, ServerUrl};
pub use catalogue::{Catalogue, Registration};
pub use entry::{LegEntry, NoteEntry, SessionEntry};
pub use error::CatalogueError;
pub use listing::{ListedAnalysis, ListedSession, Listing};
pub use nights::NightRegistration;
pub use open::Access;
pub use press::PressEntry;
pub use question::{Answer, Parameter, ParameterKind, Question};

pub use results::{
    ANALYSIS_MARK, AnalysisEntry, AnalysisFigures, CalibrationEntry, ClockEntry, EstimateEntry,
    OFFICIAL, RESULTS_SUFFIX,
};
pub use results_error::ResultsError;
pub use roles::{ROLES, Role};
pub use status::{FolderStatus, StaleFile, Staleness, Unreadable};
pub use trends::CatalogueNights;
pub use value::Value;
