//! State of a run at one instant.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::Serialize;
use skinrig_controller::State;
use skinrig_model::{AttemptId, PlannedPress, PressOutcome, PressRole, PressVerdict, RunEnd};
use skinrig_recorder::{AttemptRow, PressTally, RecorderError, SessionReader};

use super::failures::{self, CameraLoss, EndedAttempt, Failure};
use super::signal::{Signal, signals};
use crate::paths;
use crate::remote::{RemoteError, Reply, Request, RunSnapshot, ask};
use crate::rig::gates;

/// Number of latest presses shown.
const LATEST: usize = 6;
/// Number of latest faults and other interruptions shown.
const FAULTS: usize = 4;

/// How long to keep a session closed that may be being sealed: more than three times as long as its writer waits for readers.
const SEAL_GRACE: Duration = Duration::from_secs(10);

/// A run at one instant.
#[derive(Debug, Serialize)]
pub(super) struct Frame {
    /// The file.
    pub session: PathBuf,
    /// State in words.
    pub state: String,
    /// The process that writes the session, if any.
    pub writer: Option<String>,
    /// True if it is sealed.
    pub sealed: bool,
    /// State reported by the run; `None` if it does not answer.
    pub live: Option<Box<RunSnapshot>>,
    /// Name of the prototype.
    pub prototype: String,
    /// Name of the protocol.
    pub protocol: String,
    /// Name of the rig.
    pub rig: String,
    /// Civil time of the start.
    pub started_at: String,
    /// Calibrating and scored presses.
    pub presses: PressTally,
    /// Locations of the path with their progress.
    pub places: Vec<LocationStatus>,
    /// Invalid attempts since the last other one.
    pub failures_in_a_row: usize,
    /// Invalid attempts by cause, most frequent first.
    pub failures: Vec<Failure>,
    /// Lost bytes of each camera, in the file.
    pub losses: [CameraLoss; 2],
    /// The latest attempts, oldest first.
    pub latest: Vec<LatestAttempt>,
    /// The latest interruptions, oldest first.
    pub faults: Vec<Fault>,
    /// Interruptions so far.
    pub fault_count: usize,
    /// Free bytes in the session's folder.
    pub disk_free_bytes: Option<u64>,
}

/// A location of the path.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct LocationStatus {
    /// Position, skin frame, mm.
    pub at_mm: [f64; 2],
    /// Presses planned there.
    pub planned: u32,
    /// How many of them are valid.
    pub valid: u32,
    /// How many of them ended otherwise.
    pub failed: u32,
}

/// An attempt that ended.
#[derive(Debug, Serialize)]
pub(crate) struct LatestAttempt {
    /// Number of the press in the plan, from 1.
    pub press: u32,
    /// Number of the attempt, from 1.
    pub attempt: u32,
    /// Position, skin frame, mm.
    pub at_mm: [f64; 2],
    /// Verdict of the attempt.
    pub verdict: String,
    /// Reason of a verdict other than valid.
    pub reason: Option<String>,
    /// Signal in each camera.
    pub cameras: [Option<Signal>; 2],
}

/// A fault or another interruption.
#[derive(Debug, Serialize)]
pub(super) struct Fault {
    /// Session time, s.
    pub t_s: f64,
    /// Kind of the interruption.
    pub kind: String,
    /// Reason in words.
    pub reason: String,
}

impl Frame {
    /// True if the session is sealed or its run has ended.
    pub(super) fn is_over(&self) -> bool {
        self.sealed || self.writer.is_none()
    }
}

/// Follows one session.
pub(super) struct Follower {
    session: PathBuf,
    /// Constant data, read once.
    head: Option<SessionInfo>,
    /// Signals of attempts measured before.
    signals: BTreeMap<AttemptId, [Option<Signal>; 2]>,
    /// Since when the session has a writer whose run does not answer or has ended.
    silent: Option<Instant>,
}

struct SessionInfo {
    prototype: String,
    protocol: String,
    rig: String,
    started_at: String,
    formats: [skinrig_model::StreamFormat; 2],
}

impl Follower {
    /// Follows the session at this path.
    pub(super) fn new(session: PathBuf) -> Self {
        Self {
            session,
            head: None,
            signals: BTreeMap::new(),
            silent: None,
        }
    }

    /// True if the session may be being sealed, for which its writer needs exclusive access: then the file is not opened for a
    /// while.
    fn may_be_sealing(&mut self, live: Option<&RunSnapshot>, writer: Option<&str>) -> bool {
        let is_running = live.is_some_and(|live| live.state != State::Finished.name());
        if is_running || writer.is_none() {
            self.silent = None;
            return false;
        }
        self.silent.get_or_insert_with(Instant::now).elapsed() < SEAL_GRACE
    }

    /// The file.
    pub(super) fn session(&self) -> &Path {
        &self.session
    }

