//! `skinrig scene predict`: figures of a session against those of simulated sessions of its protocol.

use std::path::Path;

use skinrig_compare::scene::{LEAST_REPLICATES, SessionFigures, predict as compared};
use skinrig_model::RunHeader;
use skinrig_report::scene_prediction::{ScenePrediction, page, terminal_text};
use skinrig_results::{AlignedSession, SessionEvents, event_statistics};

use crate::analyses::scene_path;
use crate::analysis_request::AnalysisRequest;
use crate::args::ScenePredictArgs;
use crate::beside_session::{SCENE, SessionIdentity};
use crate::exit::{Exit, Failure, Outcome};
use crate::paths::{file_name, shell_path};
use crate::phase::Phase;
use crate::provenance::origin_in_words;
use crate::results::{check_writable, open, write, write_named};
use crate::scene::replicates::{Replicates, Source, each, ran_through, seeds};
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
            "{}: expected a valid session, found an INVALID one, which says nothing about its scene\n  next: `skinrig analyze {}` says why",
            path.display(),
            shell_path(path)
        )
    })?;
    drop(phase);
    let replicates_of = Replicates::of(
        &Source {
            header: &session.header,
            session: path,
            protocol: args.protocol.as_deref(),
            folder: args.sessions.as_deref(),
            command_line,
        },
        &args.overrides,
        args.level.clone(),
    )?;
    let seeds = seeds(args.seed, args.replicates, session.header.seed)?;
    let of_replicate =
        |aligned, at: &Path| figures(aligned, at, || "its analysis is INVALID".to_owned());
    let simulated = each(&seeds, "simulating", |seed| {
        replicates_of.simulate(&[], seed, of_replicate)
    })?;
    let last = simulated.found.last();
    let mut found = ScenePrediction {
        session: file_name(path),
        origin: origin_in_words(&session.header),
        scene: last.map_or_else(String::new, |(_, replicate)| {
            replicate.header.rig_name.clone()
        }),
        changed: replicates_of.changed.clone(),
        seeds: simulated.seeds(),
        failed: simulated.failed.clone(),
        figures: Vec::new(),
    };
    let replicates = simulated.found.iter();
    let replicates: Vec<SessionFigures> = replicates.map(|(_, r)| r.figures.clone()).collect();
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
    if simulated.interrupted {
        errln!(
            "INTERRUPTED after {} of {} simulated sessions",
            simulated.tried(),
            args.replicates
        );
        return Ok(Exit::Stopped);
    }
    Ok(Exit::Ok)
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
