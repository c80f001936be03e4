//! Writes the rows that were found into the new file, each checked, and tells what is missing.

use std::io;
use std::path::Path;

use sha2::{Digest, Sha256};
use skinrig_model::CameraId;
use sqlx::sqlite::SqliteConnection;

use super::cells::Value;
use super::gather::{self, Found, Rows};
use super::pages::Pages;
use super::shapes::{Part, Shape};
use super::{LostBytes, SalvageReport, SalvagedTable};
use crate::error::RecorderError;
use crate::query::Fault;
use crate::seal;

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
            Self::Reading(source) => super::io(from, "reading it", source),
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
        self.compare_with_seal().await?;
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
        // Ids count from 1 (presses from 0) without gaps.
        if let (Some([Part::Int(first)]), Some([Part::Int(last)])) = (
            rows.rows.keys().next().map(Vec::as_slice),
            rows.rows.keys().next_back().map(Vec::as_slice),
        ) {
            let begin =
                i64::from(*first > 0 && !matches!(shape.kind.name, "press" | "robot_from_skin"));
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
        for camera in CameraId::ALL {
            let (mut next, mut host_ns, mut hole) = (0i64, 0i64, None::<Hole>);
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
                if seq < next || seq - next > MOST_MISSING {
                    table.missing += 1;
                    continue;
                }
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
                if let Some(Value::Int(t)) = row.get(HOST_NS) {
                    host_ns = *t;
                }
                if let Some(hole) = hole.take() {
                    table.missing += self.close(shape, &hole, host_ns).await?;
                }
                if self.insert(shape, row).await? {
                    table.rows += 1;
                } else {
                    widen(&mut hole, camera, seq, seq, 0, false);
                }
            }
            if let Some(hole) = hole.take() {
                table.missing += self.close(shape, &hole, host_ns).await?;
            }
        }
        Ok(table)
    }

    /// Puts empty chunks where some are missing, the first after the bytes that were lost.
    async fn close(&mut self, shape: &Shape, hole: &Hole, host_ns: i64) -> Result<u64, Failed> {
        let empty = Sha256::digest([]).to_vec();
        for seq in hole.first_seq..=hole.last_seq {
            let lost = if seq == hole.first_seq {
                hole.bytes.max(1)
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

    /// Compares each table with the digest that it was sealed with, when that came back.
    async fn compare_with_seal(&mut self) -> Result<(), Failed> {
        let sealed = self
            .shapes
            .iter()
            .zip(self.rows)
            .find(|(s, _)| s.kind.name == "table_digest");
        let Some((_, sealed)) = sealed.filter(|(_, rows)| !rows.rows.is_empty()) else {
            return Ok(());
        };
        for digest in seal::digest_tables(self.conn).await? {
            let key = vec![Part::Text(digest.name.clone())];
            let Some(Found::Row(row)) = sealed.rows.get(&key) else {
                continue;
            };
            if row.get(2) == Some(&Value::Blob(digest.sha256.to_vec())) {
                continue;
            }
            let rows = match row.get(1) {
                Some(Value::Int(n)) => n.to_string(),
                _ => "unknown".to_owned(),
            };
            self.report.findings.push(format!(
                "table {}: expected the {rows} rows that were sealed, found {} rows or other values",
                digest.name, digest.rows
            ));
        }
        Ok(())
    }

    /// The new file tells where it comes from.
    async fn note(&mut self, name: &str) -> Result<(), Failed> {
        let lost = self.report.tables.iter().filter(|t| t.missing > 0);
        let mut lost: Vec<String> = lost
            .map(|t| format!("{} row(s) of {}", t.missing, t.name))
            .collect();
        lost.extend(self.report.findings.iter().cloned());
        let lost = if lost.is_empty() {
            "nothing known to be lost".to_owned()
        } else {
            format!("lost: {}", lost.join("; "))
        };
        let text = format!(
            "salvaged from {name} (SHA-256 {}); {lost}",
            self.report.source_sha256
        );
        sqlx::query(
            "INSERT INTO note (t_ns, text) VALUES ((SELECT coalesce(max(host_ns), 0) FROM chunk), ?)",
        )
        .bind(text)
        .execute(&mut *self.conn)
        .await?;
        Ok(())
    }
}

/// Columns of `chunk`.
const HOST_NS: usize = 2;
const LOST_BEFORE: usize = 3;
const RAW_BYTES: usize = 5;
/// A stream with more chunks missing in a row is no stream.
const MOST_MISSING: i64 = 1 << 20;
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
