//! Rows of records that need no state of the journal.

use skinrig_model::{
    AttemptId, DeviceIdentity, DeviceRole, HostTime, InterruptionKind, InterruptionReason,
    MissedReason, MotionCommand, RunEnd, SentMark, Setting,
};
use sqlx::sqlite::SqliteConnection;

use crate::cause;
use crate::query::Fault;

pub(crate) async fn device(
    conn: &mut SqliteConnection,
    role: DeviceRole,
    identity: DeviceIdentity,
    settings: Vec<Setting>,
) -> Result<(), Fault> {
    let id = sqlx::query("INSERT INTO device (role, model, serial, firmware) VALUES (?, ?, ?, ?)")
        .bind(role.name())
        .bind(identity.model)
        .bind(identity.serial)
        .bind(identity.firmware)
        .execute(&mut *conn)
        .await?
        .last_insert_rowid();
    for (position, setting) in (0i64..).zip(settings) {
        sqlx::query(
            "INSERT INTO setting (device, position, name, requested, read_back)
             VALUES (?, ?, ?, ?, ?)",
        )
        .bind(id)
        .bind(position)
        .bind(setting.name)
        .bind(setting.requested)
        .bind(setting.read_back)
        .execute(&mut *conn)
        .await?;
    }
    Ok(())
}

pub(crate) async fn intent(
    conn: &mut SqliteConnection,
    leg: u32,
    attempt: AttemptId,
    t: HostTime,
) -> Result<(), Fault> {
    sqlx::query(
        "INSERT INTO attempt (press, number, previous, intent_ns, leg) VALUES (?, ?, ?, ?, ?)",
    )
    .bind(attempt.press.index())
    .bind(attempt.number)
    .bind(previous(attempt.number))
    .bind(t.0)
    .bind(leg)
    .execute(&mut *conn)
    .await?;
    Ok(())
}

pub(crate) async fn command(
    conn: &mut SqliteConnection,
    t: HostTime,
    command: &MotionCommand,
) -> Result<(), Fault> {
    let [x, y, z] = command.target.to_array();
    for value in [x, y, z, command.speed_mm_s] {
        finite("a motion command", value)?;
    }
    sqlx::query("INSERT INTO command (t_ns, x_mm, y_mm, z_mm, speed_mm_s) VALUES (?, ?, ?, ?, ?)")
        .bind(t.0)
        .bind(x)
        .bind(y)
        .bind(z)
        .bind(command.speed_mm_s)
        .execute(&mut *conn)
        .await?;
    Ok(())
}

pub(crate) async fn mark(conn: &mut SqliteConnection, mark: &SentMark) -> Result<(), Fault> {
    sqlx::query("INSERT INTO mark (t_ns, kind, press, uncertainty_ns) VALUES (?, ?, ?, ?)")
        .bind(mark.t.0)
        .bind(mark.mark.kind.name())
        .bind(mark.mark.press.index())
        .bind(mark.uncertainty_ns)
        .execute(&mut *conn)
        .await?;
    Ok(())
}

pub(crate) async fn missed(
    conn: &mut SqliteConnection,
    leg: u32,
    attempt: AttemptId,
    reason: &MissedReason,
) -> Result<(), Fault> {
    sqlx::query(
        "INSERT INTO attempt (press, number, previous, verdict, reason, cause, scheduled, leg)
         VALUES (?, ?, ?, 'missed', ?, ?, 0, ?)",
    )
    .bind(attempt.press.index())
    .bind(attempt.number)
    .bind(previous(attempt.number))
    .bind(reason.to_string())
    .bind(cause::json("attempt", reason)?)
    .bind(leg)
    .execute(&mut *conn)
    .await?;
    Ok(())
}

pub(crate) async fn interruption(
    conn: &mut SqliteConnection,
    kind: InterruptionKind,
    t: HostTime,
    reason: &InterruptionReason,
) -> Result<(), Fault> {
    sqlx::query("INSERT INTO interruption (t_ns, kind, reason, cause) VALUES (?, ?, ?, ?)")
        .bind(t.0)
        .bind(kind.name())
        .bind(reason.to_string())
        .bind(cause::json("interruption", reason)?)
        .execute(&mut *conn)
        .await?;
    Ok(())
}

pub(crate) async fn note(
    conn: &mut SqliteConnection,
    t: HostTime,
    text: &str,
) -> Result<(), Fault> {
    sqlx::query("INSERT INTO note (t_ns, text) VALUES (?, ?)")
        .bind(t.0)
        .bind(text)
        .execute(&mut *conn)
        .await?;
    Ok(())
}

pub(crate) async fn ended(
    conn: &mut SqliteConnection,
    t: HostTime,
    end: &RunEnd,
) -> Result<(), Fault> {
    sqlx::query("INSERT INTO run_end (id, t_ns, status, reason, cause) VALUES (1, ?, ?, ?, ?)")
        .bind(t.0)
        .bind(end.name())
        .bind(end.reason())
        .bind(cause::json_of("run_end", end.cause())?)
        .execute(&mut *conn)
        .await?;
    Ok(())
}

/// Number of the attempt before; `None` for the first.
fn previous(number: u32) -> Option<u32> {
    number.checked_sub(1).filter(|n| *n > 0)
}

/// Rejects NaN, which SQLite would silently store as null, and infinity.
pub(crate) fn finite(place: impl ToString, value: f64) -> Result<(), Fault> {
    if value.is_finite() {
        Ok(())
    } else {
        Err(Fault::bad(place, "a finite number", value))
    }
}
