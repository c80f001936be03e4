//! The files that a writer holds open: locked against every other writer, and watched for being moved or removed.
//!
//! The lock file beside a session ([`crate::lock`]) can be removed by anybody. So a writer also locks one byte of the session file and
//! one of its log, far behind all that SQLite locks or stores. These are locks of the open file description (`fcntl(2)`, "Open file
//! description locks"): they hold as long as the file is open, whatever its name, and other handles of the process do not touch them.
//!
//! The other way round it matters: closing any handle of a file ends all POSIX locks that the process has on it, those of SQLite too
//! (sqlite.org/howtocorrupt.html, section 2.2). So the handles here are closed after SQLite's, and a session that this process
//! writes is known by [`OURS`] and not opened a second time for its lock.

use std::fs::{File, Metadata};
use std::io::{Seek, SeekFrom};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::beside::{SESSION_SUFFIX, beside};
use crate::error::RecorderError;

/// Sessions that this process writes.
static OURS: Mutex<Vec<FileId>> = Mutex::new(Vec::new());

/// Device and inode of a file: what it is, whatever its name.
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

    /// The file that is at `path` now.
    fn at(path: &Path) -> Option<Self> {
        Some(Self::of(&std::fs::metadata(path).ok()?))
    }
}

/// An open and locked file.
#[derive(Debug)]
struct Locked {
    file: File,
    id: FileId,
}

impl Locked {
    /// Opens and locks a file; `None` when another writer has it.
    fn open(path: &Path) -> std::io::Result<Option<Self>> {
        let file = File::open(path)?;
        if !byte::lock(&file)? {
            return Ok(None);
        }
        let id = FileId::of(&file.metadata()?);
        Ok(Some(Self { file, id }))
    }

    /// Where it lies now, when the system can tell.
    fn place(&self) -> Option<PathBuf> {
        use std::os::fd::AsRawFd;
        let path = std::fs::read_link(format!("/proc/self/fd/{}", self.file.as_raw_fd())).ok()?;
        (FileId::at(&path) == Some(self.id)).then_some(path)
    }
}

/// The session file and the files of its log, as the writer opened them.
#[derive(Debug)]
pub struct Held {
    path: PathBuf,
    session: Locked,
    log: Option<Locked>,
    /// Of the log's index. It is not opened: SQLite's locks lie on it.
    index: Option<FileId>,
}

impl Held {
    /// Locks the session file at `path`, and its log when there is one.
    ///
    /// `Ok(None)` when another writer has one of them.
    pub fn take(path: &Path) -> std::io::Result<Option<Self>> {
        let path = std::path::absolute(path)?;
        if is_ours(&path) {
            return Ok(None);
        }
        let Some(session) = Locked::open(&path)? else {
            return Ok(None);
        };
        let log = match Locked::open(&beside(&path, "-wal")) {
            Ok(Some(log)) => Some(log),
            Ok(None) => return Ok(None),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => None,
            Err(e) => return Err(e),
        };
        ours().push(session.id);
        Ok(Some(Self {
            path,
            session,
            log,
            index: None,
        }))
    }

    /// Locks the log that SQLite has made since, and remembers its index.
    ///
    /// `Ok(false)` when another writer has it.
    pub(crate) fn take_log(&mut self) -> std::io::Result<bool> {
        let log = beside(&self.path, "-wal");
        if self.log.as_ref().map(|l| l.id) != FileId::at(&log) || self.log.is_none() {
            self.log = Locked::open(&log)?;
        }
        self.index = FileId::at(&beside(&self.path, "-shm"));
        Ok(self.log.is_some())
    }

    /// SQLite is about to remove the log.
    pub(crate) fn without_log(&mut self) {
        (self.log, self.index) = (None, None);
    }

    /// Whether all of it is still where it was opened.
    ///
    /// # Errors
    /// [`RecorderError::Displaced`].
    pub fn check(&self) -> Result<(), RecorderError> {
        let displaced = |path: PathBuf, found: String| RecorderError::Displaced { path, found };
        let now = FileId::at(&self.path);
        if now != Some(self.session.id) {
            let own = match self.session.place() {
                Some(place) => format!("moved to {}", place.display()),
                None => "removed".to_owned(),
            };
            let found = match now {
                None => format!("it {own}"),
                Some(_) => format!("another file in its place, and its own {own}"),
            };
            return Err(displaced(self.path.clone(), found));
        }
        let log = self.log.as_ref().map(|log| log.id);
        for (ending, id) in [("-wal", log), ("-shm", self.index)] {
            let file = beside(&self.path, ending);
            let Some(id) = id else { continue };
            match FileId::at(&file) {
                Some(found) if found == id => {}
                Some(_) => {
                    return Err(displaced(file, "another file in its place".to_owned()));
                }
                None => return Err(displaced(file, "it removed".to_owned())),
            }
        }
        Ok(())
    }

    /// Where the session file lies now, and where a copy of it could be put: beside its old place, in the nearest folder above that is
    /// still there, or in the system's folder for temporary files.
    pub(crate) fn refuge(&self) -> Refuge {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let stem = name
            .strip_suffix(SESSION_SUFFIX)
            .unwrap_or(&name)
            .to_owned();
        let folders = self.path.ancestors().skip(1).map(Path::to_path_buf);
        // Not into the root of all folders.
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
        Refuge {
            place: self.session.place(),
            copies: folders.filter_map(copy_in).collect(),
        }
    }

