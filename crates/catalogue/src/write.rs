//! Writes the rows of a session. Runs inside a transaction of the caller.

use skinrig_settings::Choice;

use crate::db::Db;
use crate::entry::SessionEntry;
use crate::insert::{self, CLOCKS, DEVICES, PARAMETERS};
use crate::prototypes::{PrototypeOrigin, Relation};
use crate::results::{AnalysisEntry, AnalysisFigures, ClockEntry, OFFICIAL};
use crate::value::{Bound, Value};

/// A session file as it was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FileEntry {
    pub store: String,
    pub name: String,
    pub size_bytes: u64,
    pub is_sealed: bool,
    pub fingerprint: String,
}

/// A row of `session_file`.
struct KnownFile {
    session_id: String,
    file: FileEntry,
    is_source: bool,
}

impl FileEntry {
    /// Order in which copies of a session are its source: sealed before unsealed (`skinrig salvage` never seals), with results before
    /// without, then the shorter name.
    fn rank(&self, has_results: bool) -> (bool, bool, usize, &str, &str) {
        let (name, store) = (self.name.as_str(), self.store.as_str());
        (!self.is_sealed, !has_results, name.len(), name, store)
    }
}

/// Registers a session that was read from `file`. Returns false, without a change, if it is known as it is and `force` is false.
pub(crate) async fn session(
    db: &mut Db,
    file: &FileEntry,
    entry: &SessionEntry,
    force: bool,
) -> Result<bool, sqlx::Error> {
    let id = entry.headline.session_id.as_str();
    db.lock(id).await?;
    let (here, mut copies): (Vec<_>, Vec<_>) = files_of(db, id, file)
        .await?
        .into_iter()
        .partition(|k| k.file.store == file.store && k.file.name == file.name);
    if !force && here.iter().any(|k| k.session_id == id && k.file == *file) {
        return Ok(false);
    }
    // Another session had this name, or the file could not be read.
    if here.iter().any(|k| k.session_id != id) {
        forget(db, &file.store, &file.name).await?;
    } else {
        let sql = "DELETE FROM unreadable_file WHERE store = $1 AND name = $2";
        let place = [file.store.as_str().into(), file.name.as_str().into()];
        db.execute(sql, &place).await?;
    }
    let is_known = !copies.is_empty() || here.iter().any(|k| k.session_id == id);
    let own = file.rank(!entry.analyses.is_empty());
    // Of the other copies, only the source was read.
    let source_has_results = has_results(db, id).await?;
    let is_better = |k: &KnownFile| k.file.rank(k.is_source && source_has_results) < own;
    if copies.iter().any(|k| k.is_source && is_better(k)) {
        let sql = "DELETE FROM session_file WHERE session_id = $1 AND store = $2 AND name = $3";
        let place = [
            id.into(),
            file.store.as_str().into(),
            file.name.as_str().into(),
        ];
        db.execute(sql, &place).await?;
        return insert_file(db, id, file, false).await.map(|()| true);
    }
    // If this file was the source and a copy now outranks it, that copy has to be read: it is forgotten, and with it stale.
    copies.retain(|k| !is_better(k));
    if is_known {
        let sql = "DELETE FROM session WHERE session_id = $1";
        db.execute(sql, &[id.into()]).await?;
    }
    insert_session(db, entry).await?;
    for copy in &copies {
        insert_file(db, id, &copy.file, false).await?;
    }
    insert_file(db, id, file, true).await?;
    details(db, entry).await?;
    Ok(true)
}

/// True if analyses of this session are known.
async fn has_results(db: &mut Db, id: &str) -> Result<bool, sqlx::Error> {
    let sql = "SELECT 1 FROM analysis WHERE session_id = $1 LIMIT 1";
    let found = db.fetch(sql, &[id.into()]).await?;
    Ok(!found.rows.is_empty())
}

