//! The history of nights: one SQLite file for the nights of one or more benches.
//!
//! `migrations/history/` documents the columns. All functions block: do not call them on a thread that runs async tasks.

mod error;
mod file;
mod read;
mod write;

use std::path::{Path, PathBuf};

use skinrig_nightly::night::NIGHT_VERSION;
use skinrig_nightly::trend::derived::RATIOS;
use skinrig_nightly::trend::{
    Acceptance, Filter, History, NightSummary, NoSuchNights, Series, SuiteNights, is_charted,
};
use skinrig_nightly::{Night, unsound};
use tokio::runtime::Runtime;

pub use error::HistoryError;
use error::QueryError;

/// Usual name of the history in a folder of nights.
pub const HISTORY_FILE: &str = "history.sqlite";

/// Result of adding a night.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AppendOutcome {
    /// The night was added.
    Added,
    /// The history already had it.
    AlreadyPresent,
}

/// Adds a night, whose files are in `folder`, to the history at `path`, and creates the history if needed. Atomic; adding the same
/// night twice has no effect; several programs may add nights at the same time.
///
/// # Errors
/// [`HistoryError::Foreign`], [`HistoryError::Newer`] or [`HistoryError::Damaged`] for an unsuitable file,
/// [`HistoryError::ConflictingNight`] if it has a different night of the same name, [`HistoryError::InvalidNight`] for an unfinished
/// night or one whose times, values or names cannot be those of a night, [`HistoryError::Damaged`] also if the history has other values than
/// the same night, and errors of the operating system or SQLite.
pub fn append(path: &Path, night: &Night, folder: &Path) -> Result<AppendOutcome, HistoryError> {
    if let Some(found) = unsound(night) {
        return Err(HistoryError::InvalidNight {
            path: folder.to_owned(),
            found,
        });
    }
    let head = NightSummary::of(night, relative(path, folder));
    let fault = |fault: QueryError| fault.at(path, "adding a night");
    let sha256 = write::digest(night).map_err(fault)?;
    runtime(path)?.block_on(async {
        let mut conn = file::open(path, true).await?;
        let mut tx = file::begin(&mut conn).await.map_err(fault)?;
        match write::stored_digest(&mut tx, &head).await.map_err(fault)? {
            Some(known) if known == sha256 => {
                let stored = read::night(&mut tx, &head).await.map_err(fault)?;
                return if is_same(&stored, night) {
                    Ok(AppendOutcome::AlreadyPresent)
                } else {
                    Err(fault(QueryError::damaged(
                        &format!("night {} of {}", head.id, head.rig),
                        "the values of its night.json",
                        "others",
                    )))
                };
            }
            Some(_) => {
                return Err(HistoryError::ConflictingNight {
                    path: path.to_owned(),
                    night: head.id.clone(),
                    rig: head.rig.clone(),
                });
            }
            None => {}
        }
        write::night(&mut tx, night, &head, &sha256)
            .await
            .map_err(fault)?;
        tx.commit().await.map_err(|e| fault(e.into()))?;
        Ok(AppendOutcome::Added)
    })
}

/// Adds the night that has just ended, which is the newest of its suite and bench.
///
/// # Errors
/// Those of [`append`]; [`HistoryError::DatedEarlier`] if the history has a later night.
pub fn append_newest(
    path: &Path,
    night: &Night,
    folder: &Path,
) -> Result<AppendOutcome, HistoryError> {
    let known = match suites(path) {
        Err(HistoryError::Missing { .. }) => Vec::new(),
        known => known?,
    };
    match known.into_iter().find(|line| line.has(night)) {
        Some(line) if line.newest > night.started => Err(HistoryError::DatedEarlier {
            path: path.to_owned(),
            started: night.started.clone(),
            newest: line.newest,
        }),
        _ => append(path, night, folder),
    }
}

/// Whether the rows of a night are those of its JSON. The folder may have moved; SQLite has no NaN, and infinity is not a measurement.
fn is_same((stored, series): &(NightSummary, Vec<Series>), night: &Night) -> bool {
    let mut one = History::default();
    one.push(night, &*stored.folder);
    for head in &mut one.nights {
        head.versions.firmware.clear();
    }
    let mut series = series.clone();
    let derived = one.series.iter_mut().zip(&mut series);
    for (one, stored) in derived.flat_map(|(a, b)| a.points.iter_mut().zip(&b.points)) {
        one.value = one.value.filter(|v| v.is_finite());
        // Another version of the rules may judge otherwise.
        one.part = stored.part;
    }
    one.nights.first() == Some(stored) && one.series == series
}

