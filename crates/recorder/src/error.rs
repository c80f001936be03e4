//! Errors of session files.

use std::io::ErrorKind;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use crate::problem::Problem;

/// What to do with a damaged session file.
const NEXT_OF_DAMAGE: &str = "; restore the file from a copy, or copy its intact part into a new session with `skinrig salvage`";

/// Error of an object store, with its own words.
pub type ObjectError = Box<dyn std::error::Error + Send + Sync>;

/// Failure to write or read a session.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecorderError {
    /// An operating system call failed.
    #[error("{}: {doing}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Operation in progress.
        doing: &'static str,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A SQLite call failed.
    #[error("{}: {doing}: {source}{}", path.display(), if is_malformed(source) { NEXT_OF_DAMAGE } else { "" })]
    Sql {
        /// The session file.
        path: PathBuf,
        /// Operation in progress.
        doing: &'static str,
        /// Error of SQLite.
        source: Box<sqlx::Error>,
    },
    /// A file already exists where a new session should go.
    #[error("{}: file already exists; sessions are never overwritten: choose another name", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// There is no such file.
    #[error("{}: no such session file; `skinrig sessions` lists all sessions", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// The file is not a session.
    #[error("{}: expected a skinrig session, found {found}", path.display())]
    NotASession {
        /// The file.
        path: PathBuf,
        /// Description of the file.
        found: String,
    },
    /// The file has no rows, and perhaps no tables: the run ended before it recorded anything.
    #[error("{}: expected a session, found a file without records: its run ended before it wrote the header, or the file was \
        emptied; there is nothing to resume: delete the file and start a new session with `skinrig run`", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The rows of a sealed session are not those that were sealed.
    #[error("{}: expected the rows that were sealed, found others in {}: the file was changed or damaged after it was recorded; \
        `skinrig verify` lists the differences; restore the file from a copy", path.display(), tables.join(", "))]
    Changed {
        /// The session file.
        path: PathBuf,
        /// The tables.
        tables: Vec<String>,
    },
    /// The rows of an unsealed session contradict each other.
    #[error("{}: expected rows that agree, found {problems} that do not, the first: {first}; the file was changed or damaged after it was \
        recorded; `skinrig verify` lists the differences; restore the file from a copy", path.display())]
    Contradictory {
        /// The session file.
        path: PathBuf,
        /// The first contradiction.
        first: Box<Problem>,
        /// Number of contradictions.
        problems: u64,
    },
    /// A new annotation is not one that a log can hold.
    #[error(
        "expected {expected} in the tags, the remark and its author, found {found}; nothing was written"
    )]
    UnusableAnnotation {
        /// What was expected.
        expected: &'static str,
        /// What was found.
        found: String,
    },
    /// The session to resume fails verification. Nothing in it was changed.
    #[error("{}: expected a sound session to resume, found {} problem(s): {}; nothing was changed: `skinrig salvage` copies \
        the intact parts into a new session", path.display(), problems.len() as u64 + more_problems, join(problems))]
    Unsound {
        /// The session file.
        path: PathBuf,
        /// Problems found.
        problems: Vec<Problem>,
        /// Number of problems beyond those in `problems`.
        more_problems: u64,
    },
    /// A newer version of skinrig wrote the file.
    #[error("{}: expected schema version up to {supported}, found {found}; read it with a newer skinrig", path.display())]
    NewerSchema {
        /// The file.
        path: PathBuf,
        /// Its schema version.
        found: u32,
        /// Newest schema version that this build supports.
        supported: u32,
    },
    /// The session lies in an object store that this build cannot read.
    #[error("{}: expected a session, found a reference to {url}; build skinrig with `--features s3`", path.display())]
    NoObjectStore {
        /// The reference.
        path: PathBuf,
        /// Address of the object.
        url: String,
    },
    /// The session lies in an object store, and its file is needed.
    #[error("{0}: expected the file of a session, found a reference to {url}; `skinrig store get {0}` fetches it", path.display())]
    Referred {
        /// The reference.
        path: PathBuf,
        /// Address of the object.
        url: String,
    },
    /// The object store failed.
    #[error("{}: reading {url}: {source}", path.display())]
    Object {
        /// The reference.
        path: PathBuf,
        /// Address of the object.
        url: String,
        /// Error of the store.
        source: ObjectError,
    },
    /// The object is not the session of the reference.
    #[error("{}: {url}: expected {expected}, found {found}; restore the object, or the file from a copy", path.display())]
    OtherObject {
        /// The reference.
        path: PathBuf,
        /// Address of the object.
        url: String,
        /// The session of the reference.
        expected: String,
        /// What the store has.
        found: String,
    },
    /// A record is out of order or invalid. Nothing of it was written.
    #[error("{record}: expected {expected}, found {found}")]
    Record {
        /// The rejected record or field.
        record: String,
        /// What is valid there.
        expected: String,
        /// What was found.
        found: String,
    },
    /// Another process is writing the session.
    #[error("{}: session is in use: {by} is writing it; wait until that run ends, or stop it", path.display())]
    InUse {
        /// The session file.
        path: PathBuf,
        /// Description of that process.
        by: String,
    },
    /// The session to resume is already completed.
    #[error("{}: expected an interrupted or unfinished session, found a completed one: there is nothing to resume", path.display())]
    AlreadyCompleted {
        /// The session file.
        path: PathBuf,
    },
    /// The system failed while reading a session; its content is unknown.
    #[error(
        "{0}; the session could not be checked: repair the disk or free memory, then try again"
    )]
    Unread(String),
    /// An earlier write failed; the session accepts no more records.
    #[error("writing the session failed: {0}")]
    WriteFailed(WriteFailure),
    /// A record was accepted but was not on disk in time; it may still arrive there.
    #[error("writing the session timed out: the disk accepted no record within {} s", .0.as_secs_f64())]
    WriteTimeout(Duration),
    /// Another program kept the session open for too long to seal it. It is complete.
    #[error("{}: complete, but not sealed: another program kept it open for {} s ({found}); \
        close that program, then run `skinrig resume` to seal it", path.display(), waited.as_secs())]
    HeldOpen {
        /// The session file.
        path: PathBuf,
        /// Time spent waiting for that program.
        waited: Duration,
        /// Error of SQLite.
        found: String,
    },
    /// A file of a session in progress is no longer where its run opened it.
    #[error("{}: the file of the current run is missing: {found}", path.display())]
    Displaced {
        /// The session file, or its log.
        path: PathBuf,
        /// Current state of the file.
        found: String,
    },
    /// A file of a session was moved or removed during the run; all records were saved.
    #[error("{displaced}; all records are saved in {}", to.display())]
    Rescued {
        /// The [`Displaced`](Self::Displaced) error.
        displaced: Box<RecorderError>,
        /// Path of the saved session.
        to: PathBuf,
    },
    /// A file of a session was moved or removed during the run, and the records could not be saved.
    #[error("{displaced}; the records could not be saved: {reason}")]
    Lost {
        /// The [`Displaced`](Self::Displaced) error.
        displaced: Box<RecorderError>,
        /// Why no copy was made.
        reason: RescueError,
    },
    /// The session cannot be sealed in its current state.
    #[error("{}: cannot seal: expected {expected}, found {found}; the session stays readable, and `skinrig resume` finishes it", path.display())]
    Unsealable {
        /// The session file.
        path: PathBuf,
        /// Condition for sealing.
        expected: String,
        /// Current state.
        found: String,
    },
    /// The file is damaged or contradicts itself.
    #[error("{}: damaged: {place}: expected {expected}, found {found}{NEXT_OF_DAMAGE}", path.display())]
    Damaged {
        /// The session file.
        path: PathBuf,
        /// Table and row, or a similar location.
        place: String,
        /// What is valid there.
        expected: String,
        /// What was found.
        found: String,
    },
    /// The session has no such item.
    #[error("{}: expected {expected}, found none", path.display())]
    NotFound {
        /// The session file.
        path: PathBuf,
        /// The requested item.
        expected: String,
    },
}

