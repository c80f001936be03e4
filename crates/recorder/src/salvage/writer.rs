//! Copies recovered rows into the new file, validating each one, and lists what is missing.

use std::io;
use std::ops::RangeInclusive;
use std::path::Path;

use sha2::{Digest, Sha256};
use skinrig_model::CameraId;
use sqlx::sqlite::SqliteConnection;

use super::cells::Value;
use super::gather::{self, RecoveredRow, TableRows};
use super::pages::Pages;
use super::report::{self, LostBytes, SalvageReport, SalvagedTable};
use super::shapes::{KeyPart, TableShape};
use crate::error::RecorderError;
use crate::query::Fault;

/// Long rows per commit.
const ROWS_PER_COMMIT: usize = 64;

/// Input and output of a salvage.
pub(crate) struct SalvageWriter<'a> {
    pub conn: &'a mut SqliteConnection,
    pub pages: &'a mut Pages,
    pub shapes: &'a [TableShape],
    pub rows: &'a [TableRows],
    pub report: &'a mut SalvageReport,
}

/// Failure to read the old file or to write the new one.
pub(crate) enum SalvageError {
    Reading(io::Error),
    Writing(Fault),
}

impl From<io::Error> for SalvageError {
    fn from(e: io::Error) -> Self {
        Self::Reading(e)
    }
}

impl From<sqlx::Error> for SalvageError {
    fn from(e: sqlx::Error) -> Self {
        Self::Writing(e.into())
    }
}

impl From<Fault> for SalvageError {
    fn from(e: Fault) -> Self {
        Self::Writing(e)
    }
}

impl SalvageError {
    /// Converts it to an error for the user.
    pub(super) fn at(self, from: &Path, to: &Path) -> RecorderError {
        match self {
            Self::Reading(source) => report::io(from, "reading it", source),
            Self::Writing(fault) => fault.at(to, "writing the salvaged rows"),
        }
    }
}

/// Consecutive missing chunks, which become a gap in the stream.
struct MissingRange {
    camera: CameraId,
    first_seq: i64,
    last_seq: i64,
    /// Known lost bytes, and whether the size of every chunk is known.
    bytes: i64,
    all_known: bool,
}

