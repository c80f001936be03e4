//! Who may write a session: one process at a time, told by a lock on a file beside it and by locks on the files of the session.
//!
//! All of them end with the process, however that ends. The file beside the session says who holds it and what it does with it,
//! which readers heed; the locks on the session itself ([`crate::held`]) keep a second writer out when that file is removed.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::error::RecorderError;
use crate::held::{self, Held, Refuge};

/// Who asks [`writer_of`] holds the lock for an instant: a lock that is still held after this time is a writer's.
const LOOKED_WITHIN: Duration = Duration::from_millis(500);
/// Between two tries.
const TRY_AGAIN: Duration = Duration::from_millis(2);

/// What a holder that seals its session adds to its own words.
const SEALING: &str = ", which seals it";
/// A holder that left no word about itself.
const OTHER: &str = "another process";

/// Held by whoever writes a session, for as long as it does. The file goes away with it.
#[derive(Debug)]
pub(crate) struct WriterLock {
    path: PathBuf,
    file: File,
    session: PathBuf,
    /// None before the session file is made.
    held: Option<Held>,
}

impl WriterLock {
    /// The only lock of the session at `session`, and of the file there when there is one.
    ///
    /// # Errors
    /// [`RecorderError::InUse`] when another writer has it.
    pub fn take(session: &Path) -> Result<Self, RecorderError> {
        let path = beside(session);
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
                Err(TryLockError::WouldBlock) if from.elapsed() < LOOKED_WITHIN => {
                    std::thread::sleep(TRY_AGAIN);
                    continue;
                }
                Err(TryLockError::WouldBlock) => {
                    return Err(RecorderError::InUse {
                        path: session.to_owned(),
                        by: holder(&mut file),
                    });
                }
                Err(TryLockError::Error(e)) => return Err(io(e)),
            }
            // The one before may have removed the file between our opening and our locking: then the lock is on nothing.
            if is_still_at(&file, &path).map_err(io)? {
                break file;
            }
        };
        let mut lock = Self {
            path: path.clone(),
            session: session.to_owned(),
            held: None,
            file: file.try_clone().map_err(io)?,
        };
        if session.exists() {
            lock.hold(from)?;
        }
        file.set_len(0).map_err(io)?;
        file.seek(SeekFrom::Start(0)).map_err(io)?;
        write!(file, "process {}", std::process::id()).map_err(io)?;
        Ok(lock)
    }

    /// Locks the session file itself, which was made since.
    ///
    /// # Errors
    /// As [`take`](Self::take).
    pub(crate) fn take_file(&mut self) -> Result<(), RecorderError> {
        self.hold(Instant::now())
    }

    fn hold(&mut self, from: Instant) -> Result<(), RecorderError> {
        loop {
            match Held::take(&self.session).map_err(|e| self.io(e))? {
                Some(held) => {
                    self.held = Some(held);
                    return Ok(());
                }
                // Of two that come at once neither may have got it.
                None if from.elapsed() < LOOKED_WITHIN && !held::is_ours(&self.session) => {
                    std::thread::sleep(TRY_AGAIN);
                }
                None => return Err(self.in_use()),
            }
        }
    }

    /// Locks the log that SQLite has made.
    ///
    /// # Errors
    /// As [`take`](Self::take).
    pub(crate) fn take_log(&mut self) -> Result<(), RecorderError> {
        let Some(held) = &mut self.held else {
            return Ok(());
        };
        match held.take_log() {
            Ok(true) => Ok(()),
            Ok(false) => Err(self.in_use()),
            Err(e) => Err(self.io(e)),
        }
    }

    fn in_use(&self) -> RecorderError {
        RecorderError::InUse {
            path: self.session.clone(),
            by: OTHER.to_owned(),
        }
    }

    fn io(&self, source: std::io::Error) -> RecorderError {
        RecorderError::Io {
            path: self.session.clone(),
            doing: "locking the session",
            source,
        }
    }

    /// Whether the session is where it was opened.
    ///
    /// # Errors
    /// [`RecorderError::Displaced`].
    pub fn check(&self) -> Result<(), RecorderError> {
        self.held.as_ref().map_or(Ok(()), Held::check)
    }

    /// Where a session that is not can be kept.
    pub(crate) fn refuge(&self) -> Refuge {
        let nowhere = Refuge {
            place: None,
            copies: Vec::new(),
        };
        self.held.as_ref().map_or(nowhere, Held::refuge)
    }

    /// Copies the open session file; see [`Held::copy`].
    pub fn copy(&self, paths: &[PathBuf]) -> Result<PathBuf, String> {
        let none = || Err("expected an open session file, found none".to_owned());
        self.held
            .as_ref()
            .map_or_else(none, |held| held.copy(paths))
    }

    /// Removes what is left beside a session that is not where it was opened.
    pub fn tidy(&self) {
        if let Some(held) = &self.held {
            held.tidy();
        }
    }

    /// SQLite is about to remove the log.
    pub(crate) fn without_log(&mut self) {
        if let Some(held) = &mut self.held {
            held.without_log();
        }
    }
}

impl WriterLock {
    /// Announces that the session is being sealed, for which it must be open nowhere else: whoever wants to read it waits.
    pub(crate) fn announce_sealing(&mut self) {
        // At the end of what the holder wrote about itself. Unannounced, sealing takes its chance among the readers.
        let _ = write!(self.file, "{SEALING}");
    }

    /// Readers need not wait any longer.
    pub(crate) fn withdraw_sealing(&mut self) {
        let _ = self.file.set_len(0);
        let _ = self.file.seek(SeekFrom::Start(0));
        let _ = write!(self.file, "process {}", std::process::id());
    }
}

/// Whether the session at `session` is being sealed now.
pub(crate) fn is_being_sealed(session: &Path) -> bool {
    writer_of(session).is_some_and(|by| by.ends_with(SEALING))
}

impl Drop for WriterLock {
    fn drop(&mut self) {
        // Removed while it is locked, so that nobody removes the next one's, and only if it is ours. A file that stays behind locks nothing.
        if cfg!(unix) && is_still_at(&self.file, &self.path).unwrap_or(false) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// Who writes the session at `session` now, in words; `None` when nobody does.
pub fn writer_of(session: &Path) -> Option<String> {
    let path = beside(session);
    // To open a pipe would wait for whoever writes into it.
    let is_file = |path: &Path| std::fs::metadata(path).is_ok_and(|m| m.is_file());
    if is_file(&path)
        && let Ok(mut file) = File::open(&path)
        && let Err(TryLockError::WouldBlock) = file.try_lock_shared()
    {
        return Some(holder(&mut file));
    }
    // The file beside it may have been removed.
    match held::is_ours(session) {
        true => Some(format!("process {}", std::process::id())),
        false => held::is_held(session).then(|| OTHER.to_owned()),
    }
}

fn beside(session: &Path) -> PathBuf {
    let mut name = session.as_os_str().to_owned();
    name.push("-lock");
    PathBuf::from(name)
}

/// What the holder wrote about itself, at most a line.
fn holder(file: &mut File) -> String {
    let mut text = String::new();
    match file.take(64).read_to_string(&mut text) {
        Ok(n) if n > 0 => text,
        _ => OTHER.to_owned(),
    }
}

#[cfg(unix)]
fn is_still_at(file: &File, path: &Path) -> std::io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let held = file.metadata()?;
    Ok(std::fs::metadata(path).is_ok_and(|m| (m.dev(), m.ino()) == (held.dev(), held.ino())))
}

/// Elsewhere the file is never removed.
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
    fn who_only_looks_keeps_no_writer_out() {
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
