//! Owns the folder of sessions: which names it has. A request never names a path.

use std::path::{Path, PathBuf};

use skinrig_recorder::SESSION_SUFFIX;

use crate::problem::Problem;

/// The folder that the server shows.
#[derive(Debug, Clone)]
pub(crate) struct Folder(PathBuf);

impl Folder {
    pub(crate) const fn new(path: PathBuf) -> Self {
        Self(path)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }

    /// The session file with this name.
    pub(crate) fn session(&self, name: &str) -> Result<PathBuf, Problem> {
        // One plain component: no separator of any system, no parent folder, no drive.
        let is_plain = name.ends_with(SESSION_SUFFIX)
            && !name.starts_with('.')
            && !name.contains(['/', '\\', ':', '\0']);
        let path = self.0.join(name);
        if is_plain && path.is_file() {
            return Ok(path);
        }
        Err(Problem::absent(format!(
            "{}: expected the name of one of its sessions, found `{}`",
            self.0.display(),
            name.escape_debug()
        )))
    }
}

/// Name of a session file.
pub(crate) fn name_of(session: &Path) -> String {
    let name = session.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_plain_names_of_sessions_are_found() {
        let outer = tempfile::tempdir().unwrap();
        let inner = outer.path().join("sessions");
        std::fs::create_dir(&inner).unwrap();
        for place in [outer.path(), &inner] {
            std::fs::write(place.join("a.session.sqlite"), "").unwrap();
        }
        std::fs::write(inner.join("a.results.json"), "").unwrap();
        let folder = Folder::new(inner.clone());
        assert_eq!(
            folder.session("a.session.sqlite").unwrap(),
            inner.join("a.session.sqlite")
        );
        let absolute = inner.join("a.session.sqlite");
        for name in [
            "",
            ".session.sqlite",
            "b.session.sqlite",
            "a.results.json",
            "../a.session.sqlite",
            "..\\a.session.sqlite",
            "x/../a.session.sqlite",
            absolute.to_str().unwrap(),
            "a.session.sqlite\0",
        ] {
            assert!(folder.session(name).is_err(), "{name:?}");
        }
    }
}
