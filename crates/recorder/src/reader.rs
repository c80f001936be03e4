//! Read access to a session, sealed or still growing, as plain values and streams.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use skinrig_model::{DeviceIdentity, DeviceRole, RigidTransform, RunHeader, Setting};
use sqlx::sqlite::{SqliteConnection, SqliteRow};
use tokio::runtime::Runtime;

use crate::digest::{digest_table, sealed_tables};
use crate::error::RecorderError;
use crate::from_row::{header_from, planned_from};
use crate::object;
use crate::open::{self, Source, runtime};
use crate::query::{Fault, each_row, enum_value, int, real, sha, text};
use crate::rows::{DeviceRow, Headline, PressTally, Seal, SessionTotals};
use crate::seal::placeholder_of;
use crate::totals;

mod journal;
mod legs;
mod poses;
mod stream;

/// Read-only access to one session file.
///
/// Memory is bounded: chunks and pose blocks are read one at a time, and everything else is small. Safe to use from
/// several threads, but not from a thread that runs async tasks.
#[derive(Debug)]
pub struct SessionReader {
    path: PathBuf,
    source: Source,
    inner: Mutex<(Runtime, SqliteConnection)>,
}

/// Text fields of a header.
pub(crate) struct HeaderTexts {
    pub session_id: String,
    pub started_at: String,
    pub prototype: String,
    pub operator: String,
    pub protocol_name: String,
    pub rig_kind: String,
    pub rig_name: String,
}

