//! Writes files atomically, even while other processes write the same one.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::paths::folder_of;

/// Separates a file's name from the number of its unfinished copy.
const PARTIAL: &str = ".partial-";

/// Replaces the file at `path` in one step: writes `bytes` to a temporary file beside it, syncs it to the disk and renames it. With
/// several writers, the complete file of the last one stays. A device or pipe, such as `/dev/null`, takes the bytes and stays.
///
/// # Errors
/// The error of the system; then the file at `path` is unchanged and no temporary file is left.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    if is_device(path) {
        return OpenOptions::new().write(true).open(path)?.write_all(bytes);
    }
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

/// Tests that a file can be written at `path`, before work whose result it is to hold. Nothing at `path` changes.
///
/// # Errors
/// The error of the system.
pub(crate) fn probe(path: &Path) -> io::Result<()> {
    // To open and close a pipe would end what its reader reads.
    if is_device(path) {
        return Ok(());
    }
    let (partial, file) = create_partial(path)?;
    drop(file);
    fs::remove_file(partial)
}

/// True for what is neither a file nor a folder.
fn is_device(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir())
}

/// Bytes at the start of a file by which its kind is told.
const START_BYTES: u64 = 4096;

/// Like [`write`], at a path that a user names: replaces only a text that begins like `bytes`, so no recording and no protocol.
///
/// # Errors
/// As [`write`]; [`io::ErrorKind::AlreadyExists`] for a file of another kind, which is then unchanged.
pub(crate) fn write_named(path: &Path, bytes: &[u8]) -> io::Result<()> {
    if is_of_another_kind(path, bytes) {
        let found =
            "expected no file, or an earlier one of the same kind, found a file of another kind";
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, found));
    }
    write(path, bytes)
}

/// True for a file with zero bytes at its start, or whose first character is not that of `bytes`: JSON, HTML, YAML and columns of text
/// differ in it. A file that cannot be read is reported by whoever replaces it.
fn is_of_another_kind(path: &Path, bytes: &[u8]) -> bool {
    if !path.is_file() {
        return false;
    }
    let mut start = Vec::new();
    let read = File::open(path).and_then(|file| file.take(START_BYTES).read_to_end(&mut start));
    let first = |of: &[u8]| of.iter().copied().find(|b| !b.is_ascii_whitespace());
    let there = first(&start);
    read.is_ok() && (start.contains(&0) || there.is_some() && there != first(bytes))
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
    fn a_probe_leaves_the_file_as_it_is_and_names_what_is_missing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.json");
        probe(&path).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        fs::write(&path, "there").unwrap();
        probe(&path).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "there");
        let missing = probe(&folder.path().join("none/x.json")).unwrap_err();
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }

    /// A socket stands for a device, which only root can create: it cannot be opened as a file, and would have been replaced.
    #[test]
    #[cfg(unix)]
    fn a_device_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&path).unwrap();
        probe(&path).unwrap();
        assert!(write(&path, b"x").is_err());
        assert!(is_device(&path));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

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
    fn only_a_text_that_begins_alike_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        for (there, new, is_replaced) in [
            (&b"{\"old\": 1}"[..], "{}", true),
            (b"", "{}", true),
            (b"<!doctype html>", "<!doctype html>new", true),
            (b"SQLite format 3\0", "{}", false),
            (b"{\0", "{}", false),
            (b"skinrig: 1", "{}", false),
            (b"skinrig: 1", "<svg/>", false),
        ] {
            fs::write(&path, there).unwrap();
            let written = write_named(&path, new.as_bytes());
            assert_eq!(written.is_ok(), is_replaced, "{written:?}");
            let left = if is_replaced { new.as_bytes() } else { there };
            assert_eq!(fs::read(&path).unwrap(), left);
        }
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
