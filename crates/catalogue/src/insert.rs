//! Inserts of several rows by one statement.

use sqlx::Sqlite;
use sqlx::query::Query;
use sqlx::sqlite::SqliteArguments;

use crate::db::Db;
use crate::press::{PressEntry, camera_word};
use crate::value::Bound;

/// A statement that inserts up to `ROWS` rows.
pub(crate) struct Insert<const ROWS: usize> {
    columns: usize,
    sql: &'static str,
}

/// Inserts up to 4 rows: one statement takes much less time than one per row. Rows without a session are left out.
pub(crate) const DEVICES: Insert<4> = Insert {
    columns: 5,
    sql: "INSERT INTO device (session_id, role, model, serial, firmware)
         SELECT column1, column2, column3, column4, column5 FROM (VALUES
             ($1, $2, $3, $4, $5), ($6, $7, $8, $9, $10), ($11, $12, $13, $14, $15), ($16, $17, $18, $19, $20)) AS rows
         WHERE column1 IS NOT NULL",
};

/// Inserts up to 5 rows: one statement takes much less time than one per row. Rows without a session are left out.
pub(crate) const CLOCKS: Insert<5> = Insert {
    columns: 7,
    sql: "INSERT INTO clock_fit (session_id, analysis, map, drift_ppm, residual_rms_us, residual_max_us, n)
         SELECT column1, column2, column3, column4, column5, column6, column7 FROM (VALUES
             ($1, $2, $3, $4, $5, $6, $7), ($8, $9, $10, $11, $12, $13, $14), ($15, $16, $17, $18, $19, $20, $21),
             ($22, $23, $24, $25, $26, $27, $28), ($29, $30, $31, $32, $33, $34, $35)) AS rows
         WHERE column1 IS NOT NULL",
};

/// Inserts up to 8 rows: one statement takes much less time than one per row. Rows without a session are left out.
pub(crate) const PARAMETERS: Insert<8> = Insert {
    columns: 5,
    sql: "INSERT INTO calibration_value (session_id, analysis, parameter, value, standard_error)
         SELECT column1, column2, column3, column4, column5 FROM (VALUES
             ($1, $2, $3, $4, $5), ($6, $7, $8, $9, $10), ($11, $12, $13, $14, $15), ($16, $17, $18, $19, $20),
             ($21, $22, $23, $24, $25), ($26, $27, $28, $29, $30), ($31, $32, $33, $34, $35), ($36, $37, $38, $39, $40)) AS rows
         WHERE column1 IS NOT NULL",
};

/// Presses that one statement inserts into SQLite.
const PRESSES: usize = 64;
/// Values of a press.
const COLUMNS: usize = 18;

/// Placeholders of 1, 4, 16 and 64 presses.
macro_rules! press {
    (1) => {
        "(?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"
    };
    (4) => {
        concat!(press!(1), ",", press!(1), ",", press!(1), ",", press!(1))
    };
    (16) => {
        concat!(press!(4), ",", press!(4), ",", press!(4), ",", press!(4))
    };
    (64) => {
        concat!(
            press!(16),
            ",",
            press!(16),
            ",",
            press!(16),
            ",",
            press!(16)
        )
    };
}

/// Inserts up to [`PRESSES`] presses of a session into SQLite. Missing ones are left out.
const SOME_PRESSES: &str = concat!(
    "INSERT INTO press (session_id, press, role, location, repetition, planned_x_mm, planned_y_mm, planned_depth_mm,
         measured_x_mm, measured_y_mm, verdict, cause, camera, estimate_x_mm, estimate_y_mm, error_mm, region_major_mm,
         region_minor_mm, region_angle_deg)
     SELECT ?, * FROM (VALUES ",
    press!(64),
    ") AS rows WHERE column1 IS NOT NULL"
);

/// Inserts presses of a session into PostgreSQL: one statement for all, because each waits for the server.
#[cfg(feature = "postgres")]
const ALL_PRESSES: &str = "INSERT INTO press (session_id, press, role, location, repetition, planned_x_mm, planned_y_mm, planned_depth_mm,
         measured_x_mm, measured_y_mm, verdict, cause, camera, estimate_x_mm, estimate_y_mm, error_mm, region_major_mm,
         region_minor_mm, region_angle_deg)
     SELECT $1, * FROM UNNEST($2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19)";

