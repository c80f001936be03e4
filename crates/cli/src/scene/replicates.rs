//! Simulated sessions of the protocol of a session, each analysed and deleted.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};

use skinrig_controller::ControlHandle;
use skinrig_model::{RunEnd, RunHeader, StopReason};
use skinrig_protocol::Protocol;
use skinrig_recorder::SessionReader;
use skinrig_results::{AlignedSession, Origin, RigDocument};

use crate::analysis_request::AnalysisRequest;
use crate::check;
use crate::exit::Failure;
use crate::library::{NO_FILE, ProtocolSource, Simulation, simulate};
use crate::phase::Phase;
use crate::results::open;
use crate::signals::leave_on_ctrl_c;

/// Rejects what a simulated run is unlike, whatever its scene: presses after a break follow other ones, and a part has other
/// figures than the whole.
pub(crate) fn ran_through(reader: &SessionReader, path: &Path) -> Result<(), Failure> {
    let legs = reader.legs().map_err(Failure::session)?.len();
    let found = match reader.end().map_err(Failure::session)? {
        _ if legs > 1 => format!("{legs} legs: it was resumed"),
        Some((_, RunEnd::Completed)) => return Ok(()),
        Some((_, RunEnd::Stopped(StopReason::Decided(_)))) => {
            "one that its `stop` ended".to_owned()
        }
        Some(_) => "one that was ended before".to_owned(),
        None => "one without an end".to_owned(),
    };
    Err(Failure::input(format!(
        "{}: expected a session that ran through, as the simulated ones do, found {found}\n  next: take a session of the same skin \
         that ran through",
        path.display()
    )))
}

/// Where a protocol comes from and where its simulations go.
pub(crate) struct Source<'a> {
    /// Of the session.
    pub header: &'a RunHeader,
    pub session: &'a Path,
    /// Another protocol.
    pub protocol: Option<&'a Path>,
    /// `None`: the temporary folder.
    pub folder: Option<&'a Path>,
    pub command_line: &'a str,
}

/// The simulated sessions of a protocol.
pub(crate) struct Replicates<'a> {
    pub protocol: ProtocolSource,
    pub overrides: Vec<String>,
    /// Overrides that the session does not have.
    pub changed: Vec<String>,
    pub level: Option<String>,
    /// Where they are kept until they are analysed.
    pub folder: PathBuf,
    pub command_line: &'a str,
}

impl<'a> Replicates<'a> {
    /// `level`: of the simulation; `None`: that of the session, unless its protocol is changed.
    ///
    /// # Errors
    /// [`Failure::input`] for an import without a protocol.
    pub(crate) fn of(
        source: &Source<'a>,
        changes: &[String],
        level: Option<String>,
    ) -> Result<Self, Failure> {
        let header = source.header;
        let origin = Origin::of(header);
        let (protocol, mut overrides) = match source.protocol {
            Some(file) => (ProtocolSource::File(file.to_owned()), Vec::new()),
            None if origin == Some(Origin::Imported) => {
                return Err(Failure::input(format!(
                    "{}: expected a session that a protocol recorded, found an import\n  next: --protocol FILE names the protocol to \
                     simulate",
                    source.session.display()
                )));
            }
            None => (
                ProtocolSource::Text(header.protocol_text.clone()),
                header.overrides.clone(),
            ),
        };
        overrides.extend(changes.iter().cloned());
        // The level of the recording goes with its own protocol; a changed one may need another.
        let is_own = source.protocol.is_none() && changes.is_empty();
        let own_level = || {
            let document: RigDocument = serde_json::from_str(&header.rig_json).ok()?;
            let level = document.rig["level"].as_str()?;
            is_own.then(|| level.to_owned())
        };
        let named = source
            .protocol
            .iter()
            .map(|file| file.display().to_string());
        Ok(Self {
            protocol,
            overrides,
            changed: named.chain(changes.iter().cloned()).collect(),
            level: level.or_else(own_level),
            folder: source
                .folder
                .map_or_else(std::env::temp_dir, Path::to_owned),
            command_line: source.command_line,
        })
    }

    /// The protocol with further overrides.
    ///
    /// # Errors
    /// [`Failure::input`] with every finding.
    pub(crate) fn protocol_with(&self, overrides: &[String]) -> Result<Protocol, Failure> {
        let overrides = [&self.overrides, overrides].concat();
        let checked = match &self.protocol {
            ProtocolSource::File(path) => check::load(path, &overrides)?,
            ProtocolSource::Text(text) => check::load_text(NO_FILE, text, &overrides)?,
        };
        Ok(checked.protocol)
    }

