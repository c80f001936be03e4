//! Opens only regular files: reading a pipe, a socket or a device may block forever.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Largest text file, bytes: protocols, schedules, rig files, suites, limits and tables are far smaller.
pub(crate) const MAX_TEXT_BYTES: u64 = 64 << 20;

/// Checks that `path` is a regular file, without opening it.
///
/// # Errors
/// If `path` does not exist, is not accessible, or is not a regular file.
pub fn check(path: &Path) -> io::Result<()> {
    let kind = std::fs::metadata(path)?.file_type();
    if kind.is_file() {
        return Ok(());
    }
    let found = if kind.is_dir() {
        "a folder"
    } else {
        special(kind)
    };
    let text =
        format!("expected a regular file, found {found}; next: copy its content into a file");
    Err(io::Error::new(io::ErrorKind::InvalidInput, text))
}

#[cfg(unix)]
fn special(kind: std::fs::FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    if kind.is_fifo() {
        "a pipe"
    } else if kind.is_socket() {
        "a socket"
    } else {
        "a device"
    }
}

#[cfg(not(unix))]
fn special(_kind: std::fs::FileType) -> &'static str {
    "something else"
}

/// Opens a regular file for reading.
///
/// # Errors
/// As [`check`], and if it cannot be opened.
pub fn open(path: &Path) -> io::Result<File> {
    check(path)?;
    File::open(path)
}

/// Reads a whole text file of at most `MAX_TEXT_BYTES`.
///
/// # Errors
/// As [`open`], if reading fails, and for a longer file.
pub fn read_text(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?
        .take(MAX_TEXT_BYTES + 1)
        .read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_TEXT_BYTES {
        let text = format!("expected a text of at most {MAX_TEXT_BYTES} bytes, found a longer one");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, text));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_devices_and_long_texts_are_rejected() {
        let folder = tempfile::tempdir().unwrap();
        let error = |path: &Path| read_text(path).unwrap_err().to_string();
        assert!(error(folder.path()).contains("found a folder"));
        #[cfg(unix)]
        assert!(error(Path::new("/dev/zero")).contains("found a device"));
        let long = folder.path().join("long");
        File::create(&long)
            .unwrap()
            .set_len(MAX_TEXT_BYTES + 1)
            .unwrap();
        assert!(error(&long).contains("a longer one"));
        std::fs::write(&long, "a: 1").unwrap();
        assert_eq!(read_text(&long).unwrap(), b"a: 1");
    }
}
