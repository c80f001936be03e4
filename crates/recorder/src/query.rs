//! Helpers between SQL rows and plain values.

use std::future::poll_fn;
use std::path::Path;

use sqlx::Row;
use sqlx::sqlite::{Sqlite, SqliteArguments, SqliteConnection, SqliteRow};

use crate::error::RecorderError;

/// A failed query, or a row that violates the schema, before its file is known.
#[derive(Debug)]
pub(crate) enum Fault {
    /// SQLite failed.
    Sql(Box<sqlx::Error>),
    /// A value violates the schema.
    Bad {
        place: String,
        expected: String,
        found: String,
    },
}

impl From<sqlx::Error> for Fault {
    fn from(e: sqlx::Error) -> Self {
        Self::Sql(Box::new(e))
    }
}

impl Fault {
    /// Fault for a value that violates the schema.
    pub(crate) fn bad(place: impl ToString, expected: impl ToString, found: impl ToString) -> Self {
        Self::Bad {
            place: place.to_string(),
            expected: expected.to_string(),
            found: found.to_string(),
        }
    }

    /// Converts it to the error for this file.
    pub(crate) fn at(self, path: &Path, doing: &'static str) -> RecorderError {
        let path = path.to_owned();
        match self {
            Self::Sql(source) => RecorderError::Sql {
                path,
                doing,
                source,
            },
            Self::Bad {
                place,
                expected,
                found,
            } => RecorderError::Damaged {
                path,
                place,
                expected,
                found,
            },
        }
    }
}

/// Calls `each` for every row, one at a time.
pub(crate) async fn each_row(
    query: sqlx::query::Query<'_, Sqlite, SqliteArguments>,
    conn: &mut SqliteConnection,
    mut each: impl FnMut(&SqliteRow) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let mut rows = query.fetch(conn);
    while let Some(row) = poll_fn(|context| rows.as_mut().poll_next(context)).await {
        each(&row?)?;
    }
    Ok(())
}

/// An integer column.
pub(crate) fn int(row: &SqliteRow, column: &str) -> Result<i64, Fault> {
    Ok(row.try_get(column)?)
}

/// An integer column that may be null.
pub(crate) fn opt_int(row: &SqliteRow, column: &str) -> Result<Option<i64>, Fault> {
    Ok(row.try_get(column)?)
}

/// An integer column that must fit `T`.
pub(crate) fn num<T: TryFrom<i64>>(row: &SqliteRow, column: &str) -> Result<T, Fault> {
    let value = int(row, column)?;
    T::try_from(value)
        .map_err(|_| Fault::bad(column, format!("a {}", std::any::type_name::<T>()), value))
}

/// An integer column that must fit `T` or be null.
pub(crate) fn opt_num<T: TryFrom<i64>>(row: &SqliteRow, column: &str) -> Result<Option<T>, Fault> {
    opt_int(row, column)?.map(|_| num(row, column)).transpose()
}

/// A real column.
pub(crate) fn real(row: &SqliteRow, column: &str) -> Result<f64, Fault> {
    Ok(row.try_get(column)?)
}

/// A real column that may be null.
pub(crate) fn opt_real(row: &SqliteRow, column: &str) -> Result<Option<f64>, Fault> {
    Ok(row.try_get(column)?)
}

/// Whether the file has this table; older schemas lack the later ones.
pub(crate) async fn has_table(conn: &mut SqliteConnection, name: &str) -> Result<bool, Fault> {
    let row =
        sqlx::query("SELECT count(*) AS n FROM sqlite_schema WHERE type = 'table' AND name = ?")
            .bind(name)
            .fetch_one(conn)
            .await?;
    Ok(int(&row, "n")? > 0)
}

/// A real column that may be null, and that older schemas lack.
pub(crate) fn real_if_present(row: &SqliteRow, column: &str) -> Result<Option<f64>, Fault> {
    match row.try_get(column) {
        Err(sqlx::Error::ColumnNotFound(_)) => Ok(None),
        other => Ok(other?),
    }
}

/// A text column that may be null, and that older schemas lack.
pub(crate) fn text_if_present(row: &SqliteRow, column: &str) -> Result<Option<String>, Fault> {
    match row.try_get(column) {
        Err(sqlx::Error::ColumnNotFound(_)) => Ok(None),
        other => Ok(other?),
    }
}

/// A text column.
pub(crate) fn text(row: &SqliteRow, column: &str) -> Result<String, Fault> {
    Ok(row.try_get(column)?)
}

/// A text column that may be null.
pub(crate) fn opt_text(row: &SqliteRow, column: &str) -> Result<Option<String>, Fault> {
    Ok(row.try_get(column)?)
}

/// A blob column.
pub(crate) fn blob(row: &SqliteRow, column: &str) -> Result<Vec<u8>, Fault> {
    Ok(row.try_get(column)?)
}

/// A blob column of 32 bytes.
pub(crate) fn sha(row: &SqliteRow, column: &str) -> Result<[u8; 32], Fault> {
    let bytes = blob(row, column)?;
    <[u8; 32]>::try_from(bytes.as_slice())
        .map_err(|_| Fault::bad(column, "32 bytes", format!("{} bytes", bytes.len())))
}

/// A text column with the name of one of `all`.
pub(crate) fn enum_value<T: Copy>(
    row: &SqliteRow,
    column: &str,
    all: &[T],
    name: impl Fn(T) -> &'static str,
) -> Result<T, Fault> {
    let found = text(row, column)?;
    all.iter()
        .copied()
        .find(|t| name(*t) == found)
        .ok_or_else(|| {
            let names: Vec<_> = all.iter().map(|t| name(*t)).collect();
            Fault::bad(
                column,
                format!("one of {}", names.join(", ")),
                format!("`{found}`"),
            )
        })
}

/// Schema version of the file.
pub(crate) async fn schema_version(conn: &mut SqliteConnection) -> Result<u32, Fault> {
    let version = sqlx::query("PRAGMA user_version").fetch_one(conn).await?;
    num(&version, "user_version")
}