    /// Simulates and records a session with further overrides; `analyse` takes it. The inner error says why it cannot be analysed.
    ///
    /// # Errors
    /// [`Failure`] for a protocol or folder that cannot be used, and a run that fails.
    pub(crate) fn simulate<T>(
        &self,
        overrides: &[String],
        seed: u64,
        analyse: impl FnOnce(AlignedSession, &Path) -> Result<T, Failure>,
    ) -> Result<Result<T, Failure>, Failure> {
        let folder = tempfile::Builder::new()
            .prefix("skinrig-scene-")
            .tempdir_in(&self.folder)
            .map_err(|e| {
                Failure::input(format!(
                    "{}: no folder for a simulated session: {e}\n  next: --sessions names another folder",
                    self.folder.display()
                ))
            })?;
        let path = simulate(
            Simulation {
                protocol: self.protocol.clone(),
                overrides: [&self.overrides, overrides].concat(),
                folder: folder.path().to_owned(),
                level: self.level.clone(),
                seed: Some(seed),
                command_line: self.command_line.to_owned(),
            },
            ControlHandle::new(),
        )?;
        let opened = open(&path, AnalysisRequest::default());
        Ok(opened.and_then(|(aligned, _)| analyse(aligned, &path)))
    }
}

/// What came of simulated sessions, in the order of their seeds.
pub(crate) struct Simulated<T> {
    /// Those that were analysed.
    pub found: Vec<(u64, T)>,
    /// Those that could not be: seed and why.
    pub failed: Vec<(u64, String)>,
    /// True if ctrl-C ended it before the last.
    pub interrupted: bool,
}

impl<T> Simulated<T> {
    /// Seeds of those that were analysed.
    pub(crate) fn seeds(&self) -> Vec<u64> {
        self.found.iter().map(|(seed, _)| *seed).collect()
    }

    /// Those that were tried.
    pub(crate) fn tried(&self) -> usize {
        self.found.len() + self.failed.len()
    }
}

/// Simulates a session of each seed, as many at once as there are processors, until ctrl-C.
///
/// # Errors
/// The first [`Failure`] of `simulate`; its inner error is that of a session that cannot be analysed.
pub(crate) fn each<T: Send>(
    seeds: &[u64],
    words: &str,
    simulate: impl Fn(u64) -> Result<Result<T, Failure>, Failure> + Sync,
) -> Result<Simulated<T>, Failure> {
    let stop = leave_on_ctrl_c().map_err(Failure::internal)?;
    let phase = Phase::steps(&format!("{words} (ctrl-C leaves)"), seeds.len() as u32);
    let (next, done) = (AtomicUsize::new(0), AtomicU32::new(0));
    let work = || {
        let mut own = Vec::new();
        while !stop.load(Ordering::Relaxed)
            && let Some(seed) = seeds.get(next.fetch_add(1, Ordering::Relaxed))
        {
            let outcome = simulate(*seed);
            if outcome.is_err() {
                next.store(seeds.len(), Ordering::Relaxed);
            }
            own.push((*seed, outcome));
            phase.step(done.fetch_add(1, Ordering::Relaxed) + 1);
        }
        own
    };
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    let all = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        let ended = workers.into_iter().map(|worker| {
            let panicked = |_| Failure::internal("a simulation ended by a panic; please report it");
            worker.join().map_err(panicked)
        });
        ended.collect::<Result<Vec<_>, _>>()
    })?;
    let mut all: Vec<_> = all.into_iter().flatten().collect();
    all.sort_by_key(|(seed, _)| *seed);
    let mut simulated = Simulated {
        found: Vec::new(),
        failed: Vec::new(),
        interrupted: all.len() < seeds.len(),
    };
    for (seed, outcome) in all {
        match outcome? {
            Ok(one) => simulated.found.push((seed, one)),
            Err(why) => {
                let why = why.message.trim_start_matches("error: ").to_owned();
                simulated.failed.push((seed, why));
            }
        }
    }
    Ok(simulated)
}

/// So many seeds from `first` on (`None`: after that of the session), without that of the session: it would be simulated again.
///
/// # Errors
/// [`Failure::input`] if there are not so many.
pub(crate) fn seeds(first: Option<u64>, n: u32, own: u64) -> Result<Vec<u64>, Failure> {
    let first = first.unwrap_or(own.wrapping_add(1));
    let seeds = (first..=u64::MAX).filter(|seed| *seed != own);
    let seeds: Vec<u64> = seeds.take(n as usize).collect();
    if seeds.len() < n as usize {
        return Err(Failure::input(format!(
            "--seed: expected {n} further seeds, found {first}, which has {} to the largest",
            seeds.len()
        )));
    }
    Ok(seeds)
}
