//! The files of a folder of sessions, listed once, and the fingerprints that reveal a change.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use sha2::{Digest, Sha256};
use skinrig_recorder::{SESSION_SUFFIX, tags_path};

use crate::entry::hex;
use crate::error::CatalogueError;
use crate::results::{ANALYSIS_MARK, OFFICIAL, RESULTS_SUFFIX, stem_of};

/// The files of a folder.
#[derive(Debug)]
pub(crate) struct Folder {
    path: PathBuf,
    /// Names of the session files, sorted.
    pub sessions: Vec<String>,
    /// By the stem of the session: name of the analysis and its file.
    results: HashMap<String, Vec<(String, PathBuf)>>,
}

impl Folder {
    /// Lists a folder.
    pub(crate) fn list(path: &Path) -> Result<Self, CatalogueError> {
        let io = |source| CatalogueError::Io {
            path: path.to_owned(),
            doing: "listing it",
            source,
        };
        let place = if path.as_os_str().is_empty() {
            Path::new(".")
        } else {
            path
        };
        let (mut sessions, mut results) = (Vec::new(), HashMap::<String, Vec<_>>::new());
        for entry in std::fs::read_dir(place).map_err(io)? {
            // Names that are not UTF-8 cannot be those of sessions: SQLite does not open them.
            let Ok(name) = entry.map_err(io)?.file_name().into_string() else {
                continue;
            };
            if name.ends_with(SESSION_SUFFIX) {
                sessions.push(name);
            } else if let Some(base) = name.strip_suffix(RESULTS_SUFFIX) {
                let file = path.join(&name);
                let add = |all: &mut HashMap<String, Vec<_>>, stem: &str, analysis: &str| {
                    let of = all.entry(stem.to_owned()).or_default();
                    of.push((analysis.to_owned(), file.clone()));
                };
                add(&mut results, base, OFFICIAL);
                if let Some((stem, variant)) = base.rsplit_once(ANALYSIS_MARK)
                    && variant != OFFICIAL
                {
                    add(&mut results, stem, variant);
                }
            }
        }
        sessions.sort();
        results.values_mut().for_each(|of| of.sort());
        Ok(Self {
            path: path.to_owned(),
            sessions,
            results,
        })
    }

    /// Path of a file in the folder.
    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// The analyses of a session: names and results files.
    pub(crate) fn analyses(&self, session: &str) -> &[(String, PathBuf)] {
        let of = self.results.get(stem_of(session));
        of.map(Vec::as_slice).unwrap_or_default()
    }

    /// Digest of names, sizes and times of a session file and of those beside it.
    pub(crate) fn fingerprint(&self, session: &str) -> String {
        let file = self.file(session);
        let log = self.file(&format!("{session}-wal"));
        let tags = tags_path(&file);
        let results = self.analyses(session).iter().map(|(_, file)| file);
        let mut text = String::new();
        for path in [&file, &log, &tags].into_iter().chain(results) {
            // Of a link, what it leads to counts.
            let Ok(found) = std::fs::metadata(path) else {
                continue;
            };
            let changed = found.modified().ok();
            let since = changed.and_then(|t| t.duration_since(UNIX_EPOCH).ok());
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let nanos = since.map_or(0, |d| d.as_nanos());
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{name} {} {nanos}", found.len());
        }
        hex(&Sha256::digest(text)[..16])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn of_a_link_the_file_counts() {
        let (folder, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let (name, file) = ("a.session.sqlite", other.path().join("file"));
        std::fs::write(&file, "1").unwrap();
        std::os::unix::fs::symlink(&file, folder.path().join(name)).unwrap();
        let seen = || Folder::list(folder.path()).unwrap().fingerprint(name);
        let before = seen();
        std::fs::write(&file, "12").unwrap();
        assert_ne!(seen(), before);
    }

    #[test]
    fn a_change_beside_a_session_changes_its_fingerprint() {
        let folder = tempfile::tempdir().unwrap();
        let write =
            |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("a.session.sqlite", "1");
        write("b.session.sqlite", "1");
        let seen = || {
            let folder = Folder::list(folder.path()).unwrap();
            (
                folder.fingerprint("a.session.sqlite"),
                folder.fingerprint("b.session.sqlite"),
            )
        };
        let mut before = seen();
        for (name, text) in [
            ("a.session.sqlite", "12"),
            ("a.session.sqlite-wal", "1"),
            ("a.tags.jsonl", "1"),
            ("a.results.json", "1"),
            ("a.analysis-v=1.results.json", "1"),
            ("a.analysis-v=1.results.json", "12"),
        ] {
            write(name, text);
            let now = seen();
            assert_ne!(now.0, before.0, "{name}");
            assert_eq!(now.1, before.1, "{name}");
            before = now;
        }
        write("a.report.html", "1");
        assert_eq!(seen(), before);
        let names = |session| {
            let folder = Folder::list(folder.path()).unwrap();
            let all = folder.analyses(session).iter();
            all.map(|(name, _)| name.clone()).collect::<Vec<_>>()
        };
        assert_eq!(names("a.session.sqlite"), ["official", "v=1"]);
        assert!(names("b.session.sqlite").is_empty());
    }
}
