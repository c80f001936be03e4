//! The machine as its files tell it: `/sys`, `/proc`, `/etc`, `/run` and `/dev` below one folder.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use super::access::{Node, User};

/// Why the machine's files do not tell something.
#[derive(Debug, thiserror::Error)]
pub(super) enum MachineError {
    /// A file or folder cannot be read.
    #[error("cannot read {path}: {source}")]
    Unreadable {
        /// As the kernel names it.
        path: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The status of this process names no user.
    #[error("/proc/self/status does not tell the user")]
    NoUser,
}

impl MachineError {
    fn of(path: &str) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Unreadable { path, source }
    }
}

/// A machine.
pub(super) struct Machine {
    root: PathBuf,
    /// Free bytes of a folder.
    pub free_b: fn(&Path) -> io::Result<f64>,
}

impl Machine {
    /// The one that this program runs on.
    pub(super) fn this() -> Self {
        Self {
            root: PathBuf::from("/"),
            free_b: crate::rig::gates::free_bytes,
        }
    }

    /// One that was planted in `root`, with so much free space everywhere.
    #[cfg(test)]
    pub(super) fn planted(root: &Path, free_b: fn(&Path) -> io::Result<f64>) -> Self {
        Self {
            root: root.to_owned(),
            free_b,
        }
    }

    /// Where `path`, which begins with `/`, lies.
    pub(super) fn path(&self, path: &str) -> PathBuf {
        self.root.join(path.trim_start_matches('/'))
    }

    /// A file without the white space at its ends.
    ///
    /// # Errors
    /// [`MachineError::Unreadable`].
    pub(super) fn text(&self, path: &str) -> Result<String, MachineError> {
        // Opened and read as such: what stands in for a bus on a test bench knows no other way.
        let bytes = std::fs::read(self.path(path)).map_err(MachineError::of(path))?;
        Ok(String::from_utf8_lossy(&bytes).trim().to_owned())
    }

    /// A number in a file of its own.
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

    /// Whether there is something at `path`.
    pub(super) fn has(&self, path: &str) -> bool {
        self.path(path).exists()
    }

    /// Where a symbolic link points, as it is written.
    pub(super) fn link(&self, path: &str) -> Option<PathBuf> {
        std::fs::read_link(self.path(path)).ok()
    }

    /// Who may open the file at `path`.
    pub(super) fn node(&self, path: &str) -> Option<Node> {
        Node::of(&self.path(path))
    }

    /// A file of lines `key<colon>value`, such as `/proc/self/status`.
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

    /// Who runs this program.
    ///
    /// # Errors
    /// [`MachineError`] when the status of this process does not tell.
    pub(super) fn user(&self) -> Result<User, MachineError> {
        let status = self.table("/proc/self/status")?;
        let ids = |key: &str| -> Vec<u32> {
            let text = status.get(key).map_or("", String::as_str);
            text.split_whitespace()
                .filter_map(|id| id.parse().ok())
                .collect()
        };
        // Real, effective, saved, of the file system.
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
