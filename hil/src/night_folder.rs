//! The folder of a night: creates it and replaces its files atomically.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use chrono::{DateTime, NaiveDateTime, Utc};
use skinrig_nightly::Night;

/// Results for programs.
pub const JSON: &str = "night.json";
/// Page for people.
pub const PAGE: &str = "night.html";
/// Page of the trends up to this night.
pub const TRENDS: &str = "trends.html";
/// Results for CI servers.
pub const JUNIT: &str = "junit.xml";
/// Start of a night in the name of its folder.
const STARTED: &str = "%Y-%m-%dT%H-%M-%SZ";
/// Maximum number of nights that start in the same second.
const MAX_PER_SECOND: usize = 100;

/// The folder of one night.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NightFolder {
    id: String,
    path: PathBuf,
}

/// The folder of a night could not be created.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot create this folder: {source}", path.display())]
pub struct CreateError {
    /// The folder.
    pub path: PathBuf,
    source: io::Error,
}

/// True for a path whose name begins like those of nights.
#[must_use]
pub fn is_named_so(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let started = NaiveDateTime::parse_and_remainder(&name, STARTED);
    started.is_ok_and(|(_, rest)| rest.starts_with('-'))
}

impl NightFolder {
    /// Creates the folder of a new night of `suite` in `out`. Its name, the night's id, is unique in `out`.
    ///
    /// # Errors
    /// [`CreateError`] if `out` or the folder cannot be created.
    pub fn create(out: &Path, started: DateTime<Utc>, suite: &str) -> Result<Self, CreateError> {
        let error = |path: &Path, source| CreateError {
            path: path.to_owned(),
            source,
        };
        fs::create_dir_all(out).map_err(|e| error(out, e))?;
        let first = format!("{}-{}", started.format(STARTED), file_name(suite));
        let mut id = first.clone();
        let mut number = 1;
        loop {
            let path = out.join(&id);
            match fs::create_dir(&path) {
                Ok(()) => return Ok(Self { id, path }),
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists && number < MAX_PER_SECOND => {
                    number += 1;
                    id = format!("{first}-{number}");
                }
                Err(e) => return Err(error(&path, e)),
            }
        }
    }

    /// Id of the night.
    #[must_use]
    pub fn id(&self) -> &str {
        &self.id
    }

    /// Path of the folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a file atomically: readers see the old version or the new one, never a partial file.
    ///
    /// # Errors
    /// I/O errors.
    pub fn write(&self, name: &str, text: &str) -> io::Result<()> {
        let part = self.path.join(format!("{name}.part"));
        let mut file = File::create(&part)?;
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        fs::rename(&part, self.path.join(name))
    }

    /// Writes the night as JSON.
    ///
    /// # Errors
    /// I/O errors.
    pub fn write_json(&self, night: &Night) -> io::Result<()> {
        let text = serde_json::to_string_pretty(night).map_err(io::Error::other)?;
        self.write(JSON, &(text + "\n"))
    }
}

/// `name` as part of a file name.
fn file_name(name: &str) -> String {
    let safe = |c: char| match c {
        c if c.is_ascii_alphanumeric() || c == '-' || c == '_' => c,
        _ => '-',
    };
    name.chars().map(safe).take(40).collect()
}
