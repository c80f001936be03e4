//! Reading the journal: presses and attempts, commands, marks, notes and the end of the run.

use skinrig_model::{
    BoxReport, CheckKind, CheckVerdict, HostTime, Mark, MarkKind, MotionCommand, Notification,
    PlannedPress, Point3, PreflightCheck, PressId, PressOutcome, RunEnd, SentMark, TouchEstimate,
};

use super::SessionReader;
use crate::box_row::report_from;
use crate::cause::{EndColumns, end_from, interruption_from};
use crate::error::RecorderError;
use crate::from_row::{attempt_from, planned_from};
use crate::notification;
use crate::query::{self, enum_value, has_table, int, num, opt_text, real, text};
use crate::rows::{AttemptRow, CommandRow, InterruptionRow, NoteRow};
use crate::touch;

impl SessionReader {
    /// Every planned press in plan order, each with its attempts in order.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn presses(&self) -> Result<Vec<(PlannedPress, Vec<AttemptRow>)>, RecorderError> {
        const DOING: &str = "reading presses";
        let mut presses: Vec<(PlannedPress, Vec<AttemptRow>)> =
            self.query_all(DOING, "SELECT * FROM press ORDER BY id", |row| {
                Ok((planned_from(row)?, Vec::new()))
            })?;
        let attempts = self.query_all(
            DOING,
            "SELECT * FROM attempt ORDER BY press, number",
            attempt_from,
        )?;
        for attempt in attempts {
            match presses.binary_search_by_key(&attempt.id.press, |(planned, _)| planned.id) {
                Ok(at) => presses[at].1.push(attempt),
                Err(_) => {
                    let place = attempt.id.to_string();
                    return Err(self.damaged(place, "a planned press", "none".into()));
                }
            }
        }
        Ok(presses)
    }

    /// Outcome of the last attempt at each planned press, in plan order; `None` without a verdict. A missed press
    /// has an outcome with that verdict.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn last_outcomes(&self) -> Result<Vec<Option<PressOutcome>>, RecorderError> {
        let presses = self.presses()?;
        Ok(presses
            .into_iter()
            .map(|(_, mut attempts)| attempts.pop()?.outcome)
            .collect())
    }

    /// Checks before the run was armed, in order; empty in sessions of an older schema.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn preflight(&self) -> Result<Vec<PreflightCheck>, RecorderError> {
        const DOING: &str = "reading the preflight";
        if !self.query(DOING, async |conn| has_table(conn, "preflight").await)? {
            return Ok(Vec::new());
        }
        self.query_all(DOING, "SELECT * FROM preflight ORDER BY id", |row| {
            Ok(PreflightCheck {
                kind: CheckKind::Other,
                check: text(row, "name")?,
                expected: text(row, "expected")?,
                found: text(row, "found")?,
                verdict: enum_value(row, "verdict", &CheckVerdict::ALL, CheckVerdict::name)?,
                next_step: opt_text(row, "next_step")?.unwrap_or_default(),
            })
        })
    }

    /// Every motion command, in order.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn commands(&self) -> Result<Vec<CommandRow>, RecorderError> {
        self.query_all(
            "reading commands",
            "SELECT * FROM command ORDER BY id",
            |row| {
                Ok(CommandRow {
                    t: HostTime(int(row, "t_ns")?),
                    command: MotionCommand {
                        target: Point3::new(
                            real(row, "x_mm")?,
                            real(row, "y_mm")?,
                            real(row, "z_mm")?,
                        ),
                        speed_mm_s: real(row, "speed_mm_s")?,
                    },
                })
            },
        )
    }

    /// Marks that the trigger box sent, in order.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn marks_sent(&self) -> Result<Vec<SentMark>, RecorderError> {
        self.query_all("reading marks", "SELECT * FROM mark ORDER BY id", |row| {
            Ok(SentMark {
                mark: Mark {
                    kind: enum_value(row, "kind", &MarkKind::ALL, MarkKind::name)?,
                    press: PressId::from_index(num(row, "press")?),
                },
                t: HostTime(int(row, "t_ns")?),
                uncertainty_ns: int(row, "uncertainty_ns")?,
            })
        })
    }

    /// Reports of the trigger box on its own clock, in order, each with the host time of its arrival. Empty in
    /// sessions of schema 1.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn box_reports(&self) -> Result<Vec<(HostTime, BoxReport)>, RecorderError> {
        const DOING: &str = "reading box reports";
        if self.query(DOING, query::schema_version)? < 2 {
            return Ok(Vec::new());
        }
        self.query_all(DOING, "SELECT * FROM box_report ORDER BY id", report_from)
    }

    /// All deviations from the planned course, in order.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn interruptions(&self) -> Result<Vec<InterruptionRow>, RecorderError> {
        self.query_all(
            "reading interruptions",
            "SELECT * FROM interruption ORDER BY id",
            |row| {
                let (kind, reason) = interruption_from(row)?;
                Ok(InterruptionRow {
                    t: HostTime(int(row, "t_ns")?),
                    kind,
                    reason,
                })
            },
        )
    }

    /// All operator notes, in order.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn notes(&self) -> Result<Vec<NoteRow>, RecorderError> {
        self.query_all("reading notes", "SELECT * FROM note ORDER BY id", |row| {
            Ok(NoteRow {
                t: HostTime(int(row, "t_ns")?),
                text: text(row, "text")?,
            })
        })
    }

    /// Messages about the ends of all legs, in order; empty in sessions before schema 12.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn notifications(&self) -> Result<Vec<Notification>, RecorderError> {
        const DOING: &str = "reading notifications";
        if !self.query(DOING, async |conn| has_table(conn, "notification").await)? {
            return Ok(Vec::new());
        }
        let sql = "SELECT * FROM notification ORDER BY id";
        self.query_all(DOING, sql, notification::from_row)
    }

    /// Touches felt while the session was recorded, in order; empty in sessions before schema 13.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn touches(&self) -> Result<Vec<TouchEstimate>, RecorderError> {
        const DOING: &str = "reading touches";
        if !self.query(DOING, async |conn| has_table(conn, "touch").await)? {
            return Ok(Vec::new());
        }
        let sql = "SELECT * FROM touch ORDER BY id";
        self.query_all(DOING, sql, touch::from_row)
    }

    /// Time and kind of the run's end; `None` for a run in progress or a crashed one.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn end(&self) -> Result<Option<(HostTime, RunEnd)>, RecorderError> {
        let ends = self.query_all("reading its end", "SELECT * FROM run_end", |row| {
            let columns = EndColumns {
                status: "status",
                reason: "reason",
                cause: "cause",
            };
            Ok((HostTime(int(row, "t_ns")?), end_from(row, &columns)?))
        })?;
        Ok(ends.into_iter().next())
    }
}
