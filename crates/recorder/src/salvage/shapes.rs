//! The tables of a session as a row without a name is told by them: how many values of which kinds, and what names the row.

use sqlx::sqlite::SqliteConnection;

use super::cells::Value;
use crate::query::{Fault, each_row, int, text};

/// A table whose rows are brought back, and the statement that does it. A test holds the list against the schema.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    pub name: &'static str,
    pub insert: &'static str,
    /// Columns that every row has: older rows lack those that were added later.
    pub least: usize,
    /// Tells rows of the same shape apart: a column that holds one of these words.
    pub words: Option<(usize, &'static [&'static str])>,
    /// Rows that may be long, are many, and carry a SHA-256 of their own: (its column, the column that it is over).
    pub hashed: Option<(usize, usize)>,
}

const fn kind(name: &'static str, least: usize, insert: &'static str) -> Kind {
    Kind {
        name,
        insert,
        least,
        words: None,
        hashed: None,
    }
}

/// In the order in which rows refer to one another.
pub const KINDS: [Kind; 21] = [
    kind(
        "session",
        20,
        "INSERT INTO session VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    ),
    kind(
        "robot_from_skin",
        5,
        "INSERT INTO robot_from_skin VALUES (?, ?, ?, ?, ?)",
    ),
    kind("device", 5, "INSERT INTO device VALUES (?, ?, ?, ?, ?)"),
    kind("setting", 5, "INSERT INTO setting VALUES (?, ?, ?, ?, ?)"),
    kind(
        "preflight",
        6,
        "INSERT INTO preflight VALUES (?, ?, ?, ?, ?, ?)",
    ),
    kind("press", 7, "INSERT INTO press VALUES (?, ?, ?, ?, ?, ?, ?)"),
    kind(
        "leg",
        17,
        "INSERT INTO leg VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    ),
    kind(
        "attempt",
        17,
        "INSERT INTO attempt VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    ),
    kind(
        "command",
        6,
        "INSERT INTO command VALUES (?, ?, ?, ?, ?, ?)",
    ),
    Kind {
        hashed: Some((4, 5)),
        ..kind(
            "pose_block",
            6,
            "INSERT INTO pose_block VALUES (?, ?, ?, ?, ?, ?)",
        )
    },
    kind("mark", 5, "INSERT INTO mark VALUES (?, ?, ?, ?, ?)"),
    kind(
        "box_report",
        10,
        "INSERT INTO box_report VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    ),
    Kind {
        hashed: Some((7, 13)),
        ..kind(
            "chunk",
            14,
            "INSERT INTO chunk VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        )
    },
    kind("gap", 4, "INSERT INTO gap VALUES (?, ?, ?, ?)"),
    kind(
        "trigger_edge",
        6,
        "INSERT INTO trigger_edge VALUES (?, ?, ?, ?, ?, ?)",
    ),
    Kind {
        words: Some((2, &["completed", "stopped", "faulted"])),
        ..kind("run_end", 4, "INSERT INTO run_end VALUES (?, ?, ?, ?)")
    },
    kind(
        "interruption",
        4,
        "INSERT INTO interruption VALUES (?, ?, ?, ?)",
    ),
    kind("note", 3, "INSERT INTO note VALUES (?, ?, ?)"),
    kind("table_digest", 3, ""),
    kind(
        "previous_seal",
        21,
        "INSERT INTO previous_seal VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    ),
    kind(
        "previous_table_digest",
        4,
        "INSERT INTO previous_table_digest VALUES (?, ?, ?, ?)",
    ),
];

/// One column.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Column {
    kind: ColumnKind,
    nullable: bool,
    /// Its place in the key, from 1; 0: no part of it.
    key: i64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ColumnKind {
    Int,
    Real,
    Text,
    Blob,
    /// Stands beside the row, not in it.
    RowId,
}

/// A table's rows.
#[derive(Debug, Clone)]
pub struct Shape {
    pub kind: Kind,
    columns: Vec<Column>,
    /// Rows lie in key order and have no row id.
    keyed: bool,
}

/// What names a row within its table.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    Int(i64),
    Text(String),
}

/// The shapes of all kinds, from the schema of a new file.
pub async fn shapes(conn: &mut SqliteConnection) -> Result<Vec<Shape>, Fault> {
    let mut out = Vec::new();
    for kind in KINDS {
        let mut keyed = false;
        let sql = sqlx::query("SELECT wr FROM pragma_table_list WHERE name = ?").bind(kind.name);
        each_row(sql, conn, |row| {
            keyed = int(row, "wr")? == 1;
            Ok(())
        })
        .await?;
        let mut columns = Vec::new();
        let sql = "SELECT type, \"notnull\" AS must, pk FROM pragma_table_info(?) ORDER BY cid";
        each_row(sqlx::query(sql).bind(kind.name), conn, |row| {
            let kind = match text(row, "type")?.as_str() {
                "REAL" => ColumnKind::Real,
                "TEXT" => ColumnKind::Text,
                "BLOB" => ColumnKind::Blob,
                _ => ColumnKind::Int,
            };
            let key = int(row, "pk")?;
            let nullable = int(row, "must")? == 0 && key == 0;
            columns.push(Column {
                kind,
                nullable,
                key,
            });
            Ok(())
        })
        .await?;
        let keys = columns.iter().filter(|c| c.key > 0).count();
        if let (false, 1, Some(first)) = (keyed, keys, columns.first_mut()) {
            first.kind = ColumnKind::RowId;
        }
        out.push(Shape {
            kind,
            columns,
            keyed,
        });
    }
    Ok(out)
}

impl Shape {
    /// Whether a row with these serial types may be one of this table.
    pub fn takes(&self, types: &[u64], keyed: bool) -> bool {
        keyed == self.keyed
            && (self.kind.least..=self.columns.len()).contains(&types.len())
            && types.iter().zip(&self.columns).all(|(serial, column)| {
                match (column.kind, *serial) {
                    (ColumnKind::RowId, serial) => serial == 0,
                    (_, 0) => column.nullable,
                    (ColumnKind::Int, 1..=6 | 8 | 9) | (ColumnKind::Real, 1..=9) => true,
                    (ColumnKind::Text, n) => n >= 13 && n % 2 == 1,
                    (ColumnKind::Blob, n) => n >= 12 && n % 2 == 0,
                    _ => false,
                }
            })
    }

    /// Whether the words that tell rows of one shape apart say that it is of this table.
    pub fn says(&self, values: &[Value]) -> bool {
        self.kind.words.is_none_or(|(column, words)| {
            matches!(values.get(column), Some(Value::Text(word)) if words.contains(&word.as_str()))
        })
    }

    /// The values as columns: the row id in its place, columns that came later null.
    pub fn row(&self, mut values: Vec<Value>, rowid: Option<i64>) -> Vec<Value> {
        values.resize(self.columns.len(), Value::Null);
        if let (ColumnKind::RowId, Some(rowid)) = (self.columns[0].kind, rowid) {
            values[0] = Value::Int(rowid);
        }
        values
    }

    /// What names the row; `None` for a row that no table could hold.
    pub fn key(&self, row: &[Value]) -> Option<Vec<Part>> {
        let mut parts: Vec<(i64, Part)> = Vec::new();
        for (column, value) in self.columns.iter().zip(row).filter(|(c, _)| c.key > 0) {
            let part = match value {
                Value::Int(n) => Part::Int(*n),
                Value::Text(text) => Part::Text(text.clone()),
                _ => return None,
            };
            parts.push((column.key, part));
        }
        parts.sort();
        Some(parts.into_iter().map(|(_, part)| part).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema;

    /// A table that is added to the schema and not here would be lost by a salvage.
    #[test]
    fn every_table_of_the_schema_is_brought_back_whole() {
        let folder = tempfile::tempdir().unwrap();
        let runtime = tokio::runtime::Builder::new_current_thread()
            .build()
            .unwrap();
        runtime.block_on(async {
            let path = folder.path().join("x.session.sqlite");
            let mut conn = schema::create(&path).await.unwrap();
            let mut names: Vec<String> = Vec::new();
            let sql = "SELECT name FROM sqlite_schema WHERE type = 'table' ORDER BY name";
            each_row(sqlx::query(sql), &mut conn, |row| {
                names.push(text(row, "name")?);
                Ok(())
            })
            .await
            .unwrap();
            // What sealing writes, and what the migrations keep.
            names.retain(|n| n != "seal" && n != "_sqlx_migrations" && !n.starts_with("sqlite_"));
            let mut known: Vec<_> = KINDS.iter().map(|k| k.name.to_owned()).collect();
            known.sort();
            assert_eq!(names, known);
            for shape in shapes(&mut conn).await.unwrap() {
                let places = shape.kind.insert.matches('?').count();
                if !shape.kind.insert.is_empty() {
                    assert_eq!(places, shape.columns.len(), "{}", shape.kind.name);
                }
                assert!(
                    shape.columns.iter().any(|c| c.key > 0),
                    "{}",
                    shape.kind.name
                );
                let later = &shape.columns[shape.kind.least..];
                assert!(later.iter().all(|c| c.nullable), "{}", shape.kind.name);
            }
        });
    }
}
