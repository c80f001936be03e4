//! Tags and remarks added to a finished session, in a log beside the sealed file.
//!
//! A sealed session never changes, and no hash covers these annotations. `NAME.tags.jsonl` holds one line of JSON per annotation
//! with author and time. Lines are only appended, each in a single write, so that two people can tag the same session. The current
//! tags are the result of applying all lines in order.

use std::collections::BTreeSet;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::error::RecorderError;
use crate::sidecar::SESSION_SUFFIX;

/// File name suffix of these logs.
pub(crate) const TAGS_SUFFIX: &str = ".tags.jsonl";
/// Longest log, bytes.
const MAX_LOG_BYTES: u64 = 1 << 20;
/// Longest tag, characters.
const MAX_TAG_CHARS: usize = 40;
/// Longest remark, characters.
const MAX_NOTE_CHARS: usize = 2_000;

/// One line of a tag log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Annotation {
    /// Identifier of the session; detects a log that lies beside another session.
    pub session_id: String,
    /// Civil time, RFC 3339.
    pub at: String,
    /// Author.
    pub by: String,
    /// Tags to add.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub add: Vec<String>,
    /// Tags to remove.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub remove: Vec<String>,
    /// A remark.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// A remark with author and time.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AnnotationNote {
    /// Civil time, RFC 3339.
    pub at: String,
    /// Author.
    pub by: String,
    /// The remark.
    pub text: String,
}

/// Tags and remarks of a session after applying its whole log.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Annotations {
    /// Its tags, sorted.
    pub tags: BTreeSet<String>,
    /// Remarks, oldest first.
    pub notes: Vec<AnnotationNote>,
}

/// Path of the log beside `session`.
#[must_use]
pub fn tags_path(session: &Path) -> PathBuf {
    let name = session.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.strip_suffix(SESSION_SUFFIX).unwrap_or(&name);
    session.with_file_name(format!("{stem}{TAGS_SUFFIX}"))
}

/// Whether `tag` is valid: 1 to 40 of `a-z`, `0-9`, `.`, `_`, `-`, starting with a letter or digit.
#[must_use]
pub fn is_valid_tag(tag: &str) -> bool {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit();
    tag.len() <= MAX_TAG_CHARS
        && tag.starts_with(plain)
        && tag.chars().all(|c| plain(c) || "._-".contains(c))
}

impl Annotation {
    /// First invalid part of the line: (expected, found).
    fn fault(&self, session_id: &str) -> Option<(&'static str, String)> {
        if self.session_id != session_id {
            return Some(("a line about this session", self.session_id.clone()));
        }
        if let Some(tag) = self
            .add
            .iter()
            .chain(&self.remove)
            .find(|t| !is_valid_tag(t))
        {
            let expected = "tags of 1 to 40 of a-z, 0-9, `.`, `_`, `-`";
            return Some((expected, format!("`{}`", tag.escape_debug())));
        }
        let note = self.note.iter().chain([&self.by, &self.at]);
        for text in note {
            if text.chars().count() > MAX_NOTE_CHARS || text.chars().any(char::is_control) {
                let expected = "at most 2000 characters and no control characters";
                let begin: String = text.chars().take(40).collect();
                return Some((expected, format!("`{}`", begin.escape_debug())));
            }
        }
        None
    }
}

/// Reads the annotations of `session`, whose identifier is `session_id`; empty without a log.
///
/// # Errors
/// [`RecorderError::Damaged`] at the first invalid line or line of another session, [`RecorderError::Io`].
pub fn annotations(session: &Path, session_id: &str) -> Result<Annotations, RecorderError> {
    let path = tags_path(session);
    let io = |source| RecorderError::Io {
        path: path.clone(),
        doing: "reading it",
        source,
    };
    // Never follow a link: in a folder from an untrusted source it could expose any file.
    match std::fs::symlink_metadata(&path) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Annotations::default()),
        Err(e) => return Err(io(e)),
        Ok(found) if !found.is_file() => {
            return Err(damaged(
                &path,
                0,
                "a file",
                "a folder, a link or a device".into(),
            ));
        }
        Ok(found) if found.len() > MAX_LOG_BYTES => {
            let found = format!("{} bytes", found.len());
            return Err(damaged(&path, 0, "at most 1 MiB", found));
        }
        Ok(_) => {}
    }
    let mut bytes = Vec::new();
    std::fs::File::open(&path)
        .and_then(|file| file.take(MAX_LOG_BYTES).read_to_end(&mut bytes))
        .map_err(io)?;
    let mut all = Annotations::default();
    for (number, line) in (1..).zip(bytes.split(|b| *b == b'\n')) {
        if line.is_empty() {
            continue;
        }
        let annotation: Annotation = serde_json::from_slice(line).map_err(|e| {
            damaged(
                &path,
                number,
                "a line written by `skinrig tag`",
                e.to_string(),
            )
        })?;
        if let Some((expected, found)) = annotation.fault(session_id) {
            return Err(damaged(&path, number, expected, found));
        }
        all.tags.retain(|tag| !annotation.remove.contains(tag));
        all.tags.extend(annotation.add);
        all.notes.extend(annotation.note.map(|text| AnnotationNote {
            at: annotation.at,
            by: annotation.by,
            text,
        }));
    }
    Ok(all)
}

