//! The sessions of a folder as the catalogue has them: those whose entries are current and as complete as their files.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use skinrig_recorder::{AnnotationNote, Annotations, PressTally, SessionState, SessionTotals};

use crate::catalogue::Catalogue;
use crate::error::CatalogueError;
use crate::folder::Folder;
use crate::results::EstimateEntry;
use crate::value::Value;

/// Sessions of a folder.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Listing {
    /// Those that need not be read, by the name of their file.
    pub sessions: BTreeMap<String, ListedSession>,
    /// Names of files that are no longer in the folder.
    pub gone: Vec<String>,
}

/// A session, as its file and those beside it have it.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedSession {
    /// Content of the file.
    pub state: SessionState,
    /// Values overridden when it was recorded, as `key=value`.
    pub overrides: Vec<String>,
    /// Its analyses by name; `None` if some results cannot be used, and their files tell why.
    pub analyses: Option<Vec<ListedAnalysis>>,
}

/// An analysis of a session.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedAnalysis {
    /// Name of the variant; `None` for the official one.
    pub variant: Option<String>,
    /// False if the numbers must not be used.
    pub is_valid: bool,
    /// RMSE of the scored presses, mm.
    pub rmse_mm: EstimateEntry,
    /// Share of the attempted scored presses that were located; `None` without any.
    pub located_rate: Option<f64>,
    /// `key=value` of each setting that a variant changes.
    pub changed: Vec<String>,
}

/// Rows of a query by their first column, the identifier of the session.
type Groups = BTreeMap<String, Vec<Vec<Value>>>;

impl Catalogue {
    /// The sessions of `folder` whose entries are current. Opens none of the files.
    ///
    /// # Errors
    /// If the folder or the catalogue cannot be read.
    pub fn list(&mut self, folder: &Path) -> Result<Listing, CatalogueError> {
        let store = self.store_of(folder)?;
        let all = [NAMES, SESSIONS, TAGS, NOTES, ANALYSES].map(|sql| {
            let store = [store.as_str().into()];
            let rows = self.runtime.block_on(self.db.fetch(sql, &store));
            rows.map(|found| found.rows)
                .map_err(|e| CatalogueError::sql(&self.place, "listing a folder", e))
        });
        let [names, sessions, tags, notes, analyses] = all;
        let (names, sessions) = (names?, sessions?);
        let mut details = [tags?, notes?, analyses?].map(group);
        // Listed after the entries: what changes meanwhile is not current.
        let files = Folder::list(folder)?;
        let there: BTreeSet<&str> = files.sessions.iter().map(String::as_str).collect();
        let names = names.iter().filter_map(|row| row[0].as_text());
        let gone = names.filter(|name| !there.contains(name));
        let mut all = Listing {
            gone: gone.map(str::to_owned).collect(),
            sessions: BTreeMap::new(),
        };
        for row in &sessions {
            let (name, seen) = (row[1].as_text(), row[2].as_text());
            let Some(name) = name.filter(|name| there.contains(name)) else {
                continue;
            };
            if seen == Some(files.fingerprint(name).as_str())
                && let Some(listed) = session(row, &mut details)
            {
                all.sessions.insert(name.to_owned(), listed);
            }
        }
        Ok(all)
    }
}

const NAMES: &str = "SELECT name FROM session_file WHERE store = $1
    UNION ALL SELECT name FROM unreadable_file WHERE store = $1 ORDER BY 1";

const SESSIONS: &str = "SELECT s.session_id, f.name, f.fingerprint, s.started_at, s.prototype, s.operator, s.protocol_name, s.rig_kind,
        s.rig_name, s.ended, s.content_sha256, s.overrides_json, s.tags_problem, s.planned, s.valid, s.missed, s.invalid,
        s.excluded, s.sync_planned, s.sync_valid, s.sync_missed, s.sync_invalid, s.sync_excluded, s.chunks, s.raw_bytes,
        s.stored_bytes, s.lost_bytes, s.cd_events, s.trigger_edges, s.pose_samples
    FROM session_file f JOIN session s ON s.session_id = f.session_id
    WHERE f.store = $1 AND f.is_source = 1";

const TAGS: &str = "SELECT t.session_id, t.tag
    FROM tag t JOIN session_file f ON f.session_id = t.session_id
    WHERE f.store = $1 AND f.is_source = 1";

