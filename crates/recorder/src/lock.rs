//! The writer lock: at most one process writes a session. It consists of a lock file beside the session and of locks on the session files.
//!
//! The operating system releases all of them when the process exits. The lock file names the holder and what it does; readers respect
//! it. The locks on the session files ([`crate::file_lock`]) keep a second writer out even if someone deletes the lock file.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::error::{RecorderError, RescueError};
use crate::file_lock::{self, LockedFiles, RescueTargets};

/// [`writer_of`] takes the lock for an instant. A lock that is still held after this time belongs to a writer.
const PROBE_TIMEOUT: Duration = Duration::from_millis(500);
/// Wait between two attempts to take the lock.
const RETRY_INTERVAL: Duration = Duration::from_millis(2);

/// Suffix that a holder appends to its entry while it seals the session.
const SEALING: &str = ", which seals it";
/// Description of a holder that left no entry.
const UNKNOWN_HOLDER: &str = "another process";

/// Exclusive right to write a session, until dropped. Dropping removes the lock file.
#[derive(Debug)]
pub(crate) struct WriterLock {
    path: PathBuf,
    file: File,
    session: PathBuf,
    /// `None` until the session file exists.
    files: Option<LockedFiles>,
}

impl WriterLock {
    /// Locks the session at `session`, including its file if one exists.
    ///
    /// # Errors
    /// [`RecorderError::InUse`] if another writer holds it.
    pub(crate) fn take(session: &Path) -> Result<Self, RecorderError> {
        let path = lock_path(session);
        let io = |source| RecorderError::Io {
            path: path.clone(),
            doing: "locking the session",
            source,
        };
        let from = Instant::now();
        let mut file = loop {
            let mut file = OpenOptions::new()
                .create(true)
                .truncate(false)
                .read(true)
                .write(true)
                .open(&path)
                .map_err(io)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) if from.elapsed() < PROBE_TIMEOUT => {
                    std::thread::sleep(RETRY_INTERVAL);
                    continue;
                }
                Err(TryLockError::WouldBlock) => {
                    return Err(RecorderError::InUse {
                        path: session.to_owned(),
                        by: read_holder(&mut file),
                    });
                }
                Err(TryLockError::Error(e)) => return Err(io(e)),
            }
            // The previous holder may have removed the file after we opened it and before we locked it. That lock protects nothing.
            if is_still_at(&file, &path).map_err(io)? {
                break file;
            }
        };
        let mut lock = Self {
            path: path.clone(),
            session: session.to_owned(),
            files: None,
            file: file.try_clone().map_err(io)?,
        };
        if session.exists() {
            lock.lock_files(from)?;
        }
        file.set_len(0).map_err(io)?;
        file.seek(SeekFrom::Start(0)).map_err(io)?;
        write!(file, "process {}", std::process::id()).map_err(io)?;
        Ok(lock)
    }

    /// Locks the session file, which was created after [`take`](Self::take).
    ///
    /// # Errors
    /// As [`take`](Self::take).
    pub(crate) fn take_file(&mut self) -> Result<(), RecorderError> {
        self.lock_files(Instant::now())
    }

    fn lock_files(&mut self, from: Instant) -> Result<(), RecorderError> {
        loop {
            match LockedFiles::take(&self.session).map_err(|e| self.io(e))? {
                Some(files) => {
                    self.files = Some(files);
                    return Ok(());
                }
                // Two writers that try at the same moment may both fail.
                None if from.elapsed() < PROBE_TIMEOUT && !file_lock::is_own(&self.session) => {
                    std::thread::sleep(RETRY_INTERVAL);
                }
                None => return Err(self.in_use()),
            }
        }
    }

    /// Locks the write-ahead log that SQLite created.
    ///
    /// # Errors
    /// As [`take`](Self::take).
    pub(crate) fn take_log(&mut self) -> Result<(), RecorderError> {
        let Some(files) = &mut self.files else {
            return Ok(());
        };
        match files.take_log() {
            Ok(true) => Ok(()),
            Ok(false) => Err(self.in_use()),
            Err(e) => Err(self.io(e)),
        }
    }

    fn in_use(&self) -> RecorderError {
        RecorderError::InUse {
            path: self.session.clone(),
            by: UNKNOWN_HOLDER.to_owned(),
        }
    }

    fn io(&self, source: std::io::Error) -> RecorderError {
        RecorderError::Io {
            path: self.session.clone(),
            doing: "locking the session",
            source,
        }
    }

    /// Checks that the session files are still where the writer opened them.
    ///
    /// # Errors
    /// [`RecorderError::Displaced`].
    pub(crate) fn check(&self) -> Result<(), RecorderError> {
        self.files.as_ref().map_or(Ok(()), LockedFiles::check)
    }

    /// Where a displaced session can be saved.
    pub(crate) fn rescue_targets(&self) -> RescueTargets {
        let nowhere = RescueTargets {
            current_path: None,
            copies: Vec::new(),
        };
        self.files
            .as_ref()
            .map_or(nowhere, LockedFiles::rescue_targets)
    }

    /// Copies the open session file; see [`LockedFiles::copy`].
    pub(crate) fn copy(&self, paths: &[PathBuf]) -> Result<PathBuf, RescueError> {
        let none = || Err(RescueError::NotOpen);
        self.files
            .as_ref()
            .map_or_else(none, |files| files.copy(paths))
    }

    /// Removes the log files that a displaced session leaves behind.
    pub(crate) fn remove_log_files(&self) {
        if let Some(files) = &self.files {
            files.remove_log_files();
        }
    }

    /// Releases the log before SQLite removes it.
    pub(crate) fn forget_log(&mut self) {
        if let Some(files) = &mut self.files {
            files.forget_log();
        }
    }
}

