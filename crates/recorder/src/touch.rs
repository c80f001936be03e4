//! Rows of table `touch`: touches felt while the session was recorded.

use skinrig_model::{
    AttemptId, HostTime, PressId, TouchDepth, TouchEstimate, TouchKind, TouchRegion,
};
use sqlx::Row;
use sqlx::sqlite::{SqliteConnection, SqliteRow};

use crate::query::{Fault, enum_value, int, opt_num, opt_real};

/// Inserts an estimate.
pub(crate) async fn insert(
    conn: &mut SqliteConnection,
    estimate: &TouchEstimate,
) -> Result<(), Fault> {
    let region = estimate.region;
    let numbers = [
        estimate.at_mm.map(|at| at[0]),
        estimate.at_mm.map(|at| at[1]),
        region.map(|r| r.semi_axes_mm[0]),
        region.map(|r| r.semi_axes_mm[1]),
        region.map(|r| r.angle_deg),
        estimate.llr,
        estimate.depth.map(|d| d.mm),
        estimate.depth.map(|d| d.within_mm),
    ];
    if let Some(bad) = numbers.iter().flatten().find(|v| !v.is_finite()) {
        return Err(Fault::bad("a touch", "finite values", bad));
    }
    sqlx::query(
        "INSERT INTO touch (t_ns, until_ns, until_sd_ns, kind, press, attempt, x_mm, y_mm, major_mm, minor_mm, angle_deg, llr,
         depth_mm, depth_within_mm) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(estimate.t.0)
    .bind(estimate.until.0)
    .bind(estimate.until_sd_ns)
    .bind(estimate.kind.name())
    .bind(estimate.attempt.map(|a| a.press.index()))
    .bind(estimate.attempt.map(|a| a.number))
    .bind(numbers[0])
    .bind(numbers[1])
    .bind(numbers[2])
    .bind(numbers[3])
    .bind(numbers[4])
    .bind(numbers[5])
    .bind(numbers[6])
    .bind(numbers[7])
    .execute(conn)
    .await?;
    Ok(())
}

/// Depth in a row; schema 13 has none.
fn depth(row: &SqliteRow) -> Result<Option<TouchDepth>, Fault> {
    let value = |column: &str| match row.try_get(column) {
        Err(sqlx::Error::ColumnNotFound(_)) => Ok(None),
        found => found.map_err(Fault::from),
    };
    let depth = value("depth_mm")?.zip(value("depth_within_mm")?);
    Ok(depth.map(|(mm, within_mm)| TouchDepth { mm, within_mm }))
}

/// The estimate of a row.
pub(crate) fn from_row(row: &SqliteRow) -> Result<TouchEstimate, Fault> {
    let press: Option<u32> = opt_num(row, "press")?;
    let attempt = press.zip(opt_num(row, "attempt")?);
    let at = opt_real(row, "x_mm")?.zip(opt_real(row, "y_mm")?);
    let axes = opt_real(row, "major_mm")?.zip(opt_real(row, "minor_mm")?);
    let region = axes.zip(opt_real(row, "angle_deg")?);
    Ok(TouchEstimate {
        t: HostTime(int(row, "t_ns")?),
        until: HostTime(int(row, "until_ns")?),
        until_sd_ns: int(row, "until_sd_ns")?,
        kind: enum_value(row, "kind", TouchKind::ALL, TouchKind::name)?,
        attempt: attempt.map(|(press, number)| AttemptId {
            press: PressId::from_index(press),
            number,
        }),
        at_mm: at.map(|(x, y)| [x, y]),
        region: region.map(|((major, minor), angle_deg)| TouchRegion {
            semi_axes_mm: [major, minor],
            angle_deg,
        }),
        depth: depth(row)?,
        llr: opt_real(row, "llr")?,
    })
}