/// Reason why a session can no longer be written.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum WriteFailure {
    /// The preparation thread panicked.
    #[error("the preparation thread panicked")]
    PreparationPanicked,
    /// The writer thread exited before the session was closed.
    #[error("the writer thread exited")]
    WriterExited,
    /// The disk accepted no record for this time.
    #[error("the disk accepted no record within {} s", .0.as_secs_f64())]
    Timeout(Duration),
    /// A record is invalid. The file is not damaged.
    #[error("{}: {place}: expected {expected}, found {found}", path.display())]
    InvalidRecord {
        /// The session file.
        path: PathBuf,
        /// The record or its field.
        place: String,
        /// What is valid there.
        expected: String,
        /// What was found.
        found: String,
    },
    /// SQLite or the operating system failed.
    #[error(transparent)]
    System(Arc<RecorderError>),
}

/// Reason why a displaced session could not be saved.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RescueError {
    /// No session file is open.
    #[error("expected an open session file, found none")]
    NotOpen,
    /// No folder is left to copy to.
    #[error("expected a writable folder for a copy, found none")]
    NoFolder,
    /// Copying failed for every candidate path.
    #[error("{}", attempts(.0))]
    Copy(Vec<(PathBuf, CopyError)>),
    /// The writer thread exited first.
    #[error(transparent)]
    Writer(WriteFailure),
}

