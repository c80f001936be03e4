//! Paths and names of sessions and the files beside them.

use std::path::{Path, PathBuf};

use chrono::{DateTime, Utc};

use crate::exit::Failure;

pub(crate) use skinrig_recorder::SESSION_SUFFIX;

/// Reads a text file that the user names; `next` is what to do if it cannot be read.
///
/// # Errors
/// [`Failure::input`] when it cannot be read.
pub(crate) fn read_input(path: &Path, next: &str) -> Result<Vec<u8>, Failure> {
    skinrig_formats::regular::read_text(path).map_err(|e| {
        Failure::input(format!(
            "{}: cannot read: {e}\n  next: {next}",
            path.display()
        ))
    })
}

/// Path of a new session in `folder` (created if missing): `<UTC time>-<protocol>-<prototype>.session.sqlite`,
/// with a number if that name is taken.
///
/// # Errors
/// [`Failure::internal`] when the folder cannot be created.
pub(crate) fn new_session(
    folder: &Path,
    started: DateTime<Utc>,
    protocol: &str,
    prototype: &str,
) -> Result<PathBuf, Failure> {
    std::fs::create_dir_all(folder).map_err(|e| {
        Failure::internal(format!(
            "cannot create the sessions folder {}: {e}\n  next: choose another one with --sessions",
            folder.display()
        ))
    })?;
    let stem = format!(
        "{}-{}-{}",
        started.format("%Y%m%dT%H%M%SZ"),
        slug(protocol),
        slug(prototype)
    );
    let mut path = folder.join(format!("{stem}{SESSION_SUFFIX}"));
    let mut n = 2;
    while path.exists() {
        path = folder.join(format!("{stem}-{n}{SESSION_SUFFIX}"));
        n += 1;
    }
    Ok(path)
}

/// File name without its folder; invalid UTF-8 is replaced.
#[must_use]
pub(crate) fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Common start of the names of `session` and the files beside it.
#[must_use]
pub(crate) fn stem(session: &Path) -> String {
    let name = file_name(session);
    match name.strip_suffix(SESSION_SUFFIX) {
        Some(stem) => stem.to_owned(),
        None => name,
    }
}

/// The file beside `session` with another ending, for example `.report.html`.
#[must_use]
pub(crate) fn beside(session: &Path, suffix: &str) -> PathBuf {
    session.with_file_name(format!("{}{suffix}", stem(session)))
}

/// The folder of a session; the current folder for a bare name.
#[must_use]
pub(crate) fn folder_of(session: &Path) -> &Path {
    let folder = session.parent().filter(|p| !p.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

/// Letters, digits, `_` and `-` stay; every run of anything else becomes one `-`.
fn slug(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        if c.is_ascii_alphanumeric() || c == '_' {
            out.push(c.to_ascii_lowercase());
        } else if !out.ends_with('-') && !out.is_empty() {
            out.push('-');
        }
    }
    let out = out.trim_end_matches('-');
    if out.is_empty() {
        "unnamed".into()
    } else {
        out.chars().take(40).collect()
    }
}

/// A text as one word of a command that a person pastes into a shell.
pub(crate) fn shell_word(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:+".contains(c);
    if !text.is_empty() && !text.starts_with('-') && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

/// A path as one word of a command that a person pastes into a shell.
pub(crate) fn shell_path(path: &Path) -> String {
    shell_word(&path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_safe_in_any_shell() {
        assert_eq!(slug("Skin A/3 (soft)"), "skin-a-3-soft");
        assert_eq!(slug("../../etc"), "etc");
        assert_eq!(slug("日本"), "unnamed");
    }

    #[test]
    fn hostile_names_make_one_plain_file_in_the_folder() {
        let dir = tempfile::tempdir().unwrap();
        let t = DateTime::from_timestamp(0, 0).unwrap();
        let long = "x".repeat(10_000);
        for name in [
            "../../x",
            "/etc/passwd",
            "..",
            ".",
            "",
            "a/../../b",
            "a\\..\\b",
            "C:\\x",
            "\\\\host\\share",
            "CON",
            "nul.txt",
            "x\0y",
            "~",
            "$(touch x)",
            "-rf",
            "x\ny",
            "\u{202e}gpj",
            &long,
        ] {
            for (protocol, prototype) in [(name, "a"), ("a", name), (name, name)] {
                let path = new_session(dir.path(), t, protocol, prototype).unwrap();
                assert_eq!(path.parent(), Some(dir.path()), "{name:?}");
                let file = path.file_name().unwrap().to_str().unwrap();
                let plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
                // The leading time prevents options, hidden files and device names of Windows.
                assert!(
                    file.starts_with("19700101T000000Z-") && file.chars().all(plain),
                    "{file}"
                );
                assert!(file.len() < 140 && file.ends_with(SESSION_SUFFIX), "{file}");
            }
        }
    }

    #[test]
    fn results_are_beside_the_session() {
        let session = Path::new("s/x.session.sqlite");
        assert_eq!(
            beside(session, ".report.html"),
            Path::new("s/x.report.html")
        );
        assert_eq!(
            beside(Path::new("y.db"), ".report.html"),
            Path::new("y.db.report.html")
        );
    }

    #[test]
    fn a_taken_name_gets_a_number() {
        let dir = tempfile::tempdir().unwrap();
        let t = DateTime::from_timestamp(0, 0).unwrap();
        let first = new_session(dir.path(), t, "demo", "A").unwrap();
        std::fs::write(&first, b"").unwrap();
        let second = new_session(dir.path(), t, "demo", "A").unwrap();
        assert!(
            second
                .to_string_lossy()
                .ends_with("demo-a-2.session.sqlite")
        );
    }
}
