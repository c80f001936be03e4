//! The folder of a night: made once, its results written whole or not at all.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use chrono::{DateTime, Utc};
use skinrig_nightly::Night;

use crate::exit::Failure;

/// The results for programs.
pub(super) const JSON: &str = "night.json";
/// The page for people.
pub(super) const PAGE: &str = "night.html";
/// The page of the nights up to this one.
pub(crate) const TRENDS: &str = "trends.html";
/// The results for programs that collect those of tests.
pub(crate) const JUNIT: &str = "junit.xml";
/// Nights of one second, at most.
const MOST: usize = 100;

/// Makes the folder of a new night in `out`, and gives the night's id with it.
///
/// # Errors
/// [`Failure::rig`] (3, infrastructure) when it cannot be made.
pub(super) fn make(
    out: &Path,
    started: DateTime<Utc>,
    suite: &str,
) -> Result<(String, PathBuf), Failure> {
    let wrong = |path: &Path, e: &io::Error| {
        Failure::rig(format!(
            "{}: cannot be made: {e}\n  next: choose a folder that can be written, with --out",
            path.display()
        ))
    };
    fs::create_dir_all(out).map_err(|e| wrong(out, &e))?;
    let first = format!(
        "{}-{}",
        started.format("%Y-%m-%dT%H-%M-%SZ"),
        file_name(suite)
    );
    let mut id = first.clone();
    for again in 2.. {
        let folder = out.join(&id);
        match fs::create_dir(&folder) {
            Ok(()) => return Ok((id, folder)),
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists && again < MOST => {
                id = format!("{first}-{again}");
            }
            Err(e) => return Err(wrong(&folder, &e)),
        }
    }
    Err(Failure::internal("more nights than numbers"))
}

/// `name` as part of a file name.
fn file_name(name: &str) -> String {
    let safe = |c: char| match c {
        c if c.is_ascii_alphanumeric() || c == '-' || c == '_' => c,
        _ => '-',
    };
    name.chars().map(safe).take(40).collect()
}

/// Writes `text` under `name` in `folder`: who reads it finds the old or the new one, never half of it.
///
/// # Errors
/// What the system answers.
pub(super) fn write(folder: &Path, name: &str, text: &str) -> io::Result<()> {
    let (part, whole) = (folder.join(format!("{name}.part")), folder.join(name));
    let mut file = File::create(&part)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()?;
    fs::rename(&part, &whole)
}

/// The night as JSON.
///
/// # Errors
/// What the system answers.
pub(crate) fn write_json(folder: &Path, night: &Night) -> io::Result<()> {
    let text = serde_json::to_string_pretty(night).map_err(io::Error::other)?;
    write(folder, JSON, &(text + "\n"))
}
