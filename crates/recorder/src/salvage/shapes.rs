//! Shapes of the session tables: number and types of columns and the key, by which a row without context is identified.

use sqlx::sqlite::SqliteConnection;

use super::cells::Value;
use crate::query::{Fault, each_row, int, text};

/// A table to salvage, with its insert statement. A test compares the list with the schema.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TableSpec {
    pub name: &'static str,
    pub insert: &'static str,
    /// Fewest columns of a row; later schemas added the others.
    pub least: usize,
    /// Distinguishes rows of the same shape: a column, and the values that it may have.
    pub words: Option<(usize, &'static [&'static str])>,
    /// For tables with many long rows: the column with the SHA-256, and the column that it covers.
    pub hashed: Option<(usize, usize)>,
}

const fn table(name: &'static str, least: usize, insert: &'static str) -> TableSpec {
    TableSpec {
        name,
        insert,
        least,
        words: None,
        hashed: None,
    }
}

/// All tables, parents before children.
pub(super) const TABLES: [TableSpec; 23] = [
    table(
        "session",
        20,
        "INSERT INTO session VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    ),
    table(
        "robot_from_skin",
        5,
        "INSERT INTO robot_from_skin VALUES (?, ?, ?, ?, ?)",
    ),
    table("device", 5, "INSERT INTO device VALUES (?, ?, ?, ?, ?)"),
    table("setting", 5, "INSERT INTO setting VALUES (?, ?, ?, ?, ?)"),
    table(
        "preflight",
        6,
        "INSERT INTO preflight VALUES (?, ?, ?, ?, ?, ?)",
    ),
    table("press", 7, "INSERT INTO press VALUES (?, ?, ?, ?, ?, ?, ?)"),
    table(
        "leg",
        17,
        "INSERT INTO leg VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    ),
    table(
        "attempt",
        17,
        "INSERT INTO attempt VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    ),
    table(
        "command",
        6,
        "INSERT INTO command VALUES (?, ?, ?, ?, ?, ?)",
    ),
    TableSpec {
        hashed: Some((4, 5)),
        ..table(
            "pose_block",
            6,
            "INSERT INTO pose_block VALUES (?, ?, ?, ?, ?, ?)",
        )
    },
    table("mark", 5, "INSERT INTO mark VALUES (?, ?, ?, ?, ?)"),
    table(
        "box_report",
        10,
        "INSERT INTO box_report VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    ),
    TableSpec {
        hashed: Some((7, 13)),
        ..table(
            "chunk",
            14,
            "INSERT INTO chunk VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        )
    },
    table("gap", 4, "INSERT INTO gap VALUES (?, ?, ?, ?)"),
    table(
        "trigger_edge",
        6,
        "INSERT INTO trigger_edge VALUES (?, ?, ?, ?, ?, ?)",
    ),
    TableSpec {
        words: Some((2, &["completed", "stopped", "faulted"])),
        ..table("run_end", 4, "INSERT INTO run_end VALUES (?, ?, ?, ?, ?)")
    },
    table(
        "interruption",
        4,
        "INSERT INTO interruption VALUES (?, ?, ?, ?, ?)",
    ),
    table("note", 3, "INSERT INTO note VALUES (?, ?, ?)"),
    TableSpec {
        words: Some((2, &["mail", "webhook", "command"])),
        ..table(
            "notification",
            10,
            "INSERT INTO notification VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        )
    },
    TableSpec {
        words: Some((
            4,
            &[
                "started",
                "onset",
                "position",
                "withdrawn",
                "release",
                "skipped",
                "stopped",
                "lifted",
            ],
        )),
        ..table(
            "touch",
            13,
            "INSERT INTO touch VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        )
    },
    table("table_digest", 3, ""),
    table(
        "previous_seal",
        21,
        "INSERT INTO previous_seal VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    ),
    table(
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
    /// Position in the key, from 1; 0 if it is not part of it.
    key: i64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ColumnKind {
    Int,
    Real,
    Text,
    Blob,
    /// The row id, stored outside of the record.
    RowId,
}

/// Row format of a table.
#[derive(Debug, Clone)]
pub(crate) struct TableShape {
    pub kind: TableSpec,
    columns: Vec<Column>,
    /// Whether rows are stored in key order without a row id.
    keyed: bool,
}

/// Part of a row's key.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum KeyPart {
    Int(i64),
    Text(String),
}

/// Shapes of all tables, from the schema of a new file.
pub(super) async fn shapes(conn: &mut SqliteConnection) -> Result<Vec<TableShape>, Fault> {
    let mut out = Vec::new();
    for kind in TABLES {
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
        out.push(TableShape {
            kind,
            columns,
            keyed,
        });
    }
    Ok(out)
}

impl TableShape {
    /// Whether a record with these serial types may be a row of this table.
    pub(crate) fn matches_types(&self, types: &[u64], keyed: bool) -> bool {
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

    /// Whether the distinguishing column, if any, has one of this table's values.
    pub(crate) fn matches_values(&self, values: &[Value]) -> bool {
        self.kind.words.is_none_or(|(column, words)| {
            matches!(values.get(column), Some(Value::Text(word)) if words.contains(&word.as_str()))
        })
    }

    /// The values as columns, with the row id inserted and missing later columns as null.
    pub(super) fn row(&self, mut values: Vec<Value>, rowid: Option<i64>) -> Vec<Value> {
        values.resize(self.columns.len(), Value::Null);
        if let (ColumnKind::RowId, Some(rowid)) = (self.columns[0].kind, rowid) {
            values[0] = Value::Int(rowid);
        }
        values
    }

    /// Key of the row; `None` if a key column has an impossible type.
    pub(super) fn key(&self, row: &[Value]) -> Option<Vec<KeyPart>> {
        let mut parts: Vec<(i64, KeyPart)> = Vec::new();
        for (column, value) in self.columns.iter().zip(row).filter(|(c, _)| c.key > 0) {
            let part = match value {
                Value::Int(n) => KeyPart::Int(*n),
                Value::Text(text) => KeyPart::Text(text.clone()),
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

    /// The salvage would lose a table that is in the schema but not in this list.
    #[test]
    fn every_table_of_the_schema_is_salvaged() {
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
            // Except for the tables that sealing and the migrations write.
            names.retain(|n| n != "seal" && n != "_sqlx_migrations" && !n.starts_with("sqlite_"));
            let mut known: Vec<_> = TABLES.iter().map(|k| k.name.to_owned()).collect();
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
