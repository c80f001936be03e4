//! The machine as its files tell it: `/sys`, `/proc`, `/etc`, `/run` and `/dev` below one folder.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::access::{Node, User};

/// A machine.
pub(super) struct Machine {
    root: PathBuf,
    /// Free bytes of a folder.
    pub free_b: fn(&Path) -> Result<f64, String>,
}

impl Machine {
    /// The one that this program runs on.
    pub fn this() -> Self {
        Self {
            root: PathBuf::from("/"),
            free_b: crate::rig::gates::free_bytes,
        }
    }

    /// One that was planted in `root`, with so much free space everywhere.
    #[cfg(test)]
    pub fn planted(root: &Path, free_b: fn(&Path) -> Result<f64, String>) -> Self {
        Self {
            root: root.to_owned(),
            free_b,
        }
    }

    /// Where `path`, which begins with `/`, lies.
    pub fn path(&self, path: &str) -> PathBuf {
        self.root.join(path.trim_start_matches('/'))
    }

    /// A file without the white space at its ends.
    ///
    /// # Errors
    /// A fragment that names the file.
    pub fn text(&self, path: &str) -> Result<String, String> {
        // Opened and read as such: what stands in for a bus on a test bench knows no other way.
        match std::fs::read(self.path(path)) {
            Ok(bytes) => Ok(String::from_utf8_lossy(&bytes).trim().to_owned()),
            Err(e) => Err(format!("cannot read {path}: {e}")),
        }
    }

    /// A number in a file of its own.
    pub fn number(&self, path: &str) -> Option<u64> {
        self.text(path).ok()?.parse().ok()
    }

    /// The names in a folder, sorted.
    ///
    /// # Errors
    /// A fragment that names the folder.
    pub fn names(&self, folder: &str) -> Result<Vec<String>, String> {
        let entries = std::fs::read_dir(self.path(folder))
            .map_err(|e| format!("cannot read {folder}: {e}"))?;
        let mut names: Vec<String> = entries
            .flatten()
            .map(|e| e.file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        Ok(names)
    }

    /// Whether there is something at `path`.
    pub fn has(&self, path: &str) -> bool {
        self.path(path).exists()
    }

    /// Where a symbolic link points, as it is written.
    pub fn link(&self, path: &str) -> Option<PathBuf> {
        std::fs::read_link(self.path(path)).ok()
    }

    /// Who may open the file at `path`.
    pub fn node(&self, path: &str) -> Option<Node> {
        Node::of(&self.path(path))
    }

    /// A file of lines `key<colon>value`, such as `/proc/self/status`.
    ///
    /// # Errors
    /// A fragment that names the file.
    pub fn table(&self, path: &str) -> Result<BTreeMap<String, String>, String> {
        let lines = self.text(path)?;
        let pairs = lines.lines().filter_map(|l| l.split_once(':'));
        Ok(pairs
            .map(|(key, value)| (key.trim().to_owned(), value.trim().to_owned()))
            .collect())
    }

    /// Who runs this program.
    ///
    /// # Errors
    /// A fragment that names the file that does not tell.
    pub fn user(&self) -> Result<User, String> {
        let status = self.table("/proc/self/status")?;
        let ids = |key: &str| -> Vec<u32> {
            let text = status.get(key).map_or("", String::as_str);
            text.split_whitespace()
                .filter_map(|id| id.parse().ok())
                .collect()
        };
        // Real, effective, saved, of the file system.
        let (Some(&uid), Some(&gid)) = (ids("Uid").get(1), ids("Gid").get(1)) else {
            return Err("/proc/self/status does not tell the user".to_owned());
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
    pub fn group(&self, gid: u32) -> String {
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
