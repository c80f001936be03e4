//! `skinrig reanalyze`: analyses many sessions with other settings, each result a variant of its session.

pub(crate) mod args;
mod cluster;
mod local;
mod request;
mod table;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use skinrig_analysis::ANALYSIS_VERSION;
use skinrig_protocol::NewSettings;

use self::args::{Engine, ReanalyzeArgs};
use self::request::{Answered, Refusal, Request};
use self::table::{Row, State};
use crate::analyses;
use crate::exit::{Exit, Failure, Outcome};
use crate::phase::Phase;
use crate::selection::{self, SelectedPresses, Target};
use crate::terminal::Output;

pub(crate) use self::local::analyze_request;

/// `skinrig reanalyze`.
///
/// # Errors
/// Before any analysis: [`Failure::input`] for invalid settings or arguments, [`Failure::internal`] without the cluster. After all sessions: [`Failure::internal`] if one was lost
/// to a fault of a machine, else [`Failure::input`] if one could not be analysed, else [`Failure::limit`] if one is INVALID.
pub(crate) fn reanalyze(args: &ReanalyzeArgs, output: Output) -> Outcome {
    if args.jobs.is_some() && args.on != Engine::Local {
        return Err(Failure::input(
            "--jobs: expected no number of processes with --on dask://, found one\n  next: leave it out; the workers of the cluster decide",
        ));
    }
    let settings = settings(&args.settings)?;
    let requests = requests(args, &settings)?;
    let mut rows = before(&requests);
    let open: Vec<usize> = (0..rows.len())
        .filter(|at| rows[*at].state == State::Open)
        .collect();
    let to_do: Vec<Request> = open.iter().map(|at| requests[*at].clone()).collect();
    let mut finished = 0;
    let phase = Phase::steps("analysing sessions", to_do.len() as u32);
    let mut each = |at: usize, answer: Answered| {
        finished += 1;
        phase.step(finished);
        let at = open[at];
        rows[at] = rows[at].after(&requests[at], answer);
        if let Some(failure) = rows[at].failure() {
            phase.above(|| errln!("{failure}"));
        }
    };
    match &args.on {
        _ if to_do.is_empty() => {}
        Engine::Local => local::run(&to_do, args.jobs, &mut each),
        Engine::Dask(scheduler) => cluster::run(&to_do, scheduler, &phase, &mut each)?,
    }
    drop(phase);
    register(&requests);
    table::print(args, &settings.overrides, &rows, output);
    conclusion(&rows)
}

fn settings(path: &Path) -> Result<NewSettings, Failure> {
    let next = "write a file of settings; `skinrig schema settings` has its keys";
    let bytes = crate::paths::read_input(path, next)?;
    NewSettings::parse(&path.display().to_string(), &bytes).map_err(|f| Failure::findings(&f))
}

/// One request per session, each session once.
fn requests(args: &ReanalyzeArgs, settings: &NewSettings) -> Result<Vec<Request>, Failure> {
    let base = match &args.name {
        Some(name) => name.clone(),
        None => {
            let stem = args.settings.file_stem().unwrap_or_default();
            analyses::parse(&stem.to_string_lossy()).map_err(|e| {
                Failure::input(format!(
                    "{}: its name cannot be that of a variant: {e}\n  next: give the variant a name with --name",
                    args.settings.display()
                ))
            })?
        }
    };
    let mut found: Vec<Request> = Vec::new();
    let mut seen: BTreeMap<PathBuf, usize> = BTreeMap::new();
    for target in targets(&args.sessions)? {
        // A session that cannot be found is a row of the table.
        let session = std::path::absolute(&target.path).map_err(Failure::internal)?;
        let place = session.canonicalize().unwrap_or(session.clone());
        if let Some(earlier) = seen.get(&place) {
            same_selection(&found[*earlier], &target)?;
            continue;
        }
        seen.insert(place, found.len());
        let name = match (&args.name, &target.selected) {
            (None, Some(selected)) => format!("{base}_{}", selected.label()),
            _ => base.clone(),
        };
        let name = analyses::parse(&name).map_err(|e| Failure::input(format!("--name: {e}")))?;
        found.push(Request {
            session,
            name,
            overrides: settings.overrides.clone(),
            selected: target.selected,
            analysis_version: ANALYSIS_VERSION,
        });
    }
    Ok(found)
}

/// Sessions of the arguments; those of a folder by name.
fn targets(arguments: &[PathBuf]) -> Result<Vec<Target>, Failure> {
    let mut all = Vec::new();
    for argument in arguments {
        if !argument.is_dir() {
            all.extend(selection::sessions(argument)?.sessions);
            continue;
        }
        let mut files = crate::sessions::files(argument)?;
        if files.is_empty() {
            return Err(crate::sessions::none_in(argument));
        }
        files.sort();
        all.extend(files.into_iter().map(|path| Target {
            path,
            selected: None,
        }));
    }
    Ok(all)
}

/// Rejects a session that is named with two selections: a variant has one.
fn same_selection(request: &Request, target: &Target) -> Result<(), Failure> {
    let hash = |s: &Option<SelectedPresses>| s.as_ref().map(|s| s.name.sha256.clone());
    if hash(&request.selected) == hash(&target.selected) {
        return Ok(());
    }
    Err(Failure::input(format!(
        "{}: expected each session with one selection, found it with two, or with one and without\n  next: run the command once for \
         each",
        target.path.display()
    )))
}

/// Rows before any analysis: results that are there are not made again.
fn before(requests: &[Request]) -> Vec<Row> {
    let row = |request: &Request| {
        let stored = request.stored().filter(|stored| stored.is_sealed);
        Row::before(request, stored.map(|stored| stored.summary))
    };
    requests.par_iter().map(row).collect()
}

/// Registers the sessions whose entries are stale, folder by folder.
fn register(requests: &[Request]) {
    let mut folders: BTreeMap<&Path, Vec<PathBuf>> = BTreeMap::new();
    for request in requests {
        let folder = crate::paths::folder_of(&request.session);
        folders
            .entry(folder)
            .or_default()
            .push(request.session.clone());
    }
    for (folder, sessions) in folders {
        crate::catalogue::automatic::register_stale(folder, &sessions);
    }
}

fn conclusion(rows: &[Row]) -> Outcome {
    let failed: Vec<&Refusal> = rows.iter().filter_map(|row| row.error.as_ref()).collect();
    let message = format!(
        "{} of {} sessions failed\n  next: repair or leave out what failed, then repeat the command: finished sessions are not analysed again",
        failed.len(),
        rows.len()
    );
    let invalid = rows.iter().filter(|row| row.is_invalid()).count();
    match (failed.is_empty(), invalid) {
        (false, _) if failed.iter().any(|e| e.is_fault()) => Err(Failure::internal(message)),
        (false, _) => Err(Failure::input(message)),
        (true, 0) => Ok(Exit::Ok),
        (true, invalid) => Err(Failure::limit(format!(
            "{invalid} of {} sessions are INVALID: do not use their numbers\n  next: `skinrig report --analysis` explains one",
            rows.len()
        ))),
    }
}
