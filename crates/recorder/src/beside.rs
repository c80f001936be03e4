//! The files that lie beside a session, and what is refused there: links, and a journal that would have another file removed.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use crate::error::RecorderError;

/// How session files end.
pub const SESSION_SUFFIX: &str = ".session.sqlite";

/// The file that SQLite keeps beside a session: `-wal`, the write-ahead log, or `-journal`, what a transaction in rollback mode
/// would be undone with.
pub fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

/// A session and the files beside it are regular files: a pipe or a device may never end, or never begin. What is written beside a
/// session is written there: a link in its place, in a folder from a stranger, would lead the writing to any other file.
pub(crate) fn refuse_special_files(path: &Path) -> Result<(), RecorderError> {
    let not = |found: String| {
        Err(RecorderError::NotASession {
            path: path.to_owned(),
            found,
        })
    };
    match std::fs::metadata(path) {
        Ok(m) if m.is_dir() => return not("a folder".to_owned()),
        Ok(m) if !m.is_file() => return not("a pipe, a socket or a device".to_owned()),
        _ => {}
    }
    for ending in ["-wal", "-shm", "-journal", "-lock"] {
        let file = beside(path, ending);
        let Ok(metadata) = std::fs::symlink_metadata(&file) else {
            continue;
        };
        if !metadata.is_file() {
            let what = if metadata.is_symlink() {
                "a link"
            } else {
                "something that is not a regular file"
            };
            return not(format!("{what} beside it, {}: remove it", file.display()));
        }
    }
    Ok(())
}

/// The last bytes of a journal that names a super-journal, the one file of a transaction over several databases
/// (sqlite.org/fileformat.html section 3).
pub(crate) const SUPER_JOURNAL_END: [u8; 8] = [0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7];

/// Once SQLite has played a journal it deletes the super-journal that is named in it, which from a stranger may be any file of the
/// user. A session is one database and no transaction of its own has a super-journal.
pub(crate) fn refuse_super_journal(path: &Path) -> Result<(), RecorderError> {
    // SQLite follows a link and looks beside the file itself.
    let file = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let journal = beside(&file, "-journal");
    let io = |source| RecorderError::Io {
        path: journal.clone(),
        doing: "reading its end",
        source,
    };
    let mut opened = match File::open(&journal) {
        Ok(opened) => opened,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(e) => return Err(io(e)),
    };
    let bytes = opened.metadata().map_err(io)?.len();
    let Some(last) = bytes.checked_sub(SUPER_JOURNAL_END.len() as u64) else {
        return Ok(());
    };
    let mut end = [0; SUPER_JOURNAL_END.len()];
    opened.seek(SeekFrom::Start(last)).map_err(io)?;
    match opened.read_exact(&mut end) {
        Ok(()) => {}
        // Whoever writes the session has just cut it.
        Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => return Ok(()),
        Err(e) => return Err(io(e)),
    }
    if end == SUPER_JOURNAL_END {
        return Err(RecorderError::NotASession {
            path: path.to_owned(),
            found: format!(
                "a journal beside it, {}, that names a further file for deletion: remove the journal, and do not trust the session",
                journal.display()
            ),
        });
    }
    Ok(())
}
