//! Who may write a session: one process at a time, told by a lock on a file beside it.
//!
//! The lock ends with the process, however that ends. It lies on a file of its own, because SQLite puts its own locks on the
//! session file, and some systems let the two interfere.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::error::RecorderError;

/// Who asks [`writer_of`] holds the lock for an instant: a lock that is still held after this time is a writer's.
const LOOKED_WITHIN: Duration = Duration::from_millis(500);
/// Between two tries.
const TRY_AGAIN: Duration = Duration::from_millis(2);

/// What a holder that seals its session adds to its own words.
const SEALING: &str = ", which seals it";

/// Held by whoever writes a session, for as long as it does. The file goes away with it.
#[derive(Debug)]
pub struct WriterLock {
    path: PathBuf,
    file: File,
}

impl WriterLock {
    /// The only lock of the session at `session`.
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
        loop {
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
                file.set_len(0).map_err(io)?;
                write!(file, "process {}", std::process::id()).map_err(io)?;
                return Ok(Self { path, file });
            }
        }
    }
}

impl WriterLock {
    /// Announces that the session is being sealed, for which it must be open nowhere else: whoever wants to read it waits.
    pub fn announce_sealing(&mut self) {
        // At the end of what the holder wrote about itself. Unannounced, sealing takes its chance among the readers.
        let _ = write!(self.file, "{SEALING}");
    }

    /// Readers need not wait any longer.
    pub fn withdraw_sealing(&mut self) {
        let _ = self.file.set_len(0);
        let _ = self.file.seek(SeekFrom::Start(0));
        let _ = write!(self.file, "process {}", std::process::id());
    }
}

/// Whether the session at `session` is being sealed now.
pub fn is_being_sealed(session: &Path) -> bool {
    writer_of(session).is_some_and(|by| by.ends_with(SEALING))
}

impl Drop for WriterLock {
    fn drop(&mut self) {
        // Removed while it is locked, so that nobody removes the next one's. A file that stays behind locks nothing.
        if cfg!(unix) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// Who writes the session at `session` now, in words; `None` when nobody does.
pub fn writer_of(session: &Path) -> Option<String> {
    let path = beside(session);
    // To open a pipe would wait for whoever writes into it.
    if !std::fs::metadata(&path).is_ok_and(|m| m.is_file()) {
        return None;
    }
    let mut file = File::open(path).ok()?;
    match file.try_lock_shared() {
        Err(TryLockError::WouldBlock) => Some(holder(&mut file)),
        _ => None,
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
        _ => "another process".to_owned(),
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