impl SessionReader {
    /// Opens a session, sealed or not, even while it is being written.
    ///
    /// # Errors
    /// [`RecorderError::Missing`], [`RecorderError::NotASession`], [`RecorderError::NewerSchema`], or the error of the
    /// operating system or of SQLite.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, RecorderError> {
        let path = path.as_ref().to_owned();
        let runtime = runtime(&path)?;
        let (conn, source) = runtime.block_on(open::open(&path))?;
        Ok(Self {
            path,
            source,
            inner: Mutex::new((runtime, conn)),
        })
    }

    /// Opens the session a second time, to read it in another thread. Waits for no writer: while `self` exists, the session
    /// cannot be sealed.
    pub(crate) fn reopen(&self) -> Result<Self, RecorderError> {
        let runtime = runtime(&self.path)?;
        let conn = runtime.block_on(open::connect(&self.path, &self.source))?;
        Ok(Self {
            path: self.path.clone(),
            source: self.source.clone(),
            inner: Mutex::new((runtime, conn)),
        })
    }

    /// The session file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Runs queries on the connection.
    pub(crate) fn query<T>(
        &self,
        doing: &'static str,
        queries: impl AsyncFnOnce(&mut SqliteConnection) -> Result<T, Fault>,
    ) -> Result<T, RecorderError> {
        let mut inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        let (runtime, conn) = &mut *inner;
        let done = runtime.block_on(queries(conn));
        done.map_err(|fault| {
            let error = fault.at(&self.path, doing);
            match &self.source {
                Source::Object(url) => object::explain(&self.path, url, error),
                Source::Growing | Source::Sealed => error,
            }
        })
    }

    fn query_all<T>(
        &self,
        doing: &'static str,
        sql: &'static str,
        mut from: impl FnMut(&SqliteRow) -> Result<T, Fault>,
    ) -> Result<Vec<T>, RecorderError> {
        self.query(doing, async |conn| {
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

    /// Identifier of the session: 32 hex digits, independent of the file's name.
    ///
    /// # Errors
    /// If the file is damaged or its header is not yet written.
    pub fn session_id(&self) -> Result<String, RecorderError> {
        self.query_all(
            "reading its header",
            "SELECT session_id FROM session",
            |row| text(row, "session_id"),
        )?
        .pop()
        .ok_or_else(|| self.no_header())
    }

    /// Text fields of the header, without protocol, plan and presses. Not compared with the seal: that would read the plan, too, and a
    /// list reads a few pages of each session.
    pub(crate) fn header_texts(&self) -> Result<HeaderTexts, RecorderError> {
        let sql =
            "SELECT session_id, started_at, prototype, operator, protocol_name, rig_kind, rig_name
                   FROM session";
        self.query_all("reading its header", sql, |row| {
            Ok(HeaderTexts {
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

    /// Identity of the session.
    ///
    /// # Errors
    /// If the file is damaged or its header is not yet written; [`RecorderError::Changed`] if it is not the sealed one.
    pub fn headline(&self) -> Result<Headline, RecorderError> {
        self.check_header_seal()?;
        let sql = "SELECT session_id, started_at, prototype, protocol_name, protocol_sha256, plan_sha256, overrides_json, seed,
                          rig_kind, rig_name
                   FROM session";
        self.query_all("reading its header", sql, |row| {
            Ok(Headline {
                session_id: text(row, "session_id")?,
                started_at: text(row, "started_at")?,
                prototype: text(row, "prototype")?,
                protocol_name: text(row, "protocol_name")?,
                protocol_sha256: text(row, "protocol_sha256")?,
                plan_sha256: text(row, "plan_sha256")?,
                overrides_json: text(row, "overrides_json")?,
                seed: text(row, "seed")?,
                rig_kind: text(row, "rig_kind")?,
                rig_name: text(row, "rig_name")?,
            })
        })?
        .pop()
        .ok_or_else(|| self.no_header())
    }

    fn no_header(&self) -> RecorderError {
        // A header that has come since was not there yet: nothing had been recorded.
        match self.query("reading its header", async |conn| {
            Ok(open::is_blank(conn).await? || open::has_header(conn).await?)
        }) {
            Ok(true) => RecorderError::Empty {
                path: self.path.clone(),
            },
            Ok(false) => self.damaged("session".into(), "the run's header", "none".into()),
            Err(e) => e,
        }
    }

    /// Compares the header of a sealed session with its seal.
    fn check_header_seal(&self) -> Result<(), RecorderError> {
        const TABLE: &str = "session";
        let is_sealed = self.query("checking the seal", async |conn| {
            let sealed = sealed_tables(conn).await?;
            let Some(sealed) = sealed.into_iter().find(|table| table.name == TABLE) else {
                return Ok(true);
            };
            Ok(digest_table(conn, TABLE, |_| {}).await? == Some(sealed))
        })?;
        if is_sealed {
            return Ok(());
        }
        Err(RecorderError::Changed {
            path: self.path.clone(),
            tables: vec![TABLE.to_owned()],
        })
    }

    /// The run's header, including the planned presses.
    ///
    /// # Errors
    /// If the file is damaged or its header is not yet written; [`RecorderError::Changed`] if it is not the sealed one.
    pub fn header(&self) -> Result<RunHeader, RecorderError> {
        self.check_header_seal()?;
        self.header_as_it_is()
    }

    /// The run's header, whether or not it is the sealed one.
    pub(crate) fn header_as_it_is(&self) -> Result<RunHeader, RecorderError> {
        const DOING: &str = "reading its header";
        // A session that begins gets all these rows at once: whoever reads this one finds the others.
        let mut header = self
            .query_all(DOING, "SELECT * FROM session", header_from)?
            .pop()
            .ok_or_else(|| self.no_header())?;
        let axes = self.query_all(
            DOING,
            "SELECT * FROM robot_from_skin ORDER BY axis",
            |row| {
                Ok((
                    [real(row, "r_x")?, real(row, "r_y")?, real(row, "r_z")?],
                    real(row, "t_mm")?,
                ))
            },
        )?;
        let presses = self.query_all(
            "reading presses",
            "SELECT * FROM press ORDER BY id",
            planned_from,
        )?;
        let [(x, tx), (y, ty), (z, tz)] = axes[..] else {
            return Err(self.damaged("robot_from_skin".into(), "3 rows", axes.len().to_string()));
        };
        header.robot_from_skin = RigidTransform::new([x, y, z], [tx, ty, tz]);
        header.presses = presses;
        Ok(header)
    }

    /// The seal; `None` for a session that is unsealed, or whose sealing was interrupted before the last step.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn seal(&self) -> Result<Option<Seal>, RecorderError> {
        let is_stamped = |seal: &Seal| seal.file_sha256 != placeholder_of(&seal.tree_sha256);
        Ok(self.seal_row()?.filter(is_stamped))
    }

    /// The row of the seal, even if its file hash is missing.
    pub(crate) fn seal_row(&self) -> Result<Option<Seal>, RecorderError> {
        let seals = self.query_all("reading its seal", "SELECT * FROM seal", |row| {
            let mut totals = SessionTotals {
                presses: totals::tally(row, "")?,
                sync: totals::tally(row, "sync_")?,
                ..SessionTotals::default()
            };
            totals::sizes(row, &mut totals)?;
            Ok(Seal {
                totals,
                tree_sha256: sha(row, "tree_sha256")?,
                file_sha256: sha(row, "file_sha256")?,
            })
        })?;
        Ok(seals.into_iter().next())
    }

    /// Identity and settings of every device, in order. A device that was reconfigured appears again.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn devices(&self) -> Result<Vec<DeviceRow>, RecorderError> {
        const DOING: &str = "reading devices";
        const ROLES: [DeviceRole; 4] = [
            DeviceRole::Indenter,
            DeviceRole::Camera1,
            DeviceRole::Camera2,
            DeviceRole::TriggerBox,
        ];
        // Read settings first: while a session is being written, a device and its settings may arrive between the two queries.
        let settings = self.query_all(
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
        let mut devices = self.query_all(DOING, "SELECT * FROM device ORDER BY id", |row| {
            let identity = DeviceIdentity {
                model: text(row, "model")?,
                serial: text(row, "serial")?,
                firmware: text(row, "firmware")?,
            };
            let role = enum_value(row, "role", &ROLES, DeviceRole::name)?;
            Ok((
                int(row, "id")?,
                DeviceRow {
                    role,
                    identity,
                    settings: Vec::new(),
                },
            ))
        })?;
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

    /// Verdict counts so far, from the journal: calibrating and scored presses, then sync presses.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn tallies(&self) -> Result<(PressTally, PressTally), RecorderError> {
        self.query("counting presses", totals::tallies)
    }

    /// Counts and sizes, from the rows themselves.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn totals(&self) -> Result<SessionTotals, RecorderError> {
        self.query("counting", totals::totals)
    }
}
