//! The sessions of a folder as a list, when the catalogue has all of them as they are.

use std::collections::BTreeMap;
use std::path::Path;

use crate::catalogue::Catalogue;
use crate::error::CatalogueError;
use crate::results::EstimateEntry;
use crate::value::Value;

/// A session with its official results.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedSession {
    /// Name of its file.
    pub file: String,
    /// Civil time of the start, RFC 3339.
    pub started_at: String,
    /// Name of the pressed prototype.
    pub prototype: String,
    /// Name of the protocol file.
    pub protocol_name: String,
    /// Kind of the rig.
    pub rig_kind: String,
    /// Values overridden when it was recorded, as `key=value`.
    pub overrides: Vec<String>,
    /// Tags, sorted.
    pub tags: Vec<String>,
    /// Its official analysis.
    pub official: Option<OfficialResult>,
}

/// Result of an official analysis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OfficialResult {
    /// False if the numbers must not be used.
    pub is_valid: bool,
    /// RMSE of the scored presses, mm.
    pub rmse_mm: EstimateEntry,
}

impl Catalogue {
    /// The sessions of `folder` by start, then by name; `None` unless the catalogue answers exactly as the files do: every file
    /// readable and current, no copies, no unusable results.
    ///
    /// # Errors
    /// If the folder or the catalogue cannot be read.
    pub fn list(&mut self, folder: &Path) -> Result<Option<Vec<ListedSession>>, CatalogueError> {
        let status = self.status(folder)?;
        if status.current != status.files
            || !status.stale.is_empty()
            || !status.unreadable.is_empty()
        {
            return Ok(None);
        }
        let store = self.store_of(folder)?;
        let listed = self.runtime.block_on(async {
            let store = [store.as_str().into()];
            let sessions = self.db.fetch(SESSIONS, &store).await?;
            Ok((sessions.rows, self.db.fetch(TAGS, &store).await?.rows))
        });
        let listed = listed.map_err(|e| CatalogueError::sql(self.place(), "listing a folder", e));
        let (rows, tag_rows) = listed?;
        let mut tags: BTreeMap<&str, Vec<String>> = BTreeMap::new();
        for row in &tag_rows {
            if let (Some(id), Some(tag)) = (row[0].as_text(), row[1].as_text()) {
                tags.entry(id).or_default().push(tag.to_owned());
            }
        }
        let sessions = rows.iter().map(|row| session(row, &mut tags));
        let sessions: Option<Vec<ListedSession>> = sessions.collect();
        // A session with several files has fewer rows than files: only its source is listed.
        Ok(sessions.filter(|all| all.len() == status.files))
    }
}

const SESSIONS: &str = "SELECT s.session_id, f.name, s.started_at, s.prototype, s.protocol_name, s.rig_kind, s.overrides_json,
        a.name, a.problem, a.is_valid, a.rmse_mm, a.rmse_low_mm, a.rmse_high_mm, a.rmse_n
    FROM session_file f
    JOIN session s ON s.session_id = f.session_id
    LEFT JOIN analysis a ON a.session_id = s.session_id AND a.name = 'official'
    WHERE f.store = $1 AND f.is_source = 1
    ORDER BY s.started_at, f.name";

const TAGS: &str = "SELECT DISTINCT t.session_id, t.tag
    FROM tag t JOIN session_file f ON f.session_id = t.session_id
    WHERE f.store = $1
    ORDER BY t.session_id, t.tag";

/// A row of [`SESSIONS`]; `None` if its results cannot be used.
fn session(row: &[Value], tags: &mut BTreeMap<&str, Vec<String>>) -> Option<ListedSession> {
    let text = |at: usize| row[at].as_text().map(str::to_owned);
    let real = |at: usize| match row[at] {
        Value::Real(value) => Some(value),
        _ => None,
    };
    let official = match (&row[7], &row[8]) {
        (Value::Null, _) => None,
        (_, Value::Null) => Some(OfficialResult {
            is_valid: row[9].as_integer()? == 1,
            rmse_mm: EstimateEntry {
                value: real(10),
                low: real(11),
                high: real(12),
                n: u32::try_from(row[13].as_integer()?).ok()?,
            },
        }),
        _ => return None,
    };
    Some(ListedSession {
        file: text(1)?,
        started_at: text(2)?,
        prototype: text(3)?,
        protocol_name: text(4)?,
        rig_kind: text(5)?,
        overrides: serde_json::from_str(row[6].as_text()?).ok()?,
        tags: tags.remove(row[0].as_text()?).unwrap_or_default(),
        official,
    })
}