/// Forgets a file. Copies of its session, if it was the source, are forgotten too, and read again.
pub(crate) async fn forget(db: &mut Db, store: &str, name: &str) -> Result<(), sqlx::Error> {
    let file = [store.into(), name.into()];
    db.execute(
        "DELETE FROM session WHERE session_id IN
             (SELECT session_id FROM session_file WHERE store = $1 AND name = $2 AND is_source = 1)",
        &file,
    )
    .await?;
    db.execute(
        "DELETE FROM session_file WHERE store = $1 AND name = $2",
        &file,
    )
    .await?;
    db.execute(
        "DELETE FROM unreadable_file WHERE store = $1 AND name = $2",
        &file,
    )
    .await?;
    Ok(())
}

/// Notes that a file cannot be read, and forgets what was read from it before.
pub(crate) async fn unreadable(
    db: &mut Db,
    store: &str,
    name: &str,
    fingerprint: &str,
    reason: &str,
) -> Result<(), sqlx::Error> {
    forget(db, store, name).await?;
    db.execute(
        "INSERT INTO unreadable_file (store, name, fingerprint, reason) VALUES ($1, $2, $3, $4)",
        &[store.into(), name.into(), fingerprint.into(), reason.into()],
    )
    .await
    .map(drop)
}

/// The files of a session, and whatever else is known under the name of `file`.
async fn files_of(db: &mut Db, id: &str, file: &FileEntry) -> Result<Vec<KnownFile>, sqlx::Error> {
    let sql = "SELECT session_id, store, name, size_bytes, is_sealed, is_source, fingerprint FROM session_file
               WHERE session_id = $1 OR (store = $2 AND name = $3)";
    let place = [
        id.into(),
        file.store.as_str().into(),
        file.name.as_str().into(),
    ];
    let found = db.fetch(sql, &place).await?;
    let text = |value: &Value| value.as_text().unwrap_or_default().to_owned();
    let whole = |value: &Value| value.as_integer().unwrap_or_default();
    let file = |row: &Vec<Value>| KnownFile {
        session_id: text(&row[0]),
        file: FileEntry {
            store: text(&row[1]),
            name: text(&row[2]),
            size_bytes: whole(&row[3]).cast_unsigned(),
            is_sealed: whole(&row[4]) == 1,
            fingerprint: text(&row[6]),
        },
        is_source: whole(&row[5]) == 1,
    };
    Ok(found.rows.iter().map(file).collect())
}

async fn insert_file(
    db: &mut Db,
    id: &str,
    file: &FileEntry,
    is_source: bool,
) -> Result<(), sqlx::Error> {
    db.execute(
        "INSERT INTO session_file (session_id, store, name, size_bytes, is_sealed, is_source, fingerprint)
         VALUES ($1, $2, $3, $4, $5, $6, $7)",
        &[
            id.into(),
            file.store.as_str().into(),
            file.name.as_str().into(),
            file.size_bytes.into(),
            file.is_sealed.into(),
            is_source.into(),
            file.fingerprint.as_str().into(),
        ],
    )
    .await
    .map(drop)
}

