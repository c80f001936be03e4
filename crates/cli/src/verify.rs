//! `skinrig verify`: a session, or a bundle with one.

use std::path::Path;

use skinrig_export::verify_bundle;
use skinrig_recorder::{RecorderError, SessionReader, verify as recheck};

use crate::args::SessionArg;
use crate::exit::{Exit, Failure, Outcome};
use crate::source::Rescan;

/// Recomputes everything in a session, and holds the files of a bundle against its manifest.
///
/// # Errors
/// [`Failure::input`] for a file that is no session and a folder that is no bundle; [`Failure::limit`] when something does not match.
pub fn verify(args: &SessionArg, json: bool) -> Outcome {
    if args.session.is_dir() {
        return bundle(&args.session, json);
    }
    session(&args.session, json)
}

/// Every file of a bundle, then the session in it.
fn bundle(folder: &Path, json: bool) -> Outcome {
    let mut report = verify_bundle(folder).map_err(Failure::input)?;
    if report.problems.is_empty() {
        let inside = folder.join(&report.session);
        let id = SessionReader::open(&inside).and_then(|reader| reader.session_id());
        let id = id.map_err(Failure::input)?;
        if id != report.session_id {
            let place = &report.session;
            let problem = format!(
                "{place}: expected session {}, found {id}",
                report.session_id
            );
            report.problems.push(problem);
        }
        let session = recheck(&inside, &mut Rescan::default()).map_err(Failure::input)?;
        report.problems.extend(session.problems);
    }
    let (name, problems) = (folder.display(), report.problems.len());
    if json {
        let mut shown = serde_json::to_value(&report).map_err(Failure::internal)?;
        shown["sound"] = (problems == 0).into();
        crate::print_json(&shown);
    } else {
        for problem in &report.problems {
            outln!("{name}: {problem}");
        }
        if problems == 0 {
            outln!(
                "{name}: sound; {} files as they were written, session {}",
                report.files,
                report.session_id
            );
        }
    }
    if problems == 0 {
        Ok(Exit::Ok)
    } else {
        Err(Failure::limit(format!(
            "{name}: {problems} problem(s); the bundle is not what was exported"
        )))
    }
}

fn session(path: &Path, json: bool) -> Outcome {
    if let Err(e @ RecorderError::NotASession { .. }) = SessionReader::open(path) {
        return Err(Failure::input(e));
    }
    let report = recheck(path, &mut Rescan::default()).map_err(Failure::input)?;
    let name = path.display();
    if json {
        crate::print_json(&serde_json::json!({
            "session": path, "sound": report.is_sound(), "sealed": report.sealed,
            "problems": report.problems, "more_problems": report.more_problems, "remarks": report.remarks,
            "totals": report.totals,
        }));
    } else {
        for problem in &report.problems {
            // Some problems name the file themselves.
            let problem = problem
                .strip_prefix(&format!("{name}: "))
                .unwrap_or(problem);
            outln!("{name}: {problem}");
        }
        if report.more_problems > 0 {
            outln!("{name}: and {} more", report.more_problems);
        }
        for remark in &report.remarks {
            outln!("{name}: note: {remark}");
        }
        if let (true, Some(t)) = (report.is_sound(), report.totals) {
            outln!(
                "{name}: sound{}; {} presses, {} events, {} chunks, {:.1} MB of camera bytes, {} pose samples",
                if report.sealed {
                    ", sealed"
                } else {
                    ", but not sealed: camera bytes, poses and counts were checked, not every byte"
                },
                t.presses.planned + t.sync.planned,
                t.cd_events,
                t.chunks,
                t.raw_bytes as f64 / 1e6,
                t.pose_samples
            );
        }
    }
    if report.is_sound() {
        Ok(Exit::Ok)
    } else {
        Err(Failure::limit(format!(
            "{name}: {} problem(s); the file is not what was recorded",
            report.problems.len() as u64 + report.more_problems
        )))
    }
}
