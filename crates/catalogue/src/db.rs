//! One connection to either database: the same statements, with parameters `$1`, `$2`, ... and plain values as rows.

use sqlx::sqlite::{SqliteConnection, SqliteRow};
use sqlx::{Column, Connection, Row, TypeInfo, ValueRef};

#[cfg(feature = "postgres")]
use sqlx::postgres::{PgConnection, PgRow};

use crate::value::{Bound, Value};

/// A connection.
#[derive(Debug)]
pub(crate) enum Db {
    Sqlite(SqliteConnection),
    #[cfg(feature = "postgres")]
    Postgres(PgConnection),
}

/// Rows of a query.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rows {
    pub columns: Vec<String>,
    pub rows: Vec<Vec<Value>>,
}

/// Builds a query with its parameters, for either database.
macro_rules! query {
    ($sql:expr, $parameters:expr) => {{
        let mut query = sqlx::query($sql);
        for parameter in $parameters {
            query = match parameter {
                Bound::Integer(value) => query.bind(*value),
                Bound::Real(value) => query.bind(*value),
                Bound::Text(value) => query.bind(value.clone()),
            };
        }
        query
    }};
}

impl Db {
    /// Executes a statement; returns how many rows it changed.
    pub(crate) async fn execute(
        &mut self,
        sql: &'static str,
        parameters: &[Bound],
    ) -> Result<u64, sqlx::Error> {
        match self {
            Self::Sqlite(conn) => {
                let done = query!(sql, parameters).execute(conn).await?;
                Ok(done.rows_affected())
            }
            #[cfg(feature = "postgres")]
            Self::Postgres(conn) => {
                let done = query!(sql, parameters).execute(conn).await?;
                Ok(done.rows_affected())
            }
        }
    }

    /// All rows of a query.
    pub(crate) async fn fetch(
        &mut self,
        sql: &'static str,
        parameters: &[Bound],
    ) -> Result<Rows, sqlx::Error> {
        match self {
            Self::Sqlite(conn) => {
                let rows = query!(sql, parameters).fetch_all(conn).await?;
                Ok(Rows {
                    columns: rows.first().map(column_names).unwrap_or_default(),
                    rows: rows.iter().map(sqlite_row).collect::<Result<_, _>>()?,
                })
            }
            #[cfg(feature = "postgres")]
            Self::Postgres(conn) => {
                let rows = query!(sql, parameters).fetch_all(conn).await?;
                Ok(Rows {
                    columns: rows.first().map(column_names).unwrap_or_default(),
                    rows: rows.iter().map(postgres_row).collect::<Result<_, _>>()?,
                })
            }
        }
    }

    /// Closes the connection.
    pub(crate) async fn close(self) -> Result<(), sqlx::Error> {
        match self {
            Self::Sqlite(conn) => conn.close().await,
            #[cfg(feature = "postgres")]
            Self::Postgres(conn) => conn.close().await,
        }
    }

    /// Starts a transaction. In SQLite it excludes other writers from the first statement on, so that it cannot fail halfway.
    pub(crate) async fn begin(&mut self) -> Result<(), sqlx::Error> {
        let sql = match self {
            Self::Sqlite(_) => "BEGIN IMMEDIATE",
            #[cfg(feature = "postgres")]
            Self::Postgres(_) => "BEGIN",
        };
        self.execute(sql, &[]).await.map(drop)
    }

    /// Ends a transaction: commits it if `result` is `Ok`, takes it back otherwise.
    pub(crate) async fn end<T, E: From<sqlx::Error>>(
        &mut self,
        result: Result<T, E>,
    ) -> Result<T, E> {
        match result {
            Ok(value) => {
                self.execute("COMMIT", &[]).await?;
                Ok(value)
            }
            Err(error) => {
                // The first error counts; without a connection there is nothing to take back.
                let _ = self.execute("ROLLBACK", &[]).await;
                Err(error)
            }
        }
    }

    /// Inside a transaction: waits until no other transaction registers the same session or folder. SQLite has one writer anyway.
    pub(crate) async fn lock(&mut self, key: &str) -> Result<(), sqlx::Error> {
        match self {
            Self::Sqlite(_) => {
                let _ = key;
                Ok(())
            }
            #[cfg(feature = "postgres")]
            Self::Postgres(_) => {
                let sql = "SELECT CAST(pg_advisory_xact_lock(hashtextextended($1, 0)) AS TEXT)";
                self.execute(sql, &[key.into()]).await.map(drop)
            }
        }
    }
}

fn column_names<R: Row>(row: &R) -> Vec<String> {
    let names = row.columns().iter().map(Column::name);
    names.map(str::to_owned).collect()
}

fn sqlite_row(row: &SqliteRow) -> Result<Vec<Value>, sqlx::Error> {
    let value = |at: usize| {
        let raw = row.try_get_raw(at)?;
        if raw.is_null() {
            return Ok(Value::Null);
        }
        match raw.type_info().name() {
            "INTEGER" => row.try_get(at).map(Value::Integer),
            "REAL" => row.try_get(at).map(Value::Real),
            _ => row.try_get(at).map(Value::Text),
        }
    };
    (0..row.len()).map(value).collect()
}

#[cfg(feature = "postgres")]
fn postgres_row(row: &PgRow) -> Result<Vec<Value>, sqlx::Error> {
    let value = |at: usize| {
        let raw = row.try_get_raw(at)?;
        if raw.is_null() {
            return Ok(Value::Null);
        }
        match raw.type_info().name() {
            "INT8" => row.try_get(at).map(Value::Integer),
            "INT4" => row.try_get::<i32, _>(at).map(|v| Value::Integer(v.into())),
            "BOOL" => row.try_get::<bool, _>(at).map(|v| Value::Integer(v.into())),
            "FLOAT8" => row.try_get(at).map(Value::Real),
            _ => row.try_get(at).map(Value::Text),
        }
    };
    (0..row.len()).map(value).collect()
}
