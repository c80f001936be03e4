//! A file that is there whole or not at all, also while other processes write the same one.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// What lies between a file's name and the number of its unfinished copy.
const PARTIAL: &str = ".partial-";

/// Puts `bytes` at `path` in one step: into a file of this writer's own beside it, to the disk, and over what was there. Of several
/// writers the last one's file stays, whole.
///
/// # Errors
/// What the system says; then nothing of it is left behind, and what was at `path` is still there.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    remove_left_over(path);
    let (partial, mut file) = own(path)?;
    let written = file
        .write_all(bytes)
        .and_then(|()| file.sync_all())
        .and_then(|()| fs::rename(&partial, path));
    if written.is_err() {
        let _ = fs::remove_file(&partial);
    }
    written
}

/// A new file beside `path`, locked for as long as it is open, that nobody else writes.
fn own(path: &Path) -> io::Result<(PathBuf, File)> {
    // Never the same name again: who is about to remove one copy must not meet the next one.
    static COPIES: AtomicU64 = AtomicU64::new(0);
    let process = std::process::id();
    loop {
        let n = COPIES.fetch_add(1, Ordering::Relaxed);
        let mut name = path.as_os_str().to_owned();
        name.push(format!("{PARTIAL}{process}-{n}"));
        let partial = PathBuf::from(name);
        // Never through a link that a stranger put there.
        let file = match OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&partial)
        {
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => continue,
            other => other?,
        };
        // Without locks on this file system nobody removes it either.
        let _ = file.lock();
        // Before it was locked, somebody may have taken it for left over.
        if partial.exists() {
            return Ok((partial, file));
        }
    }
}

/// Removes what processes left that were ended while they wrote: their copies are locked no more.
fn remove_left_over(path: &Path) {
    let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else {
        return;
    };
    let folder = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let prefix = format!("{}{PARTIAL}", name.to_string_lossy());
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_copy = entry.file_name().to_string_lossy().starts_with(&prefix);
        if !is_copy || entry.file_type().is_ok_and(|t| !t.is_file()) {
            continue;
        }
        // Held until it is removed: its writer, if it is about to lock it, then sees that it is gone.
        if let Ok(file) = File::open(entry.path())
            && file.try_lock().is_ok()
        {
            let _ = fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_writers_of_one_file_leave_one_of_their_files() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.json");
        let text = |n: usize| format!("{n}").repeat(100_000);
        std::thread::scope(|scope| {
            for n in 1..6 {
                let path = &path;
                scope.spawn(move || {
                    for _ in 0..20 {
                        write(path, text(n).as_bytes()).unwrap();
                    }
                });
            }
        });
        let left = fs::read_to_string(&path).unwrap();
        assert!((1..6).any(|n| left == text(n)));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn what_an_ended_writer_left_is_removed_and_what_another_one_writes_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.json");
        let left = folder.path().join("x.json.partial-4-0");
        fs::write(&left, "half").unwrap();
        let (others, held) = own(&path).unwrap();
        write(&path, b"whole").unwrap();
        assert!(!left.exists() && others.exists());
        drop(held);
        write(&path, b"again").unwrap();
        assert!(!others.exists());
        // Where it cannot be put, nothing is left.
        let taken = folder.path().join("folder");
        fs::create_dir_all(taken.join("full")).unwrap();
        assert!(write(&taken, b"x").is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
