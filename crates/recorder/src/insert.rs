//! Writes records as rows, and decides when to commit.

use std::path::PathBuf;
use std::time::Instant;

use sha2::{Digest, Sha256};
use skinrig_model::{
    BoxReport, HostTime, PlannedPress, PoseSample, PreflightCheck, PressId, PressOutcome,
    PressVerdict, Record, RunHeader,
};
use sqlx::sqlite::SqliteConnection;

use crate::cause;
use crate::pose;
use crate::prepared::{PreparedChunk, PreparedRecord};
use crate::query::Fault;
use crate::record_rows::{self, finite};
use crate::rows::SessionTotals;
use crate::{notification, touch};

/// Uncommitted bytes that trigger a commit.
const COMMIT_BYTES: usize = 8 << 20;
/// Uncommitted records that trigger a commit.
const COMMIT_RECORDS: usize = 4096;
/// Most samples in one pose block.
const BLOCK_SAMPLES: usize = 4096;

/// The journal of a session file, open for writing.
pub(crate) struct Journal {
    pub path: PathBuf,
    pub conn: SqliteConnection,
    /// Number of the current leg.
    leg: u32,
    poses: Vec<u8>,
    pose_span: Option<(HostTime, HostTime)>,
    opened: Option<Instant>,
    pending_bytes: usize,
    pending_records: usize,
}

impl Journal {
    pub(crate) fn new(path: PathBuf, conn: SqliteConnection, leg: u32) -> Self {
        Self {
            path,
            conn,
            leg,
            poses: Vec::new(),
            pose_span: None,
            opened: None,
            pending_bytes: 0,
            pending_records: 0,
        }
    }

    /// Start of the current transaction; `None` if nothing was written since the last commit.
    pub(crate) const fn opened(&self) -> Option<Instant> {
        self.opened
    }

    /// True if the size of the current transaction requires a commit.
    pub(crate) const fn commit_due(&self) -> bool {
        self.pending_bytes >= COMMIT_BYTES || self.pending_records >= COMMIT_RECORDS
    }

    /// Commits, so that everything written so far is durable.
    pub(crate) async fn commit(&mut self) -> Result<(), Fault> {
        self.flush_poses().await?;
        if self.opened.is_some() {
            sqlx::query("COMMIT").execute(&mut self.conn).await?;
            self.opened = None;
        }
        self.pending_bytes = 0;
        self.pending_records = 0;
        Ok(())
    }

    /// Writes one record in the current transaction.
    pub(crate) async fn write(&mut self, ready: PreparedRecord, bytes: usize) -> Result<(), Fault> {
        if self.opened.is_none() {
            sqlx::query("BEGIN IMMEDIATE")
                .execute(&mut self.conn)
                .await?;
            self.opened = Some(Instant::now());
        }
        self.pending_bytes += bytes;
        self.pending_records += 1;
        let record = match ready {
            PreparedRecord::Chunk(chunk) => return self.chunk(*chunk).await,
            PreparedRecord::Record(record) => record,
        };
        match record {
            Record::Started(header) => self.started(&header).await,
            Record::Device {
                role,
                identity,
                settings,
            } => record_rows::device(&mut self.conn, role, identity, settings).await,
            Record::Preflight(checks) => self.preflight(&checks).await,
            // `resume` writes this record before it opens the journal of the leg.
            Record::Resumed(_) => Err(Fault::bad(
                "record",
                "a record within a leg",
                "the header of a leg",
            )),
            Record::Intent { attempt, t } => {
                record_rows::intent(&mut self.conn, self.leg, attempt, t).await
            }
            Record::Command { t, command } => {
                record_rows::command(&mut self.conn, t, &command).await
            }
            Record::Poses(samples) => self.poses(&samples).await,
            Record::MarkSent(mark) => record_rows::mark(&mut self.conn, &mark).await,
            Record::BoxReports { t, reports } => {
                for report in reports {
                    self.box_report(t, report).await?;
                }
                Ok(())
            }
            Record::Chunk(chunk) => {
                let place = format!("{} chunk {}", chunk.camera, chunk.seq);
                Err(Fault::bad(place, "a prepared chunk", "an unprepared one"))
            }
            Record::Outcome(outcome) => self.outcome(&outcome).await,
            Record::Missed(attempt, reason) => {
                record_rows::missed(&mut self.conn, self.leg, attempt, &reason).await
            }
            Record::Interruption { kind, t, reason } => {
                record_rows::interruption(&mut self.conn, kind, t, &reason).await
            }
            Record::Note { t, text } => record_rows::note(&mut self.conn, t, &text).await,
            Record::Touch(it) => touch::insert(&mut self.conn, &it).await,
            Record::Notification(it) => notification::insert(&mut self.conn, self.leg, &it).await,
            Record::Ended { t, end } => record_rows::ended(&mut self.conn, t, &end).await,
        }
    }