impl WriterLock {
    /// Announces that sealing begins, so that new readers wait: sealing needs the session open nowhere else.
    pub(crate) fn announce_sealing(&mut self) {
        // Appended to the holder's entry. If it fails, sealing competes with readers.
        let _ = write!(self.file, "{SEALING}");
    }

    /// Ends the announcement: readers no longer wait.
    pub(crate) fn withdraw_sealing(&mut self) {
        let _ = self.file.set_len(0);
        let _ = self.file.seek(SeekFrom::Start(0));
        let _ = write!(self.file, "process {}", std::process::id());
    }
}

/// True while a writer seals the session at `session`.
pub(crate) fn is_being_sealed(session: &Path) -> bool {
    writer_of(session).is_some_and(|by| by.ends_with(SEALING))
}

impl Drop for WriterLock {
    fn drop(&mut self) {
        // Remove the file while it is locked, so that this never removes the next holder's file. A leftover file locks nothing.
        if cfg!(unix) && is_still_at(&self.file, &self.path).unwrap_or(false) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// Description of the process that writes the session at `session`, such as `process 123`; `None` if no process does.
pub fn writer_of(session: &Path) -> Option<String> {
    let path = lock_path(session);
    // Opening a pipe would block until another process writes to it.
    let is_file = |path: &Path| std::fs::metadata(path).is_ok_and(|m| m.is_file());
    if is_file(&path)
        && let Ok(mut file) = File::open(&path)
        && let Err(TryLockError::WouldBlock) = file.try_lock_shared()
    {
        return Some(read_holder(&mut file));
    }
    // Someone may have deleted the lock file.
    match file_lock::is_own(session) {
        true => Some(format!("process {}", std::process::id())),
        false => file_lock::is_locked_by_writer(session).then(|| UNKNOWN_HOLDER.to_owned()),
    }
}

fn lock_path(session: &Path) -> PathBuf {
    let mut name = session.as_os_str().to_owned();
    name.push("-lock");
    PathBuf::from(name)
}

/// The holder's entry: the first line of the lock file, truncated.
fn read_holder(file: &mut File) -> String {
    let mut text = String::new();
    match file.take(64).read_to_string(&mut text) {
        Ok(n) if n > 0 => text,
        _ => UNKNOWN_HOLDER.to_owned(),
    }
}

#[cfg(unix)]
fn is_still_at(file: &File, path: &Path) -> std::io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let locked = file.metadata()?;
    Ok(std::fs::metadata(path).is_ok_and(|m| (m.dev(), m.ino()) == (locked.dev(), locked.ino())))
}

/// On other systems the lock file is never removed.
#[cfg(not(unix))]
fn is_still_at(_file: &File, _path: &Path) -> std::io::Result<bool> {
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_writer_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let session = folder.path().join("a.session.sqlite");
        assert_eq!(writer_of(&session), None);
        let lock = WriterLock::take(&session).unwrap();
        let me = format!("process {}", std::process::id());
        assert_eq!(writer_of(&session).as_ref(), Some(&me));
        match WriterLock::take(&session) {
            Err(RecorderError::InUse { by, .. }) => assert_eq!(by, me),
            other => panic!("{other:?}"),
        }
        drop(lock);
        assert_eq!(writer_of(&session), None);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        WriterLock::take(&session).unwrap();
    }

    #[test]
    fn a_query_does_not_block_a_writer() {
        let folder = tempfile::tempdir().unwrap();
        let session = folder.path().join("a.session.sqlite");
        let over = std::sync::atomic::AtomicBool::new(false);
        let is_over = || over.load(std::sync::atomic::Ordering::SeqCst);
        std::thread::scope(|scope| {
            let looks = || {
                while !is_over() {
                    writer_of(&session);
                }
            };
            scope.spawn(looks);
            let taken: Vec<_> = (0..300)
                .map(|_| WriterLock::take(&session).map(drop))
                .collect();
            over.store(true, std::sync::atomic::Ordering::SeqCst);
            for taken in taken {
                taken.unwrap();
            }
        });
    }
}