/// The values of a column.
#[cfg(feature = "postgres")]
fn column<'a, T>(presses: &'a [PressEntry], value: impl FnMut(&'a PressEntry) -> T) -> Vec<T> {
    presses.iter().map(value).collect()
}

/// Adds the values of a press.
fn bind<'q>(
    to: Query<'q, Sqlite, SqliteArguments>,
    press: &'q PressEntry,
) -> Query<'q, Sqlite, SqliteArguments> {
    to.bind(press.press)
        .bind(press.role.name())
        .bind(press.location)
        .bind(press.repetition)
        .bind(press.planned_x_mm)
        .bind(press.planned_y_mm)
        .bind(press.planned_depth_mm)
        .bind(press.measured_x_mm)
        .bind(press.measured_y_mm)
        .bind(press.verdict.name())
        .bind(press.cause.as_deref())
        .bind(press.camera.map(camera_word))
        .bind(press.estimate_x_mm)
        .bind(press.estimate_y_mm)
        .bind(press.error_mm)
        .bind(press.region_major_mm)
        .bind(press.region_minor_mm)
        .bind(press.region_angle_deg)
}

/// Inserts the presses of a session.
pub(crate) async fn presses(
    db: &mut Db,
    session_id: &str,
    presses: &[PressEntry],
) -> Result<(), sqlx::Error> {
    match db {
        Db::Sqlite(conn) => {
            for some in presses.chunks(PRESSES) {
                let mut query = sqlx::query(SOME_PRESSES).bind(session_id);
                for press in some {
                    query = bind(query, press);
                }
                for _ in 0..(PRESSES - some.len()) * COLUMNS {
                    query = query.bind(None::<i64>);
                }
                query.execute(&mut *conn).await?;
            }
            Ok(())
        }
        #[cfg(feature = "postgres")]
        Db::Postgres(conn) => {
            let query = sqlx::query(ALL_PRESSES)
                .bind(session_id)
                .bind(column(presses, |p| i64::from(p.press)))
                .bind(column(presses, |p| p.role.name()))
                .bind(column(presses, |p| i64::from(p.location)))
                .bind(column(presses, |p| i64::from(p.repetition)))
                .bind(column(presses, |p| p.planned_x_mm))
                .bind(column(presses, |p| p.planned_y_mm))
                .bind(column(presses, |p| p.planned_depth_mm))
                .bind(column(presses, |p| p.measured_x_mm))
                .bind(column(presses, |p| p.measured_y_mm))
                .bind(column(presses, |p| p.verdict.name()))
                .bind(column(presses, |p| p.cause.as_deref()))
                .bind(column(presses, |p| p.camera.map(camera_word)))
                .bind(column(presses, |p| p.estimate_x_mm))
                .bind(column(presses, |p| p.estimate_y_mm))
                .bind(column(presses, |p| p.error_mm))
                .bind(column(presses, |p| p.region_major_mm))
                .bind(column(presses, |p| p.region_minor_mm))
                .bind(column(presses, |p| p.region_angle_deg));
            query.execute(conn).await.map(drop)
        }
    }
}

impl<const ROWS: usize> Insert<ROWS> {
    /// Inserts all `rows`.
    pub(crate) async fn all<const COLUMNS: usize>(
        &self,
        db: &mut Db,
        rows: impl IntoIterator<Item = [Bound; COLUMNS]>,
    ) -> Result<(), sqlx::Error> {
        let rows: Vec<[Bound; COLUMNS]> = rows.into_iter().collect();
        for some in rows.chunks(ROWS) {
            let missing = some.first().map(|row| row.each_ref().map(Bound::missing));
            let missing = missing.into_iter().cycle().take(ROWS - some.len());
            let values: Vec<Bound> = some.iter().cloned().chain(missing).flatten().collect();
            debug_assert_eq!(values.len(), ROWS * self.columns);
            db.execute(self.sql, &values).await?;
        }
        Ok(())
    }
}
