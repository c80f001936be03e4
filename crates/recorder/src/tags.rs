//! Tags and remarks that people give a session when it is over: a log of its own beside the sealed file.
//!
//! A session never changes once it is sealed, and no hash covers what is said of it later. `NAME.tags.jsonl` has a line of JSON
//! for each thing that was said, by whom and when; lines are only ever appended, each in one write, so that two people may tag
//! the same session. The tags of a session are what all lines together leave.

use std::collections::BTreeSet;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::beside::SESSION_SUFFIX;
use crate::error::RecorderError;

/// How the names of these logs end.
pub const TAGS_SUFFIX: &str = ".tags.jsonl";
/// A longer log is none.
const MOST_BYTES: u64 = 1 << 20;
/// Longest tag, characters.
const MOST_TAG_CHARS: usize = 40;
/// Longest remark, characters.
const MOST_NOTE_CHARS: usize = 2_000;

/// Something that was said of a session: a line of its log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Saying {
    /// The session's own id: a log that lies beside another session is found out.
    pub session_id: String,
    /// Civil time, RFC 3339.
    pub at: String,
    /// Who.
    pub by: String,
    /// Tags given.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub add: Vec<String>,
    /// Tags taken away.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub remove: Vec<String>,
    /// A remark.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// A remark, by whom and when.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LaterNote {
    /// Civil time, RFC 3339.
    pub at: String,
    /// Who.
    pub by: String,
    /// The remark.
    pub text: String,
}

/// All that was said of a session.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Sayings {
    /// Its tags, sorted.
    pub tags: BTreeSet<String>,
    /// Remarks, in order.
    pub notes: Vec<LaterNote>,
}

/// The log beside `session`.
#[must_use]
pub fn tags_path(session: &Path) -> PathBuf {
    let name = session.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.strip_suffix(SESSION_SUFFIX).unwrap_or(&name);
    session.with_file_name(format!("{stem}{TAGS_SUFFIX}"))
}

/// Whether `tag` can be one: 1 to 40 of `a-z`, `0-9`, `.`, `_`, `-`, beginning with a letter or digit.
#[must_use]
pub fn is_tag(tag: &str) -> bool {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit();
    tag.len() <= MOST_TAG_CHARS
        && tag.starts_with(plain)
        && tag.chars().all(|c| plain(c) || "._-".contains(c))
}

impl Saying {
    /// What is wrong with it, if anything.
    fn fault(&self, session_id: &str) -> Option<(&'static str, String)> {
        if self.session_id != session_id {
            return Some(("a line about this session", self.session_id.clone()));
        }
        if let Some(tag) = self.add.iter().chain(&self.remove).find(|t| !is_tag(t)) {
            let expected = "tags of 1 to 40 of a-z, 0-9, `.`, `_`, `-`";
            return Some((expected, format!("`{}`", tag.escape_debug())));
        }
        let note = self.note.iter().chain([&self.by, &self.at]);
        for text in note {
            if text.chars().count() > MOST_NOTE_CHARS || text.chars().any(char::is_control) {
                let expected = "at most 2000 characters and no control characters";
                let begin: String = text.chars().take(40).collect();
                return Some((expected, format!("`{}`", begin.escape_debug())));
            }
        }
        None
    }
}

/// What was said of `session`, whose id is `session_id`; nothing when there is no log.
///
/// # Errors
/// [`RecorderError::Damaged`] at the first line that is none of this session, [`RecorderError::Io`].
pub fn sayings(session: &Path, session_id: &str) -> Result<Sayings, RecorderError> {
    let path = tags_path(session);
    let io = |source| RecorderError::Io {
        path: path.clone(),
        doing: "reading it",
        source,
    };
    // A link in its place, in a folder from a stranger, would show any other file.
    match std::fs::symlink_metadata(&path) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Sayings::default()),
        Err(e) => return Err(io(e)),
        Ok(found) if !found.is_file() => {
            return Err(damaged(&path, 0, "a file", "something else".into()));
        }
        Ok(found) if found.len() > MOST_BYTES => {
            let found = format!("{} bytes", found.len());
            return Err(damaged(&path, 0, "at most 1 MiB", found));
        }
        Ok(_) => {}
    }
    let mut bytes = Vec::new();
    std::fs::File::open(&path)
        .and_then(|file| file.take(MOST_BYTES).read_to_end(&mut bytes))
        .map_err(io)?;
    let mut all = Sayings::default();
    for (number, line) in (1..).zip(bytes.split(|b| *b == b'\n')) {
        if line.is_empty() {
            continue;
        }
        let saying: Saying = serde_json::from_slice(line)
            .map_err(|e| damaged(&path, number, "a line of `skinrig tag`", e.to_string()))?;
        if let Some((expected, found)) = saying.fault(session_id) {
            return Err(damaged(&path, number, expected, found));
        }
        all.tags.retain(|tag| !saying.remove.contains(tag));
        all.tags.extend(saying.add);
        all.notes.extend(saying.note.map(|text| LaterNote {
            at: saying.at,
            by: saying.by,
            text,
        }));
    }
    Ok(all)
}

