//! The lease: its file, shared by all users of a bench.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::owner::Entry;

/// Where the leases of this computer's benches lie when nothing else is said.
pub const VARIABLE: &str = "SKINRIG_LEASES";
/// Its usual place, and what follows where the system keeps it to itself.
const SHARED: [&str; 2] = ["/run/lock", "/var/lock"];

/// The folder of leases: the one of [`VARIABLE`], or one that every user of this computer can write. One of the user's own would
/// not keep two users apart.
#[must_use]
pub fn folder() -> PathBuf {
    if let Some(named) = std::env::var_os(VARIABLE).filter(|v| !v.is_empty()) {
        return named.into();
    }
    let shared = SHARED.iter().map(Path::new).find(|f| everybody_writes(f));
    shared.map_or_else(std::env::temp_dir, Path::to_path_buf)
}

#[cfg(unix)]
fn everybody_writes(folder: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    std::fs::metadata(folder).is_ok_and(|m| m.is_dir() && m.permissions().mode() & 0o002 != 0)
}

#[cfg(not(unix))]
fn everybody_writes(_folder: &Path) -> bool {
    false
}

/// Opens the file at `path` for everybody, and makes it where there is none.
///
/// Only the first open may create: in a folder with the sticky bit Linux refuses to open the file of somebody else with leave to
/// create it (`fs.protected_regular`).
pub(super) fn open(path: &Path) -> io::Result<File> {
    for _ in 0..2 {
        match OpenOptions::new().read(true).write(true).open(path) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => {}
            opened => return opened,
        }
        let made = OpenOptions::new()
            .read(true)
            .write(true)
            .create_new(true)
            .open(path);
        match made {
            // Somebody was faster.
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e),
            Ok(file) => {
                for_everybody(&file)?;
                return Ok(file);
            }
        }
    }
    Err(io::Error::other("it comes and goes"))
}

#[cfg(unix)]
fn for_everybody(file: &File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o666))
}

#[cfg(not(unix))]
fn for_everybody(_file: &File) -> io::Result<()> {
    Ok(())
}

/// What stands in the file; `None` when it is empty or not ours to understand.
pub(super) fn read(file: &mut File) -> io::Result<Option<Entry>> {
    let mut text = String::new();
    file.seek(SeekFrom::Start(0))?;
    // A lease is some hundred bytes; whatever is larger is none.
    file.take(1 << 16).read_to_string(&mut text)?;
    Ok(serde_json::from_str(&text).ok())
}

/// Writes the entry in place: in a folder with the sticky bit nobody can put another file there instead.
pub(super) fn write(file: &mut File, entry: &Entry) -> io::Result<()> {
    let text = serde_json::to_string_pretty(entry).map_err(io::Error::other)? + "\n";
    file.seek(SeekFrom::Start(0))?;
    file.write_all(text.as_bytes())?;
    file.set_len(text.len() as u64)?;
    file.sync_data()
}

/// Adds a line to the log beside the lease.
pub(super) fn log(path: &Path, line: &str) -> io::Result<()> {
    let mut file = open(&path.with_extension("log"))?;
    file.seek(SeekFrom::End(0))?;
    let at = chrono::Utc::now().to_rfc3339_opts(chrono::SecondsFormat::Secs, true);
    file.write_all(format!("{at}  {line}\n").as_bytes())
}