async fn insert_session(db: &mut Db, entry: &SessionEntry) -> Result<(), sqlx::Error> {
    let (line, totals) = (&entry.headline, entry.totals.as_ref());
    let first = entry.legs.first();
    let last = entry.legs.last();
    let (presses, sync) = (entry.presses, entry.sync);
    let values: [Bound; 35] = [
        (&line.session_id).into(),
        (&entry.content_sha256).into(),
        (&line.started_at).into(),
        entry.started_s().into(),
        (&line.prototype).into(),
        first.map_or("", |leg| leg.operator.as_str()).into(),
        (&line.protocol_name).into(),
        (&line.protocol_sha256).into(),
        (&line.plan_sha256).into(),
        (&line.overrides_json).into(),
        (&line.seed).into(),
        (&line.rig_kind).into(),
        (&line.rig_name).into(),
        first.map_or("", |leg| leg.host.as_str()).into(),
        last.map_or("", |leg| leg.software.as_str()).into(),
        last.and_then(|leg| leg.ended.as_deref()).into(),
        entry.duration_s.into(),
        presses.planned.into(),
        presses.valid.into(),
        presses.missed.into(),
        presses.invalid.into(),
        presses.excluded.into(),
        sync.planned.into(),
        sync.valid.into(),
        totals.map(|t| t.raw_bytes).into(),
        totals.map(|t| t.stored_bytes).into(),
        totals.map(|t| t.lost_bytes).into(),
        totals.map(|t| t.cd_events).into(),
        (&entry.tags_problem).into(),
        totals.map(|t| t.chunks).into(),
        totals.map(|t| t.pose_samples).into(),
        sync.missed.into(),
        sync.invalid.into(),
        sync.excluded.into(),
        totals.map(|t| t.trigger_edges).into(),
    ];
    db.execute(
        "INSERT INTO session (session_id, content_sha256, started_at, started_s, prototype, operator, protocol_name,
             protocol_sha256, plan_sha256, overrides_json, seed, rig_kind, rig_name, host, software, ended, duration_s, planned,
             valid, missed, invalid, excluded, sync_planned, sync_valid, raw_bytes, stored_bytes, lost_bytes, cd_events,
             tags_problem, chunks, pose_samples, sync_missed, sync_invalid, sync_excluded, trigger_edges)
         VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20, $21, $22, $23, $24,
             $25, $26, $27, $28, $29, $30, $31, $32, $33, $34, $35)",
        &values,
    )
    .await
    .map(drop)
}

/// Everything of a session but its own row and its files.
async fn details(db: &mut Db, entry: &SessionEntry) -> Result<(), sqlx::Error> {
    let id = entry.headline.session_id.as_str();
    for leg in &entry.legs {
        db.execute(
            "INSERT INTO leg (session_id, number, operator, started_at, host, software, ended)
             VALUES ($1, $2, $3, $4, $5, $6, $7)",
            &[
                id.into(),
                leg.number.into(),
                (&leg.operator).into(),
                (&leg.started_at).into(),
                (&leg.host).into(),
                (&leg.software).into(),
                (&leg.ended).into(),
            ],
        )
        .await?;
    }
    for (kind, presses) in &entry.faults {
        let sql = "INSERT INTO press_fault (session_id, kind, presses) VALUES ($1, $2, $3)";
        db.execute(sql, &[id.into(), kind.into(), (*presses).into()])
            .await?;
    }
    let device = |device: &[String; 4]| {
        let [role, model, serial, firmware] = device;
        [
            id.into(),
            role.into(),
            model.into(),
            serial.into(),
            firmware.into(),
        ]
    };
    DEVICES.all(db, entry.devices.iter().map(device)).await?;
    annotations(db, entry).await?;
    for analysis in &entry.analyses {
        self::analysis(db, id, analysis).await?;
    }
    Ok(())
}

/// Replaces tags and notes of a session. Returns false, without a change, if the session is not in the catalogue.
pub(crate) async fn annotate(db: &mut Db, entry: &SessionEntry) -> Result<bool, sqlx::Error> {
    let id = entry.headline.session_id.as_str();
    db.lock(id).await?;
    let known = db
        .fetch("SELECT 1 FROM session WHERE session_id = $1", &[id.into()])
        .await?;
    if known.rows.is_empty() {
        return Ok(false);
    }
    db.execute("DELETE FROM tag WHERE session_id = $1", &[id.into()])
        .await?;
    db.execute("DELETE FROM note WHERE session_id = $1", &[id.into()])
        .await?;
    annotations(db, entry).await.map(|()| true)
}

/// Tags and notes of a session.
async fn annotations(db: &mut Db, entry: &SessionEntry) -> Result<(), sqlx::Error> {
    let id = entry.headline.session_id.as_str();
    for tag in &entry.tags {
        let sql = "INSERT INTO tag (session_id, tag) VALUES ($1, $2)";
        db.execute(sql, &[id.into(), tag.into()]).await?;
    }
    for (position, note) in (1_u32..).zip(&entry.notes) {
        let later = note.later.as_ref();
        db.execute(
            "INSERT INTO note (session_id, position, noted_at, author, text) VALUES ($1, $2, $3, $4, $5)",
            &[
                id.into(),
                position.into(),
                later.map(|(at, _)| at.as_str()).into(),
                later.map(|(_, by)| by.as_str()).into(),
                (&note.text).into(),
            ],
        )
        .await?;
    }
    Ok(())
}

