//! Nights of a bench, from the JSON in their folders.

use std::path::{Path, PathBuf};

use serde::Serialize;
use sha2::{Digest, Sha256};
use skinrig_nightly::{Night, unsound};

use crate::catalogue::Catalogue;
use crate::db::Db;
use crate::entry::{hex, seconds};
use crate::error::CatalogueError;
use crate::status::Unreadable;
use crate::value::Bound;

/// Name of the results in the folder of a night.
const NIGHT_FILE: &str = "night.json";

/// Result of registering nights.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct NightRegistration {
    /// Nights that were added.
    pub registered: usize,
    /// Nights that the catalogue already had.
    pub unchanged: usize,
    /// Nights that are unfinished or could not be read.
    pub unreadable: Vec<Unreadable>,
}

impl Catalogue {
    /// Registers every night in the folders of `nights`, each in one transaction and once, keyed by what it measured.
    ///
    /// # Errors
    /// If the folder cannot be listed, or the catalogue not written.
    pub fn register_nights(&mut self, nights: &Path) -> Result<NightRegistration, CatalogueError> {
        let mut done = NightRegistration::default();
        for file in files(nights)? {
            let night = match read(&file) {
                Ok(night) => night,
                Err(e) => {
                    done.unreadable.push(Unreadable {
                        file: file.display().to_string(),
                        reason: e.to_string(),
                    });
                    continue;
                }
            };
            let folder = self.store_of(file.parent().unwrap_or(nights))?;
            let inserted = self.transaction("registering a night", async |db| {
                insert(db, &night, &folder).await
            })?;
            match inserted {
                Inserted::New => done.registered += 1,
                Inserted::Known => done.unchanged += 1,
                Inserted::Conflicting => done.unreadable.push(Unreadable {
                    file: file.display().to_string(),
                    reason: format!(
                        "expected one night {} of {}, found another in the catalogue; one of the two was changed",
                        night.id, night.rig
                    ),
                }),
            }
        }
        Ok(done)
    }
}

/// The files of nights in a folder of nights, or of one night, sorted.
fn files(nights: &Path) -> Result<Vec<PathBuf>, CatalogueError> {
    let io = |source| CatalogueError::Io {
        path: nights.to_owned(),
        doing: "listing it",
        source,
    };
    let mut found = vec![nights.join(NIGHT_FILE)];
    for entry in std::fs::read_dir(nights).map_err(io)? {
        found.push(entry.map_err(io)?.path().join(NIGHT_FILE));
    }
    found.retain(|file| file.is_file());
    found.sort();
    Ok(found)
}

fn read(path: &Path) -> Result<Night, CatalogueError> {
    let invalid = |found: String| CatalogueError::InvalidNight {
        path: path.to_owned(),
        found,
    };
    let text = std::fs::read(path).map_err(|source| CatalogueError::Io {
        path: path.to_owned(),
        doing: "reading it",
        source,
    })?;
    let night: Night = serde_json::from_slice(&text).map_err(|e| invalid(e.to_string()))?;
    match unsound(&night) {
        None => Ok(night),
        Some(found) => Err(invalid(found)),
    }
}

/// Digest of what a night measured: without its messages, which are sent later.
fn digest(night: &Night) -> String {
    let measured = Night {
        notifications: Vec::new(),
        ..night.clone()
    };
    // Plain data with text as keys: it always has a JSON form.
    hex(&Sha256::digest(
        serde_json::to_vec(&measured).unwrap_or_default(),
    ))
}

/// What became of a night.
enum Inserted {
    New,
    /// The catalogue has it.
    Known,
    /// The catalogue has another of its name, from another folder.
    Conflicting,
}

/// Inserts a night. Another state of it, from the same folder, is replaced.
async fn insert(db: &mut Db, night: &Night, folder: &str) -> Result<Inserted, sqlx::Error> {
    let sha256 = digest(night);
    db.lock(&sha256).await?;
    let sql = "DELETE FROM night WHERE folder = $1 AND sha256 <> $2";
    db.execute(sql, &[folder.into(), (&sha256).into()]).await?;
    let sql = "SELECT sha256 FROM night WHERE rig = $1 AND rig_kind = $2 AND night_id = $3 AND sha256 <> $4";
    let named = [
        (&night.rig).into(),
        (&night.rig_kind).into(),
        (&night.id).into(),
        (&sha256).into(),
    ];
    if !db.fetch(sql, &named).await?.rows.is_empty() {
        return Ok(Inserted::Conflicting);
    }
    let values: [Bound; 12] = [
        (&sha256).into(),
        (&night.id).into(),
        (&night.rig).into(),
        (&night.rig_kind).into(),
        (&night.suite).into(),
        (&night.started).into(),
        seconds(&night.started).into(),
        (&night.versions.software).into(),
        night.versions.analysis.into(),
        (&night.versions.skin).into(),
        night.verdict.name().into(),
        folder.into(),
    ];
    let added = db
        .execute(
            "INSERT INTO night (sha256, night_id, rig, rig_kind, suite, started_at, started_s, software, analysis, skin, verdict,
                 folder)
             VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12) ON CONFLICT (sha256) DO NOTHING",
            &values,
        )
        .await?;
    if added == 0 {
        return Ok(Inserted::Known);
    }
    for check in &night.checks {
        let parts = check.attempts.last().map(|a| a.parts.as_slice());
        for part in parts.unwrap_or_default() {
            for m in &part.measurements {
                db.execute(
                    "INSERT INTO night_value (sha256, check_name, subject, metric, value, unit, verdict)
                     VALUES ($1, $2, $3, $4, $5, $6, $7)",
                    &[
                        (&sha256).into(),
                        (&check.name).into(),
                        (&part.subject).into(),
                        (&m.metric).into(),
                        m.value.into(),
                        (&m.unit).into(),
                        m.verdict.name().into(),
                    ],
                )
                .await?;
            }
        }
    }
    Ok(Inserted::New)
}