    /// Copies the bytes of the open session file to the first path that takes them. For a file without a log.
    pub fn copy(&self, paths: &[PathBuf]) -> Result<PathBuf, String> {
        let copy = |mut to: File| -> std::io::Result<()> {
            let mut from = &self.session.file;
            from.seek(SeekFrom::Start(0))?;
            std::io::copy(&mut from, &mut to)?;
            to.sync_all()
        };
        first_of(paths, copy)
    }

    /// Removes what is left of the log beside the session's old and new place, after SQLite has left them.
    pub fn tidy(&self) {
        let log = self.log.as_ref().map(|log| log.id);
        let places = [Some(self.path.clone()), self.session.place()];
        for place in places.into_iter().flatten() {
            for (ending, id) in [("-wal", log), ("-shm", self.index)] {
                let file = beside(&place, ending);
                if id.is_some() && FileId::at(&file) == id {
                    let _ = std::fs::remove_file(file);
                }
            }
        }
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        let mut ours = ours();
        if let Some(at) = ours.iter().position(|id| *id == self.session.id) {
            ours.swap_remove(at);
        }
    }
}

/// Where a session that was moved or removed while it was written can be kept.
#[derive(Debug, Clone)]
pub(crate) struct Refuge {
    /// Where the file lies now; nowhere when it was removed.
    pub place: Option<PathBuf>,
    /// Where a copy may be put, the best place first. No file is there.
    pub copies: Vec<PathBuf>,
}

/// Makes an empty file at one path after the other and lets `write` fill it; the first that was filled, or why none was.
fn first_of(
    paths: &[PathBuf],
    write: impl Fn(File) -> std::io::Result<()>,
) -> Result<PathBuf, String> {
    let mut refused = Vec::new();
    for path in paths {
        let told = match File::create_new(path) {
            Ok(file) => match write(file) {
                Ok(()) => return Ok(path.clone()),
                Err(e) => {
                    let _ = std::fs::remove_file(path);
                    e.to_string()
                }
            },
            Err(e) => e.to_string(),
        };
        refused.push(format!("{}: {told}", path.display()));
    }
    Err(if refused.is_empty() {
        "expected a folder for a copy, found none".to_owned()
    } else {
        refused.join("; ")
    })
}

/// Whether a writer holds the session at `path`, told by the session file and its log alone.
///
/// The session file is opened only while there is no log and it can be written: then no reader of this process has locks on it that
/// closing it would end.
pub fn is_held(path: &Path) -> bool {
    if is_ours(path) {
        return true;
    }
    let held = |path: &Path| File::open(path).is_ok_and(|file| byte::is_locked(&file));
    let log = beside(path, "-wal");
    if let Ok(metadata) = std::fs::metadata(&log) {
        // To open a pipe would wait for whoever writes into it.
        return metadata.is_file() && held(&log);
    }
    std::fs::metadata(path).is_ok_and(|m| m.is_file() && !m.permissions().readonly()) && held(path)
}

/// Whether this process writes the session at `path`.
pub fn is_ours(path: &Path) -> bool {
    FileId::at(path).is_some_and(|id| ours().contains(&id))
}

fn ours() -> std::sync::MutexGuard<'static, Vec<FileId>> {
    OURS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The lock of one byte.
mod byte {
    use std::fs::File;
    use std::io;

    use nix::fcntl::{FcntlArg, fcntl};
    use nix::libc;

    /// Far behind the last byte of any SQLite file (281 TB, sqlite.org/limits.html) and behind the bytes that SQLite locks (from 2^30 on).
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

    /// Locks the byte through this handle, which may be read-only; false when another handle has it.
    ///
    /// A sealed session cannot be opened for writing, and a handle for reading takes only a shared lock. So each taker sets one and then
    /// looks whether another one is there: of two that come at once, at least one sees the other.
    pub fn lock(file: &File) -> io::Result<bool> {
        set(file, libc::F_RDLCK)?;
        if is_locked(file) {
            set(file, libc::F_UNLCK)?;
            return Ok(false);
        }
        Ok(true)
    }

    /// Whether another handle has the lock.
    pub(crate) fn is_locked(file: &File) -> bool {
        let mut found = of_kind(libc::F_WRLCK);
        fcntl(file, FcntlArg::F_OFD_GETLK(&mut found)).is_ok()
            && libc::c_int::from(found.l_type) != libc::F_UNLCK
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each handle is a taker of its own, also in one process, and a handle for reading will do.
    #[test]
    fn one_handle_has_the_lock() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, "").unwrap();
        let mut permissions = std::fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        std::fs::set_permissions(&path, permissions).unwrap();
        let one = Locked::open(&path).unwrap().unwrap();
        assert!(Locked::open(&path).unwrap().is_none());
        // The refused one's handle is closed by now, which takes nothing from the first.
        assert!(byte::is_locked(&File::open(&path).unwrap()));
        let moved = folder.path().join("b");
        std::fs::rename(&path, &moved).unwrap();
        assert!(Locked::open(&moved).unwrap().is_none());
        drop(one);
        assert!(!byte::is_locked(&File::open(&moved).unwrap()));
        assert!(Locked::open(&moved).unwrap().is_some());
    }

    #[test]
    fn of_many_at_once_never_two_have_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, "").unwrap();
        let inside = std::sync::atomic::AtomicUsize::new(0);
        let take = || {
            for _ in 0..2_000 {
                use std::sync::atomic::Ordering::SeqCst;
                if let Some(lock) = Locked::open(&path).unwrap() {
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
