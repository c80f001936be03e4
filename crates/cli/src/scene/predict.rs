//! `skinrig scene predict`: figures of a session against those of simulated sessions of its protocol.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use skinrig_compare::scene::{LEAST_REPLICATES, SessionFigures, predict as compared};
use skinrig_controller::ControlHandle;
use skinrig_model::{RunEnd, RunHeader, StopReason};
use skinrig_recorder::SessionReader;
use skinrig_report::scene_prediction::{ScenePrediction, page, terminal_text};
use skinrig_results::{AlignedSession, Origin, RigDocument, SessionEvents, event_statistics};

use crate::analyses::scene_path;
use crate::analysis_request::AnalysisRequest;
use crate::args::ScenePredictArgs;
use crate::beside_session::{SCENE, SessionIdentity};
use crate::exit::{Exit, Failure, Outcome};
use crate::library::{ProtocolSource, Simulation, simulate};
use crate::paths::file_name;
use crate::phase::Phase;
use crate::provenance::origin_in_words;
use crate::results::{check_writable, open, write, write_named};
use crate::signals::leave_on_ctrl_c;
use crate::terminal::Output;

/// A session opened for its figures.
struct Opened {
    header: RunHeader,
    figures: SessionFigures,
}

/// Simulates the session's protocol with other seeds and compares.
///
/// # Errors
/// [`Failure::input`] for a session or protocol that cannot be used; [`Failure::limit`] for an INVALID session.
pub(super) fn predict(args: &ScenePredictArgs, command_line: &str, output: Output) -> Outcome {
    let path = &args.session;
    let html_path = args.out.clone().unwrap_or_else(|| scene_path(path));
    check_writable(&html_path)?;
    let (aligned, _) = open(path, AnalysisRequest::default())?;
    ran_through(&aligned.session.reader, path)?;
    let identity = SessionIdentity::of(&aligned.session.reader).map_err(Failure::session)?;
    let phase = Phase::reading("analysing the session", aligned.events.bytes_read());
    let session = figures(aligned, path, || {
        format!(
            "{}: expected a valid session, found an INVALID one: its positions or clocks are wrong, not its scene\n  next: `skinrig \
             analyze {0}` names the fault",
            path.display()
        )
    })?;
    drop(phase);
    let simulations = Simulations::of(&session.header, args, command_line)?;
    let stop = leave_on_ctrl_c().map_err(Failure::internal)?;
    let phase = Phase::steps("simulating (ctrl-C leaves)", args.replicates);
    let mut found = ScenePrediction {
        session: file_name(path),
        origin: origin_in_words(&session.header),
        scene: String::new(),
        changed: simulations.changed.clone(),
        seeds: Vec::new(),
        failed: Vec::new(),
        figures: Vec::new(),
    };
    let mut replicates = Vec::new();
    for (done, seed) in (1..).zip(simulations.seeds.iter().copied()) {
        match simulations.one(seed)? {
            Ok(replicate) => {
                found.scene = replicate.header.rig_name;
                found.seeds.push(seed);
                replicates.push(replicate.figures);
            }
            Err(why) => found.failed.push((seed, why.message)),
        }
        phase.step(done);
        if stop.load(Ordering::Relaxed) {
            break;
        }
    }
    drop(phase);
    if replicates.len() < LEAST_REPLICATES {
        return Err(too_few(&found, args));
    }
    found.figures = compared(&session.figures, &replicates);
    let document = serde_json::json!({
        "format": SCENE.format, "format_version": SCENE.version, "session": identity, "prediction": found,
    });
    let text = serde_json::to_string_pretty(&document).map_err(Failure::internal)?;
    let text = skinrig_catalogue::results_digest::with_digest(&text);
    let json_path = html_path.with_extension("json");
    let write = if args.out.is_some() {
        write_named
    } else {
        write
    };
    write(&html_path, page(&found).as_bytes())?;
    write(&json_path, text.as_bytes())?;
    if output.json {
        let mut document = document;
        document["files"] = serde_json::json!({ "page": html_path, "results": json_path });
        crate::terminal::print_json(&document);
    } else {
        outln!("{}", terminal_text(&found, output.verbose));
        outln!(
            "\npage     {}\nresults  {}",
            html_path.display(),
            json_path.display()
        );
    }
    let ended = found.seeds.len() + found.failed.len();
    if ended < args.replicates as usize {
        errln!(
            "INTERRUPTED after {ended} of {} simulated sessions",
            args.replicates
        );
        return Ok(Exit::Stopped);
    }
    Ok(Exit::Ok)
}

