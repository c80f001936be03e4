//! Functions for other programs: the same steps as the command line, without a terminal.

use std::path::{Path, PathBuf};

use serde_json::Value;
use skinrig_analysis::{Analysis, LegStart};
use skinrig_protocol::limits::Margin;
use skinrig_recorder::SessionReader;
use skinrig_results::{AnalysisOptions, Session};

pub use skinrig_controller::ControlHandle;

use crate::analysis_request::AnalysisRequest;
use crate::args::{CompareArgs, RunArgs};
use crate::exit::Failure;
use crate::paths::shell_path;
use crate::results;
use crate::signals::Operator;
use crate::terminal::Output;
use crate::{analyses, check, compare, conclusion, run, selection};

pub use crate::export::invalid;
pub use crate::store::read_references;
pub use crate::view::Program;

/// Returns the official analysis of a session for its tables, without the bulk data for figures, and its later legs as aligned.
/// Reads the results beside the session if they belong to it and to this version of the analysis; otherwise analyses the session.
///
/// # Errors
/// [`Failure::input`] for a session that cannot be read or analysed.
pub fn analysis_for_tables(
    path: &Path,
    reader: &SessionReader,
    session_id: &str,
) -> Result<(Analysis, Vec<LegStart>), Failure> {
    let Some(analysis) = analyses::stored(path, session_id, None) else {
        let results = results::analyze_session(path, AnalysisRequest::default())?;
        return Ok((results.analysis, results.legs));
    };
    let legs = if reader.legs().map_err(Failure::session)?.len() > 1 {
        let session = Session::open(path, AnalysisOptions::default())?;
        session.read_input()?.align().input.legs
    } else {
        Vec::new()
    };
    Ok((analysis, legs))
}

/// Reads the text of the results of the analysis `name` beside a session (`None`: the official one).
///
/// # Errors
/// [`Failure::input`] if there are none, or if they belong to another session or variant.
pub fn stored_results(
    session: &Path,
    session_id: &str,
    name: Option<&str>,
) -> Result<String, Failure> {
    let path = analyses::results_path(session, name);
    if let Some(name) = name {
        analyses::parse(name).map_err(|e| Failure::input(format!("analysis `{name}`: {e}")))?;
        analyses::variant(session, session_id, name)?;
    } else {
        analyses::summary(session, session_id, None).map_err(|e| {
            Failure::input(format!(
                "{0}: expected results beside it, found none that can be used: {e}\n  next: `skinrig analyze {on}` writes them",
                session.display(), on = shell_path(session)))
        })?;
    }
    std::fs::read_to_string(&path)
        .map_err(|e| Failure::internal(format!("{}: cannot read: {e}", path.display())))
}

/// The refusal of a session's results that are INVALID; `None` for valid ones.
#[must_use]
pub fn invalid_results(session: &Path, results: &str) -> Option<Failure> {
    #[derive(serde::Deserialize)]
    struct Part {
        valid: bool,
    }
    let is_valid = serde_json::from_str::<Part>(results).is_ok_and(|part| part.valid);
    (!is_valid).then(|| {
        Failure::limit(format!(
            "{}: INVALID, do not use the numbers of these results (`valid` is false)\n  next: `skinrig analyze {}` says what to mend",
            session.display(),
            shell_path(session)
        ))
    })
}

/// Names of the variants beside a session.
#[must_use]
pub fn variants(session: &Path, session_id: &str) -> Vec<String> {
    let all = analyses::all(session, session_id);
    all.into_iter().filter_map(|found| found.name).collect()
}

/// Analyses a session, or the one that a selection names; with `save` also writes the results and the report beside it, as
/// `skinrig analyze` does.
///
/// # Errors
/// [`Failure::input`] for an unreadable session and for settings that do not parse; [`Failure::internal`] when a file
/// cannot be written.
pub fn analyze(session: &Path, choices: AnalysisRequest<'_>, save: bool) -> Result<Value, Failure> {
    if let Some(name) = choices.name {
        analyses::parse(name).map_err(|e| Failure::input(format!("name `{name}`: {e}")))?;
    }
    let target = selection::sessions(session)?.one(session)?;
    let choices = AnalysisRequest {
        selection: target.selected.as_ref().or(choices.selection),
        ..choices
    };
    let results = results::analyze_session(&target.path, choices)?;
    if save {
        results::write_results(&results, None, None)?;
    }
    Ok(skinrig_report::json(&results.report_input()))
}

