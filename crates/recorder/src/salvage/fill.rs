//! Writes the rows that were found into the new file, each checked, and tells what is missing.

use std::io;
use std::path::Path;

use sha2::{Digest, Sha256};
use skinrig_model::CameraId;
use sqlx::sqlite::SqliteConnection;

use super::cells::Value;
use super::gather::{self, Found, Rows};
use super::pages::Pages;
use super::report::{self, LostBytes, SalvageReport, SalvagedTable};
use super::shapes::{Part, Shape};
use crate::error::RecorderError;
use crate::query::Fault;

/// Long rows between two commits.
const BATCH: usize = 64;

/// What is needed to write the new file.
pub struct Filling<'a> {
    pub conn: &'a mut SqliteConnection,
    pub pages: &'a mut Pages,
    pub shapes: &'a [Shape],
    pub rows: &'a [Rows],
    pub report: &'a mut SalvageReport,
}

/// Reading the old file or writing the new one failed.
pub enum Failed {
    Reading(io::Error),
    Writing(Fault),
}

impl From<io::Error> for Failed {
    fn from(e: io::Error) -> Self {
        Self::Reading(e)
    }
}

impl From<sqlx::Error> for Failed {
    fn from(e: sqlx::Error) -> Self {
        Self::Writing(e.into())
    }
}

impl From<Fault> for Failed {
    fn from(e: Fault) -> Self {
        Self::Writing(e)
    }
}

impl Failed {
    /// The error for the user.
    pub fn at(self, from: &Path, to: &Path) -> RecorderError {
        match self {
            Self::Reading(source) => report::io(from, "reading it", source),
            Self::Writing(fault) => fault.at(to, "writing what was salvaged"),
        }
    }
}

/// The gap that the chunks that did not come back leave in a stream.
struct Hole {
    camera: CameraId,
    first_seq: i64,
    last_seq: i64,
    /// Bytes that are known to be lost, and whether all are known.
    bytes: i64,
    all_known: bool,
}

