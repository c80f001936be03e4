//! `skinrig challenge`: gives a session's events away without the scored positions, and scores estimates from anywhere.

use std::path::PathBuf;

use skinrig_analysis::result::Estimate;
use skinrig_export::Source;
use skinrig_export::challenge::{self, ChallengeError, ChallengeOptions, Judgement};
use skinrig_model::CameraId;
use skinrig_recorder::SessionReader;
use skinrig_results::{ChunkIndex, Origin, events_between};

use crate::args::{ChallengeArgs, ChallengeCommand, MakeArgs, ScoreArgs};
use crate::exit::{Exit, Failure, Outcome};
use crate::export::refused;
use crate::paths::beside;
use crate::results::{self, AnalysisRequest};

/// Makes or scores a challenge.
///
/// # Errors
/// [`Failure::input`] for a session, folder or table that is refused; [`Failure::internal`] when a file cannot be written.
pub(crate) fn challenge(args: &ChallengeArgs, json: bool) -> Outcome {
    match &args.command {
        ChallengeCommand::Make(args) => make(args, json),
        ChallengeCommand::Score(args) => score(args, json),
    }
}

fn failure(error: ChallengeError) -> Failure {
    match error {
        ChallengeError::Export(error) => refused(error),
        error => Failure::input(error),
    }
}

fn make(args: &MakeArgs, json: bool) -> Outcome {
    let results = results::analyze_shown(&args.session, AnalysisRequest::default())?;
    let reader = SessionReader::open(&args.session).map_err(Failure::session)?;
    let header = reader.header().map_err(Failure::session)?;
    let index = |camera: CameraId| {
        let format = header.stream_formats[camera.index()];
        ChunkIndex::read(&reader, camera, format).map_err(Failure::session)
    };
    let [one, two] = CameraId::ALL;
    let indices = [index(one)?, index(two)?];
    let mut events = |camera: CameraId, interval| {
        let mut all = Vec::new();
        events_between(&reader, &indices[camera.index()], interval, |e| all.push(e))?;
        Ok(all)
    };
    let source = Source {
        reader: &reader,
        header: &header,
        analysis: Some((&results.analysis, &results.legs)),
    };
    let default: PathBuf = beside(&args.session, ".answers.json");
    let answers = args.answers.as_ref().unwrap_or(&default);
    let mut salt = [0; 32];
    getrandom::fill(&mut salt).map_err(Failure::internal)?;
    let making = ChallengeOptions {
        overwrite: args.overwrite,
        origin: Origin::of(&header).map(Origin::name),
        salt,
    };
    let challenge_files =
        challenge::make(&source, &args.out, answers, &making, &mut events).map_err(failure)?;
    if json {
        crate::terminal::print_json(&serde_json::json!(challenge_files));
    } else {
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

fn print(found: &Judgement) {
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
