//! Locks on the open session files, and detection of files that are moved or removed while they are written.
//!
//! Anyone can delete the lock file beside a session ([`crate::lock`]). So a writer also locks one byte of the session file and one of
//! its log, far beyond everything that SQLite locks or stores. These are open file description locks (`fcntl(2)`): they last
//! as long as the file is open, survive renames, and other handles of the process do not affect them.
//!
//! The reverse is not true: closing any handle of a file drops all POSIX locks of the process on it, including SQLite's
//! (sqlite.org/howtocorrupt.html, section 2.2). So the handles here close after SQLite's. [`OWN_SESSIONS`] lists the sessions that
//! this process writes, so that testing their lock does not open them a second time.

use std::fs::{File, Metadata};
use std::io::{Seek, SeekFrom};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::error::{CopyError, RecorderError, RescueError};
use crate::sidecar::{SESSION_SUFFIX, sidecar_path};

/// Sessions that this process has open for writing.
static OWN_SESSIONS: Mutex<Vec<FileId>> = Mutex::new(Vec::new());

/// Device and inode: identifies a file independent of its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct FileId {
    device: u64,
    inode: u64,
}

impl FileId {
    fn of(metadata: &Metadata) -> Self {
        Self {
            device: metadata.dev(),
            inode: metadata.ino(),
        }
    }

    /// Identity of the file now at `path`; `None` if there is none.
    fn at(path: &Path) -> Option<Self> {
        Some(Self::of(&std::fs::metadata(path).ok()?))
    }
}

/// An open and locked file.
#[derive(Debug)]
struct LockedFile {
    file: File,
    id: FileId,
}

impl LockedFile {
    /// Opens and locks a file; `None` if another writer holds the lock.
    fn open(path: &Path) -> std::io::Result<Option<Self>> {
        let file = File::open(path)?;
        if !byte::lock(&file)? {
            return Ok(None);
        }
        let id = FileId::of(&file.metadata()?);
        Ok(Some(Self { file, id }))
    }

    /// Current path of the file, if the system can report it.
    fn current_path(&self) -> Option<PathBuf> {
        use std::os::fd::AsRawFd;
        let path = std::fs::read_link(format!("/proc/self/fd/{}", self.file.as_raw_fd())).ok()?;
        (FileId::at(&path) == Some(self.id)).then_some(path)
    }
}

/// The session file and its log files, as the writer opened them.
#[derive(Debug)]
pub(crate) struct LockedFiles {
    path: PathBuf,
    session: LockedFile,
    log: Option<LockedFile>,
    /// The log's index. It is not opened, because SQLite holds locks on it.
    index: Option<FileId>,
}

impl LockedFiles {
    /// Locks the session file at `path`, and its log if there is one.
    ///
    /// `Ok(None)` if another writer holds either of them.
    pub(crate) fn take(path: &Path) -> std::io::Result<Option<Self>> {
        let path = std::path::absolute(path)?;
        if is_own(&path) {
            return Ok(None);
        }
        let Some(session) = LockedFile::open(&path)? else {
            return Ok(None);
        };
        let log = match LockedFile::open(&sidecar_path(&path, "-wal")) {
            Ok(Some(log)) => Some(log),
            Ok(None) => return Ok(None),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => None,
            Err(e) => return Err(e),
        };
        own_sessions().push(session.id);
        Ok(Some(Self {
            path,
            session,
            log,
            index: None,
        }))
    }

    /// Locks the log that SQLite has created, and stores the identity of its index.
    ///
    /// `Ok(false)` if there is no log, or another writer holds it.
    pub(crate) fn take_log(&mut self) -> std::io::Result<bool> {
        let log = sidecar_path(&self.path, "-wal");
        if self.log.as_ref().map(|l| l.id) != FileId::at(&log) || self.log.is_none() {
            self.log = LockedFile::open(&log)?;
        }
        self.index = FileId::at(&sidecar_path(&self.path, "-shm"));
        Ok(self.log.is_some())
    }

    /// Releases the log before SQLite removes it.
    pub(crate) fn forget_log(&mut self) {
        (self.log, self.index) = (None, None);
    }

