//! Rows of table `notification`: messages about the run.

use skinrig_model::{Notification, NotificationChannel, Occasion};
use sqlx::sqlite::{SqliteConnection, SqliteRow};

use crate::cause;
use crate::query::{Fault, enum_value, num, text};

/// Inserts the row of a message about the end of a leg.
pub(crate) async fn insert(
    conn: &mut SqliteConnection,
    leg: u32,
    notification: &Notification,
) -> Result<(), Fault> {
    let fault = notification.fault.as_ref();
    let json = fault.map(|f| cause::json("notification", f)).transpose()?;
    sqlx::query(
        "INSERT INTO notification (leg, channel, occasion, subject, raised_at, ended_at, tries, reason, cause)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(leg)
    .bind(notification.channel.name())
    .bind(notification.occasion.name())
    .bind(&notification.subject)
    .bind(&notification.raised_at)
    .bind(&notification.ended_at)
    .bind(notification.tries)
    .bind(fault.map(ToString::to_string))
    .bind(json)
    .execute(conn)
    .await?;
    Ok(())
}

/// The message of a row.
pub(crate) fn from_row(row: &SqliteRow) -> Result<Notification, Fault> {
    Ok(Notification {
        channel: enum_value(
            row,
            "channel",
            &NotificationChannel::ALL,
            NotificationChannel::name,
        )?,
        occasion: enum_value(row, "occasion", Occasion::ALL, Occasion::name)?,
        subject: text(row, "subject")?,
        raised_at: text(row, "raised_at")?,
        ended_at: text(row, "ended_at")?,
        tries: num(row, "tries")?,
        fault: cause::cause_from(row, "cause")?,
    })
}