const NOTES: &str = "SELECT n.session_id, n.noted_at, n.author, n.text
    FROM note n JOIN session_file f ON f.session_id = n.session_id
    WHERE f.store = $1 AND f.is_source = 1 AND n.noted_at IS NOT NULL
    ORDER BY n.session_id, n.position";

const ANALYSES: &str = "SELECT a.session_id, a.name, a.problem, a.is_valid, a.rmse_mm, a.rmse_low_mm, a.rmse_high_mm, a.rmse_n,
        a.changed_json, a.located_rate
    FROM analysis a JOIN session_file f ON f.session_id = a.session_id
    WHERE f.store = $1 AND f.is_source = 1
    ORDER BY a.session_id, a.name";

fn group(rows: Vec<Vec<Value>>) -> Groups {
    let mut groups = Groups::new();
    for row in rows {
        if let Some(id) = row[0].as_text().map(str::to_owned) {
            groups.entry(id).or_default().push(row);
        }
    }
    groups
}

/// The text as the file has it: U+FFFD may stand for a character that a catalogue cannot hold.
fn exact(value: &Value) -> Option<String> {
    let text = value.as_text().filter(|text| !text.contains('\u{fffd}'));
    text.map(str::to_owned)
}

/// A row of [`SESSIONS`] with its tags, notes and analyses; `None` if it is less exact than the file.
fn session(row: &[Value], [tags, notes, analyses]: &mut [Groups; 3]) -> Option<ListedSession> {
    let count = |at: usize| row[at].as_integer().map(i64::cast_unsigned);
    let tally = |at: usize| {
        Some(PressTally {
            planned: count(at)?,
            valid: count(at + 1)?,
            missed: count(at + 2)?,
            invalid: count(at + 3)?,
            excluded: count(at + 4)?,
        })
    };
    let (presses, sync) = (tally(13)?, tally(18)?);
    let totals = match &row[10] {
        Value::Null => None,
        _ => Some(Box::new(SessionTotals {
            presses,
            sync,
            chunks: count(23)?,
            raw_bytes: count(24)?,
            stored_bytes: count(25)?,
            lost_bytes: count(26)?,
            cd_events: count(27)?,
            trigger_edges: count(28)?,
            pose_samples: count(29)?,
        })),
    };
    // The problem names the file as it was called then.
    if row[12] != Value::Null {
        return None;
    }
    let id = exact(&row[0])?;
    let of = |groups: &mut Groups| groups.remove(&id).unwrap_or_default();
    let tags: Option<BTreeSet<String>> = of(tags).iter().map(|row| exact(&row[1])).collect();
    let note = |row: &Vec<Value>| {
        Some(AnnotationNote {
            at: exact(&row[1])?,
            by: exact(&row[2])?,
            text: exact(&row[3])?,
        })
    };
    let notes: Option<Vec<AnnotationNote>> = of(notes).iter().map(note).collect();
    let analyses = of(analyses);
    Some(ListedSession {
        overrides: serde_json::from_str(&exact(&row[11])?).ok()?,
        analyses: analyses.iter().map(|row| analysis(row)).collect(),
        state: SessionState::Readable {
            started_at: exact(&row[3])?,
            prototype: exact(&row[4])?,
            operator: exact(&row[5])?,
            protocol_name: exact(&row[6])?,
            rig_kind: exact(&row[7])?,
            rig_name: exact(&row[8])?,
            end: match &row[9] {
                Value::Null => None,
                end => Some(exact(end)?),
            },
            sealed: totals.is_some(),
            presses,
            sync,
            annotations: Annotations {
                tags: tags?,
                notes: notes?,
            },
            tags_problem: None,
            totals,
            session_id: id,
        },
    })
}

/// A row of [`ANALYSES`]; `None` if its results cannot be used.
fn analysis(row: &[Value]) -> Option<ListedAnalysis> {
    let real = |at: usize| match row[at] {
        Value::Real(value) => Some(value),
        _ => None,
    };
    let name = exact(&row[1])?;
    Some(ListedAnalysis {
        variant: (name != crate::results::OFFICIAL).then_some(name),
        is_valid: row[3].as_integer()? == 1,
        rmse_mm: EstimateEntry {
            value: real(4),
            low: real(5),
            high: real(6),
            n: u32::try_from(row[7].as_integer()?).ok()?,
        },
        located_rate: real(9),
        changed: serde_json::from_str(&exact(&row[8])?).ok()?,
    })
}