impl SalvageWriter<'_> {
    /// Writes all rows and a note about the salvage.
    pub(super) async fn fill(&mut self, name: &str) -> Result<(), SalvageError> {
        // Keeps rows even if their parent rows are lost.
        sqlx::query("PRAGMA foreign_keys = OFF")
            .execute(&mut *self.conn)
            .await?;
        sqlx::query("BEGIN").execute(&mut *self.conn).await?;
        for (shape, rows) in self.shapes.iter().zip(self.rows) {
            let table = match shape.kind.name {
                "table_digest" => continue,
                "chunk" => self.chunks(shape, rows).await?,
                _ => self.table(shape, rows).await?,
            };
            if table.rows + table.missing > 0 {
                self.report.tables.push(table);
            }
        }
        self.drop_replaced_gaps().await?;
        self.compare_with_seal().await?;
        self.drop_unprovable_seals().await?;
        self.compare_with_each_other().await?;
        self.note(name).await?;
        sqlx::query("COMMIT").execute(&mut *self.conn).await?;
        Ok(())
    }

    async fn table(
        &mut self,
        shape: &TableShape,
        rows: &TableRows,
    ) -> Result<SalvagedTable, SalvageError> {
        let mut table = no_rows_yet(shape, rows);
        for (n, found) in rows.rows.values().enumerate() {
            if n % ROWS_PER_COMMIT == ROWS_PER_COMMIT - 1 {
                self.commit().await?;
            }
            let row = gather::read(self.pages, shape, found)?;
            let Some(row) = row.filter(|row| is_intact(shape, row)) else {
                table.missing += 1;
                continue;
            };
            if self.insert(shape, row).await? {
                table.rows += 1;
            } else {
                table.missing += 1;
            }
        }
        // Ids are consecutive, except for legs that removed a seal.
        if shape.kind.name != "previous_seal"
            && let (Some([KeyPart::Int(first)]), Some([KeyPart::Int(last)])) = (
                rows.rows.keys().next().map(Vec::as_slice),
                rows.rows.keys().next_back().map(Vec::as_slice),
            )
        {
            let begin = match shape.kind.name {
                "press" | "robot_from_skin" => 0,
                "leg" => 2,
                _ => i64::from(*first > 0),
            };
            let there = rows.rows.len() as i64;
            table.missing += last.saturating_sub(begin).saturating_add(1 - there).max(0) as u64;
        }
        Ok(table)
    }

    async fn commit(&mut self) -> Result<(), SalvageError> {
        sqlx::query("COMMIT").execute(&mut *self.conn).await?;
        sqlx::query("BEGIN").execute(&mut *self.conn).await?;
        Ok(())
    }

    /// Writes a row; false if the schema rejects it, which means that its bytes are damaged.
    async fn insert(&mut self, shape: &TableShape, row: Vec<Value>) -> Result<bool, SalvageError> {
        let mut query = sqlx::query(shape.kind.insert);
        for value in row {
            query = match value {
                Value::Null => query.bind(None::<i64>),
                Value::Int(n) => query.bind(n),
                Value::Real(x) => query.bind(x),
                Value::Text(text) => query.bind(text),
                Value::Blob(bytes) => query.bind(bytes),
                Value::InvalidText => return Ok(false),
            };
        }
        match query.execute(&mut *self.conn).await {
            Ok(_) => Ok(true),
            Err(sqlx::Error::Database(e)) if !is_disk_error(&*e) => Ok(false),
            Err(e) => Err(e.into()),
        }
    }

    /// Writes chunks in stream order. Missing chunks become empty ones after lost bytes.
    async fn chunks(
        &mut self,
        shape: &TableShape,
        rows: &TableRows,
    ) -> Result<SalvagedTable, SalvageError> {
        let mut table = no_rows_yet(shape, rows);
        let (mut fillers, mut beyond) = (MAX_MISSING, 0u64);
        for camera in CameraId::ALL {
            let (mut next, mut host_ns, mut range) = (0i64, 0i64, None::<MissingRange>);
            let legs = self.legs(camera);
            let of_camera = |key: &Vec<KeyPart>| match key[..] {
                [KeyPart::Int(c), KeyPart::Int(seq)] if c == camera.index() as i64 + 1 => Some(seq),
                _ => None,
            };
            let mine = rows
                .rows
                .iter()
                .filter_map(|(key, found)| Some((of_camera(key)?, found)));
            for (n, (seq, found)) in mine.enumerate() {
                if n % ROWS_PER_COMMIT == ROWS_PER_COMMIT - 1 {
                    self.commit().await?;
                }
                // A number far beyond all others is damaged.
                if seq < next || seq - next > fillers {
                    beyond += 1;
                    continue;
                }
                fillers -= seq - next;
                if seq > next {
                    extend_range(&mut range, camera, next..=seq - 1, None);
                }
                next = seq + 1;
                let row = gather::read(self.pages, shape, found)?;
                let Some(row) = row.filter(|row| is_intact(shape, row)) else {
                    let begun = gather::read_leading(self.pages, shape, found)?;
                    extend_range(&mut range, camera, seq..=seq, stated_bytes(&begun));
                    continue;
                };
                if let Some(range) = range.take() {
                    table.missing += self.fill_missing(shape, &range, host_ns, &legs).await?;
                }
                if let Some(Value::Int(t)) = row.get(HOST_NS) {
                    host_ns = *t;
                }
                if self.insert(shape, row).await? {
                    table.rows += 1;
                } else {
                    extend_range(&mut range, camera, seq..=seq, None);
                }
            }
            if let Some(range) = range.take() {
                table.missing += self.fill_missing(shape, &range, host_ns, &legs).await?;
            }
        }
        if beyond > 0 {
            table.missing += beyond;
            self.report.findings.push(format!(
                "chunk: {beyond} row(s) numbered too far from the others to belong to a stream were left out"
            ));
        }
        Ok(table)
    }

    /// First chunk and start (host time) of each further leg.
    fn legs(&self, camera: CameraId) -> Vec<(i64, i64)> {
        let mut legs = self.shapes.iter().zip(self.rows);
        let rows = legs.find(|(shape, _)| shape.kind.name == "leg");
        let rows = rows.into_iter().flat_map(|(_, rows)| rows.rows.values());
        rows.filter_map(|found| match found {
            RecoveredRow::Values(row) => match (
                row.get(LEG_FIRST_SEQ[camera.index()]),
                row.get(LEG_ORIGIN_NS),
            ) {
                (Some(Value::Int(seq)), Some(Value::Int(origin_ns))) => Some((*seq, *origin_ns)),
                _ => None,
            },
            RecoveredRow::Location(..) => None,
        })
        .collect()
    }

    /// Writes empty chunks in place of missing ones, the first with the number of lost bytes. Their host time is that of the last
    /// chunk before them, but not before the start of their leg.
    async fn fill_missing(
        &mut self,
        shape: &TableShape,
        range: &MissingRange,
        mut host_ns: i64,
        legs: &[(i64, i64)],
    ) -> Result<u64, SalvageError> {
        let empty = Sha256::digest([]).to_vec();
        for seq in range.first_seq..=range.last_seq {
            let begun = legs.iter().filter(|(first, _)| *first == seq);
            host_ns = begun.fold(host_ns, |t, (_, origin_ns)| t.max(*origin_ns));
            let lost = if seq == range.first_seq {
                // Word boundary of every stream format.
                range.bytes.max(UNKNOWN_LOSS_BYTES)
            } else {
                0
            };
            let mut row = vec![
                Value::Int(range.camera.index() as i64 + 1),
                Value::Int(seq),
                Value::Int(host_ns),
                Value::Int(lost),
                Value::Text("none".to_owned()),
                Value::Int(0),
                Value::Int(0),
                Value::Blob(empty.clone()),
                Value::Null,
                Value::Null,
            ];
            row.extend([
                Value::Int(0),
                Value::Int(0),
                Value::Int(0),
                Value::Blob(Vec::new()),
            ]);
            self.insert(shape, row).await?;
        }
        self.report.lost.push(LostBytes {
            camera: range.camera,
            first_seq: range.first_seq as u64,
            last_seq: range.last_seq as u64,
            bytes: range.all_known.then_some(range.bytes as u64),
        });
        Ok((range.last_seq - range.first_seq + 1) as u64)
    }

    /// Drops gap rows of replaced chunks: more was lost than they state, and the replacements have no times.
    async fn drop_replaced_gaps(&mut self) -> Result<(), SalvageError> {
        for lost in &self.report.lost {
            sqlx::query("DELETE FROM gap WHERE camera = ? AND seq BETWEEN ? AND ?")
                .bind(lost.camera.number())
                .bind(lost.first_seq as i64)
                .bind(lost.last_seq as i64)
                .execute(&mut *self.conn)
                .await?;
        }
        Ok(())
    }
}

