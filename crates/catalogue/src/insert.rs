//! Inserts of several rows by one statement.

use crate::db::Db;
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
