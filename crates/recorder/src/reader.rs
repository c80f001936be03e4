//! The read-only side: plain values and streams out of a session, sealed or still growing.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use skinrig_model::{
    CameraId, DeviceIdentity, DeviceRole, HostTime, InterruptionKind, Mark, MarkKind,
    MotionCommand, PlannedPress, Point3, PoseSample, PressId, PressOutcome, RigidTransform, RunEnd,
    RunHeader, SentMark, Setting, TriggerEdge,
};
use sqlx::sqlite::{SqliteConnection, SqliteRow};
use tokio::runtime::Runtime;

use crate::codec::{self, Codec};
use crate::error::RecorderError;
use crate::from_row::{attempt_from, chunk_from, header_from, planned_from, pose_block_from};
use crate::query::{self, Fault, blob, each_row, int, named, num, opt_text, real, sha, text};
use crate::rows::{
    AttemptRow, ChunkMeta, CommandRow, DeviceRow, InterruptionRow, NoteRow, Seal, SessionTotals,
};
use crate::schema;

const CHUNK_COLUMNS: &str = "camera, seq, host_ns, lost_before, codec, raw_bytes, raw_crc32, first_us, \
    last_us, cd_events, on_events, trigger_edges, length(stored) AS stored_bytes";

/// Reads one session file; never writes to it.
///
/// Memory stays bounded: chunks and pose blocks are read one at a time, everything else is small. Usable from
/// several threads; not on a thread that runs async tasks.
#[derive(Debug)]
pub struct SessionReader {
    path: PathBuf,
    inner: Mutex<(Runtime, SqliteConnection)>,
}

/// The short texts of a header.
pub(crate) struct Brief {
    pub session_id: String,
    pub started_at: String,
    pub prototype: String,
    pub operator: String,
    pub protocol_name: String,
    pub rig_kind: String,
    pub rig_name: String,
}