impl Filling<'_> {
    /// Writes everything, and a note about it.
    pub async fn fill(&mut self, name: &str) -> Result<(), Failed> {
        // Rows whose parents are lost come back as well.
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
        self.drop_gaps_of_holes().await?;
        self.compare_with_seal().await?;
        self.drop_broken_links().await?;
        self.compare_with_each_other().await?;
        self.note(name).await?;
        sqlx::query("COMMIT").execute(&mut *self.conn).await?;
        Ok(())
    }

    async fn table(&mut self, shape: &Shape, rows: &Rows) -> Result<SalvagedTable, Failed> {
        let mut table = SalvagedTable {
            name: shape.kind.name.to_owned(),
            rows: 0,
            missing: rows.torn,
        };
        for (n, found) in rows.rows.values().enumerate() {
            if n % BATCH == BATCH - 1 {
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
        // Ids count without gaps, but for the legs that took a seal off.
        if shape.kind.name != "previous_seal"
            && let (Some([Part::Int(first)]), Some([Part::Int(last)])) = (
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

    async fn commit(&mut self) -> Result<(), Failed> {
        sqlx::query("COMMIT").execute(&mut *self.conn).await?;
        sqlx::query("BEGIN").execute(&mut *self.conn).await?;
        Ok(())
    }

    /// Writes a row; false when the schema refuses it: its bytes are not what they were.
    async fn insert(&mut self, shape: &Shape, row: Vec<Value>) -> Result<bool, Failed> {
        let mut query = sqlx::query(shape.kind.insert);
        for value in row {
            query = match value {
                Value::Null => query.bind(None::<i64>),
                Value::Int(n) => query.bind(n),
                Value::Real(x) => query.bind(x),
                Value::Text(text) => query.bind(text),
                Value::Blob(bytes) => query.bind(bytes),
                Value::Broken => return Ok(false),
            };
        }
        match query.execute(&mut *self.conn).await {
            Ok(_) => Ok(true),
            Err(sqlx::Error::Database(e)) if !is_of_the_disk(&*e) => Ok(false),
            Err(e) => Err(e.into()),
        }
    }

    /// Writes chunks in stream order. What is missing between them becomes an empty chunk after lost bytes.
    async fn chunks(&mut self, shape: &Shape, rows: &Rows) -> Result<SalvagedTable, Failed> {
        let mut table = SalvagedTable {
            name: shape.kind.name.to_owned(),
            rows: 0,
            missing: rows.torn,
        };
        let (mut fillers, mut beyond) = (MOST_MISSING, 0u64);
        for camera in CameraId::ALL {
            let (mut next, mut host_ns, mut hole) = (0i64, 0i64, None::<Hole>);
            let legs = self.legs(camera);
            let of_camera = |key: &Vec<Part>| match key[..] {
                [Part::Int(c), Part::Int(seq)] if c == camera.index() as i64 + 1 => Some(seq),
                _ => None,
            };
            let mine = rows
                .rows
                .iter()
                .filter_map(|(key, found)| Some((of_camera(key)?, found)));
            for (n, (seq, found)) in mine.enumerate() {
                if n % BATCH == BATCH - 1 {
                    self.commit().await?;
                }
                // A number far beyond all others is no chunk's.
                if seq < next || seq - next > fillers {
                    beyond += 1;
                    continue;
                }
                fillers -= seq - next;
                if seq > next {
                    widen(&mut hole, camera, next, seq - 1, 0, false);
                }
                next = seq + 1;
                let row = gather::read(self.pages, shape, found)?;
                let Some(row) = row.filter(|row| is_intact(shape, row)) else {
                    let begun = gather::beginning(self.pages, shape, found)?;
                    let lost = [LOST_BEFORE, RAW_BYTES].map(|i| begun.get(i));
                    let bytes = match lost {
                        [Some(Value::Int(a)), Some(Value::Int(b))]
                            if (0..=MOST_BYTES).contains(a) && (0..=MOST_BYTES).contains(b) =>
                        {
                            Some(a + b)
                        }
                        _ => None,
                    };
                    widen(
                        &mut hole,
                        camera,
                        seq,
                        seq,
                        bytes.unwrap_or(0),
                        bytes.is_some(),
                    );
                    continue;
                };
                if let Some(hole) = hole.take() {
                    table.missing += self.close(shape, &hole, host_ns, &legs).await?;
                }
                if let Some(Value::Int(t)) = row.get(HOST_NS) {
                    host_ns = *t;
                }
                if self.insert(shape, row).await? {
                    table.rows += 1;
                } else {
                    widen(&mut hole, camera, seq, seq, 0, false);
                }
            }
            if let Some(hole) = hole.take() {
                table.missing += self.close(shape, &hole, host_ns, &legs).await?;
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

    /// The first chunk of each further leg and the host time at which the leg begins.
    fn legs(&self, camera: CameraId) -> Vec<(i64, i64)> {
        let mut legs = self.shapes.iter().zip(self.rows);
        let rows = legs.find(|(shape, _)| shape.kind.name == "leg");
        let rows = rows.into_iter().flat_map(|(_, rows)| rows.rows.values());
        rows.filter_map(|found| match found {
            Found::Row(row) => match (
                row.get(LEG_FIRST_SEQ[camera.index()]),
                row.get(LEG_ORIGIN_NS),
            ) {
                (Some(Value::Int(seq)), Some(Value::Int(origin_ns))) => Some((*seq, *origin_ns)),
                _ => None,
            },
            Found::Place(..) => None,
        })
        .collect()
    }

    /// Puts empty chunks where some are missing, the first after the bytes that were lost. They came when the last chunk before
    /// them did, but not before their leg began.
    async fn close(
        &mut self,
        shape: &Shape,
        hole: &Hole,
        mut host_ns: i64,
        legs: &[(i64, i64)],
    ) -> Result<u64, Failed> {
        let empty = Sha256::digest([]).to_vec();
        for seq in hole.first_seq..=hole.last_seq {
            let begun = legs.iter().filter(|(first, _)| *first == seq);
            host_ns = begun.fold(host_ns, |t, (_, origin_ns)| t.max(*origin_ns));
            let lost = if seq == hole.first_seq {
                // Words of every format begin where these end.
                hole.bytes.max(LEAST_BYTES)
            } else {
                0
            };
            let mut row = vec![
                Value::Int(hole.camera.index() as i64 + 1),
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
            camera: hole.camera,
            first_seq: hole.first_seq as u64,
            last_seq: hole.last_seq as u64,
            bytes: hole.all_known.then_some(hole.bytes as u64),
        });
        Ok((hole.last_seq - hole.first_seq + 1) as u64)
    }

    /// What is put in the place of missing chunks lost more than the gap before them, and its facts know of no loss.
    async fn drop_gaps_of_holes(&mut self) -> Result<(), Failed> {
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
/// A session with more chunks missing between others is none.
const MOST_MISSING: i64 = 1 << 20;
/// What is missing where nothing tells how much: the longest word.
const LEAST_BYTES: i64 = 8;
/// No chunk has more bytes, and no gap that a damaged row tells of is believed beyond.
const MOST_BYTES: i64 = 1 << 40;

fn widen(hole: &mut Option<Hole>, camera: CameraId, from: i64, to: i64, bytes: i64, known: bool) {
    let hole = hole.get_or_insert(Hole {
        camera,
        first_seq: from,
        last_seq: to,
        bytes: 0,
        all_known: true,
    });
    hole.last_seq = to;
    hole.bytes += bytes;
    hole.all_known &= known;
}

/// Whether the hash beside a long row is the hash of its content. Other rows have none.
fn is_intact(shape: &Shape, row: &[Value]) -> bool {
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

/// Whether SQLite's answer is about the disk and not about the row: disk full, input or output error, cannot open, read-only.
fn is_of_the_disk(error: &dyn sqlx::error::DatabaseError) -> bool {
    let code = error
        .code()
        .and_then(|c| c.parse::<u32>().ok())
        .unwrap_or(0);
    matches!(code & 0xFF, 8 | 10 | 11 | 13 | 14)
}
