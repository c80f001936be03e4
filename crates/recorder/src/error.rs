//! What can go wrong with a session file.

use std::io::ErrorKind;
use std::path::PathBuf;

/// A session could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecorderError {
    /// The operating system refused.
    #[error("{}: {doing}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was being done.
        doing: &'static str,
        /// Its answer.
        source: std::io::Error,
    },
    /// SQLite refused.
    #[error("{}: {doing}: {source}", path.display())]
    Sql {
        /// The session file.
        path: PathBuf,
        /// What was being done.
        doing: &'static str,
        /// Its answer.
        source: Box<sqlx::Error>,
    },
    /// A new session was to be written over a file.
    #[error("{}: expected no file there, found one; sessions are never overwritten: choose another name", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// No such file.
    #[error("{}: expected a session file, found nothing; `skinrig sessions` lists what there is", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// The file is something else.
    #[error("{}: expected a skinrig session, found {found}", path.display())]
    NotASession {
        /// The file.
        path: PathBuf,
        /// What it is.
        found: String,
    },
    /// There is a file, at most with tables, and no row in them: its run ended before anything was recorded.
    #[error("{}: expected a session, found a file without a record in it: its run ended before it wrote the header, or something \
        emptied the file; there is nothing to go on with: remove it, and begin with `skinrig run`", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// A session was to go on that is not what was recorded. Nothing in it was changed.
    #[error("{}: expected a sound session to go on with, found {} problem(s): {}; nothing was changed: `skinrig salvage` copies what \
        is whole into a new session", path.display(), problems.len() as u64 + more_problems, problems.join("; "))]
    Unsound {
        /// The session file.
        path: PathBuf,
        /// What is wrong, in words.
        problems: Vec<String>,
        /// Problems found beyond these.
        more_problems: u64,
    },
    /// Written by a newer skinrig.
    #[error("{}: expected schema version up to {supported}, found {found}; read it with a newer skinrig", path.display())]
    NewerSchema {
        /// The file.
        path: PathBuf,
        /// Its schema version.
        found: u32,
        /// The newest version that this build knows.
        supported: u32,
    },
    /// Records came in an impossible order, or one cannot be kept as it is. Nothing of it was written.
    #[error("{record}: expected {expected}, found {found}")]
    Record {
        /// Which record.
        record: String,
        /// What would have been accepted.
        expected: String,
        /// What came.
        found: String,
    },
    /// Another process writes the session.
    #[error("{}: expected a session that nobody writes, found {by} writing it; wait for its end, or end it", path.display())]
    InUse {
        /// The session file.
        path: PathBuf,
        /// Who.
        by: String,
    },
    /// A session was to go on that has reached its end.
    #[error("{}: expected a session that was cut off or not finished, found a completed one: there is nothing to resume", path.display())]
    Completed {
        /// The session file.
        path: PathBuf,
    },
    /// The machine could not read all of a session; what is in it is not known.
    #[error(
        "{0}; this says nothing of what is in the session: mend the disk or free memory, and try again"
    )]
    Unread(String),
    /// An earlier write failed; the session takes nothing more.
    #[error("the session is no longer written: {0}")]
    Failed(String),
    /// A record was taken, and not on the disk in time: it may come there yet.
    #[error("the session is written too slowly: {0}")]
    Late(String),
    /// Another program kept the session open for so long that it could not be sealed. It is complete.
    #[error("{}: complete, but not sealed: expected every other program to close it, found it open in one for {} s ({found}); \
        close that program, and `skinrig resume` seals it", path.display(), waited.as_secs())]
    HeldOpen {
        /// The session file.
        path: PathBuf,
        /// How long was waited for it.
        waited: std::time::Duration,
        /// SQLite's answer.
        found: String,
    },
    /// A file of a session under way is no longer where its run opened it.
    #[error("{}: expected the file that this run writes, found {found}", path.display())]
    Displaced {
        /// The session file, or its log.
        path: PathBuf,
        /// What became of it.
        found: String,
    },
    /// A file of a session was moved or removed while it was written; all of it is kept.
    #[error("{displaced}; all that was recorded is in {}", to.display())]
    Rescued {
        /// What happened, in words.
        displaced: String,
        /// Where the session is now.
        to: PathBuf,
    },
    /// A file of a session was moved or removed while it was written, and what was recorded could not be kept.
    #[error("{displaced}; what was recorded could not be saved: {why}")]
    Lost {
        /// What happened, in words.
        displaced: String,
        /// Why, path by path.
        why: String,
    },
    /// The session cannot be sealed in its present state.
    #[error("{}: cannot seal: expected {expected}, found {found}; the session stays readable, and `skinrig resume` finishes it", path.display())]
    Unsealable {
        /// The session file.
        path: PathBuf,
        /// What sealing needs.
        expected: String,
        /// What there is.
        found: String,
    },
    /// The file contradicts itself.
    #[error("{}: damaged: {place}: expected {expected}, found {found}; `skinrig verify` checks everything", path.display())]
    Damaged {
        /// The session file.
        path: PathBuf,
        /// Table and row.
        place: String,
        /// What should be there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// Something was asked for that the session does not hold.
    #[error("{}: expected {wanted}, found none", path.display())]
    NotThere {
        /// The session file.
        path: PathBuf,
        /// What was asked for.
        wanted: String,
    },
}

impl RecorderError {
    /// True for what the machine did - no room, no memory, a disk that fails, a file that is locked or may not be written - rather than the file. SQLite
    /// result codes: <https://www.sqlite.org/rescode.html>; a read that ends early (522) is a file that was cut off.
    #[must_use]
    pub fn is_of_the_machine(&self) -> bool {
        let Self::Sql { source, .. } = self else {
            // No such folder, or a file where a folder should be, is what was asked for.
            return match self {
                Self::Io { source, .. } => !matches!(
                    source.kind(),
                    ErrorKind::NotFound | ErrorKind::NotADirectory
                ),
                other => matches!(other, Self::Unread(_)),
            };
        };
        let sqlx::Error::Database(error) = &**source else {
            return matches!(&**source, sqlx::Error::Io(_));
        };
        let code: i32 = error.code().and_then(|c| c.parse().ok()).unwrap_or(0);
        matches!(code & 0xff, 3 | 5 | 6 | 7 | 8 | 10 | 13 | 14) && code != 522
    }
}
