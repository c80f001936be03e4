//! The history of nights: one SQLite file in which every night of a bench, or of several, is kept.
//!
//! Column by column it is described in `migrations/history/`. All functions block, and belong on no thread that runs async tasks.

mod error;
mod file;
mod line;
mod read;
mod write;

pub use self::line::Line;
use std::path::{Path, PathBuf};

use skinrig_nightly::Night;
use skinrig_nightly::trend::derived::RATIOS;
use skinrig_nightly::trend::{Acceptance, History, NightHead};
use tokio::runtime::Runtime;

use error::Fault;
pub use error::HistoryError;
pub use file::{HISTORY_APPLICATION_ID, HISTORY_SCHEMA_VERSION};

/// Whether a night was new to the history.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Appended {
    /// It is in there now.
    New,
    /// It was in there already.
    Known,
}

/// Which nights to read. What is not named is that of the newest night.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Filter {
    /// Name of the bench.
    pub rig: Option<String>,
    /// Name of the suite.
    pub suite: Option<String>,
}

/// Adds a night, whose files are in `folder`, to the history in `path`, which begins when there is none. All of it or nothing; the
/// same night twice is added once; others may add theirs at the same time.
///
/// # Errors
/// [`HistoryError::Foreign`], [`HistoryError::Newer`], [`HistoryError::Damaged`] for a file that is not to be written to,
/// [`HistoryError::OtherNight`] when another night of that name is in it, [`HistoryError::NoNight`] for one that did not finish, or what the operating system or SQLite said.
pub fn append(path: &Path, night: &Night, folder: &Path) -> Result<Appended, HistoryError> {
    if !night.finished {
        return Err(HistoryError::NoNight {
            path: folder.to_owned(),
            found: format!("{}, which is under way or was cut off", night.id),
        });
    }
    let head = NightHead::of(night, relative(path, folder));
    let fault = |fault: Fault| fault.at(path, "adding a night");
    let sha256 = write::digest(night).map_err(fault)?;
    runtime(path)?.block_on(async {
        let mut conn = file::open(path, true).await?;
        let mut all = file::begin(&mut conn).await.map_err(fault)?;
        match write::known(&mut all, &head).await.map_err(fault)? {
            Some(known) if known == sha256 => return Ok(Appended::Known),
            Some(_) => {
                return Err(HistoryError::OtherNight {
                    path: path.to_owned(),
                    night: head.id.clone(),
                    rig: head.rig.clone(),
                });
            }
            None => {}
        }
        write::night(&mut all, night, &head, &sha256)
            .await
            .map_err(fault)?;
        all.commit().await.map_err(|e| fault(e.into()))?;
        Ok(Appended::New)
    })
}

/// The benches and suites of which the history has nights; the one with the newest night first.
///
/// # Errors
/// [`HistoryError::Missing`], [`HistoryError::Foreign`], [`HistoryError::Newer`], [`HistoryError::Damaged`], or what the operating
/// system or SQLite said.
pub fn lines(path: &Path) -> Result<Vec<Line>, HistoryError> {
    runtime(path)?.block_on(async {
        let mut conn = file::open(path, false).await?;
        let lines = read::lines(&mut conn).await;
        lines.map_err(|fault| fault.at(path, "reading it"))
    })
}

/// The nights of one suite on one bench: two benches, or a bench and its emulation, are never one history.
///
/// # Errors
/// Those of [`lines`], and [`HistoryError::NotThere`] when there is no such night.
pub fn load(path: &Path, filter: &Filter) -> Result<History, HistoryError> {
    let lines = lines(path)?;
    let matches = |line: &&Line| {
        filter.rig.as_ref().is_none_or(|rig| *rig == line.rig)
            && filter.suite.as_ref().is_none_or(|s| *s == line.suite)
    };
    let Some(line) = lines.iter().find(matches) else {
        let each = lines.iter().map(|l| format!("{} on {}", l.suite, l.rig));
        let found = each.collect::<Vec<_>>().join(", ");
        return Err(HistoryError::NotThere {
            path: path.to_owned(),
            wanted: format!(
                "nights of {} on {}",
                filter.suite.as_deref().unwrap_or("any suite"),
                filter.rig.as_deref().unwrap_or("any bench")
            ),
            found: if found.is_empty() {
                "none at all".to_owned()
            } else {
                found
            },
        });
    };
    runtime(path)?.block_on(async {
        let mut conn = file::open(path, false).await?;
        let read = read::history(&mut conn, &line.rig, &line.suite).await;
        read.map_err(|fault| fault.at(path, "reading it"))
    })
}

/// Takes a change on `rig` as it is.
///
/// # Errors
/// Those of [`lines`], and [`HistoryError::NotThere`] when the history does not have the night or the series.
pub fn accept(path: &Path, history: &History, said: &Acceptance) -> Result<(), HistoryError> {
    let not_there = |wanted: String, found: String| HistoryError::NotThere {
        path: path.to_owned(),
        wanted,
        found,
    };
    let Some(night) = history.nights.iter().find(|n| n.id == said.night) else {
        let newest = history.nights.last().map_or("none", |n| n.id.as_str());
        return Err(not_there(
            format!("night {}", said.night),
            format!("none of that name; the newest is {newest}"),
        ));
    };
    let known = |name: &String| {
        let derived = RATIOS.iter().any(|r| r.name == name);
        derived || history.series.iter().any(|s| s.name == *name)
    };
    if let Some(name) = said.series.as_ref().filter(|name| !known(name)) {
        return Err(not_there(
            format!("a series {name}"),
            "none of that name; `skinrig hil trend` lists them".to_owned(),
        ));
    }
    let fault = |fault: Fault| fault.at(path, "noting an acceptance");
    runtime(path)?.block_on(async {
        let mut conn = file::open(path, false).await?;
        let mut all = file::begin(&mut conn).await.map_err(fault)?;
        let done = write::acceptance(&mut all, &night.rig, said).await;
        done.map_err(fault)?;
        all.commit().await.map_err(|e| fault(e.into()))
    })
}

/// Reads the JSON of a night.
///
/// # Errors
/// [`HistoryError::NoNight`] for anything else, [`HistoryError::Io`].
pub fn read_night(path: &Path) -> Result<Night, HistoryError> {
    let text = std::fs::read(path).map_err(|source| HistoryError::Io {
        path: path.to_owned(),
        doing: "reading it",
        source,
    })?;
    serde_json::from_slice(&text).map_err(|e| HistoryError::NoNight {
        path: path.to_owned(),
        found: e.to_string(),
    })
}

/// The folder of a night as the history in `path` calls it: relative when it lies below the history's own, so that both can be moved.
fn relative(path: &Path, folder: &Path) -> String {
    let full = |p: &Path| std::fs::canonicalize(p).unwrap_or_else(|_| p.to_owned());
    let own = full(home(path));
    let folder = full(folder);
    let short = folder.strip_prefix(&own).unwrap_or(&folder);
    short.to_string_lossy().into_owned()
}

/// Where the night's files are that the history in `path` calls `folder`.
#[must_use]
pub fn folder_of(path: &Path, folder: &str) -> PathBuf {
    home(path).join(folder)
}

/// The folder that the history lies in.
fn home(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

fn runtime(path: &Path) -> Result<Runtime, HistoryError> {
    tokio::runtime::Builder::new_current_thread()
        .enable_time()
        .build()
        .map_err(|source| HistoryError::Io {
            path: path.to_owned(),
            doing: "starting to read it",
            source,
        })
}
