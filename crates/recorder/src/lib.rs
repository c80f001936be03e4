//! One SQLite file per session: the one writer, the read-only reader, the check of every byte, the catalogue.
//!
//! A session is written by a [`SessionWriter`] on threads of its own: records go in, an [`Intent`] or
//! [`Outcome`] comes back only when it and everything before it is on the disk. [`SessionReader`] reads it
//! while it grows and after it is sealed; [`verify()`] recomputes all of it; [`list`] describes a folder.
//! The layout is in `docs/reference/session-file.md` and, column by column, in `migrations/`.
//!
//! This crate knows bytes, checksums and SQL. It knows no device and no event encoding.
//!
//! [`Intent`]: skinrig_model::Record::Intent
//! [`Outcome`]: skinrig_model::Record::Outcome

mod beside;
mod box_row;
pub mod catalogue;
mod chain;
pub mod codec;
pub mod error;
pub mod reader;
pub mod rows;
pub mod tags;
pub mod verify;
pub mod writer;

mod digest;
mod from_row;
#[cfg(target_os = "linux")]
mod held;
#[cfg(not(target_os = "linux"))]
#[path = "held_elsewhere.rs"]
mod held;
mod hex;
mod insert;
mod left;
mod leg;
mod lock;
mod migrations;
mod pose;
mod prepare;
mod prepared;
mod query;
mod queue;
mod rescue;
mod resume;
mod salvage;
mod schema;
mod seal;
mod totals;
mod worker;

pub use beside::SESSION_SUFFIX;
pub use catalogue::{SessionState, SessionSummary, list};
pub use codec::Codec;
pub use error::RecorderError;
pub use left::Sealed;
pub use lock::writer_of;
pub use migrations::SCHEMA_VERSION;
pub use queue::QueueLoad;
pub use reader::SessionReader;
pub use rows::{
    AttemptRow, ChunkMeta, CommandRow, DeviceRow, InterruptionRow, LegRow, Loss, NoteRow,
    PressTally, Seal, SessionTotals,
};
pub use salvage::{LostBytes, SalvageReport, SalvagedTable, salvage};
pub use tags::{LaterNote, Saying, Sayings, TAGS_SUFFIX, is_tag, say, sayings, tags_path};
pub use verify::{ChunkScanner, VerifyReport, verify};
pub use writer::SessionWriter;
