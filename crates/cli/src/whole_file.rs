//! Writes files atomically, even while other processes write the same one.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::paths::folder_of;

/// Separates a file's name from the number of its unfinished copy.
const PARTIAL: &str = ".partial-";

/// Replaces the file at `path` in one step: writes `bytes` to a temporary file beside it, syncs it to the disk and renames it. With
/// several writers, the complete file of the last one stays.
///
/// # Errors
/// The error of the system; then the file at `path` is unchanged and no temporary file is left.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    remove_leftovers(path);
    let (partial, mut file) = create_partial(path)?;
    let written = file
        .write_all(bytes)
        .and_then(|()| file.sync_all())
        .and_then(|()| fs::rename(&partial, path));
    if written.is_err() {
        let _ = fs::remove_file(&partial);
    }
    written
}

/// Creates a temporary file beside `path` that only this writer uses, locked while it is open.
fn create_partial(path: &Path) -> io::Result<(PathBuf, File)> {
    // Never reuse a name: a process about to remove one copy must not remove the next one.
    static COPIES: AtomicU64 = AtomicU64::new(0);
    let process = std::process::id();
    loop {
        let n = COPIES.fetch_add(1, Ordering::Relaxed);
        let mut name = path.as_os_str().to_owned();
        name.push(format!("{PARTIAL}{process}-{n}"));
        let partial = PathBuf::from(name);
        // Never follow a link that another user planted.
        let file = match OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&partial)
        {
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => continue,
            other => other?,
        };
        // On a file system without locks no process removes it either.
        let _ = file.lock();
        // Before it was locked, another process may have removed it as a leftover.
        if partial.exists() {
            return Ok((partial, file));
        }
    }
}

/// Removes copies left by processes that were killed while writing; these are no longer locked.
fn remove_leftovers(path: &Path) {
    let Some(name) = path.file_name() else {
        return;
    };
    let prefix = format!("{}{PARTIAL}", name.to_string_lossy());
    for entry in fs::read_dir(folder_of(path))
        .into_iter()
        .flatten()
        .flatten()
    {
        let is_copy = entry.file_name().to_string_lossy().starts_with(&prefix);
        if !is_copy || entry.file_type().is_ok_and(|t| !t.is_file()) {
            continue;
        }
        // Keep the lock until it is removed: a writer about to lock it then notices the removal.
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
    fn concurrent_writers_leave_one_complete_file() {
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
    fn leftovers_of_a_killed_writer_are_removed_but_not_files_being_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.json");
        let left = folder.path().join("x.json.partial-4-0");
        fs::write(&left, "half").unwrap();
        let (others, held) = create_partial(&path).unwrap();
        write(&path, b"whole").unwrap();
        assert!(!left.exists() && others.exists());
        drop(held);
        write(&path, b"again").unwrap();
        assert!(!others.exists());
        // After a failed write, nothing is left.
        let taken = folder.path().join("folder");
        fs::create_dir_all(taken.join("full")).unwrap();
        assert!(write(&taken, b"x").is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