async fn analysis(db: &mut Db, id: &str, entry: &AnalysisEntry) -> Result<(), sqlx::Error> {
    let figures = match &entry.figures {
        Ok(figures) => figures,
        Err(problem) => {
            let sql = "INSERT INTO analysis (session_id, name, problem) VALUES ($1, $2, $3)";
            let values = [
                id.into(),
                (&entry.name).into(),
                (&problem.to_string()).into(),
            ];
            return db.execute(sql, &values).await.map(drop);
        }
    };
    let rmse = figures.rmse_mm;
    let changed = serde_json::Value::from(figures.changed.clone()).to_string();
    let values: [Bound; 17] = [
        id.into(),
        (&entry.name).into(),
        figures.version.into(),
        (&figures.results_hash).into(),
        figures.is_valid.into(),
        (&changed).into(),
        rmse.value.into(),
        rmse.low.into(),
        rmse.high.into(),
        rmse.n.into(),
        figures.median_mm.into(),
        figures.p95_mm.into(),
        figures.bias_mm[0].into(),
        figures.bias_mm[1].into(),
        figures.repeat_std_mm.into(),
        figures.located_rate.into(),
        figures.left_out_rmse_mm.into(),
    ];
    db.execute(
        "INSERT INTO analysis (session_id, name, version, results_hash, is_valid, changed_json, rmse_mm, rmse_low_mm,
             rmse_high_mm, rmse_n, median_mm, p95_mm, bias_x_mm, bias_y_mm, repeat_std_mm, located_rate, left_out_rmse_mm)
         VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17)",
        &values,
    )
    .await?;
    if entry.name == OFFICIAL {
        insert::presses(db, id, &figures.presses).await?;
    }
    fits(db, id, &entry.name, figures).await
}

/// Clocks and calibration of an analysis.
async fn fits(
    db: &mut Db,
    id: &str,
    analysis: &String,
    figures: &AnalysisFigures,
) -> Result<(), sqlx::Error> {
    let clock = |clock: &ClockEntry| {
        [
            id.into(),
            analysis.into(),
            (&clock.map).into(),
            clock.drift_ppm.into(),
            clock.residual_rms_us.into(),
            clock.residual_max_us.into(),
            clock.n.into(),
        ]
    };
    CLOCKS.all(db, figures.clocks.iter().map(clock)).await?;
    let Some(calibration) = &figures.calibration else {
        return Ok(());
    };
    db.execute(
        "INSERT INTO calibration (session_id, analysis, model, rmse_before_mm, rmse_after_mm, n)
         VALUES ($1, $2, $3, $4, $5, $6)",
        &[
            id.into(),
            analysis.into(),
            (&calibration.model).into(),
            calibration.rmse_before_mm.into(),
            calibration.rmse_after_mm.into(),
            calibration.n.into(),
        ],
    )
    .await?;
    let parameter = |(name, value, error): &(String, Option<f64>, Option<f64>)| {
        [
            id.into(),
            analysis.into(),
            name.into(),
            (*value).into(),
            (*error).into(),
        ]
    };
    let values = calibration.values.iter().map(parameter);
    PARAMETERS.all(db, values).await
}

/// Replaces the prototypes declared in a store.
pub(crate) async fn prototypes(
    db: &mut Db,
    store: &str,
    all: &[PrototypeOrigin],
) -> Result<(), sqlx::Error> {
    db.execute("DELETE FROM prototype WHERE store = $1", &[store.into()])
        .await?;
    for prototype in all {
        db.execute(
            "INSERT INTO prototype (store, name, relation, parent, made_on, note) VALUES ($1, $2, $3, $4, $5, $6)",
            &[
                store.into(),
                (&prototype.name).into(),
                prototype.relation.map(Relation::word).into(),
                (&prototype.parent).into(),
                (&prototype.made_on).into(),
                (&prototype.note).into(),
            ],
        )
        .await?;
    }
    Ok(())
}