    async fn started(&mut self, header: &RunHeader) -> Result<(), Fault> {
        let overrides = serde_json::to_string(&header.overrides)
            .map_err(|e| Fault::bad("overrides", "text", e))?;
        sqlx::query(
            "INSERT INTO session (id, session_id, protocol_text, protocol_name, protocol_sha256,
               overrides_json, plan_json, plan_sha256, seed, rig_kind, rig_name, rig_json, stream_format_1,
               stream_format_2, prototype, operator, started_at, host, software, command_line)
             VALUES (1, lower(hex(randomblob(16))), ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        )
        .bind(&header.protocol_text)
        .bind(&header.protocol_name)
        .bind(&header.protocol_sha256)
        .bind(overrides)
        .bind(&header.plan_json)
        .bind(&header.plan_sha256)
        .bind(header.seed.to_string())
        .bind(&header.rig_kind)
        .bind(&header.rig_name)
        .bind(&header.rig_json)
        .bind(header.stream_formats[0].name())
        .bind(header.stream_formats[1].name())
        .bind(&header.prototype)
        .bind(&header.operator)
        .bind(&header.started_at)
        .bind(&header.host)
        .bind(&header.software)
        .bind(&header.command_line)
        .execute(&mut self.conn)
        .await?;
        let transform = &header.robot_from_skin;
        for (axis, (r, t)) in (0i64..).zip(transform.rotation.iter().zip(&transform.translation_mm))
        {
            for value in r.iter().chain([t]) {
                finite("robot_from_skin", *value)?;
            }
            sqlx::query(
                "INSERT INTO robot_from_skin (axis, r_x, r_y, r_z, t_mm) VALUES (?, ?, ?, ?, ?)",
            )
            .bind(axis)
            .bind(r[0])
            .bind(r[1])
            .bind(r[2])
            .bind(t)
            .execute(&mut self.conn)
            .await?;
        }
        for press in &header.presses {
            self.press(press).await?;
        }
        Ok(())
    }

    async fn preflight(&mut self, checks: &[PreflightCheck]) -> Result<(), Fault> {
        for check in checks {
            sqlx::query(
                "INSERT INTO preflight (name, expected, found, verdict, next_step)
                 VALUES (?, ?, ?, ?, ?)",
            )
            .bind(&check.check)
            .bind(&check.expected)
            .bind(&check.found)
            .bind(check.verdict.name())
            .bind(check.failed().then_some(&check.next_step))
            .execute(&mut self.conn)
            .await?;
        }
        Ok(())
    }

    async fn press(&mut self, press: &PlannedPress) -> Result<(), Fault> {
        for value in [press.at.x_mm, press.at.y_mm, press.depth_mm] {
            finite(press.id, value)?;
        }
        sqlx::query(
            "INSERT INTO press (id, role, repetition, location, x_mm, y_mm, depth_mm)
             VALUES (?, ?, ?, ?, ?, ?, ?)",
        )
        .bind(press.id.index())
        .bind(press.role.name())
        .bind(press.repetition.index())
        .bind(press.location.index())
        .bind(press.at.x_mm)
        .bind(press.at.y_mm)
        .bind(press.depth_mm)
        .execute(&mut self.conn)
        .await?;
        Ok(())
    }