/// Appends to the log beside `session`, durably; what is said of it then.
///
/// # Errors
/// As [`sayings`], of the log before and of this line; nothing is written then.
pub fn say(session: &Path, saying: &Saying) -> Result<Sayings, RecorderError> {
    let path = tags_path(session);
    if let Some((expected, found)) = saying.fault(&saying.session_id) {
        return Err(damaged(&path, 0, expected, found));
    }
    sayings(session, &saying.session_id)?;
    let io = |source| RecorderError::Io {
        path: path.clone(),
        doing: "writing it",
        source,
    };
    let mut line = serde_json::to_vec(saying).map_err(|e| io(e.into()))?;
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
    sayings(session, &saying.session_id)
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

    fn saying(add: &[&str], remove: &[&str], note: Option<&str>) -> Saying {
        let own = |all: &[&str]| all.iter().map(|t| (*t).to_owned()).collect();
        Saying {
            session_id: "5".repeat(32),
            at: "2026-11-21T00:00:00Z".into(),
            by: "Ann".into(),
            add: own(add),
            remove: own(remove),
            note: note.map(str::to_owned),
        }
    }

    #[test]
    fn what_is_said_adds_up() {
        let folder = tempfile::tempdir().unwrap();
        let session = folder.path().join("a.session.sqlite");
        let id = "5".repeat(32);
        assert_eq!(sayings(&session, &id).unwrap(), Sayings::default());
        say(&session, &saying(&["good-skin", "wet"], &[], None)).unwrap();
        let all = say(&session, &saying(&["v2"], &["wet", "dry"], Some("lamp: ä"))).unwrap();
        let tags: Vec<&str> = all.tags.iter().map(String::as_str).collect();
        assert_eq!(tags, ["good-skin", "v2"]);
        assert_eq!(
            (all.notes.len(), all.notes[0].text.as_str()),
            (1, "lamp: ä")
        );
        assert_eq!(sayings(&session, &id).unwrap(), all);
        assert_eq!(tags_path(&session), folder.path().join("a.tags.jsonl"));
    }

    #[test]
    fn a_log_that_is_none_or_of_another_session_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let session = folder.path().join("a.session.sqlite");
        say(&session, &saying(&["a"], &[], None)).unwrap();
        let good = std::fs::read(tags_path(&session)).unwrap();
        let other = sayings(&session, &"6".repeat(32)).unwrap_err();
        assert!(other.to_string().contains("line 1"), "{other}");
        // A write that was cut off, and lines by somebody else.
        for line in [&good[..good.len() / 2], b"{}", b"\xff", b"null"] {
            std::fs::write(tags_path(&session), [&good, line].concat()).unwrap();
            let refused = say(&session, &saying(&["b"], &[], None)).unwrap_err();
            assert!(refused.to_string().contains("line 2"), "{refused}");
        }
        std::fs::write(tags_path(&session), &good).unwrap();
        for tag in ["", "-a", "A", "a b", "ä", "a\n", &"a".repeat(41)] {
            assert!(say(&session, &saying(&[tag], &[], None)).is_err(), "{tag}");
        }
        assert!(say(&session, &saying(&[], &[], Some("a\u{1b}[2J"))).is_err());
        assert_eq!(std::fs::read(tags_path(&session)).unwrap(), good);
    }
}
