//! Session files: one SQLite file per session, with a single writer, a read-only reader, full verification and a catalogue.
//!
//! [`SessionWriter`] writes a session on its own threads. It returns from an [`Intent`] or [`Outcome`] only when
//! that record and all earlier ones are on disk. [`SessionReader`] reads a session while it grows and after it is
//! sealed, [`verify()`] recomputes every hash and count in it, and [`list`] describes a folder.
//! `docs/reference/session-file.md` describes the layout; `migrations/` documents every column.
//!
//! This crate handles bytes, checksums and SQL. It depends on no device and on no event encoding.
//!
//! [`Intent`]: skinrig_model::Record::Intent
//! [`Outcome`]: skinrig_model::Record::Outcome

mod box_row;
pub mod catalogue;
mod cause;
mod chain;
pub mod error;
pub mod reader;
pub mod rows;
mod sidecar;
pub mod tags;
pub mod verify;
pub mod writer;

mod checked;
mod close_result;
mod digest;
#[cfg(target_os = "linux")]
mod file_lock;
#[cfg(not(target_os = "linux"))]
#[path = "file_lock_portable.rs"]
mod file_lock;
mod from_row;
mod hex;
mod insert;
mod leg;
mod legacy_text;
mod lock;
mod migrations;
mod notification;
mod object;
mod open;
mod pose;
mod prepare;
mod prepared;
mod problem;
mod query;
mod queue;
mod record_rows;
mod rescue;
mod resume;
mod salvage;
mod schema;
mod seal;
mod stored;
mod totals;
mod touch;
mod worker;

pub use catalogue::{SessionState, SessionSummary, list, list_with};
pub use close_result::SealedSession;
pub use error::{CopyError, ObjectError, RecorderError, RescueError, WriteFailure};
pub use lock::writer_of;
pub use object::{
    OBJECTS_VFS, ObjectStore, ReadSeek, SessionReference, StartStore, session_bytes,
    use_object_store,
};
pub use problem::Problem;
pub use queue::QueueLoad;
pub use reader::SessionReader;
pub use rows::{
    AttemptRow, ChunkMeta, CommandRow, DeviceRow, Headline, InterruptionRow, LegRow, Loss, NoteRow,
    PressTally, Seal, SessionTotals,
};
pub use salvage::{LostBytes, SalvageReport, SalvagedTable, salvage};
pub use sidecar::SESSION_SUFFIX;
pub use skinrig_formats::codec::Codec;
pub use stored::{copy_session, reference_to};
pub use tags::{
    Annotation, AnnotationNote, Annotations, annotate, annotations, is_valid_tag, tags_path,
};
pub use verify::{ChunkScanner, VerifyReport, verify};
pub use writer::SessionWriter;
