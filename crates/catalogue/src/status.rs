//! Compares a catalogue with a folder of sessions.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use skinrig_recorder::writer_of;

use crate::db::Db;
use crate::error::CatalogueError;
use crate::folder::Folder;

/// A catalogue compared with a folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FolderStatus {
    /// Session files in the folder.
    pub files: usize,
    /// Files whose entries are current, unreadable ones included.
    pub current: usize,
    /// Files whose entries differ from what is in the folder.
    pub stale: Vec<StaleFile>,
    /// Sessions that are being recorded; they are registered at the end of their run.
    pub under_way: Vec<String>,
    /// Files that could not be read when they were last tried.
    pub unreadable: Vec<Unreadable>,
}

/// A file whose entry is stale.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StaleFile {
    /// Name in the folder.
    pub file: String,
    /// Why.
    pub why: Staleness,
}

/// Why an entry is stale.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Staleness {
    /// There is no entry.
    Missing,
    /// The session, its tags or its results changed since it was read.
    Changed,
    /// The file is no longer in the folder.
    Gone,
}

impl Staleness {
    /// Words for display.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Missing => "not in the catalogue",
            Self::Changed => "changed since it was read",
            Self::Gone => "no longer in the folder",
        }
    }
}

/// A session file that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Unreadable {
    /// Name in the folder.
    pub file: String,
    /// Error of reading it.
    pub reason: String,
}

/// Entries of a store by file name: fingerprint, and why the file could not be read.
type Known = BTreeMap<String, (String, Option<String>)>;

async fn known(db: &mut Db, store: &str) -> Result<Known, sqlx::Error> {
    let sql =
        "SELECT name, fingerprint, CAST(NULL AS TEXT) AS reason FROM session_file WHERE store = $1
               UNION ALL SELECT name, fingerprint, reason FROM unreadable_file WHERE store = $1";
    let found = db.fetch(sql, &[store.into()]).await?;
    let entry = |row: &Vec<crate::value::Value>| {
        let text = |at: usize| row[at].as_text().map(str::to_owned);
        Some((text(0)?, (text(1)?, text(2))))
    };
    Ok(found.rows.iter().filter_map(entry).collect())
}

/// Compares the entries of `store` with the `folder` at `path`.
pub(crate) async fn compare(
    db: &mut Db,
    place: &str,
    store: &str,
    folder: &Folder,
) -> Result<FolderStatus, CatalogueError> {
    let known = known(db, store).await;
    let mut known =
        known.map_err(|e| CatalogueError::sql(place, "comparing it with a folder", e))?;
    let mut status = FolderStatus {
        files: folder.sessions.len(),
        current: 0,
        stale: Vec::new(),
        under_way: Vec::new(),
        unreadable: Vec::new(),
    };
    for name in &folder.sessions {
        let entry = known.remove(name);
        let stale = |why| StaleFile {
            file: name.clone(),
            why,
        };
        if is_under_way(&folder.file(name)) {
            status.under_way.push(name.clone());
            continue;
        }
        match entry {
            None => status.stale.push(stale(Staleness::Missing)),
            Some((seen, _)) if seen != folder.fingerprint(name) => {
                status.stale.push(stale(Staleness::Changed));
            }
            Some((_, reason)) => {
                status.current += 1;
                status.unreadable.extend(reason.map(|reason| Unreadable {
                    file: name.clone(),
                    reason,
                }));
            }
        }
    }
    status.stale.extend(known.into_keys().map(|file| StaleFile {
        file,
        why: Staleness::Gone,
    }));
    Ok(status)
}

/// True while a program writes the session.
pub(crate) fn is_under_way(session: &Path) -> bool {
    writer_of(session).is_some()
}
