//! `skinrig challenge`: gives a session's events away without the scored positions, scores estimates from anywhere, and examines
//! programs that locate presses.

mod process;

use std::path::{Path, PathBuf};
use std::time::Duration;

use skinrig_analysis::result::Estimate;
use skinrig_export::Source;
use skinrig_export::challenge::{
    self, ChallengeError, ChallengeOptions, ChallengeSelection, Examination, Judgement, Timeouts,
};
use skinrig_model::{CameraId, CdEvent, RunHeader};
use skinrig_recorder::{RecorderError, SessionReader};
use skinrig_results::{ChunkIndex, Origin, events_between};

use self::process::Process;
use crate::analysis_request::AnalysisRequest;
use crate::args::{ChallengeArgs, ChallengeCommand, ExamineArgs, MakeArgs, ScoreArgs};
use crate::exit::{Exit, Failure, Outcome};
use crate::export::refused;
use crate::paths::{beside, shell_path};
use crate::results::{self, Results};
use crate::selection::result::SelectedResult;
use crate::selection::{self, Target};

/// Makes or scores a challenge.
///
/// # Errors
/// [`Failure::input`] for a session, folder or table that is refused; [`Failure::internal`] when a file cannot be written.
pub(crate) fn challenge(args: &ChallengeArgs, json: bool) -> Outcome {
    match &args.command {
        ChallengeCommand::Make(args) => make(args, json),
        ChallengeCommand::Score(args) => score(args, json),
        ChallengeCommand::Run(args) => run(args, json),
    }
}

fn failure(error: ChallengeError) -> Failure {
    match error {
        ChallengeError::Export(error) => refused(error),
        error => Failure::input(error),
    }
}

/// A session, and where its events are.
struct EventFile {
    reader: SessionReader,
    header: RunHeader,
    index: [ChunkIndex; 2],
}

impl EventFile {
    fn open(session: &Path) -> Result<Self, Failure> {
        let reader = SessionReader::open_checked(session).map_err(Failure::session)?;
        let header = reader.header().map_err(Failure::session)?;
        let index = |camera: CameraId| {
            let format = header.stream_formats[camera.index()];
            ChunkIndex::read(&reader, camera, format).map_err(Failure::session)
        };
        let [one, two] = CameraId::ALL;
        let index = [index(one)?, index(two)?];
        Ok(Self {
            reader,
            header,
            index,
        })
    }

    /// Events of a camera between two times of its recorded clock, µs.
    fn events(
        &self,
        camera: CameraId,
        interval: (u64, u64),
    ) -> Result<Vec<CdEvent>, RecorderError> {
        let mut all = Vec::new();
        let index = &self.index[camera.index()];
        events_between(&self.reader, index, interval, |e| all.push(e))?;
        Ok(all)
    }
}

fn salt() -> Result<[u8; 32], Failure> {
    let mut salt = [0; 32];
    getrandom::fill(&mut salt).map_err(Failure::internal)?;
    Ok(salt)
}

/// The session of an argument, analysed; what its selection changes.
fn analyzed(argument: &Path) -> Result<(Target, Results, Option<SelectedResult>), Failure> {
    let target = selection::sessions(argument)?.one(argument)?;
    let choices = AnalysisRequest {
        selection: target.selected.as_ref(),
        ..AnalysisRequest::default()
    };
    let results = results::analyze_shown(&target.path, choices)?;
    let selected = target.selected.as_ref();
    let stated = selected.map(|selected| SelectedResult::of(&results, selected));
    Ok((target, results, stated))
}

/// Prints a document, with what a selection changes.
fn print_document(mut document: serde_json::Value, selected: Option<&SelectedResult>) {
    if let Some(selected) = selected {
        document["selection"] = selected.document();
    }
    crate::terminal::print_json(&document);
}

fn make(args: &MakeArgs, json: bool) -> Outcome {
    let (target, results, selected) = analyzed(&args.session)?;
    let file = EventFile::open(&target.path)?;
    let mut events = |camera, interval| file.events(camera, interval);
    let source = Source {
        reader: &file.reader,
        header: &file.header,
        analysis: Some((&results.analysis, &results.legs)),
    };
    let own = target.selected.as_ref();
    let label = own.map_or(String::new(), |own| format!(".{}", own.label()));
    let default: PathBuf = beside(&target.path, &format!("{label}.answers.json"));
    let answers = args.answers.as_ref().unwrap_or(&default);
    let making = ChallengeOptions {
        overwrite: args.overwrite,
        origin: Origin::of(&file.header).map(Origin::name),
        selection: own.map(|own| ChallengeSelection {
            name: own.name.name.clone(),
            sha256: own.name.sha256.clone(),
            excluded: own.out.len() as u32,
        }),
        salt: salt()?,
    };
    let challenge_files = challenge::make(&source, &args.out, answers, &making, &mut events)
        .map_err(|e| match e {
            ChallengeError::InvalidSession { .. } => Failure::limit(format!(
                "{}: {e}\n  next: `skinrig show {}` lists the findings",
                target.path.display(),
                shell_path(&target.path)
            )),
            e => failure(e),
        })?;
    if json {
        print_document(serde_json::json!(challenge_files), selected.as_ref());
    } else {
        print_selected(selected.as_ref());
        for path in &challenge_files.files {
            outln!("{}", path.display());
        }
        outln!(
            "{} presses calibrate, {} to locate",
            challenge_files.calibrating,
            challenge_files.scored
        );
        outln!(
            "answers  {}  (keep this file)",
            challenge_files.answers.display()
        );
    }
    Ok(Exit::Ok)
}