    /// Checks that all files are still where they were opened.
    ///
    /// # Errors
    /// [`RecorderError::Displaced`].
    pub(crate) fn check(&self) -> Result<(), RecorderError> {
        let displaced = |path: PathBuf, found: String| RecorderError::Displaced { path, found };
        let now = FileId::at(&self.path);
        if now != Some(self.session.id) {
            let own = match self.session.current_path() {
                Some(place) => format!("moved to {}", place.display()),
                None => "removed".to_owned(),
            };
            let found = match now {
                None => format!("it was {own}"),
                Some(_) => format!("another file in its place; the original was {own}"),
            };
            return Err(displaced(self.path.clone(), found));
        }
        let log = self.log.as_ref().map(|log| log.id);
        for (ending, id) in [("-wal", log), ("-shm", self.index)] {
            let file = sidecar_path(&self.path, ending);
            let Some(id) = id else { continue };
            match FileId::at(&file) {
                Some(found) if found == id => {}
                Some(_) => {
                    return Err(displaced(file, "another file in its place".to_owned()));
                }
                None => return Err(displaced(file, "it was removed".to_owned())),
            }
        }
        Ok(())
    }

    /// Current path of the session file, and candidate paths for a copy: in its old folder, in the nearest existing folder above,
    /// or in the system's temporary folder.
    pub(crate) fn rescue_targets(&self) -> RescueTargets {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let stem = name
            .strip_suffix(SESSION_SUFFIX)
            .unwrap_or(&name)
            .to_owned();
        let folders = self.path.ancestors().skip(1).map(Path::to_path_buf);
        // Never in the root folder.
        let folders = folders.filter(|f| f.parent().is_some());
        let folders = folders.chain([std::env::temp_dir()]).filter(|f| f.is_dir());
        let copy_in = |folder: PathBuf| {
            let name = |n: u32| match n {
                1 => format!("{stem}.rescued{}", SESSION_SUFFIX),
                n => format!("{stem}.rescued-{n}{}", SESSION_SUFFIX),
            };
            let paths = (1..1000).map(|n| folder.join(name(n)));
            paths.into_iter().find(|p| !p.exists())
        };
        RescueTargets {
            current_path: self.session.current_path(),
            copies: folders.filter_map(copy_in).collect(),
        }
    }

    /// Copies the open session file, which must have no log, to the first path that works.
    pub(crate) fn copy(&self, paths: &[PathBuf]) -> Result<PathBuf, RescueError> {
        let copy = |mut to: File| -> std::io::Result<()> {
            let mut from = &self.session.file;
            from.seek(SeekFrom::Start(0))?;
            std::io::copy(&mut from, &mut to)?;
            to.sync_all()
        };
        first_of(paths, copy)
    }

    /// Removes log files left beside the old and the new path, once SQLite has closed them.
    pub(crate) fn remove_log_files(&self) {
        let log = self.log.as_ref().map(|log| log.id);
        let places = [Some(self.path.clone()), self.session.current_path()];
        for place in places.into_iter().flatten() {
            for (ending, id) in [("-wal", log), ("-shm", self.index)] {
                let file = sidecar_path(&place, ending);
                if id.is_some() && FileId::at(&file) == id {
                    let _ = std::fs::remove_file(file);
                }
            }
        }
    }
}

impl Drop for LockedFiles {
    fn drop(&mut self) {
        let mut own = own_sessions();
        if let Some(at) = own.iter().position(|id| *id == self.session.id) {
            own.swap_remove(at);
        }
    }
}

/// Where to save a session that was moved or removed while it was written.
#[derive(Debug, Clone)]
pub(crate) struct RescueTargets {
    /// Current path of the file; `None` if it was removed.
    pub current_path: Option<PathBuf>,
    /// Candidate paths for a copy, best first. No file exists there.
    pub copies: Vec<PathBuf>,
}

/// Creates a file at the first path where `write` succeeds; otherwise returns the reason for each path.
fn first_of(
    paths: &[PathBuf],
    write: impl Fn(File) -> std::io::Result<()>,
) -> Result<PathBuf, RescueError> {
    let mut attempts = Vec::new();
    for path in paths {
        let error = match File::create_new(path) {
            Ok(file) => match write(file) {
                Ok(()) => return Ok(path.clone()),
                Err(e) => {
                    let _ = std::fs::remove_file(path);
                    e
                }
            },
            Err(e) => e,
        };
        attempts.push((path.clone(), CopyError::Io(error)));
    }
    Err(RescueError::from_attempts(attempts))
}

