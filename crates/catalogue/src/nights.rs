//! Nights of a bench, from the JSON in their folders.

use std::path::{Path, PathBuf};

use serde::Serialize;
use sha2::{Digest, Sha256};
use skinrig_nightly::judge::part_verdicts;
use skinrig_nightly::trend::Acceptance;
use skinrig_nightly::{CheckResult, Night, unsound};

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
            let computer = self.computer_of(&folder).unwrap_or_default().to_owned();
            let inserted = self.transaction("registering a night", async |db| {
                insert(db, &night, &folder, &computer).await
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

    /// Replaces the accepted changes of a folder of nights by those of its history, each with the name of its bench.
    ///
    /// # Errors
    /// If the folder cannot be found, or the catalogue not written.
    pub fn replace_acceptances(
        &mut self,
        nights: &Path,
        all: &[(String, Acceptance)],
    ) -> Result<(), CatalogueError> {
        let store = self.store_of(nights)?;
        self.transaction("registering accepted changes", async |db| {
            db.lock(&store).await?;
            let sql = "DELETE FROM night_acceptance WHERE store = $1";
            db.execute(sql, &[(&store).into()]).await?;
            for (position, (rig, accepted)) in (1_u32..).zip(all) {
                db.execute(
                    "INSERT INTO night_acceptance (store, position, rig, night_id, series, reason, accepted_by, accepted_at)
                     VALUES ($1, $2, $3, $4, $5, $6, $7, $8)",
                    &[
                        (&store).into(),
                        position.into(),
                        rig.into(),
                        (&accepted.night).into(),
                        (&accepted.series).into(),
                        (&accepted.reason).into(),
                        (&accepted.by).into(),
                        (&accepted.at).into(),
                    ],
                )
                .await?;
            }
            Ok(())
        })
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

/// Inserts a night. Another state of it, from the same folder, is replaced. Benches of other computers may have the same name and begin
/// their nights in the same second.
async fn insert(
    db: &mut Db,
    night: &Night,
    folder: &str,
    computer: &str,
) -> Result<Inserted, sqlx::Error> {
    let sha256 = digest(night);
    db.lock(&sha256).await?;
    let sql = "DELETE FROM night WHERE (folder = $1 AND sha256 <> $2) OR (sha256 = $2 AND suite_sha256 IS NULL)";
    db.execute(sql, &[folder.into(), (&sha256).into()]).await?;
    let sql = "SELECT sha256 FROM night WHERE rig = $1 AND rig_kind = $2 AND night_id = $3 AND sha256 <> $4
               AND ($5 = '' OR substr(folder, 1, length($5) + 1) = $5 || ':')";
    let named = [
        (&night.rig).into(),
        (&night.rig_kind).into(),
        (&night.id).into(),
        (&sha256).into(),
        computer.into(),
    ];
    if !db.fetch(sql, &named).await?.rows.is_empty() {
        return Ok(Inserted::Conflicting);
    }
    let firmware = serde_json::Value::from_iter(
        night
            .versions
            .firmware
            .iter()
            .map(|(device, version)| [device.as_str(), version.as_str()]),
    );
    let values: [Bound; 16] = [
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
        (&night.suite_sha256).into(),
        (&night.rig_sha256).into(),
        night.golden.as_ref().map(|g| g.session.as_str()).into(),
        (&firmware.to_string()).into(),
    ];
    let added = db
        .execute(
            "INSERT INTO night (sha256, night_id, rig, rig_kind, suite, started_at, started_s, software, analysis, skin, verdict,
                 folder, suite_sha256, rig_sha256, golden, firmware_json)
             VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16) ON CONFLICT (sha256) DO NOTHING",
            &values,
        )
        .await?;
    if added == 0 {
        return Ok(Inserted::Known);
    }
    for check in &night.checks {
        insert_values(db, &sha256, check).await?;
    }
    Ok(Inserted::New)
}

/// Inserts what the last attempt at a check measured.
async fn insert_values(db: &mut Db, sha256: &str, check: &CheckResult) -> Result<(), sqlx::Error> {
    let Some(last) = check.attempts.last() else {
        return Ok(());
    };
    for (part, judged) in last.parts.iter().zip(part_verdicts(check, last)) {
        for m in &part.measurements {
            let (limit, interval) = (m.limit.as_ref(), m.interval);
            db.execute(
                "INSERT INTO night_value (sha256, check_name, subject, metric, value, unit, verdict, at_least, at_most, margin, low,
                     high, n, part_verdict, attempts)
                 VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15)",
                &[
                    sha256.into(),
                    (&check.name).into(),
                    (&part.subject).into(),
                    (&m.metric).into(),
                    m.value.into(),
                    (&m.unit).into(),
                    m.verdict.name().into(),
                    limit.and_then(|l| l.at_least).into(),
                    limit.and_then(|l| l.at_most).into(),
                    limit.map(|l| l.margin).into(),
                    interval.map(|[low, _]| low).into(),
                    interval.map(|[_, high]| high).into(),
                    m.n.into(),
                    judged.name().into(),
                    u64::try_from(check.attempts.len()).unwrap_or(u64::MAX).into(),
                ],
            )
            .await?;
        }
    }
    Ok(())
}