/// Rejects what a simulated run is unlike, whatever its scene: presses after a break follow other ones, and a part has other
/// figures than the whole.
fn ran_through(reader: &SessionReader, path: &Path) -> Result<(), Failure> {
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

/// Fewer simulated sessions than a prediction needs.
fn too_few(found: &ScenePrediction, args: &ScenePredictArgs) -> Failure {
    let n = found.seeds.len();
    match found.failed.first() {
        Some((seed, why)) => Failure::input(format!(
            "expected at least {LEAST_REPLICATES} simulated sessions that can be analysed, found {n}; seed {seed}: {why}\n  next: \
             `skinrig run` with --seed {seed} and the same changes shows it; --level optical simulates touches"
        )),
        None => Failure::stopped(format!(
            "stopped after {n} of {} simulated sessions; at least {LEAST_REPLICATES} are needed",
            args.replicates
        )),
    }
}

/// The figures of a session, without studies, which none of them needs.
fn figures(
    mut aligned: AlignedSession,
    path: &Path,
    invalid: impl FnOnce() -> String,
) -> Result<Opened, Failure> {
    aligned.input.settings.study_presses = 0;
    let header = aligned.session.header.clone();
    let name = aligned.session.path.clone();
    let events = SessionEvents::new(&name, header.stream_formats, &aligned.input.legs);
    let analysis = aligned.analyze()?.analysis;
    if !analysis.is_valid() {
        return Err(Failure::limit(invalid()));
    }
    let cameras = event_statistics(&events, Some(&analysis))
        .map_err(|e| Failure::input(format!("{}: {e}", path.display())))?;
    Ok(Opened {
        header,
        figures: SessionFigures::of(&analysis, &cameras),
    })
}

/// The simulated sessions of a protocol.
struct Simulations<'a> {
    protocol: ProtocolSource,
    overrides: Vec<String>,
    /// Overrides that the session does not have.
    changed: Vec<String>,
    level: Option<String>,
    seeds: Vec<u64>,
    /// Where they are kept until they are analysed.
    folder: PathBuf,
    command_line: &'a str,
}

impl<'a> Simulations<'a> {
    fn of(
        header: &RunHeader,
        args: &ScenePredictArgs,
        command_line: &'a str,
    ) -> Result<Self, Failure> {
        let origin = Origin::of(header);
        let (protocol, mut overrides) = match &args.protocol {
            Some(file) => (ProtocolSource::File(file.clone()), Vec::new()),
            None if origin == Some(Origin::Imported) => {
                return Err(Failure::input(format!(
                    "{}: expected a session that a protocol recorded, found an import\n  next: --protocol FILE names the protocol to \
                     simulate",
                    args.session.display()
                )));
            }
            None => (
                ProtocolSource::Text(header.protocol_text.clone()),
                header.overrides.clone(),
            ),
        };
        overrides.extend(args.overrides.iter().cloned());
        // The level of the recording goes with its own protocol; a changed one may need another.
        let is_own = args.protocol.is_none() && args.overrides.is_empty();
        let own_level = || {
            let document: RigDocument = serde_json::from_str(&header.rig_json).ok()?;
            let level = document.rig["level"].as_str()?;
            is_own.then(|| level.to_owned())
        };
        let named = args.protocol.iter().map(|file| file.display().to_string());
        Ok(Self {
            protocol,
            overrides,
            changed: named.chain(args.overrides.iter().cloned()).collect(),
            level: args.level.clone().or_else(own_level),
            seeds: seeds(
                args.seed.unwrap_or(header.seed.wrapping_add(1)),
                args.replicates,
                header.seed,
            )?,
            folder: args.sessions.clone().unwrap_or_else(std::env::temp_dir),
            command_line,
        })
    }

    /// Simulates, records and analyses one session; the inner error says why it cannot be analysed.
    fn one(&self, seed: u64) -> Result<Result<Opened, Failure>, Failure> {
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
                overrides: self.overrides.clone(),
                folder: folder.path().to_owned(),
                level: self.level.clone(),
                seed: Some(seed),
                command_line: self.command_line.to_owned(),
            },
            ControlHandle::new(),
        )?;
        let opened = open(&path, AnalysisRequest::default());
        let invalid = || "its analysis is INVALID".to_owned();
        Ok(opened.and_then(|(aligned, _)| figures(aligned, &path, invalid)))
    }
}

/// So many seeds from `first` on, without that of the session: it would be simulated again.
fn seeds(first: u64, n: u32, own: u64) -> Result<Vec<u64>, Failure> {
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
