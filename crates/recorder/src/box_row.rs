//! Conversion between reports of the trigger box and rows of `box_report`.

use skinrig_model::{BoxReport, BoxTime, HostTime, Mark, MarkKind, PressId};
use sqlx::sqlite::SqliteRow;

use crate::query::{Fault, enum_value, int, num, text};

/// The columns; `None` where a report has no such value.
#[derive(Debug, Default)]
pub(crate) struct BoxRow {
    pub taken_ns: i64,
    pub what: &'static str,
    pub box_us: Option<i64>,
    pub sent_ns: Option<i64>,
    pub received_ns: Option<i64>,
    pub kind: Option<&'static str>,
    pub press: Option<u32>,
    pub count: Option<u32>,
    pub rising: Option<bool>,
}

impl BoxRow {
    /// Columns of a report received at `taken`.
    pub(crate) fn of(taken: HostTime, report: BoxReport) -> Result<Self, Fault> {
        let us = |at: BoxTime| {
            let fits = i64::try_from(at.us);
            fits.map(Some)
                .map_err(|_| Fault::bad("box report", "a time below 2^63 µs", at.us))
        };
        let empty = Self {
            taken_ns: taken.0,
            ..Self::default()
        };
        Ok(match report {
            BoxReport::Exchange { sent, received, at } => Self {
                what: "exchange",
                box_us: us(at)?,
                sent_ns: Some(sent.0),
                received_ns: Some(received.0),
                ..empty
            },
            BoxReport::Mark { mark, at } => Self {
                what: "mark",
                box_us: us(at)?,
                kind: Some(mark.kind.name()),
                press: Some(mark.press.index()),
                ..empty
            },
            BoxReport::Sync { count, at } => Self {
                what: "sync",
                box_us: us(at)?,
                count: Some(count),
                ..empty
            },
            BoxReport::Input { rising, at } => Self {
                what: "input",
                box_us: us(at)?,
                rising: Some(rising),
                ..empty
            },
            BoxReport::Reset { noticed } => Self {
                what: "reset",
                received_ns: Some(noticed.0),
                ..empty
            },
        })
    }
}

/// Host time at which a report was received, and the report.
pub(crate) fn report_from(row: &SqliteRow) -> Result<(HostTime, BoxReport), Fault> {
    let at = || {
        Ok::<_, Fault>(BoxTime {
            us: num(row, "box_us")?,
        })
    };
    let host = |column: &str| int(row, column).map(HostTime);
    let report = match text(row, "what")?.as_str() {
        "exchange" => BoxReport::Exchange {
            sent: host("sent_ns")?,
            received: host("received_ns")?,
            at: at()?,
        },
        "mark" => BoxReport::Mark {
            mark: Mark {
                kind: enum_value(row, "kind", &MarkKind::ALL, MarkKind::name)?,
                press: PressId::from_index(num(row, "press")?),
            },
            at: at()?,
        },
        "sync" => BoxReport::Sync {
            count: num(row, "count")?,
            at: at()?,
        },
        "input" => BoxReport::Input {
            rising: int(row, "rising")? != 0,
            at: at()?,
        },
        "reset" => BoxReport::Reset {
            noticed: host("received_ns")?,
        },
        other => {
            return Err(Fault::bad(
                "box_report",
                "exchange, mark, sync, input or reset",
                other,
            ));
        }
    };
    Ok((host("taken_ns")?, report))
}