/// Reason why a session could not be copied to a path.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CopyError {
    /// SQLite accepts only UTF-8 paths.
    #[error("expected a UTF-8 path")]
    PathNotUtf8,
    /// An operating system call failed.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// SQLite failed.
    #[error(transparent)]
    Sql(#[from] Box<sqlx::Error>),
}

fn join(problems: &[Problem]) -> String {
    let texts: Vec<_> = problems.iter().map(Problem::to_string).collect();
    texts.join("; ")
}

fn attempts(attempts: &[(PathBuf, CopyError)]) -> String {
    let attempts = attempts.iter();
    let texts: Vec<_> = attempts
        .map(|(path, error)| format!("{}: {error}", path.display()))
        .collect();
    texts.join("; ")
}

impl RescueError {
    /// Error for failed copies to these paths, which may be none.
    pub(crate) fn from_attempts(attempts: Vec<(PathBuf, CopyError)>) -> Self {
        match attempts.is_empty() {
            true => Self::NoFolder,
            false => Self::Copy(attempts),
        }
    }
}

impl RecorderError {
    /// True if the system rather than the file caused the error: disk full, out of memory, I/O error, file locked or not accessible. SQLite
    /// result codes: <https://www.sqlite.org/rescode.html>. A short read (522) means that the file was truncated.
    #[must_use]
    pub fn is_system_failure(&self) -> bool {
        let Self::Sql { source, .. } = self else {
            // A missing folder, or a file in place of a folder, is a wrong path.
            return match self {
                Self::Io { source, .. } => !matches!(
                    source.kind(),
                    ErrorKind::NotFound | ErrorKind::NotADirectory
                ),
                other => matches!(other, Self::Unread(_) | Self::Object { .. }),
            };
        };
        if matches!(&**source, sqlx::Error::Io(_)) {
            return true;
        }
        let code = code_of(source);
        matches!(code & 0xff, 3 | 5 | 6 | 7 | 8 | 10 | 13 | 14) && code != SHORT_READ
    }

    /// True if the file is not a session, is damaged, or was changed after it was recorded.
    #[must_use]
    pub fn is_damage(&self) -> bool {
        match self {
            Self::Sql { source, .. } => is_malformed(source),
            Self::Damaged { .. }
            | Self::NotASession { .. }
            | Self::Empty { .. }
            | Self::Changed { .. }
            | Self::Contradictory { .. }
            | Self::Unsound { .. } => true,
            _ => false,
        }
    }
}

/// Result code of SQLite for a file that ends early.
const SHORT_READ: i32 = 522;

/// Result code of SQLite, 0 for an error that is not its own.
fn code_of(error: &sqlx::Error) -> i32 {
    let code = error.as_database_error().and_then(|e| e.code());
    code.and_then(|c| c.parse().ok()).unwrap_or(0)
}

/// True if SQLite finds the file malformed, not a database, or too short.
fn is_malformed(error: &sqlx::Error) -> bool {
    let code = code_of(error);
    matches!(code & 0xff, 11 | 26) || code == SHORT_READ
}

impl From<RecorderError> for Problem {
    fn from(error: RecorderError) -> Self {
        match error {
            RecorderError::Damaged {
                place,
                expected,
                found,
                ..
            } => Self::new(place, expected, found),
            RecorderError::Sql { doing, source, .. } => Self::new(doing, "readable rows", source),
            RecorderError::Io { doing, source, .. } => Self::new(doing, "a readable file", source),
            RecorderError::NotFound { expected, .. } => Self::new("session", expected, "none"),
            RecorderError::NotASession { found, .. } => {
                Self::new("file", "a skinrig session", found)
            }
            RecorderError::NewerSchema {
                found, supported, ..
            } => Self::new(
                "schema version",
                format_args!("up to {supported}"),
                format_args!("{found}, of a newer skinrig"),
            ),
            other => Self::new("session", "a readable session", other),
        }
    }
}