impl SessionReader {
    /// Opens a session, sealed or not, also while it is being written.
    ///
    /// # Errors
    /// [`RecorderError::Missing`], [`RecorderError::NotASession`], [`RecorderError::NewerSchema`], or what the
    /// operating system or SQLite said.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, RecorderError> {
        let path = path.as_ref().to_owned();
        let runtime = tokio::runtime::Builder::new_current_thread()
            .build()
            .map_err(|source| RecorderError::Io {
                path: path.clone(),
                doing: "starting to read it",
                source,
            })?;
        let conn = runtime.block_on(schema::open(&path))?;
        Ok(Self {
            path,
            inner: Mutex::new((runtime, conn)),
        })
    }

    /// The session file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Runs queries with the connection.
    pub(crate) fn ask<T>(
        &self,
        doing: &'static str,
        queries: impl AsyncFnOnce(&mut SqliteConnection) -> Result<T, Fault>,
    ) -> Result<T, RecorderError> {
        let mut inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        let (runtime, conn) = &mut *inner;
        runtime
            .block_on(queries(conn))
            .map_err(|fault| fault.at(&self.path, doing))
    }

    fn all<T>(
        &self,
        doing: &'static str,
        sql: &'static str,
        mut from: impl FnMut(&SqliteRow) -> Result<T, Fault>,
    ) -> Result<Vec<T>, RecorderError> {
        self.ask(doing, async |conn| {
            let mut out = Vec::new();
            each_row(sqlx::query(sql), conn, |row| {
                out.push(from(row)?);
                Ok(())
            })
            .await?;
            Ok(out)
        })
    }

    fn damaged(&self, place: String, expected: &str, found: String) -> RecorderError {
        Fault::bad(place, expected, found).at(&self.path, "reading")
    }

    /// The 32 hex digits that name this session whatever its file is called.
    ///
    /// # Errors
    /// When the file is damaged, or its header is not yet written.
    pub fn session_id(&self) -> Result<String, RecorderError> {
        self.all(
            "reading its header",
            "SELECT session_id FROM session",
            |row| text(row, "session_id"),
        )?
        .pop()
        .ok_or_else(|| self.no_header())
    }

    /// The short texts of the header, without protocol, plan and presses.
    pub(crate) fn brief(&self) -> Result<Brief, RecorderError> {
        let sql =
            "SELECT session_id, started_at, prototype, operator, protocol_name, rig_kind, rig_name
                   FROM session";
        self.all("reading its header", sql, |row| {
            Ok(Brief {
                session_id: text(row, "session_id")?,
                started_at: text(row, "started_at")?,
                prototype: text(row, "prototype")?,
                operator: text(row, "operator")?,
                protocol_name: text(row, "protocol_name")?,
                rig_kind: text(row, "rig_kind")?,
                rig_name: text(row, "rig_name")?,
            })
        })?
        .pop()
        .ok_or_else(|| self.no_header())
    }

    fn no_header(&self) -> RecorderError {
        RecorderError::NotThere {
            path: self.path.clone(),
            wanted: "the run's header".into(),
        }
    }

    /// What was known before anything moved, the planned presses included.
    ///
    /// # Errors
    /// When the file is damaged, or its header is not yet written.
    pub fn header(&self) -> Result<RunHeader, RecorderError> {
        const DOING: &str = "reading its header";
        let axes = self.all(
            DOING,
            "SELECT * FROM robot_from_skin ORDER BY axis",
            |row| {
                Ok((
                    [real(row, "r_x")?, real(row, "r_y")?, real(row, "r_z")?],
                    real(row, "t_mm")?,
                ))
            },
        )?;
        let presses = self.all(
            "reading presses",
            "SELECT * FROM press ORDER BY id",
            planned_from,
        )?;
        let mut header = self
            .all(DOING, "SELECT * FROM session", header_from)?
            .pop()
            .ok_or_else(|| self.no_header())?;
        let [(x, tx), (y, ty), (z, tz)] = axes[..] else {
            return Err(self.damaged("robot_from_skin".into(), "3 rows", axes.len().to_string()));
        };
        header.robot_from_skin = RigidTransform::new([x, y, z], [tx, ty, tz]);
        header.presses = presses;
        Ok(header)
    }

    /// The seal, or `None` for a session that was never sealed.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn seal(&self) -> Result<Option<Seal>, RecorderError> {
        let seals = self.all("reading its seal", "SELECT * FROM seal", |row| {
            let mut totals = SessionTotals {
                presses: query::tally(row, "")?,
                sync: query::tally(row, "sync_")?,
                ..SessionTotals::default()
            };
            query::sizes(row, &mut totals)?;
            Ok(Seal {
                totals,
                tree_sha256: sha(row, "tree_sha256")?,
                file_sha256: sha(row, "file_sha256")?,
            })
        })?;
        Ok(seals.into_iter().next())
    }

    /// Every device as it introduced itself, in order; one that was configured again appears again.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn devices(&self) -> Result<Vec<DeviceRow>, RecorderError> {
        const DOING: &str = "reading devices";
        const ROLES: [DeviceRole; 4] = [
            DeviceRole::Indenter,
            DeviceRole::Camera1,
            DeviceRole::Camera2,
            DeviceRole::TriggerBox,
        ];
        let mut devices = self.all(DOING, "SELECT * FROM device ORDER BY id", |row| {
            let identity = DeviceIdentity {
                model: text(row, "model")?,
                serial: text(row, "serial")?,
                firmware: text(row, "firmware")?,
            };
            let role = named(row, "role", &ROLES, DeviceRole::name)?;
            Ok((
                int(row, "id")?,
                DeviceRow {
                    role,
                    identity,
                    settings: Vec::new(),
                },
            ))
        })?;
        let settings = self.all(
            DOING,
            "SELECT * FROM setting ORDER BY device, position",
            |row| {
                let setting = Setting {
                    name: text(row, "name")?,
                    requested: text(row, "requested")?,
                    read_back: text(row, "read_back")?,
                };
                Ok((int(row, "device")?, setting))
            },
        )?;
        for (device, setting) in settings {
            match devices.iter_mut().find(|(id, _)| *id == device) {
                Some((_, row)) => row.settings.push(setting),
                None => {
                    let place = format!("setting {}", setting.name);
                    return Err(self.damaged(place, "its device", format!("device {device}")));
                }
            }
        }
        Ok(devices.into_iter().map(|(_, device)| device).collect())
    }

    /// Every planned press in plan order, each with its attempts in order.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn presses(&self) -> Result<Vec<(PlannedPress, Vec<AttemptRow>)>, RecorderError> {
        const DOING: &str = "reading presses";
        let mut presses: Vec<(PlannedPress, Vec<AttemptRow>)> =
            self.all(DOING, "SELECT * FROM press ORDER BY id", |row| {
                Ok((planned_from(row)?, Vec::new()))
            })?;
        let attempts = self.all(
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

    /// The outcome of the last attempt at each planned press, in plan order; `None` without a verdict. A press
    /// that was recorded as missed has an outcome with that verdict.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn last_outcomes(&self) -> Result<Vec<Option<PressOutcome>>, RecorderError> {
        let presses = self.presses()?;
        Ok(presses
            .into_iter()
            .map(|(_, mut attempts)| attempts.pop()?.outcome)
            .collect())
    }

    /// The trigger edges of `camera`, in stream order, all channels.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn trigger_edges(&self, camera: CameraId) -> Result<Vec<TriggerEdge>, RecorderError> {
        self.edges(camera, 0, i64::MAX)
    }

    /// The trigger edges of one chunk.
    pub(crate) fn edges(
        &self,
        camera: CameraId,
        from_seq: i64,
        to_seq: i64,
    ) -> Result<Vec<TriggerEdge>, RecorderError> {
        self.ask("reading trigger edges", async |conn| {
            let query = sqlx::query(
                "SELECT t_us, channel, rising FROM trigger_edge
                 WHERE camera = ? AND seq BETWEEN ? AND ? ORDER BY seq, position",
            );
            let mut edges = Vec::new();
            let query = query.bind(camera.number()).bind(from_seq).bind(to_seq);
            each_row(query, conn, |row| {
                edges.push(TriggerEdge {
                    t_us: num(row, "t_us")?,
                    channel: num(row, "channel")?,
                    rising: int(row, "rising")? != 0,
                });
                Ok(())
            })
            .await?;
            Ok(edges)
        })
    }

    /// The marks that the trigger box sent, in order.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn marks_sent(&self) -> Result<Vec<SentMark>, RecorderError> {
        self.all("reading marks", "SELECT * FROM mark ORDER BY id", |row| {
            Ok(SentMark {
                mark: Mark {
                    kind: named(row, "kind", &MarkKind::ALL, MarkKind::name)?,
                    press: PressId(num(row, "press")?),
                },
                t: HostTime(int(row, "t_ns")?),
                uncertainty_ns: int(row, "uncertainty_ns")?,
            })
        })
    }

    /// Every motion command, in order.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn commands(&self) -> Result<Vec<CommandRow>, RecorderError> {
        self.all(
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

    /// Every remark, in order.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn notes(&self) -> Result<Vec<NoteRow>, RecorderError> {
        self.all("reading notes", "SELECT * FROM note ORDER BY id", |row| {
            Ok(NoteRow {
                t: HostTime(int(row, "t_ns")?),
                text: text(row, "text")?,
            })
        })
    }

    /// Everything that broke the normal course, in order.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn interruptions(&self) -> Result<Vec<InterruptionRow>, RecorderError> {
        const KINDS: [InterruptionKind; 5] = [
            InterruptionKind::Pause,
            InterruptionKind::Resume,
            InterruptionKind::Stop,
            InterruptionKind::Abort,
            InterruptionKind::Fault,
        ];
        self.all(
            "reading interruptions",
            "SELECT * FROM interruption ORDER BY id",
            |row| {
                Ok(InterruptionRow {
                    t: HostTime(int(row, "t_ns")?),
                    kind: named(row, "kind", &KINDS, InterruptionKind::name)?,
                    reason: text(row, "reason")?,
                })
            },
        )
    }

    /// When and how the run ended; `None` for a run under way or cut off.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn end(&self) -> Result<Option<(HostTime, RunEnd)>, RecorderError> {
        let ends = self.all("reading its end", "SELECT * FROM run_end", |row| {
            let reason = opt_text(row, "reason")?.unwrap_or_default();
            let end = match text(row, "status")?.as_str() {
                "completed" => RunEnd::Completed,
                "stopped" => RunEnd::Stopped(reason),
                "faulted" => RunEnd::Faulted(reason),
                other => {
                    return Err(Fault::bad(
                        "run_end",
                        "completed, stopped or faulted",
                        other,
                    ));
                }
            };
            Ok((HostTime(int(row, "t_ns")?), end))
        })?;
        Ok(ends.into_iter().next())
    }

    /// Counts and sizes, from the rows themselves.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn totals(&self) -> Result<SessionTotals, RecorderError> {
        self.ask("counting", query::totals)
    }

    /// Every chunk of `camera` without its bytes, in stream order.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn chunk_index(&self, camera: CameraId) -> Result<Vec<ChunkMeta>, RecorderError> {
        self.ask("reading the chunk index", async |conn| {
            let sql = format!("SELECT {CHUNK_COLUMNS} FROM chunk WHERE camera = ? ORDER BY seq");
            let query = sqlx::query(sqlx::AssertSqlSafe(sql)).bind(camera.number());
            let mut index = Vec::new();
            each_row(query, conn, |row| {
                index.push(chunk_from(row)?);
                Ok(())
            })
            .await?;
            Ok(index)
        })
    }

    /// The bytes of one chunk as they came, checked against their checksum.
    ///
    /// # Errors
    /// [`RecorderError::NotThere`] for a number beyond the last chunk; [`RecorderError::Damaged`].
    pub fn chunk_bytes(&self, camera: CameraId, seq: u64) -> Result<Vec<u8>, RecorderError> {
        match self.chunk_at_or_after(camera, seq)? {
            Some((meta, bytes)) if meta.seq == seq => Ok(bytes),
            _ => Err(RecorderError::NotThere {
                path: self.path.clone(),
                wanted: format!("{camera} chunk {seq}"),
            }),
        }
    }

    /// The first chunk from `seq` on, with its bytes as they came, checked.
    pub(crate) fn chunk_at_or_after(
        &self,
        camera: CameraId,
        seq: u64,
    ) -> Result<Option<(ChunkMeta, Vec<u8>)>, RecorderError> {
        let Ok(from) = i64::try_from(seq) else {
            return Ok(None);
        };
        let found = self.ask("reading a chunk", async |conn| {
            let sql = format!(
                "SELECT {CHUNK_COLUMNS}, stored FROM chunk WHERE camera = ? AND seq >= ? ORDER BY seq LIMIT 1"
            );
            let query = sqlx::query(sqlx::AssertSqlSafe(sql)).bind(camera.number()).bind(from);
            let row = query.fetch_optional(conn).await?;
            row.map(|row| Ok((chunk_from(&row)?, blob(&row, "stored")?))).transpose()
        })?;
        let Some((meta, stored)) = found else {
            return Ok(None);
        };
        let place = || format!("{camera} chunk {}", meta.seq);
        let bytes = match meta.codec {
            Codec::None => stored,
            Codec::TimeHighRuns => codec::unfold(&stored, meta.raw_bytes as usize)
                .map_err(|e| self.damaged(place(), "bytes that unfold", e.to_string()))?,
        };
        if bytes.len() as u64 != meta.raw_bytes {
            let expected = format!("{} bytes", meta.raw_bytes);
            return Err(self.damaged(place(), &expected, bytes.len().to_string()));
        }
        let crc = crc32fast::hash(&bytes);
        if crc != meta.raw_crc32 {
            let expected = format!("CRC-32 {:#010x}", meta.raw_crc32);
            return Err(self.damaged(place(), &expected, format!("{crc:#010x}")));
        }
        Ok(Some((meta, bytes)))
    }

    /// Calls `each` with every chunk of `camera` from number `from_seq` on, in stream order, with its bytes as
    /// they came. One chunk is in memory at a time; `each` may use this reader.
    ///
    /// # Errors
    /// At the first damaged chunk; those before it have been handed over.
    pub fn for_each_chunk(
        &self,
        camera: CameraId,
        from_seq: u64,
        mut each: impl FnMut(ChunkMeta, &[u8]),
    ) -> Result<(), RecorderError> {
        let mut next = from_seq;
        while let Some((meta, bytes)) = self.chunk_at_or_after(camera, next)? {
            each(meta, &bytes);
            next = meta.seq + 1;
        }
        Ok(())
    }

    /// Camera-time intervals `(from_us, to_us)` in which bytes of `camera` were lost: from the last time seen
    /// before a loss to the first time seen after it; 0 and `u64::MAX` where there is none.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn gaps(&self, camera: CameraId) -> Result<Vec<(u64, u64)>, RecorderError> {
        let mut gaps = Vec::new();
        let (mut last_us, mut lost) = (0, false);
        for chunk in self.chunk_index(camera)? {
            lost |= chunk.lost_before > 0;
            if let (Some(first), Some(last)) = (chunk.facts.first_us, chunk.facts.last_us) {
                if lost {
                    gaps.push((last_us, first));
                }
                (last_us, lost) = (last, false);
            }
        }
        if lost {
            gaps.push((last_us, u64::MAX));
        }
        Ok(gaps)
    }

    /// Calls `each` with the pose samples of `from <= t <= to` in time order, a block at a time.
    ///
    /// # Errors
    /// At the first damaged block; samples before it have been handed over.
    pub fn for_each_pose_block(
        &self,
        from: HostTime,
        to: HostTime,
        mut each: impl FnMut(&[PoseSample]),
    ) -> Result<(), RecorderError> {
        let mut after = 0;
        while let Some((id, samples)) = self.pose_block_after(after, from, to)? {
            let start = samples.partition_point(|s| s.t < from);
            let end = samples.partition_point(|s| s.t <= to);
            if start < end {
                each(&samples[start..end]);
            }
            after = id;
        }
        Ok(())
    }

    /// The first pose block with an id above `after` that overlaps the span, checked.
    pub(crate) fn pose_block_after(
        &self,
        after: i64,
        from: HostTime,
        to: HostTime,
    ) -> Result<Option<(i64, Vec<PoseSample>)>, RecorderError> {
        self.ask("reading poses", async |conn| {
            let row = sqlx::query(
                "SELECT id, first_ns, last_ns, samples, sha256, data FROM pose_block
                 WHERE id = (SELECT min(id) FROM pose_block WHERE id > ? AND last_ns >= ? AND first_ns <= ?)",
            )
            .bind(after)
            .bind(from.0)
            .bind(to.0)
            .fetch_optional(conn)
            .await?;
            row.map(|row| pose_block_from(&row)).transpose()
        })
    }

    /// The pose samples of `from <= t <= to`, in time order. For spans of some seconds; see
    /// [`for_each_pose_block`](Self::for_each_pose_block) for long ones.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn poses(&self, from: HostTime, to: HostTime) -> Result<Vec<PoseSample>, RecorderError> {
        let mut poses = Vec::new();
        self.for_each_pose_block(from, to, |block| poses.extend_from_slice(block))?;
        Ok(poses)
    }
}