    async fn outcome(&mut self, outcome: &PressOutcome) -> Result<(), Fault> {
        let id = outcome.attempt;
        if matches!(outcome.verdict, PressVerdict::Missed(_)) {
            return Err(Fault::bad(
                id,
                "valid, invalid or excluded for a press that was attempted",
                "missed",
            ));
        }
        let at = outcome.measured_at;
        let numbers = [
            at.map(|p| p.x_mm),
            at.map(|p| p.y_mm),
            outcome.measured_depth_mm,
            outcome.touched_mm,
            outcome.peak_force_n,
        ];
        for value in numbers.into_iter().flatten() {
            finite(id, value)?;
        }
        let mut update = sqlx::query(
            "UPDATE attempt SET verdict = ?, reason = ?, scheduled = ?, approach_ns = ?, contact_ns = ?,
               at_depth_ns = ?, retract_ns = ?, release_ns = ?, clear_ns = ?, measured_x_mm = ?,
               measured_y_mm = ?, measured_depth_mm = ?, touched_mm = ?, peak_force_n = ?, faults = ?, cause = ?
             WHERE press = ? AND number = ? AND verdict IS NULL",
        )
        .bind(outcome.verdict.name())
        .bind(outcome.verdict.reason())
        .bind(outcome.scheduled);
        let t = outcome.timing;
        for moment in [
            t.map(|t| t.approach.0),
            t.map(|t| t.contact.0),
            t.map(|t| t.at_depth.0),
            t.map(|t| t.retract.0),
            t.map(|t| t.release.0),
            t.map(|t| t.clear.0),
        ] {
            update = update.bind(moment);
        }
        for number in numbers {
            update = update.bind(number);
        }
        let kinds = outcome.verdict.fault_kinds();
        let faults: Vec<&str> = kinds.iter().map(|kind| kind.name()).collect();
        let rows = update
            .bind((!faults.is_empty()).then(|| faults.join(" ")))
            .bind(cause::json_of("attempt", outcome.verdict.cause())?)
            .bind(id.press.index())
            .bind(id.number)
            .execute(&mut self.conn)
            .await?
            .rows_affected();
        if rows != 1 {
            return Err(Fault::bad(
                id,
                "one intent without a verdict before the outcome",
                "none",
            ));
        }
        Ok(())
    }

    async fn poses(&mut self, samples: &[PoseSample]) -> Result<(), Fault> {
        for sample in samples {
            match &mut self.pose_span {
                Some((_, last)) if sample.t < *last => {
                    return Err(Fault::bad(
                        "pose stream",
                        format!("times from {last}"),
                        sample.t,
                    ));
                }
                Some((_, last)) => *last = sample.t,
                none => *none = Some((sample.t, sample.t)),
            }
            if self.poses.is_empty()
                && let Some((first, _)) = &mut self.pose_span
            {
                *first = sample.t;
            }
            pose::encode(sample, &mut self.poses);
            if self.poses.len() >= BLOCK_SAMPLES * pose::SAMPLE_BYTES {
                self.flush_poses().await?;
            }
        }
        Ok(())
    }

    async fn box_report(&mut self, taken: HostTime, report: BoxReport) -> Result<(), Fault> {
        let row = crate::box_row::BoxRow::of(taken, report)?;
        sqlx::query(
            "INSERT INTO box_report (taken_ns, what, box_us, sent_ns, received_ns, kind, press, count, rising)
             VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
        )
        .bind(row.taken_ns)
        .bind(row.what)
        .bind(row.box_us)
        .bind(row.sent_ns)
        .bind(row.received_ns)
        .bind(row.kind)
        .bind(row.press)
        .bind(row.count)
        .bind(row.rising)
        .execute(&mut self.conn)
        .await?;
        Ok(())
    }

