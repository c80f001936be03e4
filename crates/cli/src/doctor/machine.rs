//! Reads the state of the machine from `/sys`, `/proc`, `/etc`, `/run` and `/dev` below one root folder.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use super::access::{Node, User};

/// Missing or unreadable information about the machine.
#[derive(Debug, thiserror::Error)]
pub(super) enum MachineError {
    /// A file or folder cannot be read.
    #[error("cannot read {path}: {source}")]
    Unreadable {
        /// Absolute path.
        path: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The status of this process has no user.
    #[error("/proc/self/status has no user ID")]
    NoUser,
}

impl MachineError {
    fn of(path: &str) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Unreadable { path, source }
    }
}

/// A machine, real or planted by a test.
pub(super) struct Machine {
    root: PathBuf,
    /// Free bytes of a folder.
    pub free_b: fn(&Path) -> io::Result<f64>,
    /// Measures how fast a folder takes bytes, bytes/s.
    pub write_b_s: WriteSpeed,
}

/// Measures how fast a folder takes bytes, bytes/s.
pub(super) type WriteSpeed = fn(&Path) -> Result<f64, SpeedFault>;

/// The write speed cannot be measured.
#[derive(Debug)]
pub(super) struct SpeedFault {
    /// Why.
    pub what: String,
    /// Next step.
    pub next: String,
}

/// Enough to fill the cache of a small disk, and to be written in about a second by one that is fast enough.
const PROBE_BYTES: u64 = 64 << 20;

fn write_b_s(folder: &Path) -> Result<f64, SpeedFault> {
    skinrig_hil::disk_write_rate(folder, PROBE_BYTES).map_err(|problem| SpeedFault {
        what: problem.what,
        next: problem.next.unwrap_or_default(),
    })
}

impl Machine {
    /// The machine that this program runs on.
    pub(super) fn current() -> Self {
        Self {
            root: PathBuf::from("/"),
            free_b: crate::rig::gates::free_bytes,
            write_b_s,
        }
    }

    /// A machine planted in `root`, with this free space and write speed everywhere.
    #[cfg(test)]
    pub(super) fn with_root(
        root: &Path,
        free_b: fn(&Path) -> io::Result<f64>,
        write_b_s: WriteSpeed,
    ) -> Self {
        Self {
            root: root.to_owned(),
            free_b,
            write_b_s,
        }
    }

    /// Location of the absolute path `path` below the root folder.
    pub(super) fn path(&self, path: &str) -> PathBuf {
        self.root.join(path.trim_start_matches('/'))
    }

    /// Content of a file, trimmed.
    ///
    /// # Errors
    /// [`MachineError::Unreadable`].
    pub(super) fn text(&self, path: &str) -> Result<String, MachineError> {
        // Open and read the path itself: the stand-in for a bus on a test bench supports nothing else.
        let bytes = std::fs::read(self.path(path)).map_err(MachineError::of(path))?;
        Ok(String::from_utf8_lossy(&bytes).trim().to_owned())
    }

    /// Content of a file that holds one number.
    pub(super) fn number(&self, path: &str) -> Option<u64> {
        self.text(path).ok()?.parse().ok()
    }

    /// The names in a folder, sorted.
    ///
    /// # Errors
    /// [`MachineError::Unreadable`].
    pub(super) fn names(&self, folder: &str) -> Result<Vec<String>, MachineError> {
        let entries = std::fs::read_dir(self.path(folder)).map_err(MachineError::of(folder))?;
        let mut names: Vec<String> = entries
            .flatten()
            .map(|e| e.file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        Ok(names)
    }

    /// True if `path` exists.
    pub(super) fn has(&self, path: &str) -> bool {
        self.path(path).exists()
    }

    /// Target of a symbolic link, unresolved.
    pub(super) fn link(&self, path: &str) -> Option<PathBuf> {
        std::fs::read_link(self.path(path)).ok()
    }

    /// Owner and permissions of the file at `path`.
    pub(super) fn node(&self, path: &str) -> Option<Node> {
        Node::of(&self.path(path))
    }

    /// Content of a file with lines `key<colon>value`, such as `/proc/self/status`.
    ///
    /// # Errors
    /// [`MachineError::Unreadable`].
    pub(super) fn table(&self, path: &str) -> Result<BTreeMap<String, String>, MachineError> {
        let lines = self.text(path)?;
        let pairs = lines.lines().filter_map(|l| l.split_once(':'));
        Ok(pairs
            .map(|(key, value)| (key.trim().to_owned(), value.trim().to_owned()))
            .collect())
    }

    /// The user that runs this program.
    ///
    /// # Errors
    /// [`MachineError`] when the status of this process is unreadable or has no user.
    pub(super) fn user(&self) -> Result<User, MachineError> {
        let status = self.table("/proc/self/status")?;
        let ids = |key: &str| -> Vec<u32> {
            let text = status.get(key).map_or("", String::as_str);
            text.split_whitespace()
                .filter_map(|id| id.parse().ok())
                .collect()
        };
        // In this order: real, effective, saved, file system.
        let (Some(&uid), Some(&gid)) = (ids("Uid").get(1), ids("Gid").get(1)) else {
            return Err(MachineError::NoUser);
        };
        let capabilities = status.get("CapEff");
        let capabilities = capabilities.and_then(|text| u64::from_str_radix(text, 16).ok());
        let mut groups = ids("Groups");
        groups.push(gid);
        Ok(User {
            uid,
            name: self.name_of("/etc/passwd", uid),
            groups,
            capabilities: capabilities.unwrap_or(0),
        })
    }

    /// The name of a group.
    pub(super) fn group(&self, gid: u32) -> String {
        self.name_of("/etc/group", gid)
    }

    /// Looks a number up in `/etc/passwd` or `/etc/group`: name, password, number.
    fn name_of(&self, file: &str, id: u32) -> String {
        let lines = self.text(file).unwrap_or_default();
        let number = id.to_string();
        let name = lines.lines().find_map(|line| {
            let mut fields = line.split(':');
            let name = fields.next()?;
            (fields.nth(1) == Some(number.as_str())).then(|| name.to_owned())
        });
        name.unwrap_or(number)
    }
}