fn score(args: &ScoreArgs, json: bool) -> Outcome {
    let found = challenge::score(&args.folder, &args.table, &args.answers).map_err(failure)?;
    if json {
        crate::terminal::print_json(&serde_json::json!(found));
    } else {
        print(&found);
    }
    Ok(Exit::Ok)
}

/// Time for one press unless `--timeout` states it, and how much more a guest has to learn.
const PRESS: Duration = Duration::from_secs(10);
const FIT_PRESSES: u32 = 60;

/// Prints what a selection changes.
fn print_selected(selected: Option<&SelectedResult>) {
    if let Some(selected) = selected {
        outln!("SELECTION {}", selected.line());
    }
}

fn run(args: &ExamineArgs, json: bool) -> Outcome {
    let (target, results, selected) = analyzed(&args.session)?;
    let file = EventFile::open(&target.path)?;
    let source = Source {
        reader: &file.reader,
        header: &file.header,
        analysis: Some((&results.analysis, &results.legs)),
    };
    let press = args.timeout.map_or(PRESS, Duration::from_secs);
    let timeouts = Timeouts {
        fit: press * FIT_PRESSES,
        press,
    };
    let mut events = |camera, interval| file.events(camera, interval);
    let events: Option<&mut challenge::EventQuery<'_>> = match args.events {
        true => Some(&mut events),
        false => None,
    };
    let start = || Process::start(&args.command);
    let found = challenge::examine(&source, salt()?, timeouts, events, start).map_err(failure)?;
    if json {
        print_document(serde_json::json!(found), selected.as_ref());
    } else {
        print_selected(selected.as_ref());
        print_examination(&found);
    }
    Ok(Exit::Ok)
}

fn print_examination(found: &Examination) {
    outln!("guest     {} {}", found.name, found.version);
    print(&found.guest);
    if let Some(left_out) = &found.left_out {
        let rmse = line(&left_out.guest.metrics.rmse_mm, 1.0, " mm");
        outln!("left out  {rmse}  RMSE at calibration places that it did not learn");
    }
    outln!("");
    outln!("skinrig   its own locator on the same presses");
    print(&found.own);
    if let Some(rmse) = found.left_out.as_ref().and_then(|l| l.own_rmse_mm) {
        outln!("left out  {}", line(&rmse, 1.0, " mm"));
    }
    outln!("");
    outln!(
        "error     {}  guest minus skinrig, presses that both locate",
        line(&found.difference_mm, 1.0, " mm")
    );
    let [median, slow] = found.locate_us.map(|us| us * 1e-3);
    outln!(
        "time      learning from {} presses {:.2} s; a press {median:.3} ms (99 % within {slow:.3} ms), pipes included",
        found.calibrating,
        found.fit_s
    );
}

fn print(found: &Judgement) {
    if let Some(selection) = &found.selection {
        outln!(
            "SELECTION `{}` (SHA-256 {}) excludes {} press(es) of the session",
            selection.name,
            selection.sha256,
            selection.excluded
        );
    }
    let metrics = &found.metrics;
    let mm = |e: &Estimate| line(e, 1.0, " mm");
    let percent = |e: &Estimate| line(e, 100.0, " %");
    outln!("RMSE      {}", mm(&metrics.rmse_mm));
    outln!("median    {}", mm(&metrics.median_mm));
    outln!("located   {}", percent(&metrics.located_rate));
    match &found.coverage {
        Some(coverage) => outln!("coverage  {}  of stated 95 % regions", percent(coverage)),
        None => outln!("coverage  no regions stated"),
    }
}

/// Value, 95 % interval and number of presses.
fn line(of: &Estimate, times: f64, unit: &str) -> String {
    let Some(value) = of.value else {
        return format!("-  (n = {})", of.n);
    };
    let value = value * times;
    match (of.low, of.high) {
        (Some(low), Some(high)) => {
            let (low, high) = (low * times, high * times);
            format!("{value:.2}{unit}  [{low:.2}, {high:.2}]  (n = {})", of.n)
        }
        _ => format!("{value:.2}{unit}  (n = {})", of.n),
    }
}
