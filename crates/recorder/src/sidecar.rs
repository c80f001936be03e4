//! Files beside a session, and rejection of dangerous ones: links, special files and journals with a super-journal.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use crate::error::RecorderError;

/// File name suffix of sessions.
pub const SESSION_SUFFIX: &str = ".session.sqlite";

/// Path of the file that SQLite keeps beside a session: `-wal`, the write-ahead log, or `-journal`, the rollback
/// journal.
pub(crate) fn sidecar_path(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

/// Rejects a session that is not a regular file, or has a special file beside it. Reading a pipe or a device may block forever, and
/// a link in an untrusted folder would redirect writes to any other file.
pub(crate) fn reject_special_files(path: &Path) -> Result<(), RecorderError> {
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
        let file = sidecar_path(path, ending);
        let Ok(metadata) = std::fs::symlink_metadata(&file) else {
            continue;
        };
        if !metadata.is_file() {
            let what = if metadata.is_symlink() {
                "a link"
            } else {
                "a special file"
            };
            return not(format!("{what} beside it, {}: delete it", file.display()));
        }
    }
    Ok(())
}

/// Last bytes of a journal with a super-journal, the file of a transaction over several databases
/// (sqlite.org/fileformat.html section 3).
pub(crate) const SUPER_JOURNAL_END: [u8; 8] = [0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7];

/// Rejects a journal with a super-journal. SQLite deletes the super-journal after a rollback; in an untrusted journal it
/// may name any file of the user. Sessions are single databases, so their own transactions never have one.
pub(crate) fn reject_super_journal(path: &Path) -> Result<(), RecorderError> {
    // SQLite follows links and looks beside the target.
    let file = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let journal = sidecar_path(&file, "-journal");
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
        // The writer of the session has just truncated it.
        Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => return Ok(()),
        Err(e) => return Err(io(e)),
    }
    if end == SUPER_JOURNAL_END {
        return Err(RecorderError::NotASession {
            path: path.to_owned(),
            found: format!(
                "a journal beside it, {}, that would delete another file: delete the journal, and do not trust the session",
                journal.display()
            ),
        });
    }
    Ok(())
}