    async fn flush_poses(&mut self) -> Result<(), Fault> {
        let Some((first, last)) = self.pose_span else {
            return Ok(());
        };
        if self.poses.is_empty() {
            return Ok(());
        }
        let data = std::mem::take(&mut self.poses);
        sqlx::query(
            "INSERT INTO pose_block (first_ns, last_ns, samples, sha256, data) VALUES (?, ?, ?, ?, ?)",
        )
        .bind(first.0)
        .bind(last.0)
        .bind((data.len() / pose::SAMPLE_BYTES) as i64)
        .bind(Sha256::digest(&data).as_slice())
        .bind(data.as_slice())
        .execute(&mut self.conn)
        .await?;
        self.poses = data;
        self.poses.clear();
        Ok(())
    }

    async fn chunk(&mut self, chunk: PreparedChunk) -> Result<(), Fault> {
        let camera = chunk.camera;
        sqlx::query(
            "INSERT INTO chunk (camera, seq, host_ns, lost_before, codec, raw_bytes, raw_crc32,
               stored_sha256, first_us, last_us, cd_events, on_events, trigger_edges, stored)
             VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        )
        .bind(camera.number())
        .bind(chunk.seq)
        .bind(chunk.host_time.0)
        .bind(chunk.lost_before)
        .bind(chunk.codec.name())
        .bind(chunk.raw_bytes)
        .bind(chunk.raw_crc32)
        .bind(chunk.stored_sha256.as_slice())
        .bind(chunk.first_us)
        .bind(chunk.last_us)
        .bind(chunk.cd_events)
        .bind(chunk.on_events)
        .bind(chunk.trigger_edges)
        .bind(chunk.stored)
        .execute(&mut self.conn)
        .await?;
        if let Some(gap) = chunk.gap {
            sqlx::query("INSERT INTO gap (camera, seq, from_us, to_us) VALUES (?, ?, ?, ?)")
                .bind(camera.number())
                .bind(chunk.seq)
                .bind(gap.from_us)
                .bind(gap.to_us)
                .execute(&mut self.conn)
                .await?;
        }
        if let Some(seq) = chunk.ends_gaps_from {
            sqlx::query("UPDATE gap SET to_us = ? WHERE camera = ? AND seq >= ? AND to_us IS NULL")
                .bind(chunk.first_us)
                .bind(camera.number())
                .bind(seq)
                .execute(&mut self.conn)
                .await?;
        }
        let Some(edges) = chunk.edges_json else {
            return Ok(());
        };
        // One statement for all edges: one per edge would cost more than everything else together.
        sqlx::query(
            "INSERT INTO trigger_edge (camera, seq, position, t_us, channel, rising)
             SELECT ?, ?, key, value ->> 0, value ->> 1, value ->> 2 FROM json_each(?)",
        )
        .bind(camera.number())
        .bind(chunk.seq)
        .bind(edges)
        .execute(&mut self.conn)
        .await?;
        Ok(())
    }

    /// Final counts if the session can be sealed; otherwise (expected, found).
    pub(crate) async fn sealable(
        &mut self,
    ) -> Result<Result<SessionTotals, (String, String)>, Fault> {
        let ends: i64 = sqlx::query_scalar("SELECT count(*) FROM run_end")
            .fetch_one(&mut self.conn)
            .await?;
        if ends != 1 {
            return Ok(Err((
                "the end of the run as the last record".into(),
                "none".into(),
            )));
        }
        let totals = crate::totals::totals(&mut self.conn).await?;
        let open = totals.presses.open() + totals.sync.open();
        if open > 0 {
            let first: u32 = sqlx::query_scalar(
                "SELECT min(id) FROM press WHERE NOT EXISTS (SELECT 1 FROM attempt a WHERE a.press = press.id
                   AND a.verdict IS NOT NULL
                   AND a.number = (SELECT max(number) FROM attempt WHERE press = press.id))",
            )
            .fetch_one(&mut self.conn)
            .await?;
            return Ok(Err((
                "a verdict for every planned press".into(),
                format!(
                    "{open} without one; the first is {}",
                    PressId::from_index(first)
                ),
            )));
        }
        Ok(Ok(totals))
    }
}
