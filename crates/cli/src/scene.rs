//! `skinrig scene check`: statistics of the events of a session.

use skinrig_analysis::event_statistics::event_statistics;
use skinrig_model::CameraId;
use skinrig_report::scene_check::terminal_text;

use crate::analysis_request::AnalysisRequest;
use crate::args::{SceneArgs, SceneCheckArgs, SceneCommand};
use crate::exit::{Exit, Failure, Outcome};
use crate::phase::Phase;
use crate::results::open;

/// Runs the command of `scene`.
///
/// # Errors
/// [`Failure::input`] for a session that cannot be read.
pub(crate) fn scene(args: &SceneArgs, json: bool) -> Outcome {
    match &args.command {
        SceneCommand::Check(args) => check(args, json),
    }
}

fn check(args: &SceneCheckArgs, json: bool) -> Outcome {
    let (aligned, _) = open(&args.session, AnalysisRequest::default())?;
    let phase = Phase::begin("reading the events");
    let of = |camera| event_statistics(&aligned.events, camera);
    let (one, two) = rayon::join(|| of(CameraId::One), || of(CameraId::Two));
    drop(phase);
    let failed = |e| Failure::input(format!("{}: {e}", args.session.display()));
    let cameras = [one.map_err(failed)?, two.map_err(failed)?];
    if json {
        crate::terminal::print_json(
            &serde_json::json!({ "session": args.session, "cameras": cameras }),
        );
    } else {
        outln!("{}", terminal_text(&cameras));
    }
    Ok(Exit::Ok)
}