/// Whether a writer holds the session at `path`, judged by the locks on the session file and its log.
///
/// The session file is opened only if it has no log and is writable: then no reader in this process has locks on it that
/// closing it would drop.
pub(crate) fn is_locked_by_writer(path: &Path) -> bool {
    if is_own(path) {
        return true;
    }
    let is_locked = |path: &Path| File::open(path).is_ok_and(|file| byte::is_locked(&file));
    let log = sidecar_path(path, "-wal");
    if let Ok(metadata) = std::fs::metadata(&log) {
        // Opening a pipe would block until another process writes to it.
        return metadata.is_file() && is_locked(&log);
    }
    std::fs::metadata(path).is_ok_and(|m| m.is_file() && !m.permissions().readonly())
        && is_locked(path)
}

/// Whether this process writes the session at `path`.
pub(crate) fn is_own(path: &Path) -> bool {
    FileId::at(path).is_some_and(|id| own_sessions().contains(&id))
}

fn own_sessions() -> std::sync::MutexGuard<'static, Vec<FileId>> {
    OWN_SESSIONS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Lock on a single byte.
mod byte {
    use std::fs::File;
    use std::io;

    use nix::fcntl::{FcntlArg, fcntl};
    use nix::libc;

    /// Beyond the last byte of any SQLite file (281 TB, sqlite.org/limits.html) and beyond the bytes that SQLite locks (from 2^30).
    const AT: libc::off_t = 1 << 60;

    fn of_kind(kind: libc::c_int) -> libc::flock {
        libc::flock {
            l_type: kind as libc::c_short,
            l_whence: libc::SEEK_SET as libc::c_short,
            l_start: AT,
            l_len: 1,
            l_pid: 0,
        }
    }

    fn set(file: &File, kind: libc::c_int) -> io::Result<()> {
        fcntl(file, FcntlArg::F_OFD_SETLK(&of_kind(kind)))?;
        Ok(())
    }

    /// Locks the byte through this handle, which may be read-only; false if another handle holds it.
    ///
    /// A sealed session cannot be opened for writing, and a read-only handle can take only a shared lock. So each writer sets a shared
    /// lock, then looks for another one: of two simultaneous writers, at least one sees the other.
    pub(super) fn lock(file: &File) -> io::Result<bool> {
        set(file, libc::F_RDLCK)?;
        if is_locked(file) {
            set(file, libc::F_UNLCK)?;
            return Ok(false);
        }
        Ok(true)
    }

    /// Whether another handle holds the lock.
    pub(crate) fn is_locked(file: &File) -> bool {
        let mut found = of_kind(libc::F_WRLCK);
        fcntl(file, FcntlArg::F_OFD_GETLK(&mut found)).is_ok()
            && libc::c_int::from(found.l_type) != libc::F_UNLCK
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each handle locks separately, even within one process, and a read-only handle is enough.
    #[test]
    fn one_handle_has_the_lock() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, "").unwrap();
        let mut permissions = std::fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        std::fs::set_permissions(&path, permissions).unwrap();
        let one = LockedFile::open(&path).unwrap().unwrap();
        assert!(LockedFile::open(&path).unwrap().is_none());
        // The rejected handle is closed by now, which must not drop the first lock.
        assert!(byte::is_locked(&File::open(&path).unwrap()));
        let moved = folder.path().join("b");
        std::fs::rename(&path, &moved).unwrap();
        assert!(LockedFile::open(&moved).unwrap().is_none());
        drop(one);
        assert!(!byte::is_locked(&File::open(&moved).unwrap()));
        assert!(LockedFile::open(&moved).unwrap().is_some());
    }

    #[test]
    fn two_threads_never_hold_the_lock_together() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, "").unwrap();
        let inside = std::sync::atomic::AtomicUsize::new(0);
        let take = || {
            for _ in 0..2_000 {
                use std::sync::atomic::Ordering::SeqCst;
                if let Some(lock) = LockedFile::open(&path).unwrap() {
                    assert_eq!(inside.fetch_add(1, SeqCst), 0);
                    std::thread::yield_now();
                    inside.fetch_sub(1, SeqCst);
                    drop(lock);
                }
            }
        };
        std::thread::scope(|scope| (0..4).for_each(|_| drop(scope.spawn(take))));
    }
}