/// The suites in the history, by bench; the one with the newest night first.
///
/// # Errors
/// [`HistoryError::Missing`], [`HistoryError::Foreign`], [`HistoryError::Newer`], [`HistoryError::Damaged`], and errors of the operating
/// system or SQLite.
pub fn suites(path: &Path) -> Result<Vec<SuiteNights>, HistoryError> {
    runtime(path)?.block_on(async {
        let mut conn = file::open(path, false).await?;
        let suites = read::suites(&mut conn).await;
        suites.map_err(|fault| fault.at(path, "reading it"))
    })
}

/// The nights of one suite on one bench. Two benches, or a bench and its emulation, never share a history.
///
/// # Errors
/// Those of [`suites`], and [`HistoryError::NotFound`] if no night matches.
pub fn load(path: &Path, filter: &Filter) -> Result<History, HistoryError> {
    let suites = suites(path)?;
    let not_found = |none: NoSuchNights| HistoryError::NotFound {
        path: path.to_owned(),
        expected: none.expected,
        found: none.found,
    };
    let line = &suites[filter.choose(&suites).map_err(not_found)?];
    runtime(path)?.block_on(async {
        let mut conn = file::open(path, false).await?;
        let read = read::history(&mut conn, line).await;
        read.map_err(|fault| fault.at(path, "reading it"))
    })
}

/// All accepted changes in the history, each with the name of its bench.
///
/// # Errors
/// Those of [`suites`].
pub fn acceptances(path: &Path) -> Result<Vec<(String, Acceptance)>, HistoryError> {
    runtime(path)?.block_on(async {
        let mut conn = file::open(path, false).await?;
        let read = read::acceptances(&mut conn).await;
        read.map_err(|fault| fault.at(path, "reading it"))
    })
}

/// Accepts a change: the reference of the affected series restarts at its night.
///
/// # Errors
/// Those of [`suites`], and [`HistoryError::NotFound`] if the history does not have the night or the series.
pub fn accept(path: &Path, history: &History, acceptance: &Acceptance) -> Result<(), HistoryError> {
    let not_found = |expected: String, found: String| HistoryError::NotFound {
        path: path.to_owned(),
        expected,
        found,
    };
    let Some(night) = history.nights.iter().find(|n| n.id == acceptance.night) else {
        let newest = history.nights.last().map_or("none", |n| n.id.as_str());
        return Err(not_found(
            format!("night {}", acceptance.night),
            format!("no night of that name; the newest is {newest}"),
        ));
    };
    let known = |name: &String| {
        let derived = RATIOS.iter().any(|r| r.name == name);
        derived || is_charted(name) && history.series.iter().any(|s| s.name == *name)
    };
    if let Some(name) = acceptance.series.as_ref().filter(|name| !known(name)) {
        return Err(not_found(
            format!("a series {name}"),
            "no series of that name; `skinrig hil trend` lists them".to_owned(),
        ));
    }
    let fault = |fault: QueryError| fault.at(path, "adding an acceptance");
    runtime(path)?.block_on(async {
        let mut conn = file::open(path, false).await?;
        let mut tx = file::begin(&mut conn).await.map_err(fault)?;
        let done = write::acceptance(&mut tx, &night.rig, acceptance).await;
        done.map_err(fault)?;
        tx.commit().await.map_err(|e| fault(e.into()))
    })
}

/// Reads the JSON of a night.
///
/// # Errors
/// [`HistoryError::InvalidNight`] for any other content, [`HistoryError::Io`].
pub fn read_night(path: &Path) -> Result<Night, HistoryError> {
    let text = std::fs::read(path).map_err(|source| HistoryError::Io {
        path: path.to_owned(),
        doing: "reading it",
        source,
    })?;
    let invalid = |found: String| HistoryError::InvalidNight {
        path: path.to_owned(),
        found,
    };
    let night: Night = serde_json::from_slice(&text).map_err(|e| invalid(e.to_string()))?;
    if night.version != NIGHT_VERSION {
        return Err(invalid(format!("version {}", night.version)));
    }
    Ok(night)
}

/// The folder of a night as stored in the history: relative if it is inside the history's folder, so that both can be moved.
fn relative(path: &Path, folder: &Path) -> String {
    let full = |p: &Path| std::fs::canonicalize(p).unwrap_or_else(|_| p.to_owned());
    let own = full(parent_folder(path));
    let folder = full(folder);
    let short = folder.strip_prefix(&own).unwrap_or(&folder);
    short.to_string_lossy().into_owned()
}

/// Resolves a stored `folder` of a night against the history at `path`.
#[must_use]
pub fn folder_of(path: &Path, folder: &str) -> PathBuf {
    parent_folder(path).join(folder)
}

/// The folder of the history file.
fn parent_folder(path: &Path) -> &Path {
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