/// Columns of `leg`.
const LEG_ORIGIN_NS: usize = 6;
const LEG_FIRST_SEQ: [usize; 2] = [9, 10];
/// Columns of `chunk`.
const HOST_NS: usize = 2;
const LOST_BEFORE: usize = 3;
const RAW_BYTES: usize = 5;
/// Most missing chunks between others; more means damaged numbers.
const MAX_MISSING: i64 = 1 << 20;
/// Lost bytes if the number is unknown: the longest word.
const UNKNOWN_LOSS_BYTES: i64 = 8;
/// Largest plausible loss in a row, bytes.
const MAX_BYTES: i64 = 1 << 40;

fn no_rows_yet(shape: &TableShape, rows: &TableRows) -> SalvagedTable {
    SalvagedTable {
        name: shape.kind.name.to_owned(),
        rows: 0,
        missing: rows.torn,
    }
}

/// Bytes lost with a damaged chunk: those lost before it and its own, from the readable start of its row.
fn stated_bytes(begun: &[Value]) -> Option<i64> {
    match (begun.get(LOST_BEFORE), begun.get(RAW_BYTES)) {
        (Some(Value::Int(before)), Some(Value::Int(own)))
            if (0..=MAX_BYTES).contains(before) && (0..=MAX_BYTES).contains(own) =>
        {
            Some(before + own)
        }
        _ => None,
    }
}

/// Adds missing chunks to `range`. `bytes`: how much was lost with them, if known.
fn extend_range(
    range: &mut Option<MissingRange>,
    camera: CameraId,
    chunks: RangeInclusive<i64>,
    bytes: Option<i64>,
) {
    let range = range.get_or_insert(MissingRange {
        camera,
        first_seq: *chunks.start(),
        last_seq: *chunks.end(),
        bytes: 0,
        all_known: true,
    });
    range.last_seq = *chunks.end();
    range.bytes += bytes.unwrap_or(0);
    range.all_known &= bytes.is_some();
}

/// Whether a long row matches its stored hash. Other rows have none.
fn is_intact(shape: &TableShape, row: &[Value]) -> bool {
    shape
        .kind
        .hashed
        .is_none_or(|(hash, content)| match (row.get(hash), row.get(content)) {
            (Some(Value::Blob(hash)), Some(Value::Blob(content))) => {
                Sha256::digest(content).as_slice() == hash.as_slice()
            }
            _ => false,
        })
}

/// Whether SQLite failed because of the disk rather than the row: disk full, I/O error, cannot open, read-only.
fn is_disk_error(error: &dyn sqlx::error::DatabaseError) -> bool {
    let code = error
        .code()
        .and_then(|c| c.parse::<u32>().ok())
        .unwrap_or(0);
    matches!(code & 0xFF, 8 | 10 | 11 | 13 | 14)
}
