//! Owns sessions as the answers see them: what was parsed is kept while the file stays the same, the file itself never stays open.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use skinrig_analysis::{Analysis, LegStart};
use skinrig_model::{CameraId, HostTime, PlannedPress, RunHeader};
use skinrig_recorder::{AttemptRow, ChunkMeta, LegRow, SessionReader, writer_of};
use skinrig_results::{AnalysisOptions, ChunkIndex, RigDocument, Session};

use crate::clocks::CameraTime;
use crate::folder::name_of;
use crate::lab::Lab;
use crate::problem::Problem;

/// Sessions that are kept, at most. Each holds its header and the index of its chunks.
const MOST_KEPT: usize = 8;

/// Parsed parts of one session.
pub(crate) struct ParsedSession {
    pub session_id: String,
    pub header: RunHeader,
    pub rig: RigDocument,
    pub is_sealed: bool,
    pub presses: Vec<(PlannedPress, Vec<AttemptRow>)>,
    pub legs: Vec<LegRow>,
    /// Chunks of both cameras in stream order.
    pub chunks: [Vec<ChunkMeta>; 2],
    pub indices: [ChunkIndex; 2],
    /// Stored results, if there are any.
    pub analysis: Option<Analysis>,
    /// Further legs as that analysis aligned them.
    pub leg_starts: Vec<LegStart>,
    /// `None` for a camera without any time.
    pub clocks: [Option<CameraTime>; 2],
}

/// A session open for the length of one answer.
pub(crate) struct OpenSession {
    pub path: PathBuf,
    pub reader: SessionReader,
    pub known: Arc<ParsedSession>,
}

/// State of the files at which a session was parsed.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Stamp {
    path: PathBuf,
    variant: Option<String>,
    files: [Option<(u64, SystemTime)>; 3],
}

impl Stamp {
    fn of(path: &Path, variant: Option<&str>) -> Self {
        let file = |path: &Path| {
            let found = std::fs::metadata(path).ok()?;
            Some((found.len(), found.modified().ok()?))
        };
        let log = path.with_file_name(format!("{}-wal", name_of(path)));
        // Results appear, disappear and change by renaming, which changes the folder.
        let folder = path.parent().and_then(file);
        Self {
            path: path.to_owned(),
            variant: variant.map(str::to_owned),
            files: [file(path), file(&log), folder],
        }
    }
}

/// Recently parsed sessions, the newest last.
#[derive(Default)]
pub(crate) struct Cache(Mutex<Vec<(Stamp, Arc<ParsedSession>)>>);

impl Cache {
    /// Opens the session at `path` with its stored results of this `variant` (`None`: the official ones).
    pub(crate) fn open(
        &self,
        lab: &dyn Lab,
        path: &Path,
        variant: Option<&str>,
    ) -> Result<OpenSession, Problem> {
        let stamp = Stamp::of(path, variant);
        let reader = SessionReader::open(path)?;
        let cache = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = cache
            .iter()
            .find(|(s, _)| *s == stamp)
            .map(|(_, k)| Arc::clone(k));
        drop(cache);
        let known = match found {
            Some(known) => known,
            None => {
                let unchanged = SessionReader::open_unchanged(path)?;
                // Nothing seals it, and nobody is writing it: its rows must agree, as for an analysis.
                if unchanged.seal()?.is_none() && writer_of(path).is_none() {
                    SessionReader::open_checked(path)?;
                }
                Arc::new(ParsedSession::read(&unchanged, lab, path, variant)?)
            }
        };
        let mut cache = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        cache.retain(|(s, _)| s.path != stamp.path || s.variant != stamp.variant);
        let excess = (cache.len() + 1).saturating_sub(MOST_KEPT);
        cache.drain(..excess);
        cache.push((stamp, Arc::clone(&known)));
        drop(cache);
        Ok(OpenSession {
            path: path.to_owned(),
            reader,
            known,
        })
    }
}

/// What a request for a variant without results gets, in place of a session without estimates.
fn no_variant(path: &Path, name: &str) -> Problem {
    let file = name_of(path);
    Problem::absent(format!(
        "{file}: expected results of the analysis `{name}` beside it, made by this version, found none\n  next: `skinrig analyze {file} \
         --name {name}` with its settings writes them"
    ))
}

impl ParsedSession {
    fn read(
        reader: &SessionReader,
        lab: &dyn Lab,
        path: &Path,
        variant: Option<&str>,
    ) -> Result<Self, Problem> {
        let session_id = reader.session_id()?;
        let header = reader.header()?;
        let rig: RigDocument = serde_json::from_str(&header.rig_json).map_err(|source| {
            Problem::from(skinrig_results::ResultsError::Rig {
                path: path.to_owned(),
                source,
            })
        })?;
        let is_sealed = reader.seal()?.is_some();
        let legs = reader.legs()?;
        let [one, two] = CameraId::ALL;
        let chunks = [reader.chunk_index(one)?, reader.chunk_index(two)?];
        let index = |camera: CameraId| {
            ChunkIndex::read(reader, camera, header.stream_formats[camera.index()])
        };
        let indices = [index(one)?, index(two)?];
        let analysis = lab.analysis(path, &session_id, variant);
        if let (Some(name), None) = (variant, &analysis) {
            return Err(no_variant(path, name));
        }
        let leg_starts = match &analysis {
            Some(_) if legs.len() > 1 => aligned_legs(path)?,
            _ => Vec::new(),
        };
        let clock = |k: usize| {
            let measured = analysis.as_ref();
            let measured = measured.and_then(|a| CameraTime::of_analysis(a, &leg_starts, k));
            measured.or_else(|| CameraTime::of_arrivals(&chunks[k], &legs))
        };
        let clocks = [clock(0), clock(1)];
        Ok(Self {
            presses: reader.presses()?,
            session_id,
            header,
            rig,
            is_sealed,
            legs,
            chunks,
            indices,
            analysis,
            leg_starts,
            clocks,
        })
    }

    /// First and last session time with data, s.
    pub(crate) fn span_s(&self) -> (f64, f64) {
        let arrivals = self.chunks.iter().flatten().map(|c| c.host_time);
        let attempts = self.presses.iter().flat_map(|(_, attempts)| attempts);
        let cleared = attempts.filter_map(|a| Some(a.outcome.as_ref()?.timing?.clear));
        let last = arrivals.chain(cleared).max().unwrap_or(HostTime::ZERO);
        (0.0, last.as_secs_f64().max(0.0))
    }
}

fn aligned_legs(path: &Path) -> Result<Vec<LegStart>, Problem> {
    let session = Session::open(path, AnalysisOptions::default())?;
    Ok(session.read_input()?.align().input.legs)
}
