//! The lease file, shared by all users of a bench.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::owner::Entry;

/// Environment variable that names the folder of leases.
pub const VARIABLE: &str = "SKINRIG_LEASES";
/// Default folders for leases. Where only root can write to the first, the second is used.
const SHARED: [&str; 2] = ["/run/lock", "/var/lock"];

/// The folder of leases: the one in [`VARIABLE`], or one that every user of this computer can write
/// to. A folder in the user's home would not exclude other users.
#[must_use]
pub fn folder() -> PathBuf {
    if let Some(named) = std::env::var_os(VARIABLE).filter(|v| !v.is_empty()) {
        return named.into();
    }
    let shared = SHARED.iter().map(Path::new).find(|f| is_world_writable(f));
    shared.map_or_else(std::env::temp_dir, Path::to_path_buf)
}

#[cfg(unix)]
fn is_world_writable(folder: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    std::fs::metadata(folder).is_ok_and(|m| m.is_dir() && m.permissions().mode() & 0o002 != 0)
}

#[cfg(not(unix))]
fn is_world_writable(_folder: &Path) -> bool {
    false
}

/// Opens the file at `path`, or creates it with write access for every user.
///
/// The first call creates it, later ones must not: in a folder with the sticky bit, Linux rejects
/// `O_CREAT` on an existing file of another user (`fs.protected_regular`).
pub(super) fn open(path: &Path) -> io::Result<File> {
    for _ in 0..2 {
        match OpenOptions::new().read(true).write(true).open(path) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => {}
            opened => return opened,
        }
        let created = OpenOptions::new()
            .read(true)
            .write(true)
            .create_new(true)
            .open(path);
        match created {
            // Another program created it first.
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e),
            Ok(file) => {
                make_world_writable(&file)?;
                return Ok(file);
            }
        }
    }
    Err(io::Error::other(
        "the file is repeatedly created and deleted",
    ))
}

#[cfg(unix)]
fn make_world_writable(file: &File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o666))
}

#[cfg(not(unix))]
fn make_world_writable(_file: &File) -> io::Result<()> {
    Ok(())
}

/// Reads the entry; `None` when the file is empty or has another format.
pub(super) fn read(file: &mut File) -> io::Result<Option<Entry>> {
    let mut text = String::new();
    file.seek(SeekFrom::Start(0))?;
    // A lease has a few hundred bytes, so a larger file is not a lease.
    file.take(1 << 16).read_to_string(&mut text)?;
    Ok(serde_json::from_str(&text).ok())
}

/// Writes the entry in place: a folder with the sticky bit does not allow replacing the file of another user.
pub(super) fn write(file: &mut File, entry: &Entry) -> io::Result<()> {
    let text = serde_json::to_string_pretty(entry).map_err(io::Error::other)? + "\n";
    file.seek(SeekFrom::Start(0))?;
    file.write_all(text.as_bytes())?;
    file.set_len(text.len() as u64)?;
    file.sync_data()
}

/// Appends a line to the log next to the lease.
pub(super) fn log(path: &Path, line: &str) -> io::Result<()> {
    let mut file = open(&path.with_extension("log"))?;
    file.seek(SeekFrom::End(0))?;
    let at = chrono::Utc::now().to_rfc3339_opts(chrono::SecondsFormat::Secs, true);
    file.write_all(format!("{at}  {line}\n").as_bytes())
}