/// Options of `skinrig compare`; see its help.
#[derive(Debug, Clone, Default)]
pub struct CompareOptions {
    /// Session files, folders of sessions, or names of prototypes.
    pub skins: Vec<String>,
    /// Folder in which to look for the prototypes' sessions.
    pub sessions: PathBuf,
    /// The limits file.
    pub limits: Option<PathBuf>,
    /// Margins, as `METRIC=MARGIN`.
    pub margins: Vec<String>,
    /// Error threshold of the pass rate, mm.
    pub within_mm: Option<f64>,
    /// Keys of blocking differences to override.
    pub despite: Vec<String>,
    /// The variant to compare.
    pub analysis: Option<String>,
    /// Where to write the page and its results; `None` writes neither.
    pub out: Option<PathBuf>,
}

/// Compares skins.
///
/// # Errors
/// As `skinrig compare`.
pub fn compare(options: CompareOptions) -> Result<Value, Failure> {
    if let Some(within) = options.within_mm
        && !(within.is_finite() && within > 0.0)
    {
        return Err(Failure::input(format!(
            "within: expected an error threshold above 0 mm, found {within}"
        )));
    }
    let margin = |text: &String| {
        Margin::parse(text).map_err(|e| Failure::input(format!("margin `{text}`: {e}")))
    };
    compare::document(&CompareArgs {
        margins: options
            .margins
            .iter()
            .map(margin)
            .collect::<Result<_, _>>()?,
        skins: options.skins,
        sessions: options.sessions,
        limits: options.limits,
        within: options.within_mm,
        despite: options.despite,
        sequential: false,
        looks: None,
        analysis: options.analysis,
        out: options.out,
    })
}

/// Source of a simulation's protocol.
#[derive(Debug, Clone)]
pub enum ProtocolSource {
    /// A file.
    File(PathBuf),
    /// The text itself.
    Text(String),
}

/// A campaign for the simulated rig.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// Its protocol.
    pub protocol: ProtocolSource,
    /// Overrides of the protocol, as `key=value`.
    pub overrides: Vec<String>,
    /// Folder for the session file.
    pub folder: PathBuf,
    /// Simulation level; `None` is the cheapest that the protocol's scene needs.
    pub level: Option<String>,
    /// Seed; `None` is the protocol's.
    pub seed: Option<u64>,
    /// Command line for the session's header.
    pub command_line: String,
}

/// Name of a protocol that is not in a file.
pub(crate) const NO_FILE: &str = "protocol.yaml";

/// Runs a campaign on the simulated rig, through the controller and the recorder, and returns the path of the sealed session.
/// `control` can end it, as ctrl-C ends `skinrig run`.
///
/// # Errors
/// [`Failure::findings`] for the protocol, [`Failure::rig`] for an injected fault, code 5 after a stop.
pub fn simulate(simulation: Simulation, control: ControlHandle) -> Result<PathBuf, Failure> {
    let Simulation {
        protocol,
        overrides,
        folder,
        level,
        seed,
        command_line,
    } = simulation;
    let checked = match &protocol {
        ProtocolSource::File(path) => check::load(path, &overrides)?,
        ProtocolSource::Text(text) => check::load_text(NO_FILE, text, &overrides)?,
    };
    if checked.plan.stop.is_some() {
        return Err(Failure::input(
            "expected a protocol without `stop`, found one: only `skinrig run` takes its looks\n  next: simulate a copy of the protocol file without its `stop`; `skinrig scene predict` takes it with --protocol FILE",
        ));
    }
    let args = RunArgs {
        notify: None,
        protocol: None,
        overrides: Vec::new(),
        replay: None,
        rig: None,
        tolerant: false,
        seed,
        level,
        real_time: false,
        faults: Vec::new(),
        sessions: folder,
        no_analysis: true,
        max_rmse: None,
    };
    let output = Output {
        json: true,
        verbose: false,
    };
    let operator = Operator::elsewhere(control);
    let (session, report) = run::simulated(&args, checked, &command_line, output, &operator)?;
    match conclusion::end_of(&session, &report)? {
        None => Ok(session),
        Some(stopped) => Err(Failure::stopped(stopped)),
    }
}