    /// Reads the state of the run; `None` if there is nothing new. The file is open only during the call, and with `patience` it is
    /// not opened while it may be being sealed.
    pub(super) fn read_frame(
        &mut self,
        writer: Option<&str>,
        patience: bool,
    ) -> Result<Option<Frame>, RecorderError> {
        let live = match ask(&self.session, &Request::Status) {
            Ok(Reply::Live(live)) => Some(live),
            Ok(_) | Err(RemoteError::NotListening | RemoteError::Failed(_)) => None,
        };
        if self.may_be_sealing(live.as_deref(), writer) && patience {
            return Ok(None);
        }
        let reader = SessionReader::open(&self.session)?;
        if self.head.is_none() {
            self.head = Some(head(&reader)?);
        }
        let presses = reader.presses()?;
        let interruptions = reader.interruptions()?;
        let end = reader.end()?.map(|(_, end)| end);
        let sealed = reader.seal()?.is_some();
        let (tally, _) = reader.tallies()?;
        let losses = failures::losses(&reader)?;
        let ended = failures::ended(&presses);
        let latest = &ended[ended.len().saturating_sub(LATEST)..];
        if let Some(head) = &self.head {
            let outcomes = latest.iter().map(|a| a.outcome);
            let is_new = |o: &&PressOutcome| !self.signals.contains_key(&o.attempt);
            let new: Vec<&PressOutcome> = outcomes.filter(is_new).collect();
            if !new.is_empty() {
                self.signals.extend(signals(&reader, head.formats, &new)?);
            }
        }
        drop(reader);
        let row = |a: &EndedAttempt<'_>| LatestAttempt {
            press: a.planned.id.number(),
            attempt: a.outcome.attempt.number,
            at_mm: [a.planned.at.x_mm, a.planned.at.y_mm],
            verdict: a.outcome.verdict.name().to_owned(),
            reason: a.outcome.verdict.reason(),
            cameras: self
                .signals
                .get(&a.outcome.attempt)
                .copied()
                .unwrap_or_default(),
        };
        let latest: Vec<LatestAttempt> = latest.iter().map(row).collect();
        let fault_count = interruptions.len();
        let faults = interruptions
            .into_iter()
            .skip(fault_count.saturating_sub(FAULTS));
        let faults = faults.map(|i| Fault {
            t_s: i.t.as_secs_f64(),
            kind: i.kind.name().to_owned(),
            reason: i.reason.to_string(),
        });
        let of = |text: fn(&SessionInfo) -> &String| {
            self.head.as_ref().map(text).cloned().unwrap_or_default()
        };
        Ok(Some(Frame {
            state: state(live.as_deref(), writer, end.as_ref(), sealed),
            writer: writer.map(str::to_owned),
            sealed,
            live,
            prototype: of(|h| &h.prototype),
            protocol: of(|h| &h.protocol),
            rig: of(|h| &h.rig),
            started_at: of(|h| &h.started_at),
            presses: tally,
            places: places(&presses),
            failures_in_a_row: failures::failures_in_a_row(&ended),
            failures: failures::failures(&ended),
            losses,
            latest,
            faults: faults.collect(),
            fault_count,
            disk_free_bytes: gates::free_bytes(paths::folder_of(&self.session))
                .ok()
                .map(|b| b as u64),
            session: self.session.clone(),
        }))
    }
}

fn head(reader: &SessionReader) -> Result<SessionInfo, RecorderError> {
    let header = reader.header()?;
    Ok(SessionInfo {
        prototype: header.prototype,
        protocol: header.protocol_name,
        rig: header.rig_name,
        started_at: header.started_at,
        formats: header.stream_formats,
    })
}

fn state(
    live: Option<&RunSnapshot>,
    writer: Option<&str>,
    end: Option<&RunEnd>,
    sealed: bool,
) -> String {
    match (live, writer, end) {
        _ if sealed => match end {
            Some(end) => match end.decision() {
                Some(look) => format!(
                    "{}: question decided at look {} of {}",
                    end.name(),
                    look.number,
                    look.declared
                ),
                None => end.name().to_owned(),
            },
            None => "sealed".to_owned(),
        },
        (Some(live), ..) => live.state.clone(),
        (None, Some(by), None) => format!("written by {by}, which does not respond"),
        (None, Some(_), Some(end)) => format!("{}, being sealed", end.name()),
        (None, None, Some(end)) => format!("{}, not sealed", end.name()),
        (None, None, None) => {
            "cut off: no program is running it; `skinrig resume` continues it".to_owned()
        }
    }
}

/// The locations of the path in the order of their first press, without sync presses.
fn places(presses: &[(PlannedPress, Vec<AttemptRow>)]) -> Vec<LocationStatus> {
    let mut places: Vec<LocationStatus> = Vec::new();
    let mut known: BTreeMap<[u64; 2], usize> = BTreeMap::new();
    for (planned, attempts) in presses {
        if planned.role == PressRole::Sync {
            continue;
        }
        let at_mm = [planned.at.x_mm, planned.at.y_mm];
        let index = *known.entry(at_mm.map(f64::to_bits)).or_insert_with(|| {
            places.push(LocationStatus {
                at_mm,
                planned: 0,
                valid: 0,
                failed: 0,
            });
            places.len() - 1
        });
        let place = &mut places[index];
        place.planned += 1;
        let verdict = attempts.last().and_then(|a| a.outcome.as_ref());
        match verdict.map(|o| &o.verdict) {
            Some(PressVerdict::Valid) => place.valid += 1,
            Some(_) => place.failed += 1,
            None => {}
        }
    }
    places
}