/// Appends an annotation to the log beside `session`, durably; returns all annotations.
///
/// # Errors
/// As [`annotations`], for the existing log; [`RecorderError::UnusableAnnotation`] for the new line; nothing is written then.
pub fn annotate(session: &Path, annotation: &Annotation) -> Result<Annotations, RecorderError> {
    let path = tags_path(session);
    if let Some((expected, found)) = annotation.fault(&annotation.session_id) {
        return Err(RecorderError::UnusableAnnotation { expected, found });
    }
    annotations(session, &annotation.session_id)?;
    let io = |source| RecorderError::Io {
        path: path.clone(),
        doing: "writing it",
        source,
    };
    let mut line = serde_json::to_vec(annotation).map_err(|e| io(e.into()))?;
    line.push(b'\n');
    let mut file = OpenOptions::new()
        .create(true)
        .read(true)
        .append(true)
        .open(&path)
        .map_err(io)?;
    file.write_all(&line)
        .and_then(|()| file.sync_all())
        .map_err(io)?;
    annotations(session, &annotation.session_id)
}

fn damaged(path: &Path, line: usize, expected: &str, found: String) -> RecorderError {
    let place = match line {
        0 => "tags".to_owned(),
        n => format!("line {n}"),
    };
    RecorderError::Damaged {
        path: path.to_owned(),
        place,
        expected: expected.to_owned(),
        found,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn annotation(add: &[&str], remove: &[&str], note: Option<&str>) -> Annotation {
        let own = |all: &[&str]| all.iter().map(|t| (*t).to_owned()).collect();
        Annotation {
            session_id: "5".repeat(32),
            at: "2026-11-21T00:00:00Z".into(),
            by: "Ann".into(),
            add: own(add),
            remove: own(remove),
            note: note.map(str::to_owned),
        }
    }

    #[test]
    fn annotations_accumulate() {
        let folder = tempfile::tempdir().unwrap();
        let session = folder.path().join("a.session.sqlite");
        let id = "5".repeat(32);
        assert_eq!(annotations(&session, &id).unwrap(), Annotations::default());
        annotate(&session, &annotation(&["good-skin", "wet"], &[], None)).unwrap();
        let all = annotate(
            &session,
            &annotation(&["v2"], &["wet", "dry"], Some("lamp: ä")),
        )
        .unwrap();
        let tags: Vec<&str> = all.tags.iter().map(String::as_str).collect();
        assert_eq!(tags, ["good-skin", "v2"]);
        assert_eq!(
            (all.notes.len(), all.notes[0].text.as_str()),
            (1, "lamp: ä")
        );
        assert_eq!(annotations(&session, &id).unwrap(), all);
        assert_eq!(tags_path(&session), folder.path().join("a.tags.jsonl"));
    }

    #[test]
    fn an_invalid_log_or_that_of_another_session_is_rejected() {
        let folder = tempfile::tempdir().unwrap();
        let session = folder.path().join("a.session.sqlite");
        annotate(&session, &annotation(&["a"], &[], None)).unwrap();
        let good = std::fs::read(tags_path(&session)).unwrap();
        let other = annotations(&session, &"6".repeat(32)).unwrap_err();
        assert!(other.to_string().contains("line 1"), "{other}");
        // A truncated write, and foreign lines.
        for line in [&good[..good.len() / 2], b"{}", b"\xff", b"null"] {
            std::fs::write(tags_path(&session), [&good, line].concat()).unwrap();
            let refused = annotate(&session, &annotation(&["b"], &[], None)).unwrap_err();
            assert!(refused.to_string().contains("line 2"), "{refused}");
        }
        std::fs::write(tags_path(&session), &good).unwrap();
        for tag in ["", "-a", "A", "a b", "ä", "a\n", &"a".repeat(41)] {
            assert!(
                annotate(&session, &annotation(&[tag], &[], None)).is_err(),
                "{tag}"
            );
        }
        assert!(annotate(&session, &annotation(&[], &[], Some("a\u{1b}[2J"))).is_err());
        assert_eq!(std::fs::read(tags_path(&session)).unwrap(), good);
    }
}
